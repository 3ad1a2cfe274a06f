"""What a report shows of a front or a surface: what is least over what is limited, and prices."""

from __future__ import annotations

import numpy as np

from ocp.arrays import Array
from studies.common.charts import Chart, ChartAxis, Curve
from studies.common.console import number
from studies.common.result import Result
from studies.pareto.columns import FrontAxis

FRONT = "front"


def charts(result: Result) -> tuple[Chart, ...]:
    """The front, or each slice of a surface, with the paper's laws; and the price of each limit."""
    *sliced, x, y = (FrontAxis(**axis) for axis in result.details["axes"])
    values = {name: series.values for name, series in result.arrays.items()}
    along = ChartAxis(x.key, x.title, x.unit)
    pieces = _slices(values, sliced[0]) if sliced else {FRONT: np.arange(values[x.key].size)}

    def curves(name: str) -> list[Curve]:
        return [
            Curve(piece, {x.key: values[x.key][here]}, values[name][here])
            for piece, here in pieces.items()
        ]

    tail = f" {x.key}"
    laws = [name.removesuffix(tail) for name in values if name.endswith(tail)]
    beside = [
        Curve(law, {x.key: values[f"{law} {x.key}"]}, values[f"{law} {y.key}"])
        for law in laws
        if law not in ("dominated", "price of")
    ]
    found = [Chart("front", y.title, y.unit, (along,), (*curves(y.key), *beside), path=True)]
    prices = {"price": x} if not sliced else {f"price of {axis.key}": axis for axis in (x, *sliced)}
    for name, axis in prices.items():
        series = result.arrays[name]
        title = f"price of the limit on {axis.title}"
        found.append(
            Chart(name, title, series.unit, (along,), tuple(curves(name)), meaning=series.meaning)
        )
    return tuple(found)


def _slices(values: dict[str, Array], axis: FrontAxis) -> dict[str, np.ndarray]:
    """Places of the points of each slice, by its name."""
    limits = np.unique(values["slice"])
    return {
        f"{axis.title} {number(limit, 4)} {axis.unit}": np.flatnonzero(values["slice"] == limit)
        for limit in limits
    }


def scene(result: Result) -> None:
    """Nothing moves: a front has as many motions as points."""
    del result
