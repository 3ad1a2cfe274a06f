"""`antenna-ocp sweep`: its flags, its folder, and the order of work of a sweep."""

from __future__ import annotations

import argparse
import contextlib
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.running import folder_path
from studies.sweep import STUDY

if TYPE_CHECKING:
    from studies.common.folder import ResultsFolder
    from studies.sweep.cases.plan import Plan
    from studies.sweep.cases.store import CaseStore
    from studies.sweep.config import SweepStudy
    from studies.sweep.driver import Place

PARENT = Path("results")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of the sub-command."""
    parser.add_argument("study", type=Path, metavar="SWEEP.toml", help="what is swept")
    parser.add_argument(
        "--plan",
        action="store_true",
        help="say how many cases and how long, from a few of them; end",
    )
    parser.add_argument(
        "--results",
        type=folder_path,
        metavar="DIR",
        help="results folder, new or of this sweep, which then goes on "
        "[results/sweep-NAME of SWEEP.toml]",
    )

    # how it runs
    parser.add_argument("--workers", metavar="N", help="cases at a time [the number of processors]")
    parser.add_argument(
        "--case-seconds", metavar="S", help="that a case may last; then it is a row without answer"
    )
    parser.add_argument(
        "--coarse", action="store_true", help="coarse meshes, whatever the file says"
    )
    parser.add_argument(
        "--recompute",
        action="store_true",
        help="compute again what another version of the program has left in the folder",
    )
    parser.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="a Dask scheduler, as tcp://host:8786, or 'local' for one of this machine",
    )

    # what is written
    parser.add_argument("--parquet", action="store_true", help="write the table as Parquet, too")
    parser.add_argument("--no-figures", action="store_true", help="leave the figures out")


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Plan a sweep, solve what its folder lacks, and tabulate it."""
    from studies.sweep.cases.plan import plan
    from studies.sweep.cases.store import CaseStore

    seconds, workers = _limits(options)
    _check_extras(options)
    study = read_study(options)
    planned = plan(study, console)
    path = options.results or PARENT / f"sweep-{options.study.stem}"
    store = CaseStore(path, planned.version)
    if options.plan:
        return _say_plan(planned, store, options, workers, seconds, console)

    # a cluster that does not answer is said before there is a folder
    with contextlib.closing(_place(options, workers)) as place:
        folder = _open(path, study)
        remarks = _others(store, options.recompute)
        store.open()
        interrupted = _solve(planned, store, place, seconds, console)
    return _hand_over(planned, store, folder, interrupted, remarks, options, console)


def _say_plan(
    planned: Plan,
    store: CaseStore,
    options: argparse.Namespace,
    workers: int,
    seconds: float | None,
    console: Console,
) -> ExitCode:
    """Say how many cases and how long, from a few that are solved now if none was before.

    They are solved as the sweep would solve them, and kept in its folder.
    """
    from studies.sweep.estimate import plan_text, sample

    if trial := sample(planned, store):
        console.progress(f"{len(trial.cases)} cases are solved, to measure how long one takes")
        with contextlib.closing(_place(options, workers)) as place:
            _open(store.folder, planned.study)
            store.open()
            if _solve(trial, store, place, seconds, console):
                raise KeyboardInterrupt
    console.say(plan_text(planned, store, workers))
    return ExitCode.OK


def read_study(options: argparse.Namespace) -> SweepStudy:
    """The sweep that its file and the flags on top of it state.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """
    from studies.common.configuration import read_toml
    from studies.sweep.config import study_from

    raw = read_toml(options.study)
    if options.coarse:
        raw["coarse"] = True
    return study_from(raw, options.study.parent)


def _limits(options: argparse.Namespace) -> tuple[float | None, int]:
    """Seconds of a case, and cases at a time."""
    from ocp.processors import processors
    from studies.common.configuration import as_number, positive, whole

    seconds, workers = None, processors()
    if options.case_seconds is not None:
        seconds = positive("--case-seconds", as_number(options.case_seconds))
    if options.workers is not None:
        workers = whole(1, 1024)("--workers", as_number(options.workers))
    return seconds, workers


