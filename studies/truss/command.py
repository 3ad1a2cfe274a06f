"""`antenna-ocp truss`: its flags, and the study that these state."""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError, quoted
from studies.common.key_flags import KeyFlags, add_key_flags, put_key_flags
from studies.common.running import (
    Job,
    add_results_flags,
    add_resume_flag,
    add_study_argument,
    carry_out,
    take_up,
)
from studies.truss.quantities import OBJECTIVES

if TYPE_CHECKING:
    from studies.common.folder import ResultsFolder
    from studies.truss.config import TrussStudy

FLAGS: KeyFlags = {
    "--objective": (("minimise",), ", ".join(OBJECTIVES)),
    "--speed-cap": (("caps", "speed"), "of the angle [rad/s]"),
    "--acceleration-cap": (("caps", "acceleration"), "of the angle [rad/s^2]"),
    "--jerk-cap": (
        ("caps", "jerk"),
        "of the angle [rad/s^3], or like 200/T^3, or bezier or step5 for that law's own peak; "
        "without one the acceleration is free at the ends",
    ),
    "--rope-speed-cap": (("caps", "rope_speed"), "of each rope [m/s]"),
    "--rope-acceleration-cap": (("caps", "rope_acceleration"), "of each rope [m/s^2]"),
    "--rope-jerk-cap": (("caps", "rope_jerk"), "of each rope [m/s^3]"),
    "--force-cap": (("caps", "force"), "of the motor on each rope [N]"),
    "--power-cap": (("caps", "power"), "of both motors together [W]"),
    "--motor-force-cap": (("caps", "motor_force"), "of the motor, its rotor included [N]"),
    "--motor-speed-cap": (("caps", "motor_speed"), "of one motor's shaft [rad/s]"),
    "--motor-torque-cap": (("caps", "motor_torque"), "of one motor's shaft [N m]"),
    "--reaction-cap": (("caps", "reaction"), "on the supporting arm [N]"),
    "--far-end-tension-cap": (("caps", "far_end_tension"), "at the rope's fixed end [N]"),
    "--bar-force-cap": (("caps", "bar_force"), "push or pull in a link or cross-bar [N]"),
    "--buckling-cap": (("caps", "buckling_load"), "push in a bar, part of its buckling load [1]"),
    "--reversal-cap": (("caps", "link_reversal"), "push and pull of the same link [N]; checked"),
    "--factored-force-cap": (("caps", "factored_force"), "of the motor for its margins [N]"),
    "--least-tension": (("caps", "least_tension"), "of every rope segment [N]"),
    "--friction": (("truss", "pulley_friction"), "mu between rope and pulley"),
    "--modules": (("truss", "modules"), "number of modules"),
    "--set": (("truss", "set"), "the paper's parameters: dynamic or kinematic"),
    "--intervals": (("solver", "intervals"), "mesh intervals to start from"),
    "--seconds": (("solver", "seconds"), "the search may take; the best until then is kept [s]"),
    "--concession": (("concession",), "relative loss a later objective may cost an earlier one"),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of `antenna-ocp truss`."""
    add_study_argument(parser)
    add_truss_flags(parser)
    add_motor_flags(parser)
    add_results_flags(parser)
    add_resume_flag(parser)


def add_motor_flags(parser: argparse.ArgumentParser) -> None:
    """The files of drive and margins."""
    parser.add_argument(
        "--drive",
        type=Path,
        metavar="FILE",
        help="drive.toml, whose limits are caps; or [drive] of the study's own file",
    )
    parser.add_argument(
        "--margin",
        metavar="X",
        help="margins of the motor: a preset, as aiaa-s-114, or a TOML file with [margin]",
    )
    parser.add_argument(
        "--keep-margins",
        dest="margin.keep",
        action="store_true",
        help="the motion has to keep the margins, as it does its caps",
    )


def add_truss_flags(parser: argparse.ArgumentParser) -> None:
    """The flags that state a study of the truss."""
    add_key_flags(parser, FLAGS)
    parser.add_argument("--duration", metavar="T", help="[s]; LOW..HIGH leaves it free between")
    parser.add_argument(
        "--parameter",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="any parameter of the model, e.g. link=0.16 or net_angle_deg=82; may be repeated",
    )
    parser.add_argument(
        "--starts", dest="solver.starts", metavar="A,B", help="laws to start from, with commas"
    )


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Carry out `antenna-ocp truss`."""
    from studies.common.finished import FinishedStarts
    from studies.truss.config import as_dictionary, as_toml
    from studies.truss.search.motion_search import Search
    from studies.truss.study import result_of

    take_up(options, add_arguments, "truss")
    study = read_study(options, console)
    search = Search(study, console, confirms=True)

    def keep_starts(folder: ResultsFolder) -> None:
        search.kept = FinishedStarts(folder.path)

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
        opened=keep_starts,
        resume=options.resume,
        go_on="antenna-ocp truss --resume",
    )
    return carry_out(job, options, console)


