"""Measurements of our own code over a list of values, in turn, each a fresh process."""

from __future__ import annotations

import statistics
import sys
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from benchmarks.parts import Measured, Setup
from benchmarks.processes import FreshProcess
from benchmarks.records import ROOT
from studies.common.console import number

LONGEST = 900.0  # [s], the least limit of the runs of a sweep


def child(kind: str) -> FreshProcess:
    """Return the process that measures one thing, see `benchmarks.speed.process.child`."""
    command = (sys.executable, "-m", "benchmarks.speed.process.child", kind)
    return FreshProcess(command, {"PYTHONPATH": str(ROOT)})


def sweep(
    kind: str, values: Sequence[Any], setup: Setup, repeats: int | None = None
) -> Iterator[Measured]:
    """Measure `kind` at all values in turn, several times; a failure is not repeated.

    Each record has `rows`: value, runs (what the child wrote, with the whole process's seconds)
    and failure.
    """
    limit, process = max(setup.limit, LONGEST), child(kind)
    rows: list[dict[str, Any]] = [{"value": v, "runs": [], "failure": ""} for v in values]
    for turn in range(repeats or setup.repeats):
        for row in rows:
            if row["failure"]:
                continue
            answered = process.run(row["value"], limit=limit)
            ended, row["failure"] = answered.ended, answered.failure
            if answered.answer is not None:
                seconds = {"process": ended.seconds, "processor": ended.processor}
                row["runs"].append({**answered.answer, **seconds})

            outcome = answered.failure or f"{ended.seconds:.1f} s"
            setup.console.progress(f"{kind} {row['value']}, run {turn + 1}: {outcome}")
            yield {"kind": kind, "limit": limit, "rows": rows}


def median(row: Mapping[str, Any], name: str) -> float | None:
    """Return the median of a number over the runs of a row."""
    values = [run[name] for run in row["runs"]]
    return statistics.median(values) if values else None


def first(row: Mapping[str, Any], name: str) -> Any:
    """Return what the first run says, of what does not change from run to run."""
    return row["runs"][0][name] if row["runs"] else None


def median_cells(row: Mapping[str, Any], *names: str, digits: int = 3) -> list[str]:
    """Return medians as cells of a table."""
    return [number(median(row, name), digits) for name in names]
