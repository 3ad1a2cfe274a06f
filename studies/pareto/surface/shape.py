"""A surface as points of slices: who dominates whom, its gaps, its knee.

Symbols: z, the objective that a slice limits; x, the one that is limited from point to point; y,
the one that is least.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ocp.analysis.front.continuation import FrontPoint, Ranges, distance
from ocp.analysis.front.envelope import ACCURACY, LEAST, Front
from ocp.arrays import Array

BoolArray = NDArray[np.bool_]
SAME = 1e-6  # relative: so close to the least is the least
SAMPLES = 41  # of a slice's curve, between which and another one's a distance is measured


@dataclass(frozen=True, eq=False)
class SurfacePoint:
    """A verified motion on a surface.

    Attributes
    ----------
    limit : of its slice, on z.
    z : of the motion.
    slope : dy/dlimit, by the multiplier of the slice's limit.
    point : of the slice's front: x, y, the limit on x and its slope.
    """

    limit: float
    z: float
    slope: float
    point: FrontPoint

    @property
    def place(self) -> tuple[float, float, float]:
        """The three objectives: z, x and y."""
        return self.z, self.point.x, self.point.y


@dataclass(frozen=True)
class Box:
    """The box that a surface spans, in which distances are measured.

    Attributes
    ----------
    front : of x and y.
    z : lowest and highest value.
    """

    front: Ranges
    z: tuple[float, float]

    @classmethod
    def around(cls, places: Sequence[tuple[float, float, float]]) -> Box:
        """The box of some points."""
        low, high = np.min(places, axis=0).tolist(), np.max(places, axis=0).tolist()
        return cls(Ranges((low[1], high[1]), (low[2], high[2])), (low[0], high[0]))

    @property
    def across(self) -> Ranges:
        """The range of z, which counts by its logarithm where that of x would."""
        return Ranges(self.z, (0.0, 1.0))

    def parts(self, place: tuple[float, float, float]) -> tuple[float, float, float]:
        """Where a point is, each from 0 to 1."""
        z, x, y = place
        return self.across.place(z, 0.0)[0], *self.front.place(x, y)


@dataclass(frozen=True, eq=False)
class Surface:
    """A surface.

    Attributes
    ----------
    points : none of which another one dominates, by slices with rising limits, then by rising x.
    dominated : the others, in the same order.
    gaps : (limit of the slice, x, x) of neighbours on a slice that are further apart than a gap.
    knee : index of the point that is farthest below the plane through what is best in one
        objective and worst in the others; None if all are above it.
    """

    points: tuple[SurfacePoint, ...]
    dominated: tuple[SurfacePoint, ...]
    gaps: tuple[tuple[float, float, float], ...]
    knee: int | None

    def slice(self, limit: float) -> list[SurfacePoint]:
        """The points of a slice."""
        return [point for point in self.points if point.limit == limit]

    @property
    def limits(self) -> tuple[float, ...]:
        """Of the slices that have points of the surface, rising."""
        return tuple(dict.fromkeys(point.limit for point in self.points))


def surface_of(points: Sequence[SurfacePoint], widest: float) -> Surface:
    """The surface that verified points give.

    Parameters
    ----------
    widest : distance, in parts of the ranges of x and y, from which two neighbours on a slice have
        a gap between them.
    """
    ordered = sorted(points, key=lambda p: (p.limit, p.point.x, p.point.y))
    worse = dominated(np.array([p.place for p in ordered]))
    best = [point for point, beaten in zip(ordered, worse, strict=True) if not beaten]
    rest = [point for point, beaten in zip(ordered, worse, strict=True) if beaten]
    box = Box.around([p.place for p in best])

    gaps = tuple(
        (a.limit, a.point.x, b.point.x)
        for a, b in itertools.pairwise(best)
        if a.limit == b.limit and distance(a.point, b.point, box.front) > widest
    )
    return Surface(tuple(best), tuple(rest), gaps, knee_of(best, box))


def dominated(places: Array) -> BoolArray:
    """Which points another one dominates: no worse in any objective, and better in one.

    Parameters
    ----------
    places : (points, objectives), less is better.

    Returns
    -------
    (points,) of bool. Of points that are alike in all objectives the first one remains.
    """
    room = ACCURACY * np.abs(places)
    # [p, q]: q beside p
    no_worse = (places[None, :, :] <= (places + room)[:, None, :]).all(axis=2)
    better = (places[None, :, :] < (places - room)[:, None, :]).any(axis=2)
    beaten = np.any(no_worse & better, axis=1)
    again = np.any(np.tril(no_worse & ~better, -1), axis=1)
    return np.asarray(beaten | again, dtype=bool)


def knee_of(points: Sequence[SurfacePoint], box: Box) -> int | None:
    """The point farthest below a plane, as that of two objectives is below a chord.

    The plane goes through the three places that are best in one objective and worst in the others.
    In parts of the ranges these are 0 once and 1 twice, so that it is the point with the least sum.
    On a single slice there is none.
    """
    if len({point.limit for point in points}) < 2:  # a curve, and no surface yet
        return None
    sums = [sum(box.parts(point.place)) for point in points]
    lowest = int(np.argmin(sums))
    return lowest if sums[lowest] < 2.0 else None


def apart(a: Front, b: Front, ranges: Ranges) -> float:
    """How far two slices' curves are from each other, in parts of the ranges: Hausdorff's distance.

    It is the largest distance of a point of the one from the nearest of the other.
    """
    first, second = _sampled(a, ranges), _sampled(b, ranges)
    between = np.linalg.norm(first[:, None, :] - second[None, :, :], axis=2)
    return float(max(between.min(axis=1).max(), between.min(axis=0).max()))


def _sampled(front: Front, ranges: Ranges) -> Array:
    """Places along a front, close together: (SAMPLES, 2)."""
    places = np.array([ranges.place(point.x, point.y) for point in front.points])
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))])
    at = np.linspace(0.0, along[-1], SAMPLES)
    return np.column_stack([np.interp(at, along, column) for column in places.T])


def reached(surface: Surface, z: float, x: float) -> SurfacePoint | None:
    """The best point with no more of z and x; None where there is none."""
    within = [p for p in surface.points if p.z <= z * (1 + LEAST) and p.point.x <= x * (1 + LEAST)]
    return min(within, key=lambda p: p.point.y, default=None)


def middle_of(surface: Surface) -> SurfacePoint:
    """The knee, or one in the middle where there is none."""
    points, knee = surface.points, surface.knee
    return points[len(points) // 2 if knee is None else knee]


def named_points(
    surface: Surface, chosen: SurfacePoint, keys: Sequence[str]
) -> dict[str, SurfacePoint]:
    """The points of a table: the knee, and the least of each objective, z, x and y by their keys.

    Of equally good ones it is that which is better in the others.
    """
    box = Box.around([p.place for p in surface.points])
    named = {"middle" if surface.knee is None else "knee": chosen}
    for k, key in enumerate(keys):
        lowest = min(p.place[k] for p in surface.points) * (1 + SAME)
        named[f"least {key.removeprefix('peak-')}"] = min(
            (p for p in surface.points if p.place[k] <= lowest),
            key=lambda p: sum(box.parts(p.place)),
        )
    return named
