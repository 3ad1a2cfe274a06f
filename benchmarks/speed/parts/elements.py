"""The part "elements": growth with ANCF elements, 1.3 s of the single pendulum, one tolerance."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from benchmarks.parts import Measured, Setup
from benchmarks.speed.sweep import median, median_cells, sweep
from studies.common.console import Table, number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ELEMENTS = (4, 8, 16, 32, 64)


def measure(setup: Setup) -> Iterator[Measured]:
    """Measure; see `BenchmarkPart`."""
    return sweep("elements", ELEMENTS, setup)


def tables(record: Measured) -> list[Table]:
    """Return the seconds against elements."""
    head = (
        "elements",
        "coordinates",
        "time [s]",
        "with set-up [s]",
        "steps",
        "ms per step",
        "energy drift",
        "memory [MiB]",
        "",
    )
    note = (
        "drift: relative to the largest kinetic energy; more elements vibrate faster: more steps."
    )
    rows = [_cells(row) for row in record["rows"]]
    return [Table("Single pendulum of ANCF elements, 1.3 s, medians", head, rows, (note,))]


def _cells(row: Measured) -> tuple[str, ...]:
    step = _milliseconds_a_step(row)
    return (
        str(row["value"]),
        *median_cells(row, "unknowns", "solve", "whole"),
        *median_cells(row, "steps", digits=6),
        number(step, 3),
        *median_cells(row, "drift", digits=2),
        *median_cells(row, "memory"),
        row["failure"],
    )


def _milliseconds_a_step(row: Measured) -> float | None:
    solve, steps = median(row, "solve"), median(row, "steps")
    return 1e3 * solve / steps if solve and steps else None


def draw(record: Measured) -> Figure:
    """Draw the seconds, and those per step."""
    from benchmarks.speed.plots import panels

    rows = [row for row in record["rows"] if row["runs"]]
    elements = [row["value"] for row in rows]
    whole = [median(row, "solve") for row in rows]
    each = [_milliseconds_a_step(row) or math.nan for row in rows]
    return panels(
        "Single pendulum swinging for 1.3 s",
        "ANCF elements",
        {
            "computing time [s]": {"": (elements, whole)},
            "computing time [ms per step]": {"": (elements, each)},
        },
    )
