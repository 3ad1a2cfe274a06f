"""`antenna-ocp codesign`: its flags, and the study that these state."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from studies.common.console import Console
from studies.common.exit_codes import ExitCode
from studies.common.key_flags import KeyFlags, add_key_flags, put_key_flags
from studies.common.running import Job, add_results_flags, add_study_argument, carry_out
from studies.truss.command import add_truss_flags, raw_study, truss_warnings

if TYPE_CHECKING:
    from studies.codesign.config import CodesignStudy

FLAGS: KeyFlags = {
    "--range": (("design", "range"), "part by which each may change, up and down; 0.3"),
    "--holding-force": (("design", "holding_force"), "least on each rope of the open truss [N]"),
    "--stroke": (("design", "stroke"), "most length that each rope is hauled in [m]"),
    "--stowed-height": (("design", "stowed_height"), "most height of the stowed truss [m]"),
    "--designs": (("design", "starts"), "designs to start from, the stated one first; 4"),
    "--seed": (("design", "seed"), "of the random designs among them; 1"),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of the sub-command."""
    add_study_argument(parser)
    add_truss_flags(parser)
    parser.add_argument(
        "--free", dest="design.free", metavar="A,B", help="parameters that are free, with commas"
    )
    add_key_flags(parser, FLAGS)
    parser.add_argument("--margin", metavar="X", help="margins of the motor, as of truss")
    add_results_flags(parser)


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Carry out `antenna-ocp codesign`."""
    from studies.codesign import study as work
    from studies.codesign.config import as_dictionary, as_toml
    from studies.codesign.prices import stored_prices

    study = read_study(options, console)
    job = Job(
        kind="codesign",
        name=f"codesign-{study.objective}",
        command="antenna-ocp codesign",
        question=study.question,
        configuration=as_dictionary(study),
        input_text=as_toml(study),
        check=lambda: work.check(study),
        solve=lambda: work.run(study, console),
        draw=_draw,
        files=lambda result: {"prices.csv": stored_prices(result.details["prices"])},
    )
    return carry_out(job, options, console)


def read_study(options: argparse.Namespace, console: Console) -> CodesignStudy:
    """The study that a file and the flags on top of it state.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """
    from studies.codesign.config import study_from
    from studies.common.configuration import put
    from studies.margin.schema import read_margin

    raw = raw_study(options)
    put_key_flags(raw, options, FLAGS)
    free = getattr(options, "design.free")
    if free is not None:
        put(raw, ("design", "free"), free.split(","))
    if options.margin is not None:
        raw["margin"] = read_margin(options.margin)
    with truss_warnings(console):
        return study_from(raw)


def _draw(result: Any) -> Any:
    from studies.codesign.figures import draw  # Matplotlib loads with it

    return draw(result)
