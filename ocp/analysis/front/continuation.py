"""Walks along a front: one objective is least under a limit on the other, and the limit moves.

Each point starts from the one before. Its slope, the multiplier of the limit, says how far the next
limit may be away, so that points lie evenly along the curve and not along one of its axes. The walk
is made in both directions: each follows its own basin of motions as far as that goes.

Symbols: x, the objective that is limited; y, the one that is least.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Literal, Protocol

from ocp.arrays import TINY

FrontWay = Literal["up", "down", "between"]

SHORTEST = 1 / 64  # of a stride: what fails from as near as this is left to a start afresh
LONGEST = 0.15  # of the range of x: as far as a flat curve is trusted
STEEPEST = 0.02  # of a stride along x, at least: a slope at a corner holds for one side only
FLAT = 1e-5  # relative: a limit that gains no more than this over all that is left ends the way up
HALVINGS = 2  # of a gap


class PointNotFound(Exception):
    """No motion was found at a limit; the text says why."""


@dataclass(frozen=True, eq=False)
class FrontPoint:
    """A verified motion on the way along a front.

    Attributes
    ----------
    limit : that was set on x.
    x, y : of the motion, between the points of its mesh.
    slope : dy/dlimit, by the multiplier of the limit.
    way : on which it was found: with rising limits, with falling ones, or in a gap.
    afresh : whether the start from its neighbour failed, so that it was started afresh.
    seconds : that it took.
    motion : what the subject keeps of it.
    """

    limit: float
    x: float
    y: float
    slope: float
    way: FrontWay
    afresh: bool
    seconds: float
    motion: Any


class FrontSubject(Protocol):
    """What a front is of. Both methods raise `PointNotFound`."""

    def near(self, limit: float, before: FrontPoint, way: FrontWay) -> FrontPoint:
        """The point at a limit, from a neighbour."""
        ...

    def afresh(self, limit: float, before: FrontPoint, way: FrontWay) -> FrontPoint:
        """The same from the statement's own guess."""
        ...


@dataclass(frozen=True)
class Ranges:
    """The rectangle that a front spans, in which distances are measured.

    Attributes
    ----------
    x, y : lowest and highest value.
    """

    x: tuple[float, float]
    y: tuple[float, float]

    @property
    def logarithmic(self) -> bool:
        """Whether x counts by its logarithm: where it changes by a factor of four or more."""
        low, high = self.x
        return low > 0.0 and high >= 4.0 * low

    def place(self, x: float, y: float) -> tuple[float, float]:
        """Where a point is, both from 0 to 1."""
        (left, right), (low, high) = self.x, self.y
        if self.logarithmic:
            along = math.log(max(x, 1e-9 * left) / left) / math.log(right / left)
        else:
            along = (x - left) / max(right - left, TINY)
        return along, (y - low) / max(high - low, TINY)

    def moved(self, x: float, along: float) -> float:
        """The value of x a part of the range away."""
        left, right = self.x
        if self.logarithmic:
            return x * (right / left) ** along
        return x + along * (right - left)

    def steepness(self, x: float, slope: float) -> float:
        """A slope in parts of both ranges."""
        (left, right), (low, high) = self.x, self.y
        width = x * math.log(right / left) if self.logarithmic else right - left
        return slope * width / max(high - low, TINY)


def distance(a: FrontPoint, b: FrontPoint, ranges: Ranges) -> float:
    """Of two points, in parts of the ranges."""
    return math.dist(ranges.place(a.x, a.y), ranges.place(b.x, b.y))


def walk(
    subject: FrontSubject,
    first: FrontPoint,
    last: float,
    ranges: Ranges,
    stride: float,
    say: Callable[[str], None],
) -> Iterator[FrontPoint]:
    """The points from a first one to a last limit, without the first, as they are found.

    Parameters
    ----------
    stride : length of a step along the curve, in parts of both ranges.
    say : takes a line about each limit at which no motion was found.
    """
    sign: float = 1.0 if last > first.limit else -1.0
    way: FrontWay = "up" if sign > 0 else "down"
    before, share = first, 1.0

    while sign * (last - before.limit) > 0.0:
        if way == "up" and _nothing_to_gain(before, last):
            break
        along = max(_step(before, ranges, stride) * share, STEEPEST * stride)
        limit = ranges.moved(before.limit, sign * along)
        limit = min(limit, last) if sign > 0 else max(limit, last)
        try:
            point = subject.near(limit, before, way)
        except PointNotFound as error:
            share /= 2
            if share >= SHORTEST and along > STEEPEST * stride:
                continue
            try:
                point = subject.afresh(limit, before, way)
            except PointNotFound:
                say(f"no point was found at {limit:.6g}: {error}")
                break
        yield point
        before, share = point, min(1.0, 2 * share)


def _step(point: FrontPoint, ranges: Ranges, stride: float) -> float:
    """A step along x that makes a stride along the curve."""
    step = stride / math.hypot(1.0, ranges.steepness(point.limit, point.slope))
    return min(step, LONGEST)


def _nothing_to_gain(point: FrontPoint, last: float) -> bool:
    """Whether the slope gains nothing over all that is left: a convex front is flat there."""
    return abs(point.slope) * abs(last - point.limit) <= FLAT * abs(point.y)


def fill(
    subject: FrontSubject,
    left: FrontPoint,
    right: FrontPoint,
    ranges: Ranges,
    widest: float,
) -> list[FrontPoint]:
    """Points between two that are far from each other, from both of them; empty if none is found.

    Parameters
    ----------
    widest : distance from which two points are far from each other.
    """
    found: list[FrontPoint] = []
    gaps = [(left, right)]
    for _ in range(HALVINGS):
        halves = []
        for a, b in gaps:
            middle = _middle(a, b, ranges)
            between = [p for side in (a, b) if (p := _tried(subject, middle, side)) is not None]
            if not between:
                continue
            best = min(between, key=lambda point: point.y)
            found += between
            halves += [(a, best), (best, b)]
        gaps = [pair for pair in halves if distance(*pair, ranges) > widest]
    return found


def _middle(a: FrontPoint, b: FrontPoint, ranges: Ranges) -> float:
    return math.sqrt(a.x * b.x) if ranges.logarithmic else (a.x + b.x) / 2


def _tried(subject: FrontSubject, limit: float, side: FrontPoint) -> FrontPoint | None:
    try:
        return subject.near(limit, side, "between")
    except PointNotFound:
        return None