def _check_extras(options: argparse.Namespace) -> None:
    """Say at once what is asked for and not installed; after hours it would be too late."""
    if options.parquet and find_spec("pyarrow") is None:
        raise StudyError(
            "--parquet needs pyarrow, which is not installed; install it with: "
            "pip install 'antenna-ocp[parquet]', or leave --parquet out: the table is CSV, too"
        )


def _open(path: Path, study: SweepStudy) -> ResultsFolder:
    """The folder of a sweep: a new one, or one that goes on.

    Raises
    ------
    StudyError
        If it is somebody else's or cannot be written.
    """
    from studies.common.configuration import toml_text
    from studies.common.folder import (
        INPUT_FILE,
        OUR_MARK,
        RESULT_FILE,
        ResultsFolder,
        open_results,
        provenance,
    )
    from studies.common.result import Result
    from studies.common.whole_files import write_whole
    from studies.sweep.cases.store import AGAIN, FOLDER
    from studies.sweep.config import as_dictionary

    folder = ResultsFolder(path)
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

    head = "# Reproduces this result, or goes on with it: antenna-ocp sweep input.toml\n\n"
    configuration = as_dictionary(study)
    with folder.written(AGAIN):
        (path / FOLDER).mkdir(exist_ok=True)
        write_whole(folder.file(INPUT_FILE), (head + toml_text(configuration)).encode())
        Result.begun("sweep", study.question, configuration, provenance()).save(path)
    return folder


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
            f"the results folder {store.folder} holds {listed}, which are not mixed with those of "
            "this version; compute them again with --recompute, or name another folder with "
            "--results"
        )
    return (f"Left out, as another version has made them: {listed}.",) if others else ()


def _place(options: argparse.Namespace, workers: int) -> Place:
    """Where cases are solved."""
    if options.scheduler is not None:
        from studies.sweep.workers.cluster import DaskCluster

        return DaskCluster(options.scheduler, workers)
    from studies.sweep.workers.processes import LocalProcesses

    return LocalProcesses(workers)


def _solve(
    planned: Plan,
    store: CaseStore,
    place: Place,
    seconds: float | None,
    console: Console,
) -> bool:
    """Solve what the folder lacks; return whether the user stopped it."""
    from studies.sweep.cases.lock import alone
    from studies.sweep.cases.store import remove_drafts
    from studies.sweep.driver import Driver

    try:
        with alone(store.folder):
            list(remove_drafts(store.place))
            console.progress(f"{len(planned.cases)} cases on {place}, into {store.folder}")
            Driver(planned, store, place, seconds, console).run()
    except KeyboardInterrupt:
        return True
    return False


def _hand_over(
    planned: Plan,
    store: CaseStore,
    folder: ResultsFolder,
    interrupted: bool,
    remarks: tuple[str, ...],
    options: argparse.Namespace,
    console: Console,
) -> ExitCode:
    """Tabulate a sweep, print and draw it."""
    from studies.common.running import hand_over
    from studies.sweep.cases.store import AGAIN
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

    table = tabulate(planned, store)
    content = columns(planned, table)
    result = result_of(planned, table, interrupted, remarks)
    # the study in the folder: it has what flags have said, too
    again = f"antenna-ocp sweep {folder.file('input.toml')} --results {folder.path}"
    with folder.written(AGAIN):
        folder.file(FILE).write_text(as_csv(content), "utf-8", newline="")
        if points := front_columns(planned, table):
            folder.file(FRONTS).write_text(as_csv(points), "utf-8", newline="")
        if options.parquet:
            write_parquet(content, folder.file(FILE).with_suffix(".parquet"))
        return hand_over(
            STUDY, result, folder, again, options, console, again if interrupted else ""
        )
