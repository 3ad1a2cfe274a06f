"""`antenna-ocp arm-robust`: one motion for a spread of arms, beside the nominal one."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from studies.console import Console
from studies.exit_codes import ExitCode, StudyError

if TYPE_CHECKING:
    from studies.arm.robust_study import Outcome

DURATION = 8.6  # [s]


def add_to(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the sub-command."""
    parser = subparsers.add_parser(
        "arm-robust",
        help="a motion of the arm that stands a spread of stiffness or tip mass",
        description="Finds the big arm's motion of least peak torque in 8.6 s, and one of at most "
        "a tenth more that also leaves arms of other stiffness (torque drive) or stiffness and tip "
        "mass (angle drive) still; replays both over the spread. Exit code 5 if the worst residual "
        "falls less than fivefold.",
    )
    parser.add_argument("--drive", choices=("torque", "angle"), default="torque")
    parser.add_argument("--points", type=int, default=21, help="arms a side of the grid on B21")
    parser.add_argument("--results", type=Path, metavar="DIR", help="a new results folder")
    parser.add_argument("--overwrite", action="store_true", help="replace the results folder")
    parser.set_defaults(run=run)


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Solve, replay, print, write and draw."""
    from studies.arm.robust_study import compare, figure, mass_misses, table
    from studies.arm.stage import big_arm
    from studies.results import open_results, provenance

    if options.points < 2:
        raise StudyError(f"--points is {options.points}; give 2 or more arms a side")
    stage = big_arm(DURATION)
    name = f"arm-robust-{stage.name}-{options.drive}"
    folder = open_results(options.results, name, options.overwrite)
    found = compare(stage, options.drive, options.points, console.progress, console.live)
    misses = mass_misses(found.robust.solved)
    printed = str(table(found, misses))
    console.say(printed)
    folder.file("table.txt").write_text(f"{printed}\n", "utf-8")
    figure(found).savefig(folder.file("spread.png"))
    folder.write_json("robust.json", {
        "passed": found.holds, "stage": stage.name, "duration_s": stage.duration,
        "drive": options.drive, "axes": found.spread.axes, "design": found.spread.design,
        "ratio_B21": found.ratios[0], "ratio_full": found.ratios[1],
        "motions": [_record(outcome) for outcome in (found.nominal, found.robust)],
        "angle_miss_of_tip_mass_rad": misses, "made_by": provenance(),
    })  # fmt: skip
    folder.complete()
    console.say(f"everything is in {folder.path}")
    return ExitCode.OK if found.holds else ExitCode.NOT_VERIFIED


def _record(outcome: Outcome) -> dict[str, object]:
    stage = outcome.solved.stage
    joint = stage.moving[0]
    law = outcome.solved.torques[joint]
    return {
        "name": outcome.solved.name,
        "peak_torque_Nm": outcome.peak,
        "peak_rate_Nm_per_s": float(outcome.solved.peak_rate[joint]),
        "root_E_res_B21": outcome.reduced,
        "root_E_res_full": outcome.full,
        "torque_breakpoints_s": law.x,
        "torque_coefficients": law.c,
    }
