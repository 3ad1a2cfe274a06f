"""`antenna-ocp mission`: its flags, which are the keys of its study, and what it runs."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from studies.common.console import Console
from studies.common.exit_codes import ExitCode
from studies.common.key_flags import KeyFlags, add_key_flags, put_key_flags
from studies.common.running import Job, add_results_flags, add_study_argument, carry_out

if TYPE_CHECKING:
    from studies.mission.config import MissionStudy

# those of the ring and the arm stand in [truss] and [arm] of the file
FLAGS: KeyFlags = {
    "--least": (("least",), "utilisation (in --total) or time (under the caps)"),
    "--total": (("total",), "time of all stages and dwells [s]"),
    "--dwell": (("dwell",), "after each stage, for its latch [s]"),
    "--big-torque": (("big_torque",), "cap at the root [N m]"),
    "--small-torque": (("small_torque",), "cap at the elbow [N m]"),
    "--residual-energy": (("residual_energy",), "cap on what each lock of the arm leaves [J]"),
    "--rope-force": (("rope_force",), "cap on the ring's force on one rope [N]"),
    "--reaction": (("reaction",), "cap on what the arm feels of the ring [N]"),
    "--jerk": (("jerk",), "cap of the ring's angle [rad/s^3], or like 500/T^3, bezier, step5"),
    "--reaction-angle-deg": (
        ("reaction_angle_deg",),
        "between the ring's reaction and the straight arm [deg]",
    ),
    "--intervals": (("intervals",), "of the arm's meshes; 0 for those of arm solve"),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of the sub-command."""
    add_study_argument(parser)
    add_key_flags(parser, FLAGS)
    parser.add_argument(
        "--no-refine", action="store_true", help="leave the arm's motions as they are first found"
    )
    add_results_flags(parser)


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Carry out `antenna-ocp mission`."""
    from studies.mission import study as work
    from studies.mission.config import as_dictionary, as_toml

    study = read_study(options)
    job = Job(
        kind="mission",
        name=f"mission-{study.least}",
        command="antenna-ocp mission",
        question=study.question,
        configuration=as_dictionary(study),
        input_text=as_toml(study),
        check=lambda: None,
        solve=lambda: work.run(study, console),
        draw=_draw,
    )
    return carry_out(job, options, console)


def read_study(options: argparse.Namespace) -> MissionStudy:
    """The study that a file and the flags on top of it state.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """
    from studies.common.configuration import read_toml
    from studies.mission.config import study_from

    raw = read_toml(options.study)
    put_key_flags(raw, options, FLAGS)
    if options.no_refine:
        raw["refine"] = False
    return study_from(raw)


def _draw(result: Any) -> Any:
    from studies.mission.figures import draw  # Matplotlib loads with it

    return draw(result)
