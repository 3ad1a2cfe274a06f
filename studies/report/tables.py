"""The tables of a page, from a result."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from markupsafe import Markup

from studies import registry
from studies.common.columns import flat
from studies.common.comparison_table import TableRow
from studies.common.console import number
from studies.common.parameters import ParameterLine, stated_parameters
from studies.common.result import Result
from studies.common.study import placed

_BROKEN = Markup('<span class="broken">{}</span>')


@dataclass(frozen=True)
class PageTable:
    """A table of a page, whose first column names its rows.

    Attributes
    ----------
    caption, head, rows : of texts.
    key : name of the file that its CSV button saves.
    notes : sentences below it.
    bold : rows that are, by their places.
    texts : columns of words, by their places.
    numbered : whether its rows are, and many.
    """

    caption: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    key: str
    notes: Sequence[str] = ()
    bold: Sequence[int] = ()
    texts: Sequence[int] = ()
    numbered: bool = False


def caps(result: Result) -> PageTable:
    """All caps of the study."""
    capped = [row for row in result.table if row.cap is not None]
    rows = [(row.title, row.unit, number(row.cap, 6)) for row in capped]
    return PageTable("Caps that hold at all times", ("quantity", "unit", "cap"), rows, "caps")


def parameters(result: Result) -> PageTable:
    """Every parameter of the model with its source."""
    rows = [
        (
            line.name,
            line.meaning,
            line.unit,
            number(line.value, 6) if isinstance(line.value, float) else str(line.value),
            line.source,
        )
        for line in _parameter_lines(result)
    ]
    head = ("parameter", "meaning", "unit", "value", "source")
    return PageTable("Parameters of the model", head, rows, "parameters", texts=(1, 4))


def _parameter_lines(result: Result) -> list[ParameterLine]:
    """The parameters as the mechanism has them, or else all keys of the study's own tables."""
    study, mechanism = registry.study_of(result.kind), registry.mechanism_of(result.kind)
    if mechanism is not None and mechanism.parameters is not None:
        lines: list[ParameterLine] = placed(mechanism.parameters)(result.configuration)
        return lines
    tables = {} if study is None else study.tables()
    values = result.configuration
    return [
        line
        for name, kind in tables.items()
        for line in stated_parameters(kind, values.get(name, {}) if name else values)
    ]


def quantities(result: Result) -> PageTable:
    """All quantities of all laws."""
    capped = any(row.cap is not None for row in result.table)
    bounded = any(row.bound is not None for row in result.table)
    head = ["quantity", "unit", *result.laws, *["cap"] * capped, *["bound"] * bounded]
    rows = [_row(row, result, capped, bounded) for row in result.table]
    bold = [place for place, row in enumerate(result.table) if row.minimised]
    notes = []
    if bold:
        notes.append("In bold: what is minimised.")
    if bounded:
        notes.append(
            "Bound: proven lower bound of each row. No single motion need reach all bounds."
        )
    if any(row.broken_by for row in result.table):
        notes.append("A value with ! exceeds a cap, so this law is not used for comparison.")
    return PageTable("All quantities", head, rows, "quantities", notes, bold)


def _row(row: TableRow, result: Result, capped: bool, bounded: bool) -> list[str]:
    cells: list[str] = [row.title, row.unit]
    for law in result.laws:
        value = number(row.values.get(law), 6)
        cells.append(_BROKEN.format(f"{value} !") if law in row.broken_by else value)
    return [*cells, *[number(row.cap, 6)] * capped, *[number(row.bound, 6)] * bounded]


def checks(result: Result) -> PageTable:
    """What was checked by other means."""
    rows = [
        (
            check.name,
            check.unit,
            number(check.value, 6),
            number(check.limit, 6),
            "passed" if check.passed else _BROKEN.format("FAILED"),
        )
        for check in result.checks
    ]
    return PageTable("Checks", ("check", "unit", "value", "limit", ""), rows, "checks")


def of_the_search(result: Result) -> list[PageTable]:
    """How exact the result is, and how its search went."""
    engine = result.details.get("engine")
    rounds = engine.get("rounds") if isinstance(engine, Mapping) else None
    accuracy = result.details.get("accuracy")
    found = (
        _leaf_table(accuracy, "Accuracy", "accuracy") if isinstance(accuracy, Mapping) else None,
        _records(result.details.get("starts"), "Starts of the search", "starts"),
        _records(result.details.get("rounds"), "Rounds", "rounds"),
        _records(rounds, "Mesh iterations of the best start", "mesh"),
    )
    return [one for one in found if one is not None]


def further(result: Result, key: str, title: str) -> list[PageTable] | None:
    """Tables that some results have, such as load cases or margins."""
    found = result.details.get(key)
    if isinstance(found, Mapping):
        made = _leaf_table(found, title, key)
    else:
        made = _records(found, title, key)
    return None if made is None else [made]


def versions(result: Result) -> PageTable:
    """What the result was made with."""
    return _pairs("Made by", flat(result.provenance).items(), "versions")


def _pairs(caption: str, pairs: Iterable[tuple[str, Any]], key: str) -> PageTable:
    return PageTable(caption, ("what", "value"), [(name, str(one)) for name, one in pairs], key)


def _leaf_table(content: Mapping[str, Any], title: str, key: str) -> PageTable | None:
    """A table of all that a nested mapping holds; none if that is nothing."""
    pairs = [(name, _shown(value)) for name, value in _leaves(content)]
    return _pairs(title, pairs, key) if content else None


def _records(found: Any, title: str, key: str) -> PageTable | None:
    """A table of a list of records; none if it is no such list."""
    if not (isinstance(found, list) and found and all(isinstance(one, Mapping) for one in found)):
        return None
    names = list(dict.fromkeys(name for one in found for name in one))
    rows = [
        [str(k), *(_shown(one.get(name), 4) for name in names)]
        for k, one in enumerate(found, start=1)
    ]
    head = ["", *(name.replace("_", " ") for name in names)]
    return PageTable(title, head, rows, key, numbered=True)


def _leaves(content: Mapping[str, Any], head: str = "") -> list[tuple[str, Any]]:
    found: list[tuple[str, Any]] = []
    for key, value in content.items():
        name = f"{head}{key}".replace("_", " ")
        found += _leaves(value, f"{name}: ") if isinstance(value, Mapping) else [(name, value)]
    return found


def _shown(value: Any, digits: int = 6) -> str:
    if value is None:
        return "–"
    if isinstance(value, float):
        return number(value, digits) if math.isfinite(value) else "–"
    if isinstance(value, list):
        return ", ".join(_shown(item, digits) for item in value)
    return str(value)
