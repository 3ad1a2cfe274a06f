"""Curves of a result as data: what the page, its still pictures and its script all draw."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ocp.arrays import Array
from studies.common.result import Result, Series
from studies.common.scene.chain_shapes import HEAD as SHAPES

TIME = "time"
LEAST_RANGE = 1e-6  # of the largest value: a constant's rounding noise is not worth a picture
NOTHING = 1e-12  # in any SI unit of ours: rounding noise about zero
MOST_POINTS = 2500  # of a curve; a screen has fewer columns
MODELS = {"B21": "reduced model B21"}  # heads of series that are another model's
_UNSEEN = (SHAPES, "snapshots/")  # heads of series that are drawn otherwise


@dataclass(frozen=True, eq=False)
class Curve:
    """One law in one chart.

    Attributes
    ----------
    law : its name.
    places : by key of a horizontal axis, where the values are, shape (m,).
    values : shape (m,).
    """

    law: str
    places: Mapping[str, Array]
    values: Array


@dataclass(frozen=True)
class Level:
    """A cap or a bound: a value that a curve keeps to."""

    name: str
    value: float


@dataclass(frozen=True)
class ChartAxis:
    """A horizontal axis: charts that share its key are linked."""

    key: str
    title: str
    unit: str

    @property
    def label(self) -> str:
        """Title and unit."""
        return labelled(self.title, self.unit)


@dataclass(frozen=True, eq=False)
class Chart:
    """Curves over an axis of the reader's choice.

    Attributes
    ----------
    key : unique on its page.
    title, unit, meaning : of the values.
    axes : what may be the horizontal axis, the usual one first.
    curves : one or more.
    levels : caps and bounds.
    path : whether the curves go back and forth along the axis.
    """

    key: str
    title: str
    unit: str
    axes: tuple[ChartAxis, ...]
    curves: tuple[Curve, ...]
    levels: tuple[Level, ...] = ()
    meaning: str = ""
    path: bool = False

    @property
    def label(self) -> str:
        """Title and unit."""
        return labelled(self.title, self.unit)


def labelled(title: str, unit: str) -> str:
    """A title with its unit, which a plain number has not."""
    return f"{title} [{written_unit(unit)}]" if unit not in ("", "1") else title


def written_unit(text: str) -> str:
    """A unit, or a label with one, whose squares and cubes are raised, as in rad/s²."""
    return text.replace("^2", "²").replace("^3", "³")


def value_range(values: Sequence[float]) -> tuple[float, float]:
    """Least and largest value to show, so that a constant is a straight line."""
    finite = [value for value in values if math.isfinite(value)] or [0.0]
    low, high = min(finite), max(finite)
    size = max(abs(low), abs(high))
    if size < NOTHING:
        return -1.0, 1.0
    if high - low > LEAST_RANGE * size:
        return low, high
    middle = (low + high) / 2
    return middle - 0.05 * size, middle + 0.05 * size


def charts_of_arrays(result: Result) -> tuple[Chart, ...]:
    """Charts of any result: the same quantity of several laws is one chart.

    The name of a series may have a head before its last slash: a law, or a group of quantities.
    What does not run along time is left to tables, and shapes to what moves. Where a law has a
    quantity twice, the denser one is shown.
    """
    own = next(iter(result.laws), "result")
    found: dict[tuple[str, str], dict[str, tuple[Series, Series]]] = {}
    for name, series in result.arrays.items():
        axis = result.arrays[series.axis]
        if name == series.axis or name.startswith(_UNSEEN) or not _is_time(axis):
            continue
        head, _, tail = name.rpartition("/")
        law = head if head in result.laws else MODELS.get(head, own)
        laws = found.setdefault((_axis_key(series.axis), tail), {})
        if law not in laws or laws[law][0].values.size < series.values.size:
            laws[law] = series, axis

    return tuple(_chart(axis, key, laws) for (axis, key), laws in found.items())


def _chart(axis_key: str, key: str, laws: Mapping[str, tuple[Series, Series]]) -> Chart:
    first, axis = next(iter(laws.values()))
    return Chart(
        key=f"{axis_key}-{key}",
        title=words(key),
        unit=first.unit,
        axes=(ChartAxis(axis_key, words(axis_key), axis.unit),),
        curves=tuple(
            Curve(law, {axis_key: thin(places.values)}, thin(series.values))
            for law, (series, places) in laws.items()
        ),
        meaning=first.meaning,
    )


def _axis_key(name: str) -> str:
    tail = name.rpartition("/")[2]
    return TIME if tail in (TIME, "instant") else tail


def _is_time(axis: Series) -> bool:
    return axis.unit == "s" and axis.values.size > 1


def words(name: str) -> str:
    """The name of a series as words."""
    return name.replace("_", " ").replace(" x", ", x").replace(" y", ", y")


def thin(values: Array) -> Array:
    """At most `MOST_POINTS` values, the last one included."""
    step = math.ceil(values.size / MOST_POINTS)
    return values if step == 1 else np.append(values[:-1:step], values[-1])
