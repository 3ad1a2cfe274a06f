"""The part "benchmarks": the problems with known optima, default settings, a process each."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from benchmarks.parts import Measured, Setup
from benchmarks.speed.sweep import first, median, median_cells, sweep
from studies.common.console import Table, number

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def measure(setup: Setup) -> Iterator[Measured]:
    """Measure each problem once; see `BenchmarkPart`."""
    from benchmarks.optima.problems import CATALOGUE

    return sweep("benchmark", tuple(CATALOGUE), setup, repeats=1)


def tables(record: Measured) -> list[Table]:
    """Return the seconds of each problem, and in total."""
    counts = ("rounds", "iterations", "intervals")
    head = ("problem", "solve [s]", *counts, "error", "memory [MiB]", "")
    rows = [_cells(row, counts) for row in record["rows"]]

    measured = [s for row in record["rows"] if (s := median(row, "seconds")) is not None]
    total = (f"total of {len(measured)}", number(sum(measured), 4))
    rows.append((*total, *[""] * (len(head) - len(total))))
    note = "solve: statement to verified solution, without start and imports; one run each."
    return [Table("Problems with known optima, default settings", head, rows, (note,))]


def _cells(row: Measured, counts: tuple[str, ...]) -> tuple[str, ...]:
    error = first(row, "error")
    return (
        str(row["value"]),
        *median_cells(row, "seconds"),
        *("-" if (count := first(row, key)) is None else str(count) for key in counts),
        "-" if error is None else f"{error:+.0e}",
        *median_cells(row, "memory"),
        row["failure"] or ("right" if first(row, "passed") else "not right"),
    )


def draw(record: Measured) -> Figure:
    """Draw a bar for each problem."""
    from benchmarks.speed.plots import labelled_bars

    rows = [row for row in record["rows"] if row["runs"]]
    names = [row["value"] for row in rows]
    seconds = [median(row, "seconds") or 0.0 for row in rows]
    return labelled_bars(
        "Problems with known optima", names, seconds, "seconds to a verified solution"
    )
