"""A front from its two ends: a walk from either, a look into the gaps, and the envelope."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import replace

from ocp.analysis.front.continuation import FrontPoint, FrontSubject, Ranges, distance, fill, walk
from ocp.analysis.front.envelope import ParetoFront, front_of

WIDEST = 3.0  # strides, from which two neighbours have a gap between them
LENGTH = 2.0  # of a front in parts of both its ranges, at most where it falls all the way


def front_between(
    subject: FrontSubject,
    left: FrontPoint,
    right: FrontPoint,
    points: int,
    say: Callable[[str], None] | None = None,
) -> ParetoFront:
    """The front between two points, walked from both; Ctrl-C keeps the points found until then.

    Parameters
    ----------
    subject : FrontSubject
        Finds a point from its neighbour: the front of a problem is that of `front`, and studies
        bring their own.
    left, right : FrontPoint
        At the lowest and at the highest limit.
    points : int
        About as many as a walk along the whole front takes.
    say : callable, optional
        Receives a line of progress now and then.
    """
    found, remarks = [left, right], list[str]()
    height = min(left.y, right.y), max(left.y, right.y)
    ranges = Ranges((left.x, max(right.x, right.limit)), height)
    stride = LENGTH / points
    widest = WIDEST * stride
    interrupted = False

    try:
        for first, last in ((left, right.limit), (right, left.limit)):
            for point in walk(subject, first, last, ranges, stride, remarks.append):
                # kept at once, so that nothing is lost where the user stops
                found.append(point)
            if say is not None:
                say(_count_and_seconds(found))
        for a, b in itertools.pairwise(front_of(found, ranges, widest).points):
            if distance(a, b, ranges) > widest:
                found += fill(subject, a, b, ranges, widest)
    except KeyboardInterrupt:
        interrupted = True
    front = front_of(found, ranges, widest)
    return replace(front, remarks=tuple(remarks), interrupted=interrupted)


def _count_and_seconds(points: Sequence[FrontPoint]) -> str:
    seconds = sum(point.seconds for point in points)
    return f"{len(points)} points of the Pareto front in {seconds:.1f} s"
