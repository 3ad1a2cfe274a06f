"""The show "pareto": fronts of the truss, their slopes, and what they save beside cold starts.

Each case is a front. Its motions are verified one by one by the study itself. Here three things are
added. Slopes are held against central differences of the optimum on the mesh of a point, where both
one-sided differences agree: elsewhere the active set changes. Some points are found again cold, in
two ways: from the paper's Bezier law with the front's own settings, and by the study of the truss
from all its starts. And the seconds of the processor for all of the front, its ends and what failed
included, stand beside what as many cold starts would take.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.shows.scale.fronts import found_cold, keep, study_of, times_faster
from benchmarks.shows.show import Question, Row
from ocp import FixedMesh, OcpError, prepare
from ocp.analysis.front.continuation import FrontPoint, NotFoundError
from studies.common.console import Table, number, silent
from studies.common.exit_codes import StudyError
from studies.pareto.config import pareto_from
from studies.pareto.study import front_found, result_of
from studies.pareto.truss import TrussFront
from studies.truss.motions.laws import pinned_bezier
from studies.truss.search.motion_search import Search

LINE = "fronts of the truss: slopes against differences, seconds beside cold starts: 8 cases"
LIMIT = 3600.0  # [s]

_FORCE = ["peak-acceleration", "peak-force"]
CASES: tuple[dict[str, Any], ...] = (
    *(
        {
            "duration": duration,
            "caps": {"jerk": "500/T^3"},
            "truss": {"pulley_friction": mu},
            "pareto": {"objectives": _FORCE},
        }
        for duration in (6.0, 10.0)
        for mu in (0.0, 0.01)
    ),
    # from the least acceleration, 4 D/T^2 and a little more under the jerk cap, to 20 times it
    *(
        {
            "duration": 140.0,
            "caps": {"jerk": "500/T^3"},
            "truss": {"pulley_friction": mu},
            "pareto": {"objectives": _FORCE, "range": [3.13e-4, 6.25e-3]},
        }
        for mu in (0.0, 0.01)
    ),
    *(
        {
            "duration": [5.5, 12.0],
            "caps": {"jerk": 2.5},
            "truss": {"pulley_friction": mu},
            "pareto": {"objectives": ["time", "peak-force"]},
        }
        for mu in (0.0, 0.01)
    ),
)
COLD = 4  # points that are found again cold
STEP = 1e-3  # of a limit, of the differences
SMOOTH = 0.02  # by which one-sided differences may differ where the active set stays


def question(seed: int, index: int) -> Question:
    """The study of a case."""
    return study_of(CASES, index)


def answer(question: Question, folder: Path) -> Row:
    """The front, its slopes, and cold starts at some of its points."""
    begin = time.process_time()
    subject = TrussFront(pareto_from(question["study"]), silent())
    subject.check()
    found = front_found(subject)
    front, walked = found.front, time.process_time() - begin

    result = result_of(subject, found)
    keep(result, folder)

    misses = [miss for point in front.points if (miss := slope_miss(subject, point)) is not None]
    places = np.linspace(0, len(front.points) - 1, COLD).round().astype(int)
    cold = [_cold(subject, front.points[place]) for place in places]
    return {
        "question": result.question,
        "points": len(front.points),
        "dominated": len(front.dominated),
        "gaps": len(front.gaps),
        "checks": [check.sentence for check in result.checks],
        "remarks": list(result.remarks),
        "slopes": len(misses),
        "within": sum(miss <= 0.01 for miss in misses),
        "worst slope": max(misses, default=float("nan")),
        "walked": walked,
        "solves": subject.solves,
        "cold": cold,
    }


def slope_miss(subject: TrussFront, point: FrontPoint) -> float | None:
    """Relative difference of a slope from the central one; None where the active set changes."""
    motion = point.motion
    solution, limit = motion.solution, motion.program.limit
    settings = dataclasses.replace(
        subject.settings, refinement=FixedMesh(), verify=False, iterations=None
    )
    values = []
    try:
        prepared = prepare(motion.program.problem, settings=settings, guess=solution)
        for factor in (1 - STEP, 1.0, 1 + STEP):
            found = prepared.solve(constants={limit: point.limit * factor}, guess=solution)
            values.append(found.objective)
    except OcpError:
        return None
    step = STEP * point.limit
    below, above = (values[1] - values[0]) / step, (values[2] - values[1]) / step
    if abs(above - below) > SMOOTH * max(abs(above), abs(below)):
        return None
    return abs(point.slope / ((below + above) / 2) - 1)


def _cold(subject: TrussFront, point: FrontPoint) -> dict[str, Any]:
    """A point found again without a neighbour, in two ways."""

    def from_one_start() -> float:
        bezier = pinned_bezier(subject.truss.truss, subject.at(point.limit).duration[1])
        program = subject.program(bezier, point.limit)
        return subject.first(program, (point.limit,), "between").y

    def by_the_study() -> float:
        best = Search(subject.at(point.limit), silent()).run().deployment
        return best.values[subject.least]

    alone, seconds_alone = found_cold(from_one_start, NotFoundError)
    searched, seconds_of_study = found_cold(by_the_study, StudyError)
    return {
        "limit": point.limit,
        "front": point.y,
        "one start": alone,
        "seconds of one start": seconds_alone,
        "study": searched,
        "seconds of the study": seconds_of_study,
    }


def tables(rows: Sequence[Row]) -> list[Table]:
    """The fronts, and their cold starts."""
    answered = [row for row in rows if not row["failure"]]
    return [_fronts(answered), _cold_starts(answered)]


def _fronts(rows: Sequence[Row]) -> Table:
    cells = [
        (
            row["question"],
            row["points"],
            row["dominated"],
            row["gaps"],
            f"{row['within']} of {row['slopes']}",
            f"{100 * row['worst slope']:.2g}",
            row["solves"],
            f"{row['walked']:.0f}",
            *(f"{_times(row, way):.1f}" for way in ("one start", "the study")),
        )
        for row in rows
    ]
    head = ("front", "points", "dominated", "gaps", "slopes within 1 %", "worst [%]", "solves")
    notes = [
        f"slopes: against central differences, {STEP:g} of the limit each way, on a point's mesh, "
        f"where both sides agree to {100 * SMOOTH:g} %",
        f"times faster: seconds of {COLD} cold starts, for as many as the front has points, beside "
        "all seconds of the front",
    ]
    columns = (*head, "seconds", "times faster: one start", "the study")
    return Table("fronts", columns, [tuple(map(str, line)) for line in cells], notes)


def _times(row: Row, way: str) -> float:
    seconds = [cold[f"seconds of {way}"] for cold in row["cold"]]
    return times_faster(seconds, row["points"], row["walked"])


def _cold_starts(rows: Sequence[Row]) -> Table:
    cells = [
        (
            row["question"],
            number(cold["limit"], 6),
            number(cold["front"], 7),
            number(cold["one start"], 7),
            f"{cold['seconds of one start']:.1f}",
            number(cold["study"], 7),
            f"{cold['seconds of the study']:.1f}",
        )
        for row in rows
        for cold in row["cold"]
    ]
    head = ("front", "limit", "front's value", "one cold start", "[s]", "the study's", "[s]")
    return Table("points found again cold", head, cells, ["seconds are the processor's"])
