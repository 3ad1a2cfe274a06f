"""A front as a picture: its points, bounds and laws above, the price of its limit below."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ocp.arrays import Array
from studies.common.drawing import COLOURS, label_axes, logarithmic_below, look
from studies.common.result import Result
from studies.fronts.columns import WAYS, FrontAxis

MARKS = {
    "up": ("found with rising limits", ">"),
    "down": ("with falling limits", "<"),
    "between": ("in a gap", "o"),
}
ROOM = 0.06  # of the height, above and below what is shown
STEEP = 0.05  # of the highest price: with one below, prices are drawn by their logarithm
NOTHING = 1e-6  # of the highest price
FLAT = 4.0  # times what a point is known to: the least height of the figure
TALLEST = 2.0  # of the front's height, which a law may be above it and still be shown


def draw(result: Result) -> Iterator[tuple[str, Figure]]:
    """The figure of a result, with the name of its file."""
    yield "front", front_figure(result)


def front_figure(result: Result) -> Figure:
    """The front with its bounds, the paper's laws and its knee; below it the price."""
    x, y = (FrontAxis(**axis) for axis in result.details["axes"])
    figure = Figure(figsize=(8.4, 6.6), dpi=150, layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(2.4, 1.0))
    _front(top, result, x.key, y.key)
    _price(bottom, result, x.key)

    label_axes(top, "", f"{y.title} [{y.unit}]", fit=False)
    label_axes(
        bottom, f"{x.title} [{x.unit}]", f"price\n[{result.arrays['price'].unit}]", fit=False
    )
    figure.suptitle(result.question, fontsize=11)
    figure.legend(
        *top.get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False
    )
    return figure


def _front(panel: Axes, result: Result, limited: str, least: str) -> None:
    arrays = {name: series.values for name, series in result.arrays.items()}
    x, y, bound = arrays[limited], arrays[least], arrays["bound"]

    panel.plot(*_broken(x, y, result.details["gaps"]), color=COLOURS[0], lw=1.2, zorder=3)
    for way, (label, marker) in MARKS.items():
        here = arrays["way"] == WAYS[way]
        if here.any():
            panel.plot(x[here], y[here], marker, ms=4, color=COLOURS[0], label=label, zorder=4)
    dominated = arrays[f"dominated {limited}"], arrays[f"dominated {least}"]
    if dominated[0].size:
        panel.plot(*dominated, "x", ms=4, color="0.7", label="dominated", zorder=2)
    _limits(panel, result, limited, least)

    knee = result.details["knee"]
    if knee is not None:
        at = int(np.argmin(np.abs(x - knee)))
        panel.plot(x[at], y[at], "D", ms=8, mfc="none", color=COLOURS[1], label="knee", zorder=5)

    low, high = _heights(panel, y, bound, result.details.get("known", 0.0))
    lines = _laws(panel, arrays, limited, least)
    reach = high + TALLEST * (high - low)
    high = max([high, *(min(_of(x).max(), reach) for x in lines if _of(x).min() <= reach)])
    top = high + ROOM * (high - low)
    panel.set_ylim(low - ROOM * (high - low), top)
    for line in lines:
        if _of(line).min() > top:
            line.set_label(f"{line.get_label()} (above)")
    # a front may end far from a limit that no motion attains
    limit = result.details.get("open_ends", {}).get(least, low)
    for line in panel.get_lines():
        if limit < panel.get_ylim()[0] and line.get_label() == _open(limit):
            line.set_label(f"{_open(limit)} (below)")


def _limits(panel: Axes, result: Result, limited: str, least: str) -> None:
    """What no motion is below or left of, and the ends that no motion attains."""
    bound, open_ends = result.arrays["bound"].values, result.details.get("open_ends", {})
    if np.isfinite(bound).any():
        x = result.arrays[limited].values
        panel.plot(x, bound, color="0.35", lw=1, ls="--", label=result.details["bound"])
    if limited in result.bounds and limited not in open_ends:
        least_x = result.bounds[limited]
        panel.axvline(
            least_x, color="0.35", lw=1, ls=":", label="proven: no motion is left of this line"
        )
    for name, line in ((limited, panel.axvline), (least, panel.axhline)):
        if name in open_ends:
            line(open_ends[name], color=COLOURS[3], lw=1.2, ls="-.", label=_open(open_ends[name]))


def _open(value: float) -> str:
    return f"open end at {value:.6g}: no motion reaches it"


def _heights(panel: Axes, y: Array, bound: Array, known: float) -> tuple[float, float]:
    """Between which heights a front lies; a flat one is shown in the band of what is known.

    Parameters
    ----------
    known : part of a value by which a point may be wrong.
    """
    low, high, room = float(np.nanmin([*y, *bound])), float(y.max()), known * float(y.max())
    if float(y.max() - y.min()) <= room:
        panel.axhspan(y.min() - room, y.min() + room, color="0.9", zorder=0)
        panel.plot([], [], color="0.9", lw=6, label="as far as a point is known")
        low -= room
    # what no point is known to must not look like a slope
    return low, max(high, low + FLAT * room)


def _laws(panel: Axes, arrays: dict[str, Array], limited: str, least: str) -> list[Line2D]:
    """The laws beside a front: a point each, or a curve."""
    tail, lines = f" {limited}", []
    for law in (name.removesuffix(tail) for name in arrays if name.endswith(tail)):
        if law == "dominated":
            continue
        colour, style = look(law)
        at_x, at_y = arrays[f"{law} {limited}"], arrays[f"{law} {least}"]
        marker = "s" if at_x.size == 1 else style
        lines += panel.plot(at_x, at_y, marker, color=colour, label=law)
    return lines


def _of(line: Line2D) -> Array:
    """Heights of a line."""
    return np.asarray(line.get_ydata(), dtype=float)


def _price(panel: Axes, result: Result, limited: str) -> None:
    """What one more of the limit saves, by the multiplier."""
    x, price = result.arrays[limited].values, result.arrays["price"].values
    panel.plot(*_broken(x, price, result.details["gaps"]), ".-", ms=4, lw=1, color=COLOURS[2])
    highest = float(price.max(initial=0.0))
    if highest > 0.0 and price.min() < STEEP * highest:
        panel.set_yscale("log")
        # the limit does not press any more where the price is rounding
        panel.set_ylim(max(float(price.min()), NOTHING * highest) / 2, 2 * highest)
    if x.max() >= 4 * x.min():
        logarithmic_below(panel)


def _broken(x: np.ndarray, y: np.ndarray, gaps: list[list[float]]) -> tuple[np.ndarray, np.ndarray]:
    """A curve that ends before each gap and begins again behind it."""
    places = [int(np.searchsorted(x, gap[0], side="right")) for gap in gaps]
    return np.insert(x, places, np.nan), np.insert(y, places, np.nan)
