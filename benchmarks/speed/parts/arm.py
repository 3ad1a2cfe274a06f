"""The part "arm": a stage at the paper's pace, the big arm by 90 degrees, least peak torque."""

from __future__ import annotations

from collections.abc import Iterator

from benchmarks.parts import Measured, Setup
from benchmarks.speed.sweep import median_cells, sweep
from studies.common.console import Table

DURATIONS = (86.0,)  # [s]


def measure(setup: Setup) -> Iterator[Measured]:
    """Measure; see `BenchmarkPart`."""
    return sweep("arm", DURATIONS, setup)


def tables(record: Measured) -> list[Table]:
    """Return seconds and memory."""
    head = ("duration [s]", "solve [s]", "process [s]", "memory [MiB]", "converged")
    rows = []
    for row in record["rows"]:
        medians = median_cells(row, "whole", "process", "memory")
        rows.append((f"{row['value']:g}", *medians, row["failure"] or "yes"))
    note = "one solve on its first mesh (150 intervals), set-up and the engine's checks included."
    return [Table("Stage of the big arm on the reduced model, medians", head, rows, (note,))]


def draw(record: Measured) -> None:
    """Draw nothing: one number."""
