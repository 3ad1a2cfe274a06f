"""`antenna-ocp robust truss`: its flags, and the study that these state."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from studies.common.console import Console
from studies.common.exit_codes import ExitCode
from studies.common.key_flags import KeyFlags, add_key_flags, put_key_flags
from studies.common.running import Job, add_results_flags, add_study_argument, carry_out
from studies.truss.command import add_truss_flags, raw_study, truss_warnings

if TYPE_CHECKING:
    from studies.robust.config import RobustTrussStudy

FLAGS: KeyFlags = {
    "--draws": (("robust", "draws"), "trusses drawn from the scatter; 10000"),
    "--seed": (("robust", "seed"), "of the draws; 1"),
    "--confidence": (("robust", "confidence"), "of the interval of a rate; 0.95"),
}
COARSE = {"intervals": 24, "starts": ["bezier"]}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of the sub-command."""
    add_study_argument(parser)
    add_truss_flags(parser)
    add_key_flags(parser, FLAGS)
    parser.add_argument("--coarse", action="store_true", help="one start on a coarse mesh")
    parser.add_argument("--margin", metavar="X", help="margins by factors, to compare with")
    add_results_flags(parser)


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Carry out `antenna-ocp robust truss`."""
    from studies.robust import study as work
    from studies.robust.config import as_dictionary, as_toml

    study = read_study(options, console)
    job = Job(
        kind="robust-truss",
        name="robust-truss",
        command="antenna-ocp robust truss",
        question=study.question,
        configuration=as_dictionary(study),
        input_text=as_toml(study),
        check=lambda: work.check(study),
        solve=lambda: work.run(study, console),
        draw=_draw,
    )
    return carry_out(job, options, console)


def read_study(options: argparse.Namespace, console: Console) -> RobustTrussStudy:
    """The study that a file and the flags on top of it state.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """
    from studies.margin.schema import read_margin
    from studies.robust.config import study_from

    raw = raw_study(options)
    put_key_flags(raw, options, FLAGS)
    if options.coarse:
        raw["solver"] = {**raw.get("solver", {}), **COARSE}
    if options.margin is not None:
        raw["margin"] = read_margin(options.margin)
    with truss_warnings(console):
        return study_from(raw)


def _draw(result: Any) -> Any:
    from studies.robust.figures import draw  # Matplotlib loads with it

    return draw(result)
