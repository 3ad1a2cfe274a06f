"""Figures of the parts that measure our own code alone: numbers in, a `Figure` out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from studies.common.drawing import COLOURS, label_axes

Curve = tuple[Sequence[float], Sequence[float | None]]  # None or nan where there is no value


def panels(title: str, along: str, quantities: Mapping[str, Mapping[str, Curve]]) -> Figure:
    """Draw one panel for each quantity: its curves (x, y) by name.

    Values that span more than a decade are drawn logarithmically, as `along` is, so that what is
    proportional to it is a straight line of slope one; others begin at zero.
    """
    figure = Figure(figsize=(4.2 * len(quantities), 3.8), dpi=110, layout="constrained")
    figure.suptitle(title, fontsize=11)
    axes: Any = figure.subplots(1, len(quantities), squeeze=False)[0]
    for panel, (quantity, lines) in zip(axes, quantities.items(), strict=True):
        for (name, (x, y)), colour in zip(lines.items(), COLOURS, strict=False):
            values = np.array(y, dtype=float)  # None becomes nan
            panel.plot(x, values, "o-", ms=4, color=colour, label=name or None)
        if len(lines) > 1:
            panel.legend(frameon=False, fontsize=8)

        # A tick at every measured place: they are few, and no round decades.
        panel.set_xscale("log")
        places = next(iter(lines.values()))[0]
        panel.set_xticks(places, [f"{x:,}" for x in places], rotation=45, fontsize=8)
        panel.set_xticks([], minor=True)
        _scale_values(panel)
        label_axes(panel, along, quantity, fit=False)
    return figure


def points(title: str, along: str, quantity: str, curves: Mapping[str, Curve]) -> Figure:
    """Draw curves (x, y) by name in one panel, as points: many of them, and noisy."""
    figure = Figure(figsize=(6.4, 3.8), dpi=110, layout="constrained")
    panel = figure.subplots()
    for (name, (x, y)), colour in zip(curves.items(), COLOURS, strict=False):
        panel.plot(x[: len(y)], np.array(y, dtype=float), ".", ms=5, color=colour, label=name)
    panel.legend(frameon=False, fontsize=8)
    _scale_values(panel)
    label_axes(panel, along, quantity, fit=False)
    panel.set_title(title, fontsize=11, loc="left")
    return figure


def _scale_values(panel: Axes) -> None:
    """Logarithmic where the values span more than a decade, from zero otherwise."""
    values = np.concatenate([np.asarray(line.get_ydata(), float) for line in panel.get_lines()])
    values = values[values > 0]
    if values.size and values.max() > 10 * values.min():
        panel.set_yscale("log")
    else:
        panel.set_ylim(0.0, 1.15 * values.max() if values.size else 1.0)


def labelled_bars(title: str, names: Sequence[str], seconds: Sequence[float], what: str) -> Figure:
    """Draw a horizontal bar for each name, with its seconds."""
    figure = Figure(figsize=(8.0, 1.2 + 0.3 * len(names)), dpi=110, layout="constrained")
    panel = figure.subplots()
    panel.barh(range(len(names)), list(seconds), color=COLOURS[0])
    for place, value in enumerate(seconds):
        panel.annotate(f" {value:.2f}", (value, place), va="center", fontsize=8)
    panel.set_yticks(range(len(names)), list(names))
    panel.invert_yaxis()
    panel.margins(x=0.12)  # room for the words beside the longest bar
    label_axes(panel, what, "", fit=False)
    panel.grid(visible=False, axis="y")
    panel.set_title(title, fontsize=11, loc="left")
    return figure
