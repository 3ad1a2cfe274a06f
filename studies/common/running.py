"""What the commands of all studies have in common: their flags, and the order of work of a run.

Nothing heavy is loaded here before it is needed: the flags serve `--help` too.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.study import Study, placed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from studies.common.folder import ResultsFolder
    from studies.common.result import Result

    Draw = Callable[[Result], Iterator[tuple[str, Figure]]]


GOES_ON_WITH = ("resume", "no_figures")  # what may be typed when a study goes on
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
        parser.add_argument("--no-figures", action="store_true", help="draw no figures")


def add_resume_flag(parser: argparse.ArgumentParser) -> None:
    """Which run is to go on."""
    parser.add_argument(
        "--resume",
        type=folder_path,
        metavar="DIR",
        help="resume a study that was stopped, in its results folder",
    )


def take_up(study: Study, options: argparse.Namespace) -> None:
    """Let a study go on in its folder: what it asks is there, and nothing else may be said.

    Parameters
    ----------
    options : Namespace
        Its `study` becomes the file in the folder, if there is something to go on with; its
        `typed` are the flags that were typed, by what they state.

    Raises
    ------
    StudyError
        If a flag or a file says something else, or the folder is none that could go on.
    """
    if options.resume is None:
        return
    from studies.common.folder import INPUT_FILE, resumed_results

    typed = {name: flag for name, flag in options.typed.items() if name not in GOES_ON_WITH}
    for what in (*typed.values(), *["a study"] * (options.study is not None)):
        raise StudyError(
            f"--resume continues the study in {options.resume} and allows no other arguments, but "
            f"{what} is given; leave it out"
        )
    options.study = resumed_results(options.resume, study.kind) / INPUT_FILE


def folder_path(text: str) -> Path:
    """The path of a flag; an empty text is none, nor one that no disk takes."""
    if not text.strip():
        raise argparse.ArgumentTypeError("it is empty; name a folder")
    if max((len(part.encode()) for part in Path(text).parts), default=0) > LONGEST_NAME:
        raise argparse.ArgumentTypeError(
            f"it has a name of more than {LONGEST_NAME} characters; give a shorter one"
        )
    return Path(text)


def carry_out(
    study: Study, stated: Any, name: str, options: argparse.Namespace, console: Console
) -> ExitCode:
    """Run a study: check it, open its folder, solve it, and print, write and draw its result.

    The folder has a `result.json` from the start, which says that it is incomplete.

    Parameters
    ----------
    stated : configuration
        What is asked.
    name : str
        Of the results folder, unless the user names one.

    Raises
    ------
    StudyError
        If it cannot be met, its folder cannot be opened, or it was not solved.
    """
    from models.errors import ModelError
    from studies.common.configuration import toml_text
    from studies.common.folder import INPUT_FILE, ResultsFolder, open_results, provenance
    from studies.common.result import Result
    from studies.common.whole_files import write_whole

    how: dict[str, Any] = {}
    try:
        checked = None if study.check is None else placed(study.check)(stated, console)
    except ModelError as error:  # the mechanics say themselves which number they cannot take
        raise StudyError(str(error)) from error
    if checked is not None:
        how["checked"] = checked
    if study.resumes and options.resume is not None:
        folder = ResultsFolder(options.resume)
    else:
        folder = open_results(options.results, name, options.overwrite)

    command, configuration = f"antenna-ocp {study.name}", study.configuration(stated)
    head = f"# Reproduces this result: {command} input.toml\n\n"
    go_on = f"{command} --resume {folder.path}" if study.resumes else ""
    console.progress(
        f"results go to {folder.path}{go_on and f'; to resume after an interruption: {go_on}'}"
    )
    with folder.written(f"to resume: {go_on}") if go_on else folder.written():
        if study.resumes:
            from studies.common.finished import finished_steps  # the engine loads with it

            how["kept"] = finished_steps(folder.path, [study.kind, configuration])
            if options.resume is not None:
                console.progress(_taken_over(how["kept"].count))
        again = folder.file(INPUT_FILE)
        # whole at any moment, as it is what a run goes on with
        write_whole(again, (head + toml_text(configuration, inline=("minimise",))).encode())
        begun = Result.begun(study.kind, stated.question, configuration, provenance())
        begun.save(folder.path)

        def solve() -> Result:
            found: Result = placed(study.run)(stated, console, **how)
            return found

        result = _solved(solve, folder, begun, go_on, console)
        code = hand_over(study, result, folder, f"{command} {again}", options, console, go_on)
        if study.ends and code is ExitCode.OK:
            from studies.common.finished import forget_steps

            forget_steps(folder.path)
        return code


def _taken_over(count: int) -> str:
    """What to say of finished steps that a study finds in its folder."""
    if not count:
        return "no step of this study, as input.toml states it, was finished by this version"
    return f"{count} step{'s were' if count > 1 else ' was'} finished in an earlier run"


def _solved(
    solve: Callable[[], Result],
    folder: ResultsFolder,
    begun: Result,
    go_on: str,
    console: Console,
) -> Result:
    """The result of a study; why there is none is kept in its folder."""
    try:
        return solve()
    except StudyError as error:
        if error.exit_code is ExitCode.INTERRUPTED and go_on:
            error = StudyError(f"{error}; to resume: {go_on}", error.exit_code)
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
            f"interrupted; the files written so far are kept; to resume: {go_on}",
            ExitCode.INTERRUPTED,
        ) from stop


def hand_over(
    study: Study,
    result: Result,
    folder: ResultsFolder,
    again: str,
    options: argparse.Namespace,
    console: Console,
    go_on: str = "",
) -> ExitCode:
    """Write, print and draw a result. A first Ctrl-C waits until it is written.

    Parameters
    ----------
    again : str
        The command that repeats the study.
    go_on : str
        The command that goes on with it where it was stopped; empty if none does.
    """
    from ocp.nlp.interrupts import noted_interrupts
    from studies.common.writers import exit_code, outcome_text, write

    outcome = outcome_text if study.outcome is None else placed(study.outcome)
    with noted_interrupts() as stop:
        try:
            write(result, folder)
            for name, text in _files(study, result).items():
                folder.file(name).write_text(text, "utf-8", newline="")
        finally:  # on a full disk, at least the user has it
            console.say(f"\n{outcome(result)}")

    interrupted = result.interrupted or stop.asked
    if study.figures is not None and not (options.no_figures or interrupted):
        try:
            draw_into(result, folder, placed(study.figures), console)
        except KeyboardInterrupt:  # all numbers are written; only figures are missing
            interrupted = True
    folder.complete()

    if interrupted:
        console.complain(
            f"interrupted; the results so far are kept{go_on and f'; to resume: {go_on}'}"
        )
    console.say(f"all files are in {folder.path}; to run it again: {again}")
    return ExitCode.INTERRUPTED if interrupted else exit_code(result)


def _files(study: Study, result: Result) -> Mapping[str, str]:
    """Further files beside those of every study: their texts, by name."""
    return {} if study.files is None else placed(study.files)(result)


def draw_into(result: Result, folder: ResultsFolder, draw: Draw, console: Console) -> None:
    """Draw all figures of a result into a folder."""
    from studies.common.drawing import save

    # some studies have none
    if save(draw(result), folder, console):
        console.progress("figures drawn")
