"""What the points of all ways make of a front: its lower envelope, gaps, knee and prices.

Symbols: x, the objective that is limited; y, the one that is least.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from ocp.analysis.front.continuation import FrontPoint, Ranges, distance

LEAST = 1e-9  # relative: what is called less
ACCURACY = 1e-6  # relative, of each objective: the solver's, below which two motions are alike


@dataclass(frozen=True, eq=False, repr=False)
class ParetoFront:
    """A Pareto front of verified motions.

    Attributes
    ----------
    points : tuple of FrontPoint
        By rising `x` (the limited objective); `y` is the minimised one, `slope` the derivative of
        `y` with respect to the limit (the negative shadow price), and `motion` the `Solution`.
    dominated : tuple of FrontPoint
        Motions that another point beats in both objectives.
    gaps : tuple of (float, float)
        Ranges of the limited objective in which no undominated point was found.
    knee : FrontPoint or None
        The point farthest below the chord between both ends.
    remarks : tuple of str
        Sentences on ends that no motion attains and on limits at which no motion was found.
    interrupted : bool
        Whether the user stopped the computation; the points found until then are kept.
    """

    points: tuple[FrontPoint, ...]
    dominated: tuple[FrontPoint, ...] = ()
    gaps: tuple[tuple[float, float], ...] = ()
    knee: FrontPoint | None = None
    remarks: tuple[str, ...] = ()
    interrupted: bool = False

    def __repr__(self) -> str:
        first, last = self.points[0], self.points[-1]
        return (
            f"ParetoFront: {len(self.points)} points from ({first.x:.6g}, {first.y:.6g}) to "
            f"({last.x:.6g}, {last.y:.6g}), {len(self.gaps)} gaps"
        )

    @property
    def middle(self) -> FrontPoint:
        """The knee, or the point in the middle where there is none."""
        return self.points[len(self.points) // 2] if self.knee is None else self.knee

    def at_most(self, x: float) -> FrontPoint | None:
        """The best point whose limited objective is an x or less; None where there is none."""
        within = [point for point in self.points if point.x <= x * (1 + LEAST)]
        return min(within, key=lambda point: point.y, default=None)

    def replaced(self, points: Sequence[FrontPoint]) -> ParetoFront:
        """The front with the given points in place of its own, one for each.

        A better motion at one limit may dominate neighbours, which then leave the front.
        """
        best, rest = undominated(points)
        knee = None if self.knee is None else points[self.points.index(self.knee)]
        return replace(
            self,
            points=tuple(best),
            dominated=(*self.dominated, *rest),
            knee=knee if knee in best else None,
        )


def front_of(points: Sequence[FrontPoint], ranges: Ranges, widest: float) -> ParetoFront:
    """The front that verified points give.

    Parameters
    ----------
    widest : distance in parts of the ranges from which two neighbours have a gap between them.
    """
    best, rest = undominated(points)
    gaps = tuple((a.x, b.x) for a, b in itertools.pairwise(best) if distance(a, b, ranges) > widest)
    return ParetoFront(tuple(best), tuple(rest), gaps, knee_of(best, ranges))


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


def knee_of(points: Sequence[FrontPoint], ranges: Ranges) -> FrontPoint | None:
    """The point farthest below the chord between both ends, in parts of the ranges."""
    if len(points) < 3:
        return None
    places = [ranges.place(p.x, p.y) for p in points]
    (x0, y0), (x1, y1) = places[0], places[-1]
    length = math.hypot(x1 - x0, y1 - y0)
    below = [((x1 - x0) * (y0 - y) - (x0 - x) * (y1 - y0)) / length for x, y in places]
    highest = max(range(len(points)), key=lambda k: below[k])
    return points[highest] if below[highest] > 0.0 else None
