"""A front in sentences: its ends, its knee, what more of one objective saves of the other."""

from __future__ import annotations

from collections.abc import Sequence

from studies.common.console import number
from studies.pareto.columns import FrontAxis
from studies.pareto.continuation import FrontPoint
from studies.pareto.envelope import Front, reached

HUNDREDTH = 0.01  # of a limit: so much more of it has a price that one can imagine
TOLERANCE = 1e-6  # relative: of the verification, within which two values are indistinguishable


def front_in_words(front: Front, x: FrontAxis, y: FrontAxis) -> tuple[str, ...]:
    """Both ends, the knee and the gaps; then what a little more of the limit saves."""
    first, last = front.points[0], front.points[-1]
    sentences = [
        f"The front has {len(front.points)} verified points, from {_at(first, x, y)} to "
        f"{_at(last, x, y)}; dropped because others dominate them: {len(front.dominated)}."
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
    priced = [price_at(front.points[place], x, y) for place in dict.fromkeys(places)]
    return (*sentences, *priced)


def price_at(point: FrontPoint, x: FrontAxis, y: FrontAxis) -> str:
    """What a second, or a hundredth of the limit, saves at a point."""
    more = 1.0 if x.key == "time" else HUNDREDTH * point.limit
    share = "" if x.key == "time" else " (1 %)"
    return (
        f"At {number(point.limit, 5)} {x.unit}: {number(more, 3)} {x.unit}{share} more of "
        f"{x.title} saves {number(-point.slope * more, 3)} {y.unit} of {y.title}, at this slope."
    )


def dominated_law(
    front: Front,
    name: str,
    place: tuple[float, float],
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
    head = f"{name} ({number(x, 5)} {across.unit}, {number(y, 6)} {up.unit})"
    also = f"; it breaks the cap on {', '.join(broken)}" if broken else ""
    best = reached(front.points, x)
    if best is None:
        return f"{head} is left of the front, where no point was looked for{also}."
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
