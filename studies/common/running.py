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

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from studies.common.folder import ResultsFolder
    from studies.common.result import Result

    Draw = Callable[[Result], Iterator[tuple[str, Figure]]]


def add_study_argument(parser: argparse.ArgumentParser) -> None:
    """The file of a study, which flags override."""
    parser.add_argument(
        "study", nargs="?", type=Path, metavar="STUDY.toml", help="a study; flags override it"
    )


def add_results_flags(parser: argparse.ArgumentParser, figures: bool = True) -> None:
    """Where results go."""
    parser.add_argument("--results", type=Path, metavar="DIR", help="a new results folder")
    parser.add_argument("--overwrite", action="store_true", help="replace the results folder")
    if figures:
        parser.add_argument("--no-figures", action="store_true", help="leave the figures out")


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


def carry_out(job: Job, options: argparse.Namespace, console: Console) -> ExitCode:
    """Run a study: check it, open its folder, solve it, and print, write and draw its result.

    The folder has a `result.json` from the start, which says that it is incomplete.

    Raises
    ------
    StudyError
        If it cannot be met, its folder cannot be opened, or it was not solved.
    """
    from studies.common.folder import open_results, provenance
    from studies.common.result import Result

    job.check()
    folder = open_results(options.results, job.name, options.overwrite)
    console.progress(f"results go to {folder.path}")
    folder.file("input.toml").write_text(job.input_text, "utf-8")
    begun = Result.begun(job.kind, job.question, job.configuration, provenance())
    begun.save(folder.path)

    try:
        result = job.solve()
    except StudyError as error:
        infeasible = error.exit_code is ExitCode.INFEASIBLE
        begun.failed(str(error), infeasible).save(folder.path)
        folder.write_json("failure.json", {"sentence": str(error), "code": error.exit_code.name})
        raise
    for name, text in job.files(result).items():
        folder.file(name).write_text(text, "utf-8", newline="")
    again = f"{job.command} {folder.file('input.toml')}"
    return hand_over(result, folder, job.draw, again, options, console, job.outcome)


def hand_over(
    result: Result,
    folder: ResultsFolder,
    draw: Draw,
    again: str,
    options: argparse.Namespace,
    console: Console,
    outcome: Callable[[Result], str] | None = None,
) -> ExitCode:
    """Write, print and draw a result.

    Parameters
    ----------
    again : str
        The command that repeats the study.
    outcome : callable, optional
        What is printed of the result; the text of every study by default.
    """
    from studies.common.writers import exit_code, outcome_text, write

    write(result, folder)
    console.say(f"\n{(outcome or outcome_text)(result)}")

    interrupted = result.interrupted
    if not (options.no_figures or interrupted):
        try:
            draw_into(result, folder, draw, console)
        except KeyboardInterrupt:  # all numbers are written; only figures are missing
            interrupted = True
    folder.complete()

    if interrupted:
        console.complain("interrupted; what was found until then is kept")
    console.say(f"everything is in {folder.path}; rerun: {again}")
    return ExitCode.INTERRUPTED if interrupted else exit_code(result)


def draw_into(result: Result, folder: ResultsFolder, draw: Draw, console: Console) -> None:
    """Draw all figures of a result into a folder."""
    from studies.common.drawing import save

    save(draw(result), folder, console)
    console.progress("figures drawn")
