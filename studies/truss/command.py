"""`antenna-ocp truss`: its flags, and the study that these state."""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.running import Job, add_results_flags, add_study_argument, carry_out
from studies.truss.quantities import OBJECTIVES

if TYPE_CHECKING:
    from studies.truss.config import TrussStudy

# flag: (place in the configuration, help). Texts are turned into numbers where they are numbers.
FLAGS: Mapping[str, tuple[tuple[str, ...], str]] = {
    "--objective": (("minimise",), ", ".join(OBJECTIVES)),
    "--speed-cap": (("caps", "speed"), "of the angle [rad/s]"),
    "--acceleration-cap": (("caps", "acceleration"), "of the angle [rad/s^2]"),
    "--jerk-cap": (
        ("caps", "jerk"),
        "of the angle [rad/s^3], or like 200/T^3, or bezier or step5 for that law's own peak; "
        "without one the acceleration is free at the ends",
    ),
    "--force-cap": (("caps", "force"), "of the motor on each rope [N]"),
    "--least-tension": (("caps", "least_tension"), "of every rope segment [N]"),
    "--friction": (("truss", "pulley_friction"), "mu between rope and pulley"),
    "--modules": (("truss", "modules"), "number of modules"),
    "--set": (("truss", "set"), "the paper's parameters: dynamic or kinematic"),
    "--intervals": (("solver", "intervals"), "mesh intervals to start from"),
    "--concession": (("concession",), "relative loss a later objective may cost an earlier one"),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of `antenna-ocp truss`."""
    add_study_argument(parser)
    add_truss_flags(parser)
    add_results_flags(parser)


def add_truss_flags(parser: argparse.ArgumentParser) -> None:
    """The flags that state a study of the truss."""
    for flag, (_, text) in FLAGS.items():
        parser.add_argument(flag, metavar="X", help=text)
    parser.add_argument("--duration", metavar="T", help="[s]; LOW..HIGH leaves it free between")
    parser.add_argument(
        "--parameter",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="any parameter of the model, e.g. link=0.16 or net_angle_deg=82; may be repeated",
    )
    parser.add_argument("--starts", metavar="A,B", help="laws to start from, with commas")


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Carry out `antenna-ocp truss`."""
    from studies.truss.config import as_dictionary, as_toml
    from studies.truss.search import Search
    from studies.truss.study import result_of

    study = read_study(options, console)
    search = Search(study, console)
    job = Job(
        kind="truss",
        name=study.name,
        command="antenna-ocp truss",
        question=study.question,
        configuration=as_dictionary(study),
        input_text=as_toml(study),
        check=search.check,
        solve=lambda: result_of(study, search.run()),
        draw=_draw,
    )
    return carry_out(job, options, console)


def _draw(result: Any) -> Any:
    from studies.truss.figures import draw  # Matplotlib loads with it

    return draw(result)


def read_study(options: argparse.Namespace, console: Console) -> TrussStudy:
    """The study that TOML and flags state.

    Raises
    ------
    StudyError
        Naming the key or flag, its value and the remedy.
    """
    return stated_study(raw_study(options), console)


def raw_study(options: argparse.Namespace) -> dict[str, Any]:
    """What TOML and flags state, not yet checked.

    Raises
    ------
    StudyError
        If the file cannot be read or a flag cannot be understood.
    """
    from studies.common.configuration import read_toml

    raw = read_toml(options.study) if options.study is not None else {}
    _apply_flags(raw, options)
    return raw


def stated_study(raw: Mapping[str, Any], console: Console) -> TrussStudy:
    """The study that a nested dictionary states; what the model warns of is said once.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """
    from studies.truss.config import study_from

    # such as a spring that pulls: it stops nothing
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        study = study_from(raw)
    for warning in {str(item.message) for item in caught}:
        console.progress(f"warning: {warning}")
    return study


def _apply_flags(raw: dict[str, Any], options: argparse.Namespace) -> None:
    from studies.common.configuration import as_number, put

    for flag, (place, _) in FLAGS.items():
        text = getattr(options, flag.removeprefix("--").replace("-", "_"))
        if text is not None:
            put(raw, place, as_number(text))

    if options.duration is not None:
        ends = [as_number(end) for end in options.duration.split("..")]
        raw["duration"] = ends[0] if len(ends) == 1 else ends
    for assignment in options.parameter:
        name, equals, text = assignment.partition("=")
        if not equals:
            raise StudyError(f"--parameter is {assignment!r}; write NAME=VALUE, e.g. link=0.16")
        put(raw, ("truss", *name.strip().split(".")), as_number(text.strip()))
    if options.starts is not None:
        put(raw, ("solver", "starts"), options.starts.split(","))
