"""Measurements of our own code over a list of values, in turn, each a fresh process."""

from __future__ import annotations

import statistics
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import studies
from studies.common.console import number
from studies.speed.fresh import Program
from studies.speed.setup import Record, Setup

LONGEST = 900.0  # [s], the least limit of the runs of a sweep


def child(kind: str) -> Program:
    """The program that measures one thing, see `studies.speed.child`."""
    root = str(Path(studies.__file__).parents[1])
    return Program((sys.executable, "-m", "studies.speed.child", kind), {"PYTHONPATH": root})


def sweep(
    kind: str, values: Sequence[Any], setup: Setup, repeats: int | None = None
) -> Iterator[Record]:
    """Measure `kind` at all values in turn, several times; a failure is not repeated.

    Each record has `rows`: value, runs (what the child wrote, with the whole process's seconds)
    and failure.
    """
    limit, program = max(setup.limit, LONGEST), child(kind)
    rows: list[dict[str, Any]] = [{"value": v, "runs": [], "failure": ""} for v in values]
    count = repeats or setup.repeats
    for turn in range(count):
        for row in rows:
            if row["failure"]:
                continue
            done = program.run(row["value"], limit=limit)
            row["failure"] = done.failure
            if done.answer is not None:
                row["runs"].append(
                    {**done.answer, "process": done.seconds, "processor": done.processor}
                )
            said = done.failure or f"{done.seconds:.1f} s"
            setup.console.progress(f"{kind} {row['value']}, run {turn + 1}: {said}")
            yield {"kind": kind, "limit": limit, "rows": rows}


def median(row: Mapping[str, Any], name: str) -> float | None:
    """Median of a number over the runs of a row."""
    values = [run[name] for run in row["runs"]]
    return statistics.median(values) if values else None


def first(row: Mapping[str, Any], name: str) -> Any:
    """What the first run says, of what does not change from run to run."""
    return row["runs"][0][name] if row["runs"] else None


def shown(row: Mapping[str, Any], *names: str, digits: int = 3) -> list[str]:
    """Medians as cells."""
    return [number(median(row, name), digits) for name in names]
