"""The table of a sweep, from its files: one row a case, and the result that every command has."""

from __future__ import annotations

import csv
import dataclasses
import io
import math
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ocp.arrays import Array
from studies.common.comparison_table import TableRow
from studies.common.folder import provenance
from studies.common.result import Criterion, Result, Series, Verdict
from studies.sweep.cases.plan import Plan
from studies.sweep.cases.store import CaseStore, DamagedCase
from studies.sweep.config import as_dictionary
from studies.sweep.subjects import subject, units

ANSWERED = ("solved", "infeasible", "refused")  # what a case may end with and be an answer
FILE, FRONTS = "cases.csv", "fronts.csv"


@dataclass(frozen=True, eq=False)
class CaseTable:
    """What came of all cases.

    Attributes
    ----------
    statuses, reasons, verdicts : of each case; "missing" where there is no file.
    keys : names of their files.
    quantities : values of each case, shape (cases,), nan where it has none.
    titles : name and unit of each quantity.
    seconds : that each case took [s], shape (cases,).
    minimised : quantities that are objectives.
    fronts : of cases that are fronts, by the numbers of the cases: titles and units of their
        columns, and these.
    """

    statuses: list[str]
    reasons: list[str]
    verdicts: list[str]
    keys: list[str]
    quantities: dict[str, Array]
    titles: dict[str, tuple[str, str]]
    seconds: Array
    minimised: tuple[str, ...]
    fronts: dict[int, Mapping[str, Any]]


def tabulate(plan: Plan, store: CaseStore) -> CaseTable:
    """Read the files of all cases of a plan."""
    count, present = len(plan.cases), store.keys()
    table = CaseTable([], [], [], [], {}, {}, np.full(count, np.nan), (), {})
    minimised: dict[str, None] = {}
    for case in plan.cases:
        record: Mapping[str, Any] = {"status": "missing"}
        if case.key in present:
            try:
                record = store.read(case.key)
            except DamagedCase as damage:
                record = {"status": "missing", "reason": str(damage)}
        table.statuses.append(record["status"])
        table.reasons.append(record.get("reason", ""))
        table.verdicts.append(record.get("verdict", ""))
        table.keys.append(case.key)
        table.seconds[case.number] = _number(record.get("seconds"))
        minimised |= dict.fromkeys(record.get("minimised", ()))
        if record["status"] == "solved" and "front" in record:
            table.fronts[case.number] = record["front"]
        for name, value in record.get("values", {}).items():
            if name not in table.quantities:
                table.quantities[name] = np.full(count, np.nan)
                table.titles[name] = tuple(record["titles"][name])
            # an answer that failed a check is told by its status, and is no value
            if record["status"] == "solved":
                table.quantities[name][case.number] = _number(value)
    return dataclasses.replace(table, minimised=tuple(minimised))


def _number(value: Any) -> float:
    return math.nan if value is None else float(value)


def columns(plan: Plan, table: CaseTable) -> dict[str, list[Any]]:
    """All columns of the tidy table, by their heads; a value that is not there is None."""
    units = _units(plan)
    found: dict[str, list[Any]] = {"case": [case.number + 1 for case in plan.cases]}
    for place, axis in enumerate(plan.study.parameters):
        unit = units.get(axis.key, "")
        head = f"{axis.key} [{unit}]" if unit else axis.key
        found[head] = [case.point[place] for case in plan.cases]
    found |= {"status": table.statuses, "verdict": table.verdicts}
    for name, values in table.quantities.items():
        found[f"{name} [{table.titles[name][1]}]"] = _stated(values)
    found |= {"seconds [s]": _stated(table.seconds), "file": table.keys, "reason": table.reasons}
    return found


def _units(plan: Plan) -> dict[str, str]:
    """Units of the keys that vary."""
    keys = [axis.key for axis in plan.study.parameters]
    return units(subject(plan.study.subject)[0], keys)


def _stated(values: Array) -> list[Any]:
    return [None if value != value else value for value in values.tolist()]


