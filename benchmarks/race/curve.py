"""The part "curve": accuracy against time, every contestant on several meshes."""

from __future__ import annotations

from collections.abc import Iterator

from benchmarks.parts import Measured, Setup
from benchmarks.race.contestants import PROBLEMS
from benchmarks.race.medians import TITLES, error_cells
from benchmarks.race.runs import measured
from studies.common.console import Table, number


def measure(setup: Setup) -> Iterator[Measured]:
    """Run every contestant once on each of its meshes; see `BenchmarkPart`."""
    return measured(setup, 1, lambda problem, contestant: contestant.sizes[problem])


def tables(record: Measured) -> list[Table]:
    """Return one table for each problem."""
    head = ("contestant", "size", "solve [s]", "process [s]", "end [rad]", "peak", "caps", "")
    note = "size: as each contestant's script says (intervals; ours: -log10 of a tolerance)."
    by_problem = []
    for problem in PROBLEMS:
        title = f"Accuracy against time, one run each. {TITLES[problem]}"
        rows = [_cells(row) for row in record["rows"] if row["problem"] == problem]
        by_problem.append(Table(title, head, rows, (note,)))
    return by_problem


def _cells(row: Measured) -> tuple[str, ...]:
    seconds = (number(row["medians"][column], 3) for column in ("solve", "process"))
    verdict = "right" if row["right"] else row["why not"]
    return (row["title"], str(row["size"]), *seconds, *error_cells(row["check"]), verdict)
