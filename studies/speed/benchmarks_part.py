"""A pass over the problems with known optima, default settings, each a fresh process."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from studies.common.console import Table, number
from studies.speed.setup import Record, Setup
from studies.speed.sweep import first, median, shown, sweep

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def measure(setup: Setup) -> Iterator[Record]:
    """Measure each problem once; see `Part`."""
    from studies.benchmarks.catalogue import CATALOGUE

    return sweep("benchmark", tuple(CATALOGUE), setup, repeats=1)


def tables(record: Record) -> list[Table]:
    """Seconds of each problem, and in total."""
    head = (
        "problem",
        "solve [s]",
        "rounds",
        "iterations",
        "intervals",
        "error",
        "memory [MiB]",
        "",
    )
    rows = [
        (str(row["value"]), *shown(row, "seconds"),
         *("-" if not row["runs"] or first(row, key) is None else str(first(row, key))
           for key in ("rounds", "iterations", "intervals")),
         "-" if first(row, "error") is None else f"{first(row, 'error'):+.0e}",
         *shown(row, "memory"),
         row["failure"] or ("right" if first(row, "passed") else "not right"))
        for row in record["rows"]
    ]  # fmt: skip
    seconds = [median(row, "seconds") for row in record["rows"]]
    total = sum(s for s in seconds if s is not None)
    measured = sum(s is not None for s in seconds)
    rows.append((f"total of {measured}", number(total, 4), *[""] * 6))
    note = "solve: statement to verified solution, without start and imports; one run each."
    return [Table("Problems with known optima, default settings", head, rows, (note,))]


def draw(record: Record) -> Figure:
    """A bar for each problem."""
    from studies.speed.plots import labelled_bars

    rows = [row for row in record["rows"] if row["runs"]]
    return labelled_bars(
        "Problems with known optima",
        [row["value"] for row in rows],
        [median(row, "seconds") or 0.0 for row in rows],
        "seconds to a verified solution",
    )
