"""A front from its two ends: a walk from either, a look into the gaps, and the envelope.

A sketch is walked one way only.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ocp.analysis.front.continuation import FrontPoint, Ranges, Subject, distance, fill, walk
from ocp.analysis.front.envelope import Front, front_of

WIDEST = 3.0  # strides, from which two neighbours have a gap between them
LENGTH = 2.0  # of a front in parts of both its ranges, at most where it falls all the way


@dataclass(frozen=True, eq=False)
class Walked:
    """A front and how it came about.

    Attributes
    ----------
    front : Front
    remarks : sentences on limits at which nothing was found.
    stopped : whether the user stopped the walks.
    """

    front: Front
    remarks: tuple[str, ...]
    stopped: bool


def both_ways(
    subject: Subject,
    left: FrontPoint,
    right: FrontPoint,
    count: int,
    say: Callable[[str], None],
) -> Walked:
    """The front between two points.

    Parameters
    ----------
    left, right : the points at the lowest and at the highest limit.
    count : points that a walk may take for all of the front.
    say : takes a line of progress.
    """
    points, remarks, stopped = [left, right], list[str](), False
    height = min(left.y, right.y), max(left.y, right.y)
    ranges = Ranges((left.x, max(right.x, right.limit)), height)
    stride = LENGTH / count
    widest = WIDEST * stride

    try:
        for first, last in ((left, right.limit), (right, left.limit)):
            for point in walk(subject, first, last, ranges, stride, remarks.append):
                # kept at once, so that nothing is lost where the user stops
                points.append(point)
            say(_count_and_seconds(points))
        front = front_of(points, ranges, widest)
        for a, b in itertools.pairwise(front.points):
            if distance(a, b, ranges) > widest:
                points += fill(subject, a, b, ranges, widest)
    except KeyboardInterrupt:
        stopped = True
    return Walked(front_of(points, ranges, widest), tuple(remarks), stopped)


def walked_down(
    subject: Subject, right: FrontPoint, last: float, tallest: float, count: int
) -> Walked:
    """A front from its highest limit to a last one, with falling limits alone.

    Parameters
    ----------
    tallest : about the highest value of what is least.
    count : points that a walk may take for all of the front.
    """
    ranges = Ranges((last, right.limit), (right.y, max(tallest, right.y)))
    points, remarks, stopped = [right], list[str](), False
    try:
        for point in walk(subject, right, last, ranges, LENGTH / count, remarks.append):
            points.append(point)  # at once, so that nothing is lost where the user stops
    except KeyboardInterrupt:
        stopped = True
    return Walked(front_of(points, ranges, WIDEST * LENGTH / count), tuple(remarks), stopped)


def _count_and_seconds(points: Sequence[FrontPoint]) -> str:
    seconds = sum(point.seconds for point in points)
    return f"{len(points)} points of the front in {seconds:.1f} s"
