"""The arm's stage at the paper's pace: the big arm by 90 degrees in 86 s, least peak torque."""

from __future__ import annotations

from collections.abc import Iterator

from studies.common.console import Table
from studies.speed.setup import Record, Setup
from studies.speed.sweep import shown, sweep

DURATIONS = (86.0,)  # [s]


def measure(setup: Setup) -> Iterator[Record]:
    """Measure; see `Part`."""
    return sweep("arm", DURATIONS, setup)


def tables(record: Record) -> list[Table]:
    """Seconds and memory."""
    head = ("duration [s]", "solve [s]", "process [s]", "memory [MiB]", "converged")
    rows = [
        (f"{row['value']:g}", *shown(row, "whole", "process", "memory"),
         row["failure"] or "yes")
        for row in record["rows"]
    ]  # fmt: skip
    note = "one solve on its first mesh (150 intervals), set-up and the engine's checks included."
    return [Table("Stage of the big arm on the reduced model, medians", head, rows, (note,))]


def draw(record: Record) -> None:
    """No figure: one number."""
