"""A trade-off of the truss from its configuration to its result.

Two walks, from either end of the front, and a look into the gaps that they leave. Whatever a point
comes from, its motion is evaluated between the points of its mesh, as every motion of the truss is.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np

from studies.common.console import Console, silent
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.folder import provenance
from studies.common.result import Criterion, Result, Series, Verdict
from studies.pareto.config import ParetoStudy, configuration_of
from studies.pareto.continuation import FrontPoint, NotFoundError, Ranges, distance, fill, walk
from studies.pareto.envelope import Front, front_of
from studies.pareto.truss import TrussFront
from studies.pareto.words import dominated_law, front_in_words, price_in_words
from studies.truss.checks import broken_caps, table_rows
from studies.truss.limits.bounds import lower_bounds
from studies.truss.limits.tolerances import CAPS
from studies.truss.motions.deployment import Deployment
from studies.truss.motions.laws import paper_laws
from studies.truss.quantities import QUANTITIES

COARSE_POINTS = 6
WIDEST = 3.0  # strides, from which two neighbours have a gap between them
WAYS = {"up": 1.0, "between": 0.0, "down": -1.0}


def run(study: ParetoStudy, console: Console | None = None) -> Result:
    """Find the front of two objectives of the truss.

    Parameters
    ----------
    study : ParetoStudy
        What is asked.
    console : Console, optional
        Where lines of progress go; nowhere by default.

    Returns
    -------
    Result
        Of the kind "pareto-truss"; its main axis is the objective that is limited.

    Raises
    ------
    StudyError
        If no motion meets the caps, an objective has no minimiser, or there is nothing to trade.
    """
    console = console or silent()
    subject = TrussFront(study, console)
    subject.check()
    return result_of(subject, *front_found(subject))


def front_found(subject: TrussFront) -> tuple[Front, tuple[str, ...], bool]:
    """The front, remarks on what was not found, and whether the user stopped it.

    Raises
    ------
    StudyError
        If an end of the front has no motion.
    """
    console, pareto = subject.console, subject.study.pareto
    (lows, slow), (high, free) = subject.ends()
    try:
        left = subject.first(subject.program(slow, high), lows, "up")
        right = subject.first(subject.program(free, high), (high,), "down")
    except NotFoundError as error:
        raise StudyError(
            f"no motion was found at an end of the front, between {lows[0]:.6g} and {high:.6g}: "
            f"{error}; state a smaller pareto.range",
            ExitCode.NOT_SOLVED,
        ) from error
    points, remarks, stopped = [left, right], list[str](), False
    ranges = Ranges((left.x, max(right.x, high)), (min(left.y, right.y), max(left.y, right.y)))

    count = min(pareto.points, COARSE_POINTS) if pareto.coarse else pareto.points
    stride = 2.0 / count
    try:
        for first, last in ((left, high), (right, left.limit)):
            points += _told(walk(subject, first, last, ranges, stride, remarks.append), console)
        front = front_of(points, ranges, WIDEST * stride)
        for a, b in itertools.pairwise(front.points):
            if distance(a, b, ranges) > WIDEST * stride:
                points += fill(subject, a, b, ranges, WIDEST * stride)
    except KeyboardInterrupt:
        stopped = True
    return front_of(points, ranges, WIDEST * stride), tuple(remarks), stopped


def _told(points: list[FrontPoint], console: Console) -> list[FrontPoint]:
    if points:
        seconds = sum(point.seconds for point in points)
        console.progress(f"way {points[0].way}: {len(points)} points in {seconds:.1f} s")
    return points


def result_of(subject: TrussFront, front: Front, remarks: tuple[str, ...], stopped: bool) -> Result:
    """The result that a front gives."""
    study, limited, least = subject.study, subject.limited, subject.least
    bounds = np.array([subject.bound(p.x) or np.nan for p in front.points])
    chosen = front.points[len(front.points) // 2 if front.knee is None else front.knee]
    laws = paper_laws(
        study.truss.truss,
        chosen.motion.deployment.law.duration,
        study.truss.drive,
        study.truss.margin,
    )
    shown = [_named(chosen, "knee" if front.knee is not None else "middle")]
    shown += [_named(front.points[0], f"least {_short(limited)}")]
    shown += [_named(front.points[-1], f"least {_short(least)}"), *laws]
    free = dataclasses.replace(
        study.truss, minimise=[n for n in (limited, least) if n in _MINIMISED]
    )

    lowest = lower_bounds(free, None)

    return Result(
        kind="pareto-truss",
        question=study.question,
        configuration=configuration_of(study),
        arrays={**_series(subject, front, bounds), **_law_series(subject, front, laws)},
        table=table_rows(free, shown, lowest),
        bounds={key: bound for key, bound in lowest.items() if key in (limited, least)},
        verdict=_verdict(front, stopped),
        checks=_checks(front, bounds, least),
        remarks=(
            *front_in_words(front, limited, least),
            *price_in_words(front, limited, least),
            *(dominated_law(front, law, limited, least, _broken(subject, law)) for law in laws),
            *remarks,
        ),
        details=_details(subject, front),
        provenance=provenance(),
        interrupted=stopped,
    )


_MINIMISED = frozenset(QUANTITIES) - {"peak-jerk"}


def _short(name: str) -> str:
    return name.removeprefix("peak-")


def _named(point: FrontPoint, name: str) -> Deployment:
    deployment: Deployment = dataclasses.replace(point.motion.deployment, name=name)
    return deployment


def _broken(subject: TrussFront, law: Deployment) -> tuple[str, ...]:
    """Titles of the caps that a law breaks, all but the limit."""
    broken = broken_caps(subject.truss, law.values)
    return tuple(QUANTITIES[key].title for key in broken if key != subject.limited)


def _verdict(front: Front, stopped: bool) -> Verdict:
    count = len(front.points)
    if stopped:
        return Verdict("unverified", f"unverified: stopped with {count} points of the front")
    return Verdict(
        "local",
        f"local: {count} verified points, each the best of walks from both ends of the front",
    )


def _checks(front: Front, bounds: np.ndarray, least: str) -> tuple[Criterion, ...]:
    """That no point is below its bound; each point itself was held against all that it has to."""
    values = np.array([p.y for p in front.points])
    known = np.isfinite(bounds)
    checks = [
        Criterion(
            "points of the front whose motion meets all its checks",
            "1",
            float(len(front.points)),
            float(len(front.points)),
            True,
        )
    ]
    if known.any():
        below = float((1 - values[known] / bounds[known]).max())
        unit = "of the bound"
        checks.append(
            Criterion(
                f"{QUANTITIES[least].title} below its bound", unit, below, CAPS, below <= CAPS
            )
        )
    return tuple(checks)


def _series(subject: TrussFront, front: Front, bounds: np.ndarray) -> dict[str, Series]:
    """The front along its limited objective, and what it dominates."""
    x, y = subject.limited, subject.least
    ux, uy = QUANTITIES[x].unit, QUANTITIES[y].unit

    def column(points: Sequence[FrontPoint], name: str) -> np.ndarray:
        return np.array([float(getattr(point, name)) for point in points])

    points, others = front.points, front.dominated
    return {
        x: Series(ux, x, column(points, "x"), "of the motion, the limited objective"),
        y: Series(uy, x, column(points, "y"), "least under that limit"),
        "limit": Series(ux, x, column(points, "limit"), "that was set"),
        "price": Series(
            f"{uy}/({ux})", x, -column(points, "slope"), "what one more of the limit saves"
        ),
        "bound": Series(uy, x, bounds, "that no motion under the limit is below"),
        "way": Series(
            "1",
            x,
            np.array([WAYS[p.way] for p in points]),
            "1 limit rising, -1 falling, 0 in a gap",
        ),
        "afresh": Series("1", x, column(points, "afresh"), "1 where the neighbour was no start"),
        "seconds": Series("s", x, column(points, "seconds"), "that the point took"),
        f"dominated {x}": Series(ux, f"dominated {x}", column(others, "x"), "of the motion"),
        f"dominated {y}": Series(uy, f"dominated {x}", column(others, "y"), "of the motion"),
    }


def _law_series(subject: TrussFront, front: Front, laws: Sequence[Deployment]) -> dict[str, Series]:
    """Where the paper's laws are: a point each, or a curve if the duration is traded."""
    x, y, truss = subject.limited, subject.least, subject.truss
    durations = [laws[0].law.duration]
    if x == "time":
        durations = [point.x for point in front.points]
    places: dict[str, list[tuple[float, float]]] = {law.name: [] for law in laws}
    for duration in durations:
        for law in paper_laws(truss.truss, duration, truss.drive, truss.margin):
            places[law.name].append((law.values[x], law.values[y]))
    found = {}
    for name, pairs in places.items():
        axis, values = f"{name} {x}", np.array(pairs)
        found[axis] = Series(QUANTITIES[x].unit, axis, values[:, 0], f"of the {name} law")
        found[f"{name} {y}"] = Series(QUANTITIES[y].unit, axis, values[:, 1], f"of the {name} law")
    return found


def _details(subject: TrussFront, front: Front) -> dict[str, Any]:
    points = [*front.points, *front.dominated]
    return {
        "limited": subject.limited,
        "least": subject.least,
        "gaps": [list(gap) for gap in front.gaps],
        "knee": None if front.knee is None else front.points[front.knee].x,
        "points": len(front.points),
        "dominated": len(front.dominated),
        "solves": subject.solves,
        "afresh": sum(point.afresh for point in points),
        "seconds_of_points": sum(point.seconds for point in points),
        "iterations": sum(point.motion.solution.iterations for point in points),
    }
