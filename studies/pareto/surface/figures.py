"""A surface as a picture: a curve for each slice in the colour of its limit, and both prices."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, LogNorm, Normalize, to_hex
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator
from numpy.typing import NDArray

from ocp.arrays import Array
from studies.common.console import number
from studies.common.drawing import label_axes, logarithmic_below, typeset
from studies.common.result import Result
from studies.pareto.columns import FrontAxis

Places = NDArray[np.intp]
DARK = 0.88  # of the colour map: its last, pale part is hard to see on white
LAW_MARKS = ("s", "^")
DECADE = 10.0  # of prices, at least, that are drawn
NOTHING = 1e-5  # of the highest price: below that a limit does not press
WIDE = 4.0  # ratio of a range's ends from which it is drawn by its logarithm
NARROW = 0.04  # of the range: ticks of the colour bar that are closer would cover each other


@dataclass(frozen=True, eq=False)
class _Picture:
    """What all panels draw with: the arrays, the axes, and the colours of the slices."""

    arrays: dict[str, Array]
    z: FrontAxis
    x: FrontAxis
    y: FrontAxis
    gaps: Sequence[Sequence[float]]
    colours: ScalarMappable

    def slices(self) -> Iterator[tuple[float, Places, str]]:
        """Limit, places in the arrays, and colour of each slice."""
        for limit in np.unique(self.arrays["slice"]).tolist():
            yield limit, np.flatnonzero(self.arrays["slice"] == limit), self.colour(limit)

    def colour(self, limit: float) -> str:
        """The colour of a limit."""
        return to_hex(self.colours.to_rgba(np.array([limit]))[0])

    def curve(self, here: Places, limit: float, key: str) -> tuple[Array, Array]:
        """A quantity along a slice, with a break at each of its gaps."""
        x, values = self.arrays[self.x.key][here], self.arrays[key][here]
        ends = [gap[1] for gap in self.gaps if gap[0] == limit]
        breaks = np.searchsorted(x, ends, side="right")
        return np.insert(x, breaks, np.nan), np.insert(values, breaks, np.nan)


def surface_figure(result: Result) -> Figure:
    """The slices with their bounds, the paper's laws and the knee; below them both prices."""
    picture = _picture(result)
    x, y, z = picture.x, picture.y, picture.z
    figure = Figure(figsize=(8.8, 8.4), dpi=150, layout="constrained")
    panels = figure.subplots(3, 1, sharex=True, height_ratios=(2.6, 1.0, 1.0))
    _curves(panels[0], result, picture)
    for panel, axis in zip(panels[1:], (x, z), strict=True):
        _prices(panel, picture, axis)

    label_axes(panels[0], "", f"{y.title} [{y.unit}]", fit=False)
    for panel, axis in zip(panels[1:], (x, z), strict=True):
        unit = result.arrays[f"price of {axis.key}"].unit
        below = f"{x.title} [{x.unit}]" if axis is z else ""
        label_axes(panel, below, f"[{unit}]", fit=False)
        panel.set_title(f"price of the limit on {axis.title}", loc="left", fontsize=10)
    _bar(figure, panels, picture)
    figure.suptitle("\n".join(result.question.rsplit(": ", 1)), fontsize=11)
    figure.legend(
        *panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False
    )
    return figure


def _picture(result: Result) -> _Picture:
    arrays = {name: series.values for name, series in result.arrays.items()}
    z, x, y = (FrontAxis(**axis) for axis in result.details["axes"])
    limits = np.unique(arrays["slice"])
    low, high = float(limits[0]), float(limits[-1])
    if high <= low:
        low, high = 0.99 * low, 1.01 * high
    norm = LogNorm(low, high) if high >= WIDE * low > 0.0 else Normalize(low, high)
    part = colormaps["viridis"](np.linspace(0.0, DARK, 256))
    return _Picture(
        arrays, z, x, y, result.details["gaps"], ScalarMappable(norm, ListedColormap(part))
    )


