"""The part "modules": problem B in 140 s with more and more modules, on a fixed mesh."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from benchmarks.parts import Measured, Setup
from benchmarks.speed.parts.growth import per_interval
from benchmarks.speed.sweep import median, median_cells, sweep
from studies.common.console import Table, number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MODULES = (6, 12, 24, 50, 100, 300, 1000)
INTERVALS = 100  # as in `child.modules`


def measure(setup: Setup) -> Iterator[Measured]:
    """Measure; see `BenchmarkPart`."""
    return sweep("modules", MODULES, setup)


def tables(record: Measured) -> list[Table]:
    """Return seconds against modules."""
    head = (
        "modules",
        "unknowns",
        "set-up [s]",
        "solve [s]",
        "iterations",
        "ms per iteration",
        "memory [MiB]",
        "",
    )
    title = f"Problem B in 140 s, friction 0.24/modules, {INTERVALS} intervals, medians"
    note = "the trusses differ, and so do the iterations; the program's size does not."
    return [Table(title, head, [_cells(row) for row in record["rows"]], (note,))]


def _cells(row: Measured) -> tuple[str, ...]:
    return (
        str(row["value"]),
        *median_cells(row, "unknowns", digits=6),
        *median_cells(row, "set_up", "solve", "iterations"),
        number(_milliseconds_an_iteration(row), 3),
        *median_cells(row, "memory"),
        row["failure"],
    )


def _milliseconds_an_iteration(row: Measured) -> float | None:
    each = per_interval(row)
    return 1e3 * INTERVALS * each if each else None


def draw(record: Measured) -> Figure:
    """Draw set-up and time per iteration."""
    from benchmarks.speed.plots import panels

    rows = [row for row in record["rows"] if row["runs"]]
    modules = [row["value"] for row in rows]
    set_up = [median(row, "set_up") for row in rows]
    each = [_milliseconds_an_iteration(row) or math.nan for row in rows]
    return panels(
        f"Problem B in 140 s, {INTERVALS} intervals",
        "modules",
        {
            "set-up [s]": {"": (modules, set_up)},
            "solve [ms per iteration]": {"": (modules, each)},
        },
    )
