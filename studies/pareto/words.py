"""A front in sentences: its ends, its knee, what more of one objective saves of the other."""

from __future__ import annotations

from studies.common.console import number
from studies.pareto.continuation import FrontPoint
from studies.pareto.envelope import Front, reached
from studies.truss.limits.tolerances import CAPS
from studies.truss.motions.deployment import Deployment
from studies.truss.quantities import QUANTITIES

HUNDREDTH = 0.01  # of a limit: so much more of it has a price that one can imagine


def front_in_words(front: Front, limited: str, least: str) -> tuple[str, ...]:
    """Both ends, the knee and the gaps."""
    first, last = front.points[0], front.points[-1]
    sentences = [
        f"The front has {len(front.points)} verified points, from {_at(first, limited, least)} to "
        f"{_at(last, limited, least)}; {len(front.dominated)} points that others dominate were "
        "dropped."
    ]
    if front.knee is not None:
        knee = front.points[front.knee]
        sentences.append(f"Its knee is at {_at(knee, limited, least)}.")
    unit = QUANTITIES[limited].unit
    sentences += [
        f"It has a gap between {number(a, 6)} and {number(b, 6)} {unit}: no point was found there "
        "that no other dominates."
        for a, b in front.gaps
    ]
    return tuple(sentences)


def price_in_words(front: Front, limited: str, least: str) -> tuple[str, ...]:
    """What a little more of the limit saves: at both ends and at the knee."""
    places = [0, len(front.points) - 1]
    if front.knee is not None:
        places.insert(1, front.knee)
    return tuple(price_at(front.points[place], limited, least) for place in dict.fromkeys(places))


def price_at(point: FrontPoint, limited: str, least: str) -> str:
    """What a second, or a hundredth of the limit, saves at a point."""
    x, y = QUANTITIES[limited], QUANTITIES[least]
    more = 1.0 if limited == "time" else HUNDREDTH * point.limit
    share = "" if limited == "time" else " (1 %)"
    return (
        f"At {number(point.limit, 5)} {x.unit}: {number(more, 3)} {x.unit}{share} more of "
        f"{x.title} saves {number(-point.slope * more, 3)} {y.unit} of {y.title}, at this slope."
    )


def dominated_law(
    front: Front, law: Deployment, limited: str, least: str, broken: tuple[str, ...]
) -> str:
    """How the front compares with a law of the paper at the law's own limit."""
    x, y = law.values[limited], law.values[least]
    unit = QUANTITIES[least].unit
    head = f"{law.name} ({number(x, 5)} {QUANTITIES[limited].unit}, {number(y, 6)} {unit})"
    also = f"; it breaks the cap on {', '.join(broken)}" if broken else ""
    best = reached(front.points, x)
    if best is None:
        return f"{head} is left of the front, where no point was looked for{also}."
    gain = 1 - best.y / y
    if gain > CAPS:
        return (
            f"{head} is dominated: with no more {QUANTITIES[limited].title} the front needs "
            f"{number(best.y, 6)} {unit}, {100 * gain:.3g} % less{also}."
        )
    word = "indistinguishable from" if gain > -CAPS else "below"
    return f"{head} is {word} the front, by {abs(100 * gain):.2g} %{also}."


def _at(point: FrontPoint, limited: str, least: str) -> str:
    return (
        f"{number(point.x, 6)} {QUANTITIES[limited].unit} with {number(point.y, 6)} "
        f"{QUANTITIES[least].unit}"
    )
