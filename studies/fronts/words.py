"""A front in sentences: its ends, its knee, what more of one objective saves of the other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ocp import FrontPoint, ParetoFront
from ocp.arrays import Array
from studies.common.console import number
from studies.common.result import Criterion, Verdict
from studies.fronts.columns import FrontAxis

HUNDREDTH = 0.01  # of a limit: so much more of it has a price that one can imagine
BELOW = 1e-6  # relative, by which a value may be below its bound
TOLERANCE = 1e-6  # relative: of the verification, within which two values are indistinguishable


def front_in_words(front: ParetoFront, x: FrontAxis, y: FrontAxis) -> tuple[str, ...]:
    """Its remarks, both ends, the knee and the gaps; then what a little more of the limit saves."""
    first, last = front.points[0], front.points[-1]
    span = f"{len(front.points)} verified points, from {_at(first, x, y)} to {_at(last, x, y)}"
    if len(front.points) == 1:
        span = f"one verified point, {_at(first, x, y)}"
    sentences = [
        *front.remarks,
        f"The Pareto front has {span}; dominated points removed: {len(front.dominated)}.",
    ]
    if front.knee is not None:
        sentences.append(f"Its knee point is at {_at(front.knee, x, y)}.")
    sentences += [
        f"It has a gap between {number(a, 6)} and {number(b, 6)} {x.unit}: all points found there "
        "are dominated."
        for a, b in front.gaps
    ]

    # two places may be alike in all digits that are said
    priced = (first, *([] if front.knee is None else [front.knee]), last)
    return (*sentences, *dict.fromkeys(price_at(point, x, y) for point in priced))


def front_verdict(front: ParetoFront) -> Verdict:
    """Local: from both ends, or unverified where the user stopped it."""
    count = len(front.points)
    if front.interrupted:
        words = f"{count} point{'s' * (count != 1)} of the front"
        return Verdict("unverified", f"unverified: stopped with {words}")
    return Verdict(
        "local",
        f"local: {count} verified points, each the better result of continuations from both ends "
        "of the front",
    )


def checks_of_points(front: ParetoFront, y: FrontAxis, bounds: Array) -> tuple[Criterion, ...]:
    """That no point is below its bound; each point itself was held against all that it has to.

    Parameters
    ----------
    bounds : (points,) proven, nan where there is none.
    """
    count = float(len(front.points))
    name = "points of the Pareto front whose motion passes all its checks"
    checks = [Criterion(name, "1", count, count, True)]

    known = np.isfinite(bounds)
    if known.any():
        values = np.array([point.y for point in front.points])
        below = float((1 - values[known] / bounds[known]).max())
        checks.append(
            Criterion(f"{y.title} below its bound", "of the bound", below, BELOW, below <= BELOW)
        )
    return tuple(checks)


def open_end_in_words(sentence: str, value: float, nearest: float) -> str:
    """That no motion attains an end of a front.

    Parameters
    ----------
    sentence : of the limit, and why it is not attained.
    value : the limit.
    nearest : of the points of the front.
    """
    above = f"{100 * (nearest / value - 1):.2g} %"
    return (
        f"An end of the front is open: {sentence}; the nearest point is {above} above it, and a "
        "wider range may come closer."
    )


def price_at(point: FrontPoint, x: FrontAxis, y: FrontAxis) -> str:
    """What a second, or a hundredth of the limit, saves at a point."""
    more, share = (1.0, "") if x.key == "time" else (HUNDREDTH * point.limit, " (1 %)")
    saved = max(-point.slope, 0.0) * more
    return (
        f"At {number(point.limit, 5)} {x.unit}: {number(more, 3)} {x.unit}{share} more {x.title} "
        f"reduces the {y.title} by {number(saved, 3)} {y.unit} (shadow price)."
    )


def nothing_to_trade(
    left: FrontPoint, right: FrontPoint, axes: tuple[FrontAxis, FrontAxis], known: float
) -> str | None:
    """That both ends of a front are alike in what is least; None where they differ.

    Parameters
    ----------
    known : part of a value by which a point may be wrong.
    """
    if left.y > (1.0 + known) * right.y:
        return None
    x, y = axes
    return (
        f"There is no trade-off: {y.title} is {number(left.y, 4)} {y.unit} at "
        f"{number(left.limit, 5)} {x.unit} of {x.title} and {number(right.y, 4)} {y.unit} at "
        f"{number(right.limit, 5)} {x.unit}, and the accuracy of a point is {100 * known:g} %."
    )


def dominated_law(
    front: ParetoFront,
    name: str,
    place: Sequence[float],
    axes: tuple[FrontAxis, FrontAxis],
    broken: Sequence[str] = (),
) -> str:
    """How the front compares with a law at the law's own limit.

    Parameters
    ----------
    place : x and y of the law.
    broken : titles of the caps that the law breaks.
    """
    (x, y), (across, up) = place, axes
    best = front.at_most(x)
    head = f"{name} ({number(x, 5)} {across.unit}, {number(y, 6)} {up.unit})"
    also = f"; it breaks the cap on {', '.join(broken)}" if broken else ""
    if best is None:
        return f"{head} is left of the front, outside its range{also}."
    gain = 1 - best.y / y
    if gain > TOLERANCE:
        return (
            f"{head} is dominated: with no more {across.title} the front needs "
            f"{number(best.y, 6)} {up.unit}, {100 * gain:.3g} % less{also}."
        )
    word = "indistinguishable from" if gain > -TOLERANCE else "below"
    return f"{head} is {word} the front, by {abs(100 * gain):.2g} %{also}."


def _at(point: FrontPoint, x: FrontAxis, y: FrontAxis) -> str:
    return f"{number(point.x, 6)} {x.unit} with {number(point.y, 6)} {y.unit}"
