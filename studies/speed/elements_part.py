"""Growth with ANCF elements: the single pendulum, 1.3 s of motion, one local tolerance."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from studies.common.console import Table, number
from studies.speed.setup import Record, Setup
from studies.speed.sweep import median, shown, sweep

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ELEMENTS = (4, 8, 16, 32, 64)


def measure(setup: Setup) -> Iterator[Record]:
    """Measure; see `Part`."""
    return sweep("elements", ELEMENTS, setup)


def _each(row: Record) -> float | None:
    """Seconds per step."""
    solve, steps = median(row, "solve"), median(row, "steps")
    return solve / steps if solve and steps else None


def tables(record: Record) -> list[Table]:
    """Seconds against elements."""
    head = ("elements", "coordinates", "time [s]", "with set-up [s]", "steps", "ms per step",
            "energy drift", "memory [MiB]", "")  # fmt: skip
    rows = []
    for row in record["rows"]:
        each = _each(row)
        rows.append((
            str(row["value"]), *shown(row, "unknowns", "solve", "whole"),
            *shown(row, "steps", digits=6), number(each and 1e3 * each, 3),
            *shown(row, "drift", digits=2), *shown(row, "memory"), row["failure"],
        ))  # fmt: skip
    note = (
        "drift: relative to the largest kinetic energy; more elements vibrate faster: more steps."
    )
    return [Table("Single pendulum of ANCF elements, 1.3 s, medians", head, rows, (note,))]


def draw(record: Record) -> Figure:
    """Seconds, and per step."""
    from studies.speed.plots import panels

    rows = [row for row in record["rows"] if row["runs"]]
    n = [row["value"] for row in rows]
    return panels(
        "Single pendulum swinging for 1.3 s",
        "ANCF elements",
        {
            "computing time [s]": {"": (n, [median(row, "solve") for row in rows])},
            "computing time [ms per step]": {
                "": (n, [1e3 * (_each(row) or math.nan) for row in rows])
            },
        },
    )
