"""Growth with the number of modules: problem B in 140 s on a fixed mesh of 100 intervals."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from studies.common.console import Table, number
from studies.speed.growth_part import per_interval
from studies.speed.setup import Record, Setup
from studies.speed.sweep import median, shown, sweep

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MODULES = (6, 12, 24, 50, 100, 300, 1000)
INTERVALS = 100


def measure(setup: Setup) -> Iterator[Record]:
    """Measure; see `Part`."""
    return sweep("modules", MODULES, setup)


def tables(record: Record) -> list[Table]:
    """Seconds against modules."""
    head = ("modules", "unknowns", "set-up [s]", "solve [s]", "iterations",
            "ms per iteration", "memory [MiB]", "")  # fmt: skip
    rows = []
    for row in record["rows"]:
        each = per_interval(row)
        rows.append((
            str(row["value"]), *shown(row, "unknowns", digits=6),
            *shown(row, "set_up", "solve", "iterations"),
            number(each and 1e3 * INTERVALS * each, 3), *shown(row, "memory"), row["failure"],
        ))  # fmt: skip
    note = "the trusses differ, and so do the iterations; the program's size does not."
    return [
        Table(
            f"Problem B in 140 s, friction 0.24/modules, {INTERVALS} intervals, medians",
            head,
            rows,
            (note,),
        )
    ]


def draw(record: Record) -> Figure:
    """Set-up and time per iteration."""
    from studies.speed.plots import panels

    rows = [row for row in record["rows"] if row["runs"]]
    n = [row["value"] for row in rows]
    return panels(
        f"Problem B in 140 s, {INTERVALS} intervals",
        "modules",
        {
            "set-up [s]": {"": (n, [median(row, "set_up") for row in rows])},
            "solve [ms per iteration]": {
                "": (n, [1e3 * INTERVALS * (per_interval(row) or math.nan) for row in rows])
            },
        },
    )
