"""A surface as series of a result, which figures and readers take it from again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ocp.arrays import Array
from studies.common.result import Series
from studies.pareto.columns import WAYS, price_unit
from studies.pareto.surface.shape import Surface
from studies.pareto.surface.walk import Stack
from studies.pareto.surface.words import SurfaceAxes

NUMBER = "point"  # the main axis: points are numbered from 1, as their motions are


def surface_series(surface: Surface, bounds: Array, axes: SurfaceAxes) -> dict[str, Series]:
    """The points of a surface by their numbers, and those that it dominates.

    Parameters
    ----------
    bounds : (points,), nan where there is none.
    """
    points, others = surface.points, surface.dominated
    z, x, y = axes.z, axes.x, axes.y

    def series(unit: str, values: Sequence[float] | Array, meaning: str) -> Series:
        return Series(unit, NUMBER, np.asarray(values), meaning)

    inner, rest = [point.point for point in points], f"dominated {x.key}"
    found = {
        NUMBER: series("1", np.arange(1.0, len(points) + 1), "of a motion, by slices"),
        z.key: series(z.unit, [p.z for p in points], "of the motion, the objective of the slices"),
        x.key: series(x.unit, [p.x for p in inner], "of the motion, limited on each slice"),
        y.key: series(y.unit, [p.y for p in inner], "least under both limits"),
        "slice": series(z.unit, [p.limit for p in points], f"limit on {z.title}"),
        "limit": series(x.unit, [p.limit for p in inner], f"limit on {x.title}"),
        f"price of {z.key}": series(
            price_unit(y, z), [-p.slope for p in points], "what one more of the limit saves"
        ),
        f"price of {x.key}": series(
            price_unit(y, x), [-p.slope for p in inner], "what one more of the limit saves"
        ),
        "bound": series(y.unit, bounds, "that no motion under both limits is below"),
        "way": series(
            "1",
            [WAYS[p.way] for p in inner],
            "1 with rising limits, -1 with falling ones, 0 in a gap",
        ),
        "afresh": series("1", [p.afresh for p in inner], "1 where a neighbour was no start"),
        "seconds": series("s", [p.seconds for p in inner], "that the point took"),
    }
    lost = {axis.key: [p.place[k] for p in others] for k, axis in enumerate((z, x, y))}
    return found | {
        f"dominated {axis.key}": Series(axis.unit, rest, np.array(lost[axis.key]), "of the motion")
        for axis in (x, z, y)
    }


def surface_law_series(
    places: Mapping[str, Sequence[Sequence[float]]], axes: SurfaceAxes
) -> dict[str, Series]:
    """Where laws are: the three objectives of each, at one place or at several."""
    found = {}
    for name, triples in places.items():
        values, along = np.array(triples), f"{name} {axes.x.key}"
        for k, axis in ((1, axes.x), (0, axes.z), (2, axes.y)):
            meaning = f"of the {name} law"
            found[f"{name} {axis.key}"] = Series(axis.unit, along, values[:, k], meaning)
    return found


def surface_details(
    stack: Stack, axes: SurfaceAxes, bound: str = "proven: none is below"
) -> dict[str, object]:
    """What a figure needs besides, and how it came about; `bound` is what a bound says."""
    surface = stack.surface
    return {
        "axes": [vars(axis) for axis in (axes.z, axes.x, axes.y)],
        "bound": bound,
        "slices": list(surface.limits),
        "gaps": [list(gap) for gap in surface.gaps],
        "knee": None if surface.knee is None else surface.knee + 1,
        "points": len(surface.points),
        "dominated": len(surface.dominated),
        "seconds_of_points": sum(p.point.seconds for p in (*surface.points, *surface.dominated)),
    }


def surface_bounds(stack: Stack) -> Array:
    """What no motion under a point's limits is below: (points,), nan where nothing is known."""
    subjects = {one.limit: one.subject for one in stack.slices}
    return np.array([subjects[p.limit].bound(p.point.x) or np.nan for p in stack.surface.points])
