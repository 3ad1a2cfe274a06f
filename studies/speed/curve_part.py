"""Accuracy against time: every contestant on several meshes, a fresh process each."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from studies.common.console import Table, number
from studies.speed.race_part import PROBLEMS, TITLES, taking_part
from studies.speed.setup import Record, Setup

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def measure(setup: Setup) -> Iterator[Record]:
    """Run every contestant once on each of its meshes; see `Part`."""
    from studies.speed.race import Row, programs, race

    contestants = taking_part(setup)
    progress = setup.console.progress
    made = programs(contestants, setup.environments, progress)
    rows = [
        Row(problem, contestant, size)
        for problem in PROBLEMS
        for contestant in contestants
        for size in contestant.sizes[problem]
    ]
    for state in race(rows, made, 1, setup.limit, progress):
        yield {"limit": setup.limit, "rows": [r.record() for r in state]}


def tables(record: Record) -> list[Table]:
    """One table for each problem."""
    head = ("contestant", "size", "solve [s]", "process [s]", "end [rad]", "peak", "caps", "")
    return [
        Table(
            f"Accuracy against time, one run each. {TITLES[problem]}",
            head,
            [_cells(row) for row in record["rows"] if row["problem"] == problem],
            ("size: as each contestant's script says (intervals; ours: -log10 of a tolerance).",),
        )
        for problem in PROBLEMS
    ]


def _cells(row: Record) -> tuple[str, ...]:
    check = row["check"]
    found = ("-",) * 3
    if check is not None:
        found = (f"{check['miss']:+.0e}", f"{check['peak_error']:+.1e}", f"{check['excess']:.0e}")
    seconds = (number(row["medians"][column], 3) for column in ("solve", "process"))
    verdict = "right" if row["right"] else row["why not"]
    return (row["title"], str(row["size"]), *seconds, *found, verdict)


def draw(record: Record) -> Figure:
    """Error of the dense peak or excess of a cap, whichever is larger, against seconds."""
    from studies.speed.plots import curves

    return curves(record["rows"], TITLES)
