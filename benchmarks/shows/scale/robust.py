"""The show "robust": one law of the truss for several scenarios, tried on trusses that are drawn.

A case runs the command, and replays its law on trusses of another seed, so that the rate does not
rest on the draws of one run. It says the processor's seconds of that replay.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Sequence
from pathlib import Path

from benchmarks.shows.show import Question, Row
from benchmarks.shows.truss_random import run_command
from studies.common.configuration import toml_text
from studies.common.console import Table, number
from studies.common.exit_codes import ExitCode
from studies.common.rates import rate
from studies.common.result import Result
from studies.robust.config import study_from
from studies.robust.replay import drawn, replay
from studies.robust.study import BY_FACTORS, NOMINAL_LAW, ROBUST
from studies.truss.limits.tolerances import CAPS, TENSION
from studies.truss.motions.deployment import Deployment
from studies.truss.motions.laws import law_of_result

LINE = "a robust law of the truss, slow and fast, tried on 10,000 trusses: 3 cases"
LIMIT = 1500.0  # [s]; a case takes two to five minutes

DEPLOYMENTS = (
    {"duration": 140.0, "caps": {"jerk": "bezier"}},
    {"duration": 6.0, "caps": {"jerk": "500/T^3"}},
    {"duration": 4.0, "caps": {"jerk": "500/T^3"}},
)
UNCERTAIN = {
    "draws": 10_000,
    "scenarios": {
        "rough": {"pulley_friction": 0.015, "joint_friction": 0.15, "net_stiffness": 220.0},
        "smooth": {"pulley_friction": 0.005, "joint_friction": 0.05},
        "weak springs": {"spring_stiffness": 90.0},
        "stuck joint": {"stuck_moment": 40.0, "stuck_angle_deg": 40.0},
    },
    "scatter": {
        "pulley_friction": {"low": 0.005, "high": 0.015},
        "joint_friction": {"low": 0.05, "high": 0.15},
        "spring_stiffness": {"low": 90.0, "high": 110.0},
        "net_stiffness": {"low": 180.0, "high": 220.0},
    },
}


def question(seed: int, index: int) -> Question:
    """The deployment of a case; the trusses of the command are drawn with the seed."""
    uncertain = {**UNCERTAIN, "seed": seed}
    stated = {"truss": {"pulley_friction": 0.01}, "margin": {"preset": "aiaa-s-114"}}
    return {**DEPLOYMENTS[index % len(DEPLOYMENTS)], **stated, "robust": uncertain}


def answer(question: Question, folder: Path) -> Row:
    """Forces of both laws, their rates, and the seconds of a replay on other draws."""
    file = folder / "study.toml"
    stated = {name: value for name, value in question.items() if name in KEYS}
    file.write_text(toml_text(stated), "utf-8")
    command = ["robust", "truss", str(file), "--results", str(folder / "results"), "--overwrite"]
    code, _ = run_command(command, folder / "printed.txt")
    if code not in (ExitCode.OK, ExitCode.NOT_VERIFIED):
        return {"code": int(code), "force": None}

    result = Result.load(folder / "results")
    study = study_from(result.configuration)
    law = Deployment("robust", law_of_result(result), study.deployment.truss)
    other = dataclasses.replace(study.uncertainty, seed=study.uncertainty.seed + 1)
    values = drawn(dataclasses.replace(study, uncertainty=other))
    begin = time.process_time()
    replayed = replay(law, values)
    seconds = time.process_time() - begin
    over = replayed.peak > result.details["motor_force"] * (1 + CAPS)
    broken = int((over | (replayed.least < -TENSION * replayed.peak)).sum())
    worst = next(row for row in result.table if row.key == "worst-force")
    return {
        "code": int(code),
        "force": worst.values["robust"],
        "nominal": worst.values["nominal optimum"],
        "bound": worst.bound,
        "verdict": result.verdict.kind,
        "rates": result.details["rates"],
        "corners": len(result.details["corners"]),
        "other_draws": dataclasses.asdict(rate(broken, len(values), 0.95)),
        "replay_seconds": seconds,
    }


KEYS = ("duration", "caps", "truss", "margin", "robust")


def tables(rows: Sequence[Row]) -> list[Table]:
    """Each case in a line."""
    answered = [row for row in rows if not row["failure"] and row["force"] is not None]
    cells = [
        (
            f"{row['duration']:g} s",
            number(row["force"], 6),
            number(row["nominal"], 6),
            number(row["bound"], 6),
            row["verdict"],
            str(row["corners"]),
            *(_rate(row["rates"][law]["any"]) for law in (ROBUST, NOMINAL_LAW, BY_FACTORS)),
            _rate(row["other_draws"]),
            f"{row['replay_seconds']:.1f} s",
        )
        for row in answered
    ]
    head = (
        *("duration", "robust, worst [N]", "nominal, worst [N]", "bound [N]", "verdict"),
        *("corners added", "robust breaks a limit", "nominal", "nominal, motor by factors"),
        *("robust, other draws", "processor"),
    )
    notes = [f"{len(rows) - len(answered)} cases failed to answer"]
    return [Table("robust laws on drawn trusses", head, cells, notes)]


def _rate(rate: dict[str, float]) -> str:
    share = 100 * rate["broken"] / rate["draws"]
    return f"{share:.3g} % ({100 * rate['low']:.3g} to {100 * rate['high']:.3g} %)"