def _draw(result: Any) -> Any:
    from studies.truss.figures import draw  # Matplotlib loads with it

    return draw(result)


def read_study(options: argparse.Namespace, console: Console) -> TrussStudy:
    """The study that TOML, flags, and the files of drive and margins state.

    Raises
    ------
    StudyError
        Naming the key or flag, its value and the remedy.
    """
    return stated_study(raw_with_motor(options), console)


def raw_with_motor(options: argparse.Namespace) -> dict[str, Any]:
    """What TOML, flags, and the files of drive and margins state, not yet checked.

    Raises
    ------
    StudyError
        If a file cannot be read or a flag cannot be understood.
    """
    from studies.common.configuration import table
    from studies.drive.schema import read_drive
    from studies.margin.schema import read_margin

    raw = raw_study(options)
    if options.drive is not None:
        raw["drive"] = read_drive(options.drive)
    if options.margin is not None:
        raw["margin"] = read_margin(options.margin)
    if getattr(options, "margin.keep"):
        raw["margin"] = {**table("margin", raw.get("margin", {})), "keep": True}
    return raw


def raw_study(options: argparse.Namespace) -> dict[str, Any]:
    """What TOML and flags state, not yet checked.

    Raises
    ------
    StudyError
        If the file cannot be read or a flag cannot be understood.
    """
    from studies.common.configuration import read_toml

    raw = read_toml(options.study)
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

    with truss_warnings(console):
        return study_from(raw)


@contextmanager
def truss_warnings(console: Console) -> Iterator[None]:
    """Say each warning of the model once, such as of a spring that pulls: it stops nothing."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        yield
    for warning in {str(item.message) for item in caught}:
        console.progress(f"warning: {warning}")


def _apply_flags(raw: dict[str, Any], options: argparse.Namespace) -> None:
    from studies.common.configuration import as_number, put

    put_key_flags(raw, options, FLAGS)
    if options.duration is not None:
        ends = [as_number(end.strip()) for end in options.duration.split("..")]
        raw["duration"] = ends[0] if len(ends) == 1 else ends
    _apply_parameters(raw, options)
    starts = getattr(options, "solver.starts")
    if starts is not None:
        put(raw, ("solver", "starts"), starts.split(","))


# What another flag, or the same angle in another unit, states too.
_SAME = {
    "pulley_friction": "--friction",
    "modules": "--modules",
    "set": "--set",
    "net_angle": "net_angle_deg",
    "net_angle_deg": "net_angle",
    "stowed_angle": "stowed_angle_deg",
    "stowed_angle_deg": "stowed_angle",
}


def _apply_parameters(raw: dict[str, Any], options: argparse.Namespace) -> None:
    """Put the parameters of the flags into the study; one that is stated twice is refused."""
    from studies.common.configuration import as_number, put

    stated: dict[str, str] = {}
    for assignment in options.parameter:
        name, equals, text = (part.strip() for part in assignment.partition("="))
        if not (name and equals and text):
            raise StudyError(
                f"--parameter is {quoted(assignment)}; write NAME=VALUE, e.g. link=0.16"
            )

        same = _SAME.get(name, "")
        of_flag = None
        if same.startswith("--"):
            of_flag = getattr(options, ".".join(FLAGS[same][0]))
        other = next((key for key in (name, same) if key in stated), None)
        if other is not None or of_flag is not None:
            first = f"{same} {of_flag}" if other is None else f"--parameter {other}={stated[other]}"
            raise StudyError(
                f"{first} and --parameter {name}={text} state the same thing; leave one of them out"
            )

        stated[name] = text
        if isinstance(raw.get("truss"), dict):
            raw["truss"].pop(same, None)  # the flag overrides the file, in whichever unit
        put(raw, ("truss", *name.split(".")), as_number(text))
