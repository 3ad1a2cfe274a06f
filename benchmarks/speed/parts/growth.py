"""The part "growth": problem B on fixed uniform meshes of more and more intervals."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from benchmarks.parts import Measured, Setup
from benchmarks.speed.sweep import first, median, median_cells, sweep
from studies.common.console import Table, number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INTERVALS = (100, 300, 1000, 3000, 5000, 10_000, 20_000)


def measure(setup: Setup) -> Iterator[Measured]:
    """Measure; see `BenchmarkPart`."""
    return sweep("growth", INTERVALS, setup)


def per_interval(row: Measured) -> float | None:
    """Return the processor seconds of the solve per interval and iteration."""
    solve, iterations = median(row, "solve"), first(row, "iterations")
    return solve / first(row, "intervals") / iterations if solve and iterations else None


def memory_per_interval(row: Measured) -> float | None:
    """Return the peak memory above that of the imports, per interval [KiB]."""
    peak, base = median(row, "memory"), median(row, "imports")
    return None if peak is None or base is None else 1024 * (peak - base) / row["value"]


def tables(record: Measured) -> list[Table]:
    """Return seconds and memory against intervals."""
    head = (
        "intervals",
        "unknowns",
        "rows",
        "set-up [s]",
        "solve [s]",
        "iterations",
        "us per interval and iteration",
        "set-up / solve",
        "memory [MiB]",
        "above imports, KiB an interval",
        "",
    )
    title = "Problem B on fixed uniform meshes (degree 4), no refinement, medians"
    note = "seconds of processor time; set-up: statement to functions; solve: IPOPT."
    return [Table(title, head, [_cells(row) for row in record["rows"]], (note,))]


def _cells(row: Measured) -> tuple[str, ...]:
    each, set_up, solve = per_interval(row), median(row, "set_up"), median(row, "solve")
    status = row["failure"] or str(first(row, "status"))
    return (
        str(row["value"]),
        *median_cells(row, "unknowns", "rows", digits=7),
        *median_cells(row, "set_up", "solve", "iterations"),
        number(each and 1e6 * each, 3),
        number(set_up / solve if set_up and solve else None, 2),
        *median_cells(row, "memory"),
        number(memory_per_interval(row), 3),
        "" if status == "Solve_Succeeded" else status,
    )


def draw(record: Measured) -> Figure:
    """Draw seconds per interval and iteration, set-up beside solve, and memory."""
    from benchmarks.speed.plots import panels

    rows = [row for row in record["rows"] if row["runs"]]
    intervals = [row["value"] for row in rows]

    # A solve without iterations has no time per iteration: a gap, not a zero.
    each = [1e6 * (per_interval(row) or math.nan) for row in rows]
    set_up = [median(row, "set_up") for row in rows]
    solve = [median(row, "solve") for row in rows]
    memory = [median(row, "memory") for row in rows]
    return panels(
        "Problem B on fixed uniform meshes",
        "intervals",
        {
            "solve [µs per interval and iteration]": {"": (intervals, each)},
            "processor time [s]": {"set-up": (intervals, set_up), "solve": (intervals, solve)},
            "peak memory [MiB]": {"": (intervals, memory)},
        },
    )
