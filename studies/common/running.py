"""What the commands of all studies have in common: their flags, and the order of work of a run.

Nothing heavy is loaded here before it is needed: the flags serve `--help` too.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.key_flags import typed_flags

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from studies.common.folder import ResultsFolder
    from studies.common.result import Result

    Draw = Callable[[Result], Iterator[tuple[str, Figure]]]


LONGEST_NAME = 255  # bytes of one folder's name, on every common file system


def add_study_argument(parser: argparse.ArgumentParser) -> None:
    """The file of a study, which flags override."""
    parser.add_argument(
        "study", nargs="?", type=Path, metavar="STUDY.toml", help="a study; flags override it"
    )


def add_results_flags(parser: argparse.ArgumentParser, figures: bool = True) -> None:
    """Where results go."""
    parser.add_argument("--results", type=folder_path, metavar="DIR", help="a new results folder")
    parser.add_argument("--overwrite", action="store_true", help="replace the results folder")
    if figures:
        parser.add_argument("--no-figures", action="store_true", help="leave the figures out")


def add_resume_flag(parser: argparse.ArgumentParser) -> None:
    """Which run is to go on."""
    parser.add_argument(
        "--resume",
        type=folder_path,
        metavar="DIR",
        help="go on with a study that was stopped, in its results folder",
    )


def take_up(
    options: argparse.Namespace,
    add_arguments: Callable[[argparse.ArgumentParser], None],
    kind: str,
) -> None:
    """Let a study go on in its folder: what it asks is there, and nothing else may be said.

    Parameters
    ----------
    options : Namespace
        Its `study` becomes the file in the folder, if there is something to go on with.
    add_arguments : callable
        Of the command, whose defaults tell what was said.
    kind : str
        Of study, which the folder has to be of.

    Raises
    ------
    StudyError
        If a flag or a file says something else, or the folder is none that could go on.
    """
    if options.resume is None:
        return
    from studies.common.folder import INPUT_FILE, resumed_results

    parser = argparse.ArgumentParser()
    add_arguments(parser)
    typed = typed_flags(parser, options)
    for name, value in vars(options).items():
        if name not in ("resume", "no_figures") and value != parser.get_default(name):
            what = typed.get(name, "a study")
            raise StudyError(
                f"--resume goes on with the study in {options.resume}, and takes no other words, "
                f"but {what} is given; leave it out"
            )
    options.study = resumed_results(options.resume, kind) / INPUT_FILE


def folder_path(text: str) -> Path:
    """The path of a flag; an empty text is none, nor one that no disk takes."""
    if not text.strip():
        raise argparse.ArgumentTypeError("it is empty; name a folder")
    if max((len(part.encode()) for part in Path(text).parts), default=0) > LONGEST_NAME:
        raise argparse.ArgumentTypeError(
            f"it has a name of more than {LONGEST_NAME} characters; give a shorter one"
        )
    return Path(text)


@dataclass(frozen=True, eq=False)
class Job:
    """A study that a command carries out.

    Attributes
    ----------
    kind : of study, such as "truss".
    name : of the results folder, unless the user names one.
    command : what repeats the study, before the path of its `input.toml`.
    question, configuration : of the result.
    input_text : content of `input.toml`.
    check : raises StudyError where a study cannot be met, before a folder is made for it.
    solve : gives the result.
    draw : gives its figures, with the names of their files.
    files : further files beside those of every study: their texts, by name.
    outcome : what is printed of the result, where that is not the text of every study.
    opened : called with the folder before the solve.
    resume : folder of a run that was stopped, which goes on there; None for a new one.
    go_on : what goes on with a run that was stopped, before the path of its folder; empty if
        nothing does.
    """

    kind: str
    name: str
    command: str
    question: str
    configuration: Mapping[str, Any]
    input_text: str
    check: Callable[[], None]
    solve: Callable[[], Result]
    draw: Draw
    files: Callable[[Result], Mapping[str, str]] = lambda result: {}
    outcome: Callable[[Result], str] | None = None
    opened: Callable[[ResultsFolder], None] = lambda folder: None
    resume: Path | None = None
    go_on: str = ""


def carry_out(job: Job, options: argparse.Namespace, console: Console) -> ExitCode:
    """Run a study: check it, open its folder, solve it, and print, write and draw its result.

    The folder has a `result.json` from the start, which says that it is incomplete.

    Raises
    ------
    StudyError
        If it cannot be met, its folder cannot be opened, or it was not solved.
    """
    from models.errors import ModelError
    from studies.common.folder import ResultsFolder, open_results, provenance
    from studies.common.result import Result

    try:
        job.check()
    except ModelError as error:  # the mechanics say themselves which number they cannot take
        raise StudyError(str(error)) from error
    if job.resume is not None:
        folder = ResultsFolder(job.resume)
    else:
        folder = open_results(options.results, job.name, options.overwrite)
    go_on = f"{job.go_on} {folder.path}" if job.go_on else ""
    console.progress(
        f"results go to {folder.path}{go_on and f'; if it is stopped, it goes on by: {go_on}'}"
    )
    with folder.written(f"go on by: {go_on}") if go_on else folder.written():
        job.opened(folder)
        folder.file("input.toml").write_text(job.input_text, "utf-8")
        begun = Result.begun(job.kind, job.question, job.configuration, provenance())
        begun.save(folder.path)
        result = _solved(job, folder, begun, go_on, console)
        again = f"{job.command} {folder.file('input.toml')}"
        return hand_over(
            result, folder, job.draw, again, options, console, job.outcome, go_on, job.files
        )


def _solved(job: Job, folder: ResultsFolder, begun: Result, go_on: str, console: Console) -> Result:
    """The result of a study; why there is none is kept in its folder."""
    try:
        return job.solve()
    except StudyError as error:
        if error.exit_code is ExitCode.INTERRUPTED and go_on:
            error = StudyError(f"{error}; go on by: {go_on}", error.exit_code)
        infeasible = error.exit_code is ExitCode.INFEASIBLE
        try:
            begun.failed(str(error), infeasible).save(folder.path)
            record = {"sentence": str(error), "code": error.exit_code.name}
            folder.write_json("failure.json", record)
        except (OSError, StudyError):
            console.complain(str(error))  # what is raised now is the disk's
            raise
        raise error from None
    except KeyboardInterrupt as stop:
        if not go_on:
            raise
        raise StudyError(
            f"interrupted; what was written until then is kept; go on by: {go_on}",
            ExitCode.INTERRUPTED,
        ) from stop


def hand_over(
    result: Result,
    folder: ResultsFolder,
    draw: Draw,
    again: str,
    options: argparse.Namespace,
    console: Console,
    outcome: Callable[[Result], str] | None = None,
    go_on: str = "",
    files: Callable[[Result], Mapping[str, str]] = lambda result: {},
) -> ExitCode:
    """Write, print and draw a result. A first Ctrl-C waits until it is written.

    Parameters
    ----------
    again : str
        The command that repeats the study.
    outcome : callable, optional
        What is printed of the result; the text of every study by default.
    go_on : str
        The command that goes on with it where it was stopped; empty if none does.
    files : callable
        As of a `Job`.
    """
    from ocp.nlp.interrupts import noted_interrupts
    from studies.common.writers import exit_code, outcome_text, write

    with noted_interrupts() as stop:
        try:
            write(result, folder)
            for name, text in files(result).items():
                folder.file(name).write_text(text, "utf-8", newline="")
        finally:  # on a full disk, at least the user has it
            console.say(f"\n{(outcome or outcome_text)(result)}")

    interrupted = result.interrupted or stop.asked
    if not (options.no_figures or interrupted):
        try:
            draw_into(result, folder, draw, console)
        except KeyboardInterrupt:  # all numbers are written; only figures are missing
            interrupted = True
    folder.complete()

    if interrupted:
        console.complain(
            f"interrupted; what was found until then is kept{go_on and f'; go on by: {go_on}'}"
        )
    console.say(f"everything is in {folder.path}; rerun: {again}")
    return ExitCode.INTERRUPTED if interrupted else exit_code(result)


def draw_into(result: Result, folder: ResultsFolder, draw: Draw, console: Console) -> None:
    """Draw all figures of a result into a folder."""
    from studies.common.drawing import save

    # some studies have none
    if save(draw(result), folder, console):
        console.progress("figures drawn")
