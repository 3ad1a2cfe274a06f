"""Figures of the speed benchmark: records in, a `Figure` out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle, product
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from studies.common.drawing import COLOURS, label_axes

Rows = Sequence[Mapping[str, Any]]
RIGHT, WRONG = COLOURS[0], "#c9d8e6"
SHORTEST = 0.05  # [s], where logarithmic bars begin
FLOOR = 1e-9  # relative errors below are drawn here


def bars(rows: Rows, titles: Mapping[str, str]) -> Figure:
    """Seconds of each contestant's process, a logarithmic panel for each problem, its parts beside.

    Bars of answers that are not right are pale.
    """
    figure = Figure(figsize=(12.0, 1.8 + 0.28 * len(rows)), dpi=110, layout="constrained")
    panels: Any = figure.subplots(len(titles), 1, squeeze=False)[:, 0]
    for panel, (problem, title) in zip(panels, titles.items(), strict=True):
        mine = [row for row in rows if row["problem"] == problem]
        longest = max((row["medians"]["process"] or 0.0 for row in mine), default=0.0) or 1.0
        panel.set_xscale("log")
        panel.set_xlim(SHORTEST, longest * (longest / SHORTEST) ** 0.9)
        for place, row in enumerate(mine):
            seconds = row["medians"]["process"] or SHORTEST
            panel.barh(place, seconds, color=RIGHT if row["right"] else WRONG)
            panel.annotate(
                _beside(row), (seconds, place), (4, 0), textcoords="offset points",
                va="center", fontsize=8, color="black" if row["right"] else "#b00020",
            )  # fmt: skip
        panel.set_yticks(range(len(mine)), [row["title"] for row in mine])
        panel.invert_yaxis()
        panel.set_title(_typeset(title), fontsize=10, loc="left")
        # the axis goes on to make room for words
        decades = 10.0 ** np.arange(np.ceil(np.log10(SHORTEST)), np.ceil(np.log10(longest)) + 1)
        panel.set_xticks(decades, [f"{x:g}" for x in decades])
        panel.set_xticks([], minor=True)
        label_axes(panel, "whole process without verification [s], medians", "", fit=False)
        panel.grid(visible=False, axis="y")
    return figure


def _typeset(title: str) -> str:
    for plain, typeset in (("<=", "≤"), ("^2", "²"), ("^3", "³")):
        title = title.replace(plain, typeset)
    return title


def _beside(row: Mapping[str, Any]) -> str:
    """Parts of the seconds and what is wrong."""
    medians, why = row["medians"], "" if row["right"] else f"not right: {row['why not'][:70]}"
    if medians["process"] is None:
        return why
    own = medians["verification"]
    checked = "" if own is None else f", verification {own:.2g}"
    parts = f"start {medians['start']:.2g}, solve {medians['solve']:.2g}{checked}"
    return f"{medians['process']:.2g} s ({parts}) {why}"


def curves(rows: Rows, titles: Mapping[str, str]) -> Figure:
    """Error against seconds, both logarithmic; filled where the answer is right."""
    figure = Figure(figsize=(11.0, 5.0), dpi=110, layout="constrained")
    panels: Any = figure.subplots(1, len(titles), squeeze=False)[0]
    for panel, (problem, title) in zip(panels, titles.items(), strict=True):
        mine = [row for row in rows if row["problem"] == problem and row["check"] is not None]
        names = dict.fromkeys(row["title"] for row in rows)
        looks = product(("o", "D"), COLOURS)  # another marker where the colours begin again
        for name, (marker, colour) in zip(names, cycle(looks)):
            points = [row for row in mine if row["title"] == name]
            seconds = [row["medians"]["process"] for row in points]
            errors = [worst_error(row["check"]) for row in points]
            panel.plot(seconds, errors, "-", marker=marker, lw=1, color=colour, label=name)
            for x, y, row in zip(seconds, errors, points, strict=True):
                face = colour if row["right"] else "white"
                panel.plot(x, y, marker, color=colour, markerfacecolor=face)
        panel.axhline(1e-3, color="grey", lw=0.8, ls="--")
        panel.set(xscale="log", yscale="log")
        panel.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        panel.xaxis.set_major_formatter("{x:g}")
        panel.xaxis.set_minor_locator(NullLocator())
        short = title.split(",")[0] + title[title.rfind(", least") :]
        panel.set_title(_typeset(short), fontsize=10)
        label_axes(panel, "whole process without verification [s]",
                   "error of peak or excess of a cap, relative", fit=False)  # fmt: skip
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside lower center", ncols=4, frameon=False, fontsize=8,
        title="filled: right; dashed: allowed",
    )  # fmt: skip
    return figure


def worst_error(check: Mapping[str, Any]) -> float:
    """The larger of the peak's error and the excess of a cap; not below `FLOOR`."""
    return max(abs(check["peak_error"]), check["excess"] or 0.0, FLOOR)


def panels(title: str, along: str, named: Mapping[str, Mapping[str, tuple[Any, Any]]]) -> Figure:
    """One panel for each quantity: its curves (x, y) by name; nan where there is no value.

    Values that span more than a decade are drawn logarithmically, as `along` is, so that what is
    proportional to it is a straight line of slope one; others begin at zero.
    """
    figure = Figure(figsize=(4.2 * len(named), 3.8), dpi=110, layout="constrained")
    figure.suptitle(title, fontsize=11)
    axes: Any = figure.subplots(1, len(named), squeeze=False)[0]
    for panel, (quantity, lines) in zip(axes, named.items(), strict=True):
        for (name, (x, y)), colour in zip(lines.items(), COLOURS, strict=False):
            panel.plot(x, y, "o-", ms=4, color=colour, label=name or None)
        panel.set_xscale("log")
        ticks = next(iter(lines.values()))[0]
        panel.set_xticks(ticks, [f"{x:,}" for x in ticks], rotation=45, fontsize=8)
        panel.set_xticks([], minor=True)
        if len(lines) > 1:
            panel.legend(frameon=False, fontsize=8)
        _scale(panel)
        label_axes(panel, along, quantity, fit=False)
    return figure


def _scale(panel: Axes) -> None:
    """Logarithmic where the values span more than a decade, from zero otherwise."""
    values = np.concatenate([np.asarray(line.get_ydata(), float) for line in panel.get_lines()])
    values = values[values > 0]
    if values.size and values.max() > 10 * values.min():
        panel.set_yscale("log")
    else:
        panel.set_ylim(0.0, 1.15 * values.max() if values.size else 1.0)


def labelled_bars(title: str, names: Sequence[str], seconds: Sequence[float], what: str) -> Figure:
    """A horizontal bar for each name, with its seconds."""
    figure = Figure(figsize=(8.0, 1.2 + 0.3 * len(names)), dpi=110, layout="constrained")
    panel = figure.subplots()
    panel.barh(range(len(names)), list(seconds), color=RIGHT)
    for place, value in enumerate(seconds):
        panel.annotate(f" {value:.2f}", (value, place), va="center", fontsize=8)
    panel.set_yticks(range(len(names)), list(names))
    panel.invert_yaxis()
    panel.margins(x=0.12)
    label_axes(panel, what, "", fit=False)
    panel.grid(visible=False, axis="y")
    panel.set_title(title, fontsize=11, loc="left")
    return figure
