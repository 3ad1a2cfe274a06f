"""What a report shows of links in a plane: curves of all series, and the links in motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ocp.arrays import Array
from studies.common.charts import Chart, Level, charts_of_arrays
from studies.common.result import Result
from studies.common.scene.chain_shapes import ChainShapes, read_shapes
from studies.common.scene.moving_picture import LawOfMotion, MovingPicture, Strand

# series as charts: title, and the quantity of the table whose cap they keep; the others follow
_TITLES = {
    "root_torque": ("torque of the root", "peak_root_torque"),
    "elbow_torque": ("torque of the elbow", "peak_elbow_torque"),
    "tip_acceleration": ("acceleration of the antenna", ""),
    "bending_big": ("largest bending moment of the big arm", ""),
    "bending_small": ("largest bending moment of the small arm", ""),
    "elbow_x": ("place of the elbow, x", ""),
    "elbow_y": ("place of the elbow, y", ""),
    "elbow_vx": ("speed of the elbow, x", ""),
    "elbow_vy": ("speed of the elbow, y", ""),
    "tip_x": ("place of the antenna, x", ""),
    "tip_y": ("place of the antenna, y", ""),
    "tip_vx": ("speed of the antenna, x", ""),
    "tip_vy": ("speed of the antenna, y", ""),
    "elbow_off_x": ("elbow after the lock, x", ""),
    "elbow_off_y": ("elbow after the lock, y", ""),
    "tip_off_x": ("antenna after the lock, x", ""),
    "tip_off_y": ("antenna after the lock, y", ""),
}
_NAMES = ("big arm", "small arm")
_LEFT_OUT = {"locked", "node"}


def charts(result: Result, by_meaning: bool = False) -> tuple[Chart, ...]:
    """All series over time, those with a name of their own first.

    Parameters
    ----------
    by_meaning : bool
        Whether the others are called by their meaning.
    """
    found = []
    for chart in charts_of_arrays(result):
        key = chart.key.partition("-")[2]
        if key in _LEFT_OUT or key.startswith("lock_impulse"):
            continue
        found.append(_titled(result, chart, key, by_meaning))
    order = {key: place for place, key in enumerate(_TITLES)}
    return tuple(sorted(found, key=lambda c: order.get(c.key.partition("-")[2], len(order))))


def _titled(result: Result, chart: Chart, key: str, by_meaning: bool) -> Chart:
    named = chart.meaning if by_meaning and chart.meaning else chart.title
    title, quantity = _TITLES.get(key, (named, ""))
    caps = {row.key: row.cap for row in result.table}
    cap = caps.get(quantity)
    levels = () if cap is None else (Level("cap", cap), Level("cap", -cap))
    return Chart(
        key=chart.key,
        title=title,
        unit=chart.unit,
        axes=chart.axes,
        curves=chart.curves,
        levels=levels,
        meaning=chart.meaning,
    )


def scene(result: Result) -> MovingPicture | None:
    """The arm in motion; None where the result does not hold its shapes."""
    shapes = read_shapes(result)
    if shapes is None:
        return None
    return moving_links(result, shapes, "the arm in its plane", _NAMES)


def moving_links(
    result: Result, shapes: ChainShapes, title: str, names: Sequence[str]
) -> MovingPicture:
    """Links of these names in motion."""
    counts = [nodes.shape[1] for nodes in shapes.nodes]
    first = np.concatenate([[0], np.cumsum(counts)])
    strands = []
    for link, count in enumerate(counts):
        chain = first[link] + np.arange(count)
        strands.append(Strand(names[link], np.stack([chain[:-1], chain[1:]], axis=1)))

    own = next(iter(result.laws), "motion")
    times = shapes.times
    return MovingPicture(
        title=title,
        shapes=_in_space(shapes.nodes),
        parameter=times,
        strands=tuple(strands),
        laws=(LawOfMotion(own, times, times, np.ones_like(times)),),
        straight=_in_space(shapes.straight()),
        size=_extent(shapes),
        flat=True,
    )


def _in_space(links: tuple[Array, ...]) -> Array:
    """Places (m, p, 3) of all nodes of all links."""
    flat = np.concatenate(links, axis=1)
    return np.concatenate([flat, np.zeros((*flat.shape[:2], 1))], axis=2)


def _extent(shapes: ChainShapes) -> float:
    places = np.concatenate([nodes.reshape(-1, 2) for nodes in shapes.nodes])
    return float(np.ptp(places, axis=0).max())
