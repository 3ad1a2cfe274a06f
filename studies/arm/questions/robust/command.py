"""`antenna-ocp robust`: motions for a spread of arms, beside the nominal one."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError

if TYPE_CHECKING:
    from studies.arm.config import ArmStudy
    from studies.arm.questions.robust.comparison import Comparison, Outcome

_OWN = ("torque_cap", "rate_cap", "latch", "satellite_inertia")  # what the study decides itself


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of the sub-command."""
    parser.add_argument("--drive", choices=("torque", "angle"), default="torque")
    parser.add_argument("--stage", metavar="NAME", help="big (8.6 s) or small (11.2 s)")
    parser.add_argument("--duration", metavar="X", help="of the motion [s]")
    parser.add_argument(
        "--config", type=Path, metavar="TOML",
        help="stage, angles and arm as for `arm`; flags override it",
    )  # fmt: skip
    parser.add_argument("--points", type=int, default=21, help="arms a side of the grid on B21")
    parser.add_argument("--results", type=Path, metavar="DIR", help="a new results folder")
    parser.add_argument("--overwrite", action="store_true", help="replace the results folder")
    parser.add_argument("--no-figures", action="store_true", help="leave the figures out")


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Solve, replay, print, write and draw."""
    from studies.arm.optimal.solve import check_bending
    from studies.arm.questions.robust.comparison import compare, mass_misses, table
    from studies.common.folder import open_results

    study = read_study(options)
    check_bending(study.stage)
    name = f"arm-robust-{study.stage.name}-{options.drive}"
    folder = open_results(options.results, name, options.overwrite)
    found = compare(study.stage, options.drive, options.points, console.progress, console.live)
    misses = mass_misses(found.robust[0].solved, console.live)
    printed = str(table(found, misses))
    console.say(printed)
    folder.file("table.txt").write_text(f"{printed}\n", "utf-8")
    folder.write_json("robust.json", record(study, found, misses))
    if not options.no_figures:
        from studies.arm.report.robust_figures import spread_figure, torque_figure

        spread_figure(found).savefig(folder.file("spread.png"))
        torque_figure(found).savefig(folder.file("torque.png"))
    folder.complete()
    console.say(f"everything is in {folder.path}")
    return ExitCode.OK if found.holds else ExitCode.NOT_VERIFIED


def read_study(options: argparse.Namespace) -> ArmStudy:
    """The stage asked for.

    Raises
    ------
    StudyError
        If the grid has no two points a side, the stage turns both joints, or the file says what
        this study decides itself.
    """
    from studies.arm.config import read

    if options.points < 2:
        raise StudyError(f"--points is {options.points}; give 2 or more arms a side")
    study = read(options.config, {"stage": options.stage, "duration": options.duration})
    if len(study.stage.moving) > 1:
        raise StudyError(
            f"robust turns one joint, the stage '{study.stage.name}' both; give big or small"
        )
    for key in _OWN:
        if key in study.given:
            raise StudyError(f"robust takes no {key}; leave it out of the file")
    if study.objective != "smoothest":
        raise StudyError(
            f"robust takes no objective, the file says {study.objective}; leave it out"
        )
    return study


def record(study: ArmStudy, found: Comparison, misses: dict[float, float]) -> dict[str, object]:
    """What `robust.json` holds."""
    from studies.common.folder import provenance

    return {
        "passed": found.holds, "study": dict(study.given), "drive": found.spread.drive,
        "axes": found.spread.axes, "design": found.spread.design,
        "motions": [_motion(outcome, found.nominal) for outcome in found.outcomes],
        "angle_miss_of_tip_mass_rad": misses, "made_by": provenance(),
    }  # fmt: skip


def _motion(outcome: Outcome, nominal: Outcome) -> dict[str, object]:
    joint = outcome.solved.stage.moving[0]
    law = outcome.solved.torques[joint]
    reduced, full = outcome.ratios(nominal)
    return {
        "name": outcome.solved.name,
        "peak_torque_Nm": outcome.peak,
        "peak_rate_Nm_per_s": float(outcome.solved.peak_rate[joint]),
        "ratio_B21": reduced,
        "ratio_full": full,
        "root_E_res_B21": outcome.reduced,
        "root_E_res_full": outcome.full,
        "torque_breakpoints_s": law.x,
        "torque_coefficients": law.c,
    }
