"""Figures of a sweep, from its result: curves, heat maps, tornados, points."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ocp.arrays import Array
from studies.common.charts import written_unit
from studies.common.drawing import COLOURS, STYLES, label_axes, legend_below
from studies.common.result import Result

PANELS = 3  # quantities in a figure, unless the user asks for more
CURVES = 7  # of one family that a reader tells apart
TICKED = 8  # values that are all named on their axis
SAME = 1e-6  # relative: a spread below it is none
WRAPPED = 36  # signs of a line of a label
SIGNS_PER_INCH = 14.0  # of a head
HANDLE = 12  # signs that the line before a text of a legend takes, and the room after it
LACKING = "#b0b0b0"  # where a case has no solution


@dataclass(frozen=True, eq=False)
class Parameter:
    """A key that varies, as it is drawn.

    Attributes
    ----------
    name, unit : for the label.
    values : of each case, shape (cases,): numbers, or the place among the words.
    words : of a key that is no number; empty for numbers.
    logarithmic : whether its values are spread so.
    """

    name: str
    unit: str
    values: Array
    words: tuple[str, ...]
    logarithmic: bool

    @property
    def label(self) -> str:
        """Of its axis."""
        return written_unit(f"{self.name} [{self.unit}]") if self.unit else self.name

    def of(self, value: float) -> str:
        """One of its values, for a legend."""
        shown = self.words[int(value)] if self.words else f"{value:.4g}"
        return f"{shown} {self.unit}".rstrip() if not self.words else shown

    def along(self, panel: Axes, vertical: bool = False) -> None:
        """Give a panel its scale and marks."""
        axis = panel.yaxis if vertical else panel.xaxis
        if self.words:
            axis.set_ticks(range(len(self.words)), list(self.words))
            return
        if self.logarithmic:
            (panel.set_yscale if vertical else panel.set_xscale)("log")
        values = np.unique(self.values)
        if values.size <= TICKED:
            axis.set_ticks(values, [f"{value:.4g}" for value in values])
            axis.set_ticks([], minor=True)


def draw(result: Result) -> Iterator[tuple[str, Figure]]:
    """Every figure of a sweep with the name of its file."""
    quantities, solved = shown(result), _solved(result)
    if not quantities or not solved.any():
        return
    parameters, sampling = _parameters(result), result.configuration["sampling"]
    if result.details.get("fronts"):
        yield "fronts", fronts(result)
    if sampling == "one-at-a-time":
        yield "tornado", tornado(result, quantities)
        return
    if sampling == "grid" and len(parameters) <= 2:
        yield "curves", curves(result, parameters, quantities)
        if len(parameters) == 2 and min(np.unique(p.values).size for p in parameters) > 2:
            yield "heat_map", heat_map(result, parameters, quantities)
        return
    yield "points", points(result, parameters, quantities)
    if "sobol_indices" in result.details:
        yield "sobol_indices", indices(result)


def shown(result: Result) -> list[str]:
    """The quantities of the figures: those that are asked for, else the objectives."""
    known = list(result.details["titles"])
    asked = [name for name in result.configuration.get("show", ()) if name in known]
    return asked or list(result.details["minimised"][:PANELS]) or _varying(result, known)[:PANELS]


def _varying(result: Result, known: Sequence[str]) -> list[str]:
    """The quantities that the keys change; all of them where they change none."""
    spreads = {}
    for name in known:
        values = result.arrays[name].values[np.isfinite(result.arrays[name].values)]
        spreads[name] = values.size and np.ptp(values) > SAME * np.abs(values).max()
    return [name for name in known if spreads[name]] or list(known)


def _solved(result: Result) -> Array:
    return np.array([status == "solved" for status in result.details["statuses"]])


def _parameters(result: Result) -> list[Parameter]:
    columns = list(zip(*result.details["points"], strict=True))
    found = []
    for (name, stated), column in zip(
        result.configuration["parameters"].items(), columns, strict=True
    ):
        numeric = all(isinstance(v, int | float) and not isinstance(v, bool) for v in column)
        words: tuple[str, ...] = ()
        if numeric:
            values = np.array(column, dtype=float)
        else:
            texts = [_text(value) for value in column]
            words = tuple(dict.fromkeys(texts))
            values = np.array([words.index(text) for text in texts], dtype=float)
        log = numeric and _is_logarithmic(values, stated)
        found.append(Parameter(name, result.details["units"].get(name, ""), values, words, log))
    return found


def _text(value: Any) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list | dict) else str(value)


def _is_logarithmic(values: Array, stated: Any) -> bool:
    """Whether values stand so, as by their ratios."""
    if isinstance(stated, dict):
        return stated.get("scale") == "log"
    distinct = np.unique(values)
    if distinct.size < 3 or distinct[0] <= 0.0:
        return False
    ratios = distinct[1:] / distinct[:-1]
    return bool(ratios.max() < 1.01 * ratios.min() and ratios.min() > 1.1)


def _panels(result: Result, count: int, height: float = 4.0) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(5.2 * count + 0.6, height), dpi=150, layout="constrained")
    _head(figure, result)
    return figure, list(figure.subplots(1, count, squeeze=False)[0])


def _head(figure: Figure, result: Result) -> None:
    """Question and verdict above a figure, in lines that fit into its width."""
    signs = int(SIGNS_PER_INCH * figure.get_figwidth())
    lines = [
        textwrap.fill(line, signs, break_on_hyphens=False)
        for line in (result.question, result.verdict.sentence)
    ]
    figure.suptitle("\n".join(lines), fontsize=9)


def _label(result: Result, name: str) -> str:
    title, unit = result.details["titles"][name]
    return textwrap.fill(written_unit(f"{title} [{unit}]"), WRAPPED)


def _mark_lacking(panel: Axes, places: Array) -> None:
    """Marks on the lower edge where cases have no solution."""
    if places.size:
        foot = panel.get_xaxis_transform()
        panel.plot(
            places,
            np.full(places.size, 0.02),
            "x",
            color=LACKING,
            transform=foot,
            label="no solution",
        )


def curves(result: Result, parameters: Sequence[Parameter], quantities: Sequence[str]) -> Figure:
    """Quantities along the first key, a curve for each value of the second one."""
    figure, panels = _panels(result, len(quantities))
    first, second = parameters[0], parameters[1] if len(parameters) > 1 else None
    families = np.array([0.0]) if second is None else np.unique(second.values)
    if second is not None and families.size > CURVES:
        # some of them, spread evenly: the heat map has all
        families = families[np.linspace(0, families.size - 1, CURVES).round().astype(int)]

    for panel, name in zip(panels, quantities, strict=True):
        values = result.arrays[name].values
        lacking = []
        for number, family in enumerate(families):
            own = np.ones(values.size, bool) if second is None else second.values == family
            order = np.flatnonzero(own)[np.argsort(first.values[own], kind="stable")]
            label = None if second is None else f"{second.name} = {second.of(family)}"
            panel.plot(
                first.values[order],
                values[order],
                "o" if first.words else "o" + STYLES[number % len(STYLES)],
                ms=3.5,
                color=COLOURS[number % len(COLOURS)],
                label=label,
            )
            lacking.append(first.values[order][~np.isfinite(values[order])])
        _mark_lacking(panel, np.unique(np.concatenate(lacking)))
        first.along(panel)
        label_axes(panel, first.label, _label(result, name), fit=False)
    # below the panels, as curves may be anywhere in them
    labels = panels[0].get_legend_handles_labels()[1]
    if labels:
        signs = int(SIGNS_PER_INCH * figure.get_figwidth())
        columns = max(1, signs // (max(map(len, labels)) + HANDLE))
        legend_below(figure, panels[0], min(columns, len(labels)))
    return figure


def fronts(result: Result) -> Figure:
    """The fronts of all cases, with their values of the keys; below them the prices."""
    figure = Figure(figsize=(8.4, 6.6), dpi=150, layout="constrained")
    _head(figure, result)
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(2.4, 1.0))
    found = result.details["fronts"]
    colours = matplotlib.colormaps["viridis"](np.linspace(0.0, 0.9, len(found)))
    keys, units = list(result.configuration["parameters"]), result.details["units"]
    for (number, axes), colour in zip(found.items(), colours, strict=True):
        point = result.details["points"][int(number) - 1]
        label = ", ".join(
            f"{key} = {_text(_short(value))} {units.get(key, '')}".rstrip()
            for key, value in zip(keys, point, strict=True)
        )
        x, *others = (result.arrays[f"case {number}/{axis['key']}"].values for axis in axes)
        for panel, values in zip((top, bottom), others, strict=True):
            panel.plot(x, values, "o-", ms=3, lw=1, color=colour, label=label)
    across, up, price = next(iter(found.values()))
    label_axes(top, "", f"{up['title']} [{up['unit']}]", fit=False)
    below = f"{across['title']} [{across['unit']}]"
    label_axes(bottom, below, f"price\n[{price['unit']}]", fit=False)
    legend_below(figure, top, min(len(found), 3))
    return figure


def heat_map(result: Result, parameters: Sequence[Parameter], quantities: Sequence[str]) -> Figure:
    """Quantities over two keys, a cell for each case; grey where there is no solution."""
    figure, panels = _panels(result, len(quantities), 4.4)
    first, second = parameters[0], parameters[1]
    x, y = np.unique(first.values), np.unique(second.values)
    for panel, name in zip(panels, quantities, strict=True):
        cells = np.full((y.size, x.size), np.nan)
        at = np.searchsorted(y, second.values), np.searchsorted(x, first.values)
        cells[at] = result.arrays[name].values
        panel.set_facecolor(LACKING)
        drawn = panel.pcolormesh(_edges(x, first), _edges(y, second), cells, cmap="viridis")
        bar = figure.colorbar(drawn, ax=panel)
        bar.set_label(_label(result, name))
        first.along(panel)
        second.along(panel, vertical=True)
        panel.set_xlabel(first.label)
        panel.set_ylabel(second.label)
        # all that are least: of cases that differ by rounding none is the better one
        finite = cells[np.isfinite(cells)]
        reach = np.abs(finite).max(initial=0.0) * SAME
        rows, columns = np.nonzero(cells <= finite.min(initial=np.inf) + reach)
        panel.plot(x[columns], y[rows], "*", ms=11, mfc="w", mec="k", mew=0.7)
    panels[0].set_title("star: minimum; grey: no solution", fontsize=8)
    return figure


def _edges(centres: Array, parameter: Parameter) -> Array:
    """Edges of cells around values."""
    spaced = np.log(centres) if parameter.logarithmic else centres
    middles = (spaced[1:] + spaced[:-1]) / 2
    edges = np.concatenate([[2 * spaced[0] - middles[0]], middles, [2 * spaced[-1] - middles[-1]]])
    return np.exp(edges) if parameter.logarithmic else edges


def tornado(result: Result, quantities: Sequence[str]) -> Figure:
    """The change of a quantity by each key alone, from its value in the base study."""
    rows = list(result.configuration["parameters"])
    figure, panels = _panels(result, len(quantities), 1.8 + 0.42 * len(rows))
    cases = result.details["points"]
    for panel, name in zip(panels, quantities, strict=True):
        values = result.arrays[name].values
        if not math.isfinite(values[0]):
            _say_no_middle(panel, _label(result, name))
            continue

        bars = []
        for place, key in enumerate(rows):
            own = [n for n, point in enumerate(cases) if point[place] is not None]
            known = [(values[n], _text(_short(cases[n][place]))) for n in own]
            bars.append((key, [item for item in known if math.isfinite(item[0])]))
        # the longest bar is at the top, which gives the figure its name
        bars.sort(key=lambda bar: _reach(bar[1], values[0]))
        for height, (_, known) in enumerate(bars):
            for value, _ in known:
                colour = COLOURS[0] if value <= values[0] else COLOURS[1]
                panel.barh(height, value - values[0], left=values[0], height=0.55, color=colour)
            _name_ends(panel, height, values[0], known)

        panel.axvline(values[0], color="k", lw=0.8)
        units = result.details["units"]
        names = [f"{key} [{units[key]}]" if key in units else key for key, _ in bars]
        panel.set_yticks(range(len(bars)), names)
        label_axes(panel, _label(result, name), "", fit=False)
        panel.margins(x=0.18)
    return figure


def _name_ends(panel: Axes, height: float, base: float, known: Sequence[tuple[float, str]]) -> None:
    """Write at each end of a bar which values of the key have led there."""
    for side, sign in (("right", -1), ("left", 1)):
        there = sorted(item for item in known if (item[0] > base) == (sign > 0))
        if not there:
            continue
        panel.annotate(
            ", ".join(text for _, text in there),
            (there[-1 if sign > 0 else 0][0], height),
            xytext=(3 * sign, 0),
            textcoords="offset points",
            ha=side,
            va="center",
            fontsize=7,
        )


def _short(value: Any) -> Any:
    return f"{value:.4g}" if isinstance(value, float) else value


def _reach(known: Sequence[tuple[float, str]], base: float) -> float:
    return max((abs(value - base) for value, _ in known), default=0.0)


def points(result: Result, parameters: Sequence[Parameter], quantities: Sequence[str]) -> Figure:
    """Quantities of all cases against each key."""
    columns, rows = min(len(parameters), 4), len(quantities)
    figure = Figure(figsize=(3.6 * columns + 0.6, 3.0 * rows + 0.6), dpi=150, layout="constrained")
    _head(figure, result)
    grid = figure.subplots(rows, columns, squeeze=False, sharey="row")
    for row, name in zip(grid, quantities, strict=True):
        values = result.arrays[name].values
        for panel, parameter in zip(row, parameters, strict=False):
            panel.plot(parameter.values, values, "o", ms=3, color=COLOURS[0], alpha=0.7)
            _mark_lacking(panel, parameter.values[~np.isfinite(values)])
            parameter.along(panel)
            label_axes(panel, parameter.label, "", fit=False)
        row[0].set_ylabel(_label(result, name))
    return figure


def _say_no_middle(panel: Axes, label: str) -> None:
    """The text in place of the bars if the base study has no solution."""
    panel.set_axis_off()
    words = f"{label}:\nthe base study has no solution,\nso no case can be compared with it"
    panel.text(0.5, 0.5, words, ha="center", va="center", transform=panel.transAxes, fontsize=9)


def indices(result: Result) -> Figure:
    """Shares of each quantity's variance that the keys cause, with their intervals."""
    found = result.details["sobol_indices"]
    figure, panels = _panels(result, len(found), 3.8)
    for panel, (name, shares) in zip(panels, found.items(), strict=True):
        keys = list(shares["first"])
        for shift, part, label in ((-0.19, "first", "alone"), (0.19, "total", "with interactions")):
            panel.bar(
                np.arange(len(keys)) + shift,
                list(shares[part].values()),
                0.36,
                yerr=list(shares[f"{part}_interval"].values()),
                capsize=3,
                color=COLOURS[0] if part == "first" else COLOURS[1],
                label=label,
            )
        panel.set_xticks(range(len(keys)), keys)
        label_axes(panel, "", "share of the variance (95 % interval)", fit=False)
        panel.set_title(result.details["titles"][name][0], fontsize=9)
    panels[0].legend(fontsize=8, frameon=False)
    return figure
