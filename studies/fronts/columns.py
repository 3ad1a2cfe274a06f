"""A front as series of a result, which figures and readers take it from again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ocp import FrontPoint, ParetoFront
from ocp.arrays import Array
from studies.common.result import Series

WAYS = {"up": 1.0, "between": 0.0, "down": -1.0}


@dataclass(frozen=True)
class FrontAxis:
    """One of the two objectives of a front.

    Attributes
    ----------
    key, title, unit : of the quantity.
    """

    key: str
    title: str
    unit: str


def price_unit(y: FrontAxis, x: FrontAxis) -> str:
    """Unit of what one more of x saves of y."""
    compound = "/" in x.unit or " " in x.unit
    return f"{y.unit}/({x.unit})" if compound else f"{y.unit}/{x.unit}"


def front_series(
    front: ParetoFront, bounds: Array, x: FrontAxis, y: FrontAxis
) -> dict[str, Series]:
    """The front along its limited objective, and the points that it dominates.

    Parameters
    ----------
    bounds : (points,), nan where there is none.
    """

    def column(points: Sequence[FrontPoint], name: str) -> Array:
        return np.array([float(getattr(point, name)) for point in points])

    points, others = front.points, front.dominated
    ways = np.array([WAYS[point.way] for point in points])
    main, rest = x.key, f"dominated {x.key}"
    return {
        main: Series(x.unit, main, column(points, "x"), "of the motion, the limited objective"),
        y.key: Series(y.unit, main, column(points, "y"), "minimum under this limit"),
        "limit": Series(x.unit, main, column(points, "limit"), "that was set"),
        "price": Series(
            price_unit(y, x),
            main,
            -column(points, "slope"),
            "shadow price: reduction for one more unit of the limit",
        ),
        "bound": Series(y.unit, main, bounds, "proven lower bound under the limit"),
        "way": Series("1", main, ways, "1 with rising limits, -1 with falling ones, 0 in a gap"),
        "afresh": Series(
            "1", main, column(points, "afresh"), "1 if no neighbour was used as the start"
        ),
        "seconds": Series("s", main, column(points, "seconds"), "time for the point"),
        rest: Series(x.unit, rest, column(others, "x"), "of the motion"),
        f"dominated {y.key}": Series(y.unit, rest, column(others, "y"), "of the motion"),
    }


def law_series(
    places: Mapping[str, Sequence[Sequence[float]]], x: FrontAxis, y: FrontAxis
) -> dict[str, Series]:
    """Where laws are: a point each, or a curve if the duration is traded."""
    found = {}
    for name, pairs in places.items():
        axis, values = f"{name} {x.key}", np.array(pairs)
        found[axis] = Series(x.unit, axis, values[:, 0], f"of the {name} law")
        found[f"{name} {y.key}"] = Series(y.unit, axis, values[:, 1], f"of the {name} law")
    return found


def front_details(front: ParetoFront, x: FrontAxis, y: FrontAxis) -> dict[str, object]:
    """What a figure needs besides, and how the front came about."""
    points = [*front.points, *front.dominated]
    return {
        "axes": [vars(x), vars(y)],
        "gaps": [list(gap) for gap in front.gaps],
        "knee": None if front.knee is None else front.knee.x,
        "points": len(front.points),
        "dominated": len(front.dominated),
        "afresh": sum(point.afresh for point in points),
        "seconds_of_points": sum(point.seconds for point in points),
    }


def point_name(number: int) -> str:
    """How a point of a front is named, from 1, the one with the least limit first."""
    return f"point {number}"
