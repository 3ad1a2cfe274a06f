"""Figures of the race: rows of a record in, a `Figure` out."""

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
RIGHT, WRONG, COMPLAINT = COLOURS[0], "#c9d8e6", "#b00020"
SHORTEST = 0.05  # [s], where logarithmic bars begin
FLOOR = 1e-9  # relative errors below are drawn here
ALLOWED = 1e-3  # error at which an answer is right


def bars(rows: Rows, titles: Mapping[str, str]) -> Figure:
    """Draw the seconds of each contestant's process, a logarithmic panel for each problem.

    The parts of the seconds stand beside. Bars of answers that are not right are pale.
    """
    figure = Figure(figsize=(12.0, 1.8 + 0.28 * len(rows)), dpi=110, layout="constrained")
    panels: Any = figure.subplots(len(titles), 1, squeeze=False)[:, 0]
    for panel, (problem, title) in zip(panels, titles.items(), strict=True):
        _draw_bars(panel, [row for row in rows if row["problem"] == problem])
        panel.set_title(_typeset(title), fontsize=10, loc="left")
    return figure


def _draw_bars(panel: Axes, rows: Rows) -> None:
    for place, row in enumerate(rows):
        seconds = row["medians"]["process"] or SHORTEST
        panel.barh(place, seconds, color=RIGHT if row["right"] else WRONG)
        panel.annotate(
            _words_beside(row),
            (seconds, place),
            (4, 0),
            textcoords="offset points",
            va="center",
            fontsize=8,
            color="black" if row["right"] else COMPLAINT,
        )
    panel.set_yticks(range(len(rows)), [row["title"] for row in rows])
    panel.invert_yaxis()

    # The axis goes on beyond the longest bar to make room for words; its ticks do not.
    longest = max((row["medians"]["process"] or 0.0 for row in rows), default=0.0) or 1.0
    panel.set_xscale("log")
    panel.set_xlim(SHORTEST, longest * (longest / SHORTEST) ** 0.9)
    first, last = np.ceil(np.log10([SHORTEST, longest]))
    decades = 10.0 ** np.arange(first, last + 1)
    panel.set_xticks(decades, [f"{x:g}" for x in decades])
    panel.set_xticks([], minor=True)

    label_axes(panel, "whole process without verification [s], medians", "", fit=False)
    panel.grid(visible=False, axis="y")


def _words_beside(row: Mapping[str, Any]) -> str:
    """Parts of the seconds and what is wrong."""
    medians, why = row["medians"], "" if row["right"] else f"not right: {row['why not'][:70]}"
    if medians["process"] is None:
        return why
    verification = medians["verification"]
    checked = "" if verification is None else f", verification {verification:.2g}"
    parts = f"start {medians['start']:.2g}, solve {medians['solve']:.2g}{checked}"
    return f"{medians['process']:.2g} s ({parts}) {why}"


def curves(rows: Rows, titles: Mapping[str, str]) -> Figure:
    """Draw error against seconds, both logarithmic; filled where the answer is right."""
    figure = Figure(figsize=(11.0, 5.0), dpi=110, layout="constrained")
    panels: Any = figure.subplots(1, len(titles), squeeze=False)[0]

    # Another marker where the colours begin again, so that every contestant looks different.
    names = dict.fromkeys(row["title"] for row in rows)
    looks = dict(zip(names, cycle(product(("o", "D"), COLOURS)), strict=False))

    for panel, (problem, title) in zip(panels, titles.items(), strict=True):
        answered = [row for row in rows if row["problem"] == problem and row["check"] is not None]
        for name, (marker, colour) in looks.items():
            points = [row for row in answered if row["title"] == name]
            _draw_curve(panel, points, name, marker, colour)
        _scale_curves(panel)
        short = title.split(",")[0] + title[title.rfind(", least") :]
        panel.set_title(_typeset(short), fontsize=10)

    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(
        handles,
        labels,
        loc="outside lower center",
        ncols=4,
        frameon=False,
        fontsize=8,
        title="filled: right; dashed: allowed",
    )
    return figure


def _draw_curve(panel: Axes, points: Rows, name: str, marker: str, colour: str) -> None:
    seconds = [row["medians"]["process"] for row in points]
    errors = [worst_error(row["check"]) for row in points]
    panel.plot(seconds, errors, "-", marker=marker, lw=1, color=colour, label=name)
    for x, y, row in zip(seconds, errors, points, strict=True):
        face = colour if row["right"] else "white"
        panel.plot(x, y, marker, color=colour, markerfacecolor=face)


def _scale_curves(panel: Axes) -> None:
    panel.axhline(ALLOWED, color="grey", lw=0.8, ls="--")
    panel.set(xscale="log", yscale="log")
    panel.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    panel.xaxis.set_major_formatter("{x:g}")
    panel.xaxis.set_minor_locator(NullLocator())
    across, up = "whole process without verification [s]", "error of peak or excess of a cap"
    label_axes(panel, across, f"{up}, relative", fit=False)


def worst_error(check: Mapping[str, Any]) -> float:
    """Return the larger of the peak's error and the excess of a cap; not below `FLOOR`."""
    return max(abs(check["peak_error"]), check["excess"] or 0.0, FLOOR)


def _typeset(title: str) -> str:
    for plain, typeset in (("<=", "≤"), ("^2", "²"), ("^3", "³")):
        title = title.replace(plain, typeset)
    return title