def _curves(panel: Axes, result: Result, picture: _Picture) -> None:
    """The slices, what they are held against, and the knee."""
    arrays, x, y = picture.arrays, picture.x.key, picture.y.key
    for limit, here, colour in picture.slices():
        panel.plot(*picture.curve(here, limit, y), ".-", ms=6, lw=1.4, color=colour, zorder=3)
        if np.isfinite(arrays["bound"][here]).any():
            panel.plot(arrays[x][here], arrays["bound"][here], "--", lw=0.9, color=colour, zorder=1)
    if np.isfinite(arrays["bound"]).any():
        panel.plot([], [], "--", lw=0.9, color="0.35", label=result.details["bound"])

    knee = result.details["knee"]
    if knee is not None:
        at = arrays[x][knee - 1], arrays[y][knee - 1]
        panel.plot(*at, "D", ms=9, mfc="none", mew=1.4, color="#d55e00", label="knee", zorder=5)
    low, high = float(np.nanmin([*arrays[y], *arrays["bound"]])), float(arrays[y].max())
    tops = [_laws(panel, picture, name, mark) for name, mark in _named(picture)]
    highest = max([high, *(top for top in tops if top < high + 2 * (high - low))])
    panel.set_ylim(low - 0.06 * (highest - low), highest + 0.06 * (highest - low))
    if arrays[x].max() >= WIDE * arrays[x].min() > 0.0:
        logarithmic_below(panel)


def _named(picture: _Picture) -> list[tuple[str, str]]:
    """The laws beside the surface, each with its mark."""
    tail = f" {picture.x.key}"
    names = [name.removesuffix(tail) for name in picture.arrays if name.endswith(tail)]
    names = [name for name in names if name not in ("dominated", "price of")]
    return list(zip(names, LAW_MARKS, strict=False))


def _laws(panel: Axes, picture: _Picture, name: str, mark: str) -> float:
    """A law: on each slice in its colour if that is a duration; the highest of it."""
    arrays = picture.arrays
    z, x, y = (arrays[f"{name} {axis.key}"] for axis in (picture.z, picture.x, picture.y))
    if picture.z.key == "time":
        for limit, *at in zip(z, x, y, strict=True):
            panel.plot(*at, mark, ms=6, mfc="none", color=picture.colour(limit), zorder=2)
        panel.plot([], [], mark, ms=6, mfc="none", color="0.35", label=f"{name} law")
    else:
        style = mark if x.size == 1 else f"{mark}-"
        panel.plot(x, y, style, ms=4, lw=0.8, mfc="none", color="0.35", label=f"{name} law")
    return float(y.max())


def _prices(panel: Axes, picture: _Picture, of: FrontAxis) -> None:
    """What one more of a limit saves, along each slice."""
    key = f"price of {of.key}"
    for limit, here, colour in picture.slices():
        panel.plot(*picture.curve(here, limit, key), ".-", ms=4, lw=1, color=colour)
    highest = float(picture.arrays[key].max(initial=0.0))
    if highest > 0.0:
        panel.set_yscale("log")
        # the limit does not press any more where its price is rounding
        lowest = max(float(picture.arrays[key].min()), NOTHING * highest)
        panel.set_ylim(min(lowest / 2, highest / DECADE), 2 * highest)


def _bar(figure: Figure, panels: Sequence[Axes], picture: _Picture) -> None:
    """The colours of the slices, with a tick for each that has room."""
    bar = figure.colorbar(picture.colours, ax=list(panels), aspect=40, pad=0.015)
    bar.set_label(typeset(f"{picture.z.title} at most [{picture.z.unit}]"))
    limits = np.unique(picture.arrays["slice"])
    places = np.asarray(picture.colours.norm(limits), dtype=float)
    ticks, last = [], -1.0
    for limit, place in zip(limits.tolist(), places.tolist(), strict=True):
        if place - last > NARROW:
            ticks.append(limit)
            last = place
    bar.ax.yaxis.set_major_locator(FixedLocator(ticks))
    bar.ax.yaxis.set_minor_locator(NullLocator())
    bar.ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: number(value, 4)))
