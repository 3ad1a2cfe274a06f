"""`antenna-ocp report`: what a stored result says, and its figures drawn again."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError

if TYPE_CHECKING:
    from studies.common.result import Result

# kind of study: module with a function `draw(result)`
ARM_FIGURES = "studies.arm.report.comparison_figures"
FIGURES = {
    "truss": "studies.truss.figures",
    "check": "studies.check.figures",
    "check-arm": "studies.check.figures",
    "arm": ARM_FIGURES,
    "arm-baselines": ARM_FIGURES,
    "arm-sequence": ARM_FIGURES,
    "pareto-arm": ARM_FIGURES,
    "robust": ARM_FIGURES,
    "paper": "studies.paper.figures",
    "flex": "studies.flex.figures",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of the sub-command."""
    parser.add_argument("results", type=Path, metavar="RESULTS", help="a results folder")
    parser.add_argument(
        "--figures", type=Path, metavar="DIR", help="draw its figures into this new folder"
    )
    parser.add_argument("--overwrite", action="store_true", help="replace that folder")
    parser.add_argument(
        "--partial", action="store_true", help="report what there is of an incomplete result"
    )


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Print the report, and draw the figures if they are asked for.

    The exit code is 0 if the result could be read, whatever it says.
    """
    from studies.common.result import Result
    from studies.common.writers import report_text

    result = Result.load(options.results, partial=options.partial)
    if options.figures is not None:
        _draw(result, options, console)
    console.say(report_text(result))
    return ExitCode.OK


def _draw(result: Result, options: argparse.Namespace, console: Console) -> None:
    from importlib import import_module

    from studies.common.folder import open_results
    from studies.common.running import draw_into

    if result.kind not in FIGURES:
        known = ", ".join(FIGURES)
        raise StudyError(f"results of the kind '{result.kind}' have no figures; {known} have")
    draw = import_module(FIGURES[result.kind]).draw
    folder = open_results(options.figures, "figures", options.overwrite)
    draw_into(result, folder, draw, console)
    folder.complete()
