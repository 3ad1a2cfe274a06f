"""What the points of all ways make of a front: its lower envelope, gaps, knee and prices.

Symbols: x, the objective that is limited; y, the one that is least.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

from ocp.analysis.front.continuation import FrontPoint, Ranges, distance

LEAST = 1e-9  # relative: what is called less
ACCURACY = 1e-6  # relative, of each objective: the solver's, below which two motions are alike


@dataclass(frozen=True, eq=False)
class Front:
    """A front.

    Attributes
    ----------
    points : none of which another one dominates, by rising x.
    dominated : the others, by rising x.
    gaps : (x, x) of neighbours that are further apart than a gap.
    knee : index of the point that is farthest below the chord of both ends; None without one.
    """

    points: tuple[FrontPoint, ...]
    dominated: tuple[FrontPoint, ...]
    gaps: tuple[tuple[float, float], ...]
    knee: int | None


def front_of(points: Sequence[FrontPoint], ranges: Ranges, widest: float) -> Front:
    """The front that verified points give.

    Parameters
    ----------
    widest : distance in parts of the ranges from which two neighbours have a gap between them.
    """
    best, rest = undominated(points)
    gaps = tuple((a.x, b.x) for a, b in itertools.pairwise(best) if distance(a, b, ranges) > widest)
    return Front(tuple(best), tuple(rest), gaps, knee_of(best, ranges))


def alone(point: FrontPoint) -> Front:
    """A front of one point."""
    return front_of([point], Ranges((point.x, point.x), (point.y, point.y)), 1.0)


def undominated(
    points: Sequence[FrontPoint],
) -> tuple[list[FrontPoint], list[FrontPoint]]:
    """Points that no other one dominates, and the others, by rising x."""
    best: list[FrontPoint] = []
    rest: list[FrontPoint] = []
    ordered = sorted(points, key=lambda p: (p.x, p.y))
    for place, point in enumerate(ordered):
        room_x, room_y = ACCURACY * abs(point.x), ACCURACY * abs(point.y)
        # of points that are alike the first one remains
        beaten = any(
            other.x <= point.x + room_x
            and other.y <= point.y + room_y
            and (other.x < point.x - room_x or other.y < point.y - room_y or k < place)
            for k, other in enumerate(ordered)
            if k != place
        )
        (rest if beaten else best).append(point)
    return best, rest


def knee_of(points: Sequence[FrontPoint], ranges: Ranges) -> int | None:
    """The point farthest below the chord between both ends, in parts of the ranges."""
    if len(points) < 3:
        return None
    places = [ranges.place(p.x, p.y) for p in points]
    (x0, y0), (x1, y1) = places[0], places[-1]
    length = math.hypot(x1 - x0, y1 - y0)
    below = [((x1 - x0) * (y0 - y) - (x0 - x) * (y1 - y0)) / length for x, y in places]
    highest = max(range(len(points)), key=lambda k: below[k])
    return highest if below[highest] > 0.0 else None


def reached(points: Sequence[FrontPoint], x: float) -> FrontPoint | None:
    """The best point at or below an x; None if the front begins above it."""
    within = [point for point in points if point.x <= x * (1 + LEAST)]
    return min(within, key=lambda point: point.y, default=None)
