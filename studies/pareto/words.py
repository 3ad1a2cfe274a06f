"""A front in sentences: its ends, its knee, what more of one objective saves of the other."""

from __future__ import annotations

from collections.abc import Sequence

from ocp.analysis.front.continuation import FrontPoint
from ocp.analysis.front.envelope import Front, reached
from studies.common.console import number
from studies.pareto.columns import FrontAxis

HUNDREDTH = 0.01  # of a limit: so much more of it has a price that one can imagine
TOLERANCE = 1e-6  # relative: of the verification, within which two values are indistinguishable


def front_in_words(front: Front, x: FrontAxis, y: FrontAxis) -> tuple[str, ...]:
    """Both ends, the knee and the gaps; then what a little more of the limit saves."""
    first, last = front.points[0], front.points[-1]
    span = f"{len(front.points)} verified points, from {_at(first, x, y)} to {_at(last, x, y)}"
    if len(front.points) == 1:
        span = f"one verified point, {_at(first, x, y)}"
    sentences = [
        f"The front has {span}; dropped because others dominate them: {len(front.dominated)}."
    ]
    if front.knee is not None:
        sentences.append(f"Its knee is at {_at(front.points[front.knee], x, y)}.")
    sentences += [
        f"It has a gap between {number(a, 6)} and {number(b, 6)} {x.unit}: no point was found "
        "there that no other dominates."
        for a, b in front.gaps
    ]

    places = [0, len(front.points) - 1]
    if front.knee is not None:
        places.insert(1, front.knee)
    # two places may be alike in all digits that are said
    priced = dict.fromkeys(price_at(front.points[place], x, y) for place in places)
    return (*sentences, *priced)


def open_end_in_words(sentence: str, value: float, nearest: float) -> str:
    """That no motion attains an end of a front.

    Parameters
    ----------
    sentence : of the limit, and why it is not attained.
    value : the limit.
    nearest : of the points of the front.
    """
    above = f"{100 * (nearest / value - 1):.2g} %"
    return f"An end of the front is open: {sentence}; the nearest point is {above} above it."


def price_at(point: FrontPoint, x: FrontAxis, y: FrontAxis) -> str:
    """What a second, or a hundredth of the limit, saves at a point."""
    saved = price_in_words(point.limit, point.slope, x, y, of_a_time=1.0)
    return f"At {number(point.limit, 5)} {x.unit}: {saved} of {y.title}, at this slope."


def price_in_words(
    limit: float, slope: float, of: FrontAxis, least: FrontAxis, of_a_time: float
) -> str:
    """What a little more of a limit saves: so many seconds of a time, else a hundredth of it."""
    more, share = (of_a_time, "") if of.key == "time" else (HUNDREDTH * limit, " (1 %)")
    return (
        f"{number(more, 3)} {of.unit}{share} more of {of.title} saves "
        f"{number(max(-slope, 0.0) * more, 3)} {least.unit}"
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
        f"There is nothing to trade: {y.title} is {number(left.y, 4)} {y.unit} at "
        f"{number(left.limit, 5)} {x.unit} of {x.title} and {number(right.y, 4)} {y.unit} at "
        f"{number(right.limit, 5)} {x.unit}, and a point is known to {100 * known:g} %."
    )


def dominated_law(
    front: Front,
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
    best = reached(front.points, x)
    return law_beside(
        f"{name} ({number(x, 5)} {across.unit}, {number(y, 6)} {up.unit})",
        (None if best is None else best.y, y, up.unit),
        ("front", across.title, "is left of the front, where no point was looked for"),
        broken,
    )


def law_beside(
    head: str,
    compared: tuple[float | None, float, str],
    words: tuple[str, str, str],
    broken: Sequence[str],
) -> str:
    """How a law compares with the best point that has no more than it of what is limited.

    Parameters
    ----------
    head : the law and where it is.
    compared : what is least, of the best point (None without one) and of the law, and its unit.
    words : "front" or "surface", what there is no more of, and what is said without a point.
    broken : titles of the caps that the law breaks.
    """
    (best, value, unit), (of, limited, nowhere) = compared, words
    also = f"; it breaks the cap on {', '.join(broken)}" if broken else ""
    if best is None:
        return f"{head} {nowhere}{also}."
    gain = 1 - best / value
    if gain > TOLERANCE:
        return (
            f"{head} is dominated: with no more {limited} the {of} needs {number(best, 6)} {unit}, "
            f"{100 * gain:.3g} % less{also}."
        )
    word = "indistinguishable from" if gain > -TOLERANCE else "below"
    return f"{head} is {word} the {of}, by {abs(100 * gain):.2g} %{also}."


def _at(point: FrontPoint, x: FrontAxis, y: FrontAxis) -> str:
    return f"{number(point.x, 6)} {x.unit} with {number(point.y, 6)} {y.unit}"
