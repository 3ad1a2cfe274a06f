"""Figures of the speed benchmark: records in, a `Figure` out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.figure import Figure

Rows = Sequence[Mapping[str, Any]]
RIGHT, WRONG = "#1f77b4", "#c9d8e6"
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
        panel.set_title(title, fontsize=10, loc="left")
        panel.set_xlabel("whole process without verification [s], medians")
        panel.xaxis.set_major_formatter("{x:g}")
    return figure


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
        for name in dict.fromkeys(row["title"] for row in rows):
            points = [row for row in mine if row["title"] == name]
            seconds = [row["medians"]["process"] for row in points]
            errors = [worst_error(row["check"]) for row in points]
            line = panel.plot(seconds, errors, "-", lw=1, label=name)[0]
            for x, y, row in zip(seconds, errors, points, strict=True):
                face = line.get_color() if row["right"] else "white"
                panel.plot(x, y, "o", color=line.get_color(), markerfacecolor=face)
        panel.axhline(1e-3, color="grey", lw=0.8, ls="--")
        panel.set(xscale="log", yscale="log")
        panel.xaxis.set_major_formatter("{x:g}")
        panel.xaxis.set_minor_formatter("{x:g}")
        panel.tick_params(axis="x", which="both", labelsize=7)
        panel.set_title(title.split(",")[0] + title[title.rfind(", least") :], fontsize=10)
        panel.set_xlabel("whole process without verification [s]")
        panel.set_ylabel("error of peak or excess of a cap, relative")
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
    """One panel for each quantity: its curves (x, y) by name, both axes logarithmic."""
    figure = Figure(figsize=(4.2 * len(named), 3.8), dpi=110, layout="constrained")
    figure.suptitle(title, fontsize=11)
    axes: Any = figure.subplots(1, len(named), squeeze=False)[0]
    for panel, (quantity, lines) in zip(axes, named.items(), strict=True):
        top = 0.0
        for name, (x, y) in lines.items():
            panel.plot(x, y, "o-", ms=4, label=name or None)
            top = max(top, *y, 0.0)
        panel.set_xscale("log")
        ticks = next(iter(lines.values()))[0]
        panel.set_xticks(ticks, [f"{x:,}" for x in ticks], rotation=45, fontsize=8)
        panel.set_xticks([], minor=True)
        if len(lines) > 1:
            panel.set_yscale("log")
            panel.legend(frameon=False, fontsize=8)
        else:
            panel.set_ylim(0.0, 1.15 * top or 1.0)
        panel.set_xlabel(along)
        panel.set_ylabel(quantity)
        panel.grid(alpha=0.3)
    return figure


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
    panel.set_xlabel(what)
    panel.set_title(title, fontsize=11, loc="left")
    return figure