def as_csv(content: Mapping[str, list[Any]]) -> str:
    """The tidy table as CSV; a list or table of a study stands in one cell."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\r\n")
    writer.writerow(content)
    for row in zip(*content.values(), strict=True):
        writer.writerow("" if v is None else repr(v) if isinstance(v, float) else v for v in row)
    return text.getvalue()


def front_columns(plan: Plan, table: CaseTable) -> dict[str, list[Any]]:
    """The points of all fronts by the heads of their columns, each with its case; empty of none."""
    found: dict[str, list[Any]] = {}
    known = columns(plan, table)
    heads = ["case", *list(known)[1 : 1 + len(plan.study.parameters)]]
    for number, front in table.fronts.items():
        points = front["points"]
        count = len(points[front["axes"][0]["key"]])
        for head in heads:
            found.setdefault(head, []).extend([known[head][number]] * count)
        for axis in front["axes"]:
            found.setdefault(f"{axis['key']} [{axis['unit']}]", []).extend(points[axis["key"]])
    return found


def write_parquet(content: Mapping[str, list[Any]], path: Path) -> None:
    """The tidy table as Parquet; a key whose values are of several kinds is text there."""
    import pyarrow
    from pyarrow import parquet

    arrays = {}
    for head, values in content.items():
        kinds = {type(value) for value in values if value is not None}
        plain = kinds <= {int, float} or kinds in ({str}, {bool}, set())
        arrays[head] = pyarrow.array(
            values if plain else [None if value is None else str(value) for value in values],
            type=pyarrow.float64() if kinds == {int, float} else None,
        )
    parquet.write_table(pyarrow.table(arrays), path)


def result_of(plan: Plan, table: CaseTable, interrupted: bool, remarks: tuple[str, ...]) -> Result:
    """The result of a sweep: its quantities along the cases, and how many have an answer."""
    indices, of_indices = _indices(plan, table)

    return Result(
        kind="sweep",
        question=plan.study.question,
        configuration=as_dictionary(plan.study),
        arrays=dict(_series(plan, table)),
        table=tuple(_rows(table)),
        verdict=_verdict(table),
        checks=(_answers(table),),
        remarks=(
            *remarks,
            *of_indices,
            *_not_shown(plan, table),
            *_failures(table),
        ),
        details={
            "statuses": table.statuses,
            "minimised": list(table.minimised),
            "titles": {name: list(title) for name, title in table.titles.items()},
            "units": _units(plan),
            "points": [list(case.point) for case in plan.cases],
            "version": plan.version.name,
            "fronts": {number + 1: front["axes"] for number, front in table.fronts.items()},
            **({"sobol_indices": indices} if indices else {}),
        },
        provenance=provenance(),
        interrupted=interrupted,
    )


def _indices(plan: Plan, table: CaseTable) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Sobol indices where the cases were drawn for them, and what to say of them."""
    if plan.study.sampling != "sobol-indices":
        return {}, ()
    from studies.sweep.indices import sobol_indices

    keys = [axis.key for axis in plan.study.parameters]
    asked = [name for name in plan.study.show if name in table.quantities]
    names = asked or table.minimised or table.quantities
    chosen = {name: table.quantities[name] for name in names}
    found, sentence = sobol_indices(keys, chosen, plan.study.seed)
    return found, (sentence,) if sentence else ()


def _series(plan: Plan, table: CaseTable) -> Iterator[tuple[str, Series]]:
    numbers = np.arange(1.0, len(plan.cases) + 1)
    yield "case", Series("1", "case", numbers, "number of the case")
    for name, values in table.quantities.items():
        title, unit = table.titles[name]
        yield name, Series(unit, "case", values, title)
    yield "seconds", Series("s", "case", table.seconds, "time that the case took")
    for number, front in table.fronts.items():
        head, axes = f"case {number + 1}/", front["axes"]
        for axis in axes:
            values = np.array(front["points"][axis["key"]], dtype=float)
            along = f"{head}{axes[0]['key']}"
            yield f"{head}{axis['key']}", Series(axis["unit"], along, values, axis["title"])


def _rows(table: CaseTable) -> Iterator[TableRow]:
    """Least, median and greatest of each quantity."""
    for name, values in table.quantities.items():
        known = values[np.isfinite(values)]
        if not known.size:
            continue
        spread = {
            "least": float(known.min()),
            "median": float(np.median(known)),
            "greatest": float(known.max()),
        }
        title, unit = table.titles[name]
        yield TableRow(name, title, unit, spread, minimised=name in table.minimised)


def _verdict(table: CaseTable) -> Verdict:
    """How sure the sweep is: as sure as its least sure case."""
    solved = [v for v, s in zip(table.verdicts, table.statuses, strict=True) if s == "solved"]
    counts = Counter(table.statuses)
    others = ", ".join(f"{count} {name}" for name, count in counts.items() if name != "solved")
    sentence = f"{counts['solved']} of {len(table.statuses)} cases are solved and verified"
    if others:
        sentence += f" ({others})"
    if not solved:
        return Verdict("none", f"{sentence}; the reasons are in {FILE}")
    kinds = Counter(solved)
    sentence += ": " + ", ".join(f"{count} {kind}" for kind, count in kinds.items())
    sure = all(kind == "global" for kind in solved)
    measured = all(kind == "measured" for kind in solved)
    return Verdict("global" if sure else "measured" if measured else "local", sentence)


def _answers(table: CaseTable) -> Criterion:
    without = [status for status in table.statuses if status not in ANSWERED]
    return Criterion("cases without an answer", "", len(without), 0.0, not without)


def _not_shown(plan: Plan, table: CaseTable) -> Iterator[str]:
    """The quantities for figures that no case has."""
    for name in plan.study.show:
        if name not in table.quantities and table.quantities:
            yield f"show names {name}, which no case has; they have {', '.join(table.quantities)}."


def _failures(table: CaseTable) -> Iterator[str]:
    """What kept cases from a solution, each reason once."""
    reasons = Counter(
        f"{status}: {reason}"
        for status, reason in zip(table.statuses, table.reasons, strict=True)
        if status not in ("solved", "missing")
    )
    for reason, count in reasons.most_common(5):
        yield f"{count} case{'s' if count > 1 else ''} {reason}"
    if len(reasons) > 5:
        yield f"{len(reasons) - 5} further reasons are in {FILE}"
