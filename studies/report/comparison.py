"""Two results compared on one page."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from studies.common.charts import TIME, Chart, ChartAxis, Curve
from studies.common.columns import flat
from studies.common.console import number
from studies.common.result import Result
from studies.report.html import document
from studies.report.page import Shown, payload, shown
from studies.report.tables import PageTable

SHARE = ChartAxis("share", "share of the duration", "%")  # durations may differ by far


def beside(results: Sequence[Result], names: Sequence[str]) -> str:
    """The page of two results, each called by the name of its folder."""
    names = [f"{name} ({'AB'[k]})" for k, name in enumerate(names)]
    whats = [shown(result) for result in results]
    charts = _together(results, whats, names)
    laws = tuple(dict.fromkeys(curve.law for chart in charts for curve in chart.curves))
    what = Shown(laws, charts, None)
    return document(
        "beside.html",
        f"{names[0]} compared with {names[1]}",
        payload(what),
        results=list(zip(names, results, strict=True)),
        shown=what,
        quantities=_quantities(results, names),
        differences=_settings(results, names),
    )


def _own(result: Result) -> dict[str, tuple[str, str, float]]:
    """Title, unit and value of each quantity of the result's own law."""
    own = next(iter(result.laws), "")
    return {
        row.key: (row.title, row.unit, row.values[own]) for row in result.table if own in row.values
    }


def _quantities(results: Sequence[Result], names: Sequence[str]) -> PageTable:
    first, second = map(_own, results)
    rows = []
    for key in dict.fromkeys((*first, *second)):
        title, unit, _ = first.get(key) or second[key]
        pair = [side[key][2] if key in side else None for side in (first, second)]
        rows.append((title, unit, *(number(value, 6) for value in pair), _change(*pair)))
    return PageTable(
        "The law of each result", ("quantity", "unit", *names, "B relative to A"), rows, "beside"
    )


def _change(first: float | None, second: float | None) -> str:
    if first is None or second is None or not abs(first) > 0.0 or second != second:
        return "–"
    change = 100 * (second / first - 1)
    return "the same" if abs(change) < 1e-4 else f"{change:+.3g} %"


def _together(
    results: Sequence[Result], whats: Sequence[Shown], names: Sequence[str]
) -> tuple[Chart, ...]:
    """Charts that both have, each with the own law of both."""
    first, second = ({chart.key: chart for chart in what.charts} for what in whats)
    charts = []
    for key, chart in first.items():
        if (
            key not in second
            or second[key].unit != chart.unit
            or TIME not in chart.curves[0].places
        ):
            continue
        curves: list[Curve] = []
        for other, result, name in zip((chart, second[key]), results, names, strict=True):
            own = next(iter(result.laws), "")
            mine = [curve for curve in other.curves if curve.law == own] or list(other.curves[:1])
            curves += [_shared(curve, name) for curve in mine]
        axes = chart.axes if chart.path else (SHARE, *chart.axes)
        charts.append(dataclasses.replace(chart, axes=axes, curves=tuple(curves), levels=()))
    return tuple(charts)


def _shared(curve: Curve, name: str) -> Curve:
    """The curve under the name of its result, also over the share of its own duration."""
    places = dict(curve.places)
    if TIME in places:
        places[SHARE.key] = 100 * places[TIME] / places[TIME][-1]
    return dataclasses.replace(curve, law=name, places=places)


def _settings(results: Sequence[Result], names: Sequence[str]) -> PageTable:
    """The settings that differ."""
    both = [flat(result.configuration) for result in results]
    keys = dict.fromkeys(key for one in both for key in one)
    rows = [(key, *(str(one.get(key, "–")) for one in both)) for key in keys]
    rows = [row for row in rows if row[1] != row[2]]
    return PageTable("Settings", ("setting", *names), rows, "settings")
