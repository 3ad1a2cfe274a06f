"""The show "pareto-arm": fronts of the arm, their slopes, and what they save beside cold starts.

Each case is a front whose points the study verifies one by one on the full model. Slopes are held
against central differences of what was minimised, two motions solved beside a point from its own.
Some points are found again cold, refined as a motion of `arm solve` is.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.shows.scale.fronts import found_cold, keep, study_of, times_faster
from benchmarks.shows.show import Question, Row
from ocp.analysis.front.continuation import FrontPoint, NotFoundError
from studies.arm.config import question_from
from studies.arm.questions.fronts.point import unit_of
from studies.arm.questions.fronts.study import front_result, laws_beside, walked_front
from studies.arm.questions.fronts.subject import ArmFront
from studies.arm.trade_off import TradeOffStudy
from studies.common.console import Table, number, silent

LINE = "fronts of the arm: slopes against differences, seconds beside cold starts: 3 cases"
LIMIT = 3600.0  # [s]

CASES: tuple[dict[str, Any], ...] = (
    {"stage": "big", "objectives": ["time", "peak-torque"]},
    {"stage": "small", "objectives": ["time", "peak-torque"]},
    {"stage": "big", "objectives": ["time", "deflection"]},
)
SAMPLED = 3  # points whose slope is looked at, and which are found again cold
STEP = 2e-3  # of a limit, of the differences


def question(seed: int, index: int) -> Question:
    """The study of a case."""
    return study_of(CASES, index)


def answer(question: Question, folder: Path) -> Row:
    """The front, its slopes, and cold starts at some of its points."""
    begin = time.process_time()
    subject = ArmFront(question_from(TradeOffStudy, question["study"]), silent())
    walked = walked_front(subject)
    front, seconds = walked.front, time.process_time() - begin

    span = front.points[0].x, front.points[-1].x
    result = front_result(subject, walked, laws_beside(subject.study, span, silent(), True))
    keep(result, folder)

    places = np.linspace(1, len(front.points) - 2, SAMPLED).round().astype(int)
    sampled = [front.points[place] for place in places]
    found = [*front.points, *front.dominated]
    return {
        "question": result.question,
        "points": len(front.points),
        "dominated": len(front.dominated),
        "gaps": len(front.gaps),
        "afresh": sum(point.afresh for point in found),
        "left": max(point.motion.replay.residual_energy for point in front.points),
        "slopes": [_slopes(subject, point) for point in sampled],
        "walked": seconds,
        "solves": len(found),
        "cold": [_cold(subject, point) for point in sampled],
        "remarks": list(result.remarks),
    }


def _slopes(subject: ArmFront, point: FrontPoint) -> dict[str, float]:
    """A slope, and the central difference of the same motions without torque that is added."""
    sides = []
    for factor in (1 - STEP, 1 + STEP):
        beside = subject.near(point.limit * factor, point, "between").motion
        # in the unit of what is least, as it was solved
        sides.append(beside.motion.objective * unit_of(beside.motion))
    difference = (sides[1] - sides[0]) / (2 * STEP * point.limit)
    return {"limit": point.limit, "slope": point.slope, "difference": difference}


def _cold(subject: ArmFront, point: FrontPoint) -> dict[str, float]:
    """A point found again without a neighbour."""
    value, seconds = found_cold(
        lambda: subject.afresh(point.limit, point, "between").y, NotFoundError
    )
    return {"limit": point.limit, "front": point.y, "cold": value, "seconds": seconds}


def tables(rows: Sequence[Row]) -> list[Table]:
    """The fronts, their slopes, and cold starts."""
    answered = [row for row in rows if not row["failure"]]
    return [_fronts(answered), _sampled(answered)]


def _fronts(rows: Sequence[Row]) -> Table:
    head = (
        "front",
        "points",
        "dominated",
        "gaps",
        "afresh",
        "most left [J]",
        "seconds",
        "times faster than cold",
    )
    lines = [
        (
            row["question"],
            str(row["points"]),
            str(row["dominated"]),
            str(row["gaps"]),
            str(row["afresh"]),
            f"{row['left']:.1e}",
            f"{row['walked']:.0f}",
            f"{_times(row):.1f}",
        )
        for row in rows
    ]
    notes = [
        f"times faster: seconds of {SAMPLED} cold starts, for as many as all points, beside all"
    ]
    return Table("fronts of the arm", head, lines, notes)


def _times(row: Row) -> float:
    seconds = [cold["seconds"] for cold in row["cold"]]
    return times_faster(seconds, row["solves"], row["walked"])


def _sampled(rows: Sequence[Row]) -> Table:
    head = ("front", "limit", "slope", "by differences", "off [%]", "value", "cold", "cold [s]")
    lines = [
        (
            row["question"],
            number(cold["limit"], 5),
            number(slope["slope"], 5),
            number(slope["difference"], 5),
            f"{100 * abs(slope['slope'] / slope['difference'] - 1):.2g}",
            number(cold["front"], 6),
            number(cold["cold"], 6),
            f"{cold['seconds']:.1f}",
        )
        for row in rows
        for slope, cold in zip(row["slopes"], row["cold"], strict=True)
    ]
    notes = [f"differences: {STEP:g} of the limit each way; a value is known to a per cent"]
    return Table("points looked at again", head, lines, notes)
