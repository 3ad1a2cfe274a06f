"""What `antenna-ocp sweep` does: it plans the cases, solves what is lacking, and tabulates all."""

from __future__ import annotations

import argparse
import contextlib
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from ocp.processors import processors
from studies.common.configuration import as_number, positive, read_toml, toml_text, whole
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.folder import (
    INPUT_FILE,
    OUR_MARK,
    RESULT_FILE,
    ResultsFolder,
    open_results,
    provenance,
)
from studies.common.result import Result
from studies.common.running import hand_over
from studies.common.whole_files import write_whole
from studies.sweep import STUDY
from studies.sweep.cases.lock import alone
from studies.sweep.cases.plan import Plan, plan
from studies.sweep.cases.store import AGAIN, FOLDER, CaseStore, remove_drafts
from studies.sweep.config import SweepStudy, as_dictionary, study_from
from studies.sweep.driver import Driver, Place
from studies.sweep.estimate import plan_text, sample
from studies.sweep.table import (
    FILE,
    FRONTS,
    as_csv,
    columns,
    front_columns,
    result_of,
    tabulate,
    write_parquet,
)
from studies.sweep.workers.processes import LocalProcesses

PARENT = Path("results")


def sweep(options: argparse.Namespace, console: Console) -> ExitCode:
    """Plan a sweep, solve what its folder lacks, and tabulate it.

    Raises
    ------
    StudyError
        If the sweep or a flag is wrong, or the folder cannot be written.
    """
    seconds, workers = _limits(options)
    _check_extras(options)
    planned = plan(read_study(options), console)
    folder = ResultsFolder(options.results or PARENT / f"sweep-{options.study.stem}")
    store = CaseStore(folder.path, planned.version)
    asked = AskedSweep(planned, store, folder, options, seconds, workers, console)
    return asked.said_how_long() if options.plan else asked.carried_out()


@dataclass(frozen=True)
class AskedSweep:
    """A sweep, the folder of its cases, and what flags say of them.

    Attributes
    ----------
    planned : the cases.
    store, folder : where they are kept, and all that is made of them.
    options, console : of the command.
    seconds : after which a case is ended; None for no limit.
    workers : cases at a time.
    """

    planned: Plan
    store: CaseStore
    folder: ResultsFolder
    options: argparse.Namespace
    seconds: float | None
    workers: int
    console: Console

    def said_how_long(self) -> ExitCode:
        """Say how many cases and how long, from a few that are solved now if none was before.

        They are solved as the sweep would solve them, and kept in its folder.
        """
        if trial := sample(self.planned, self.store):
            count = len(trial.cases)
            self.console.progress(f"{count} cases are solved to estimate the time of all")
            with contextlib.closing(self._place()) as place:
                _open(self.folder, self.planned.study)
                self.store.open()
                if self._solved(trial, place):
                    raise KeyboardInterrupt
        self.console.say(plan_text(self.planned, self.store, self.workers))
        return ExitCode.OK

    def carried_out(self) -> ExitCode:
        """Solve what the folder lacks, and tabulate, print and draw all."""
        # a cluster that does not answer is said before there is a folder
        with contextlib.closing(self._place()) as place:
            _open(self.folder, self.planned.study)
            remarks = _others(self.store, self.options.recompute)
            self.store.open()
            interrupted = self._solved(self.planned, place)

        table = tabulate(self.planned, self.store)
        content = columns(self.planned, table)
        result = result_of(self.planned, table, interrupted, remarks)
        # the study in the folder: it has what flags have said, too
        folder, options = self.folder, self.options
        again = f"antenna-ocp sweep {folder.file('input.toml')} --results {folder.path}"
        with folder.written(AGAIN):
            folder.file(FILE).write_text(as_csv(content), "utf-8", newline="")
            if points := front_columns(self.planned, table):
                folder.file(FRONTS).write_text(as_csv(points), "utf-8", newline="")
            if options.parquet:
                write_parquet(content, folder.file(FILE).with_suffix(".parquet"))
            go_on = again if interrupted else ""
            return hand_over(STUDY, result, folder, again, options, self.console, go_on)

    def _place(self) -> Place:
        """Where cases are solved."""
        if self.options.scheduler is None:
            return LocalProcesses(self.workers)
        from studies.sweep.workers.cluster import DaskCluster

        return DaskCluster(self.options.scheduler, self.workers)

    def _solved(self, planned: Plan, place: Place) -> bool:
        """Solve what the folder lacks; return whether the user stopped it."""
        try:
            with alone(self.store.folder):
                list(remove_drafts(self.store.place))
                count, into = len(planned.cases), self.store.folder
                self.console.progress(f"{count} cases on {place}, into {into}")
                Driver(planned, self.store, place, self.seconds, self.console).run()
        except KeyboardInterrupt:
            return True
        return False


def read_study(options: argparse.Namespace) -> SweepStudy:
    """The sweep that its file and the flags on top of it state.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """
    raw = read_toml(options.study)
    if options.coarse:
        raw["coarse"] = True
    return study_from(raw, options.study.parent)


def _limits(options: argparse.Namespace) -> tuple[float | None, int]:
    """Seconds of a case, and cases at a time."""
    seconds, workers = None, processors()
    if options.case_seconds is not None:
        seconds = positive("--case-seconds", as_number(options.case_seconds))
    if options.workers is not None:
        workers = whole(1, 1024)("--workers", as_number(options.workers))
    return seconds, workers


def _check_extras(options: argparse.Namespace) -> None:
    """Raise an error immediately if a package is missing; after hours it would be too late."""
    if options.parquet and find_spec("pyarrow") is None:
        raise StudyError(
            "--parquet needs pyarrow, which is not installed; install it with: "
            "pip install 'antenna-ocp[parquet]', or remove --parquet: the table is also "
            "written as CSV"
        )


def _open(folder: ResultsFolder, study: SweepStudy) -> None:
    """Make the folder of a sweep, or let it go on.

    Raises
    ------
    StudyError
        If it is somebody else's or cannot be written.
    """
    path = folder.path
    with folder.written(AGAIN):
        # killed just after it was made, a folder has no result yet
        new = not (path / RESULT_FILE).exists()
        ours = (path / OUR_MARK).is_file() and (new or (path / FOLDER).is_dir())
        if not ours and path.exists() and not (path.is_dir() and not any(path.iterdir())):
            raise StudyError(
                f"{path} exists already and is no results folder of a sweep; name a new one with "
                "--results",
                ExitCode.NO_RESULTS_FOLDER,
            )
    if not ours:
        open_results(path, path.name)

    head = "# Reproduces or resumes this result: antenna-ocp sweep input.toml\n\n"
    configuration = as_dictionary(study)
    with folder.written(AGAIN):
        (path / FOLDER).mkdir(exist_ok=True)
        write_whole(folder.file(INPUT_FILE), (head + toml_text(configuration)).encode())
        Result.begun("sweep", study.question, configuration, provenance()).save(path)


def _others(store: CaseStore, recompute: bool) -> tuple[str, ...]:
    """What to say of cases that another version of the program has left.

    Raises
    ------
    StudyError
        If there are some, none of this version, and nobody asked for these to be computed again.
    """
    others = store.others()
    listed = "; ".join(f"{count} cases of {name}" for name, count in others.items())
    if others and not store.keys() and not recompute:
        raise StudyError(
            f"the results folder {store.folder} contains {listed}, which cannot be mixed "
            "with cases of this version; compute them again with --recompute, or name another "
            "folder with --results"
        )
    return (f"Not used, because another version computed them: {listed}.",) if others else ()
