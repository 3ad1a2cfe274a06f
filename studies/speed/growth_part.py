"""Growth with the mesh: problem B on fixed uniform meshes, no refinement."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from studies.common.console import Table, number
from studies.speed.setup import Record, Setup
from studies.speed.sweep import first, median, shown, sweep

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INTERVALS = (100, 300, 1000, 3000, 5000, 10_000, 20_000)


def measure(setup: Setup) -> Iterator[Record]:
    """Measure; see `Part`."""
    return sweep("growth", INTERVALS, setup)


def per_interval(row: Mapping[str, Any]) -> float | None:
    """Processor seconds of the solve per interval and iteration."""
    solve, iterations = median(row, "solve"), first(row, "iterations")
    return solve / first(row, "intervals") / iterations if solve and iterations else None


def memory_per_interval(row: Mapping[str, Any]) -> float | None:
    """Peak memory above that of the imports, per interval [KiB]."""
    peak, base = median(row, "memory"), median(row, "imports")
    return None if peak is None or base is None else 1024 * (peak - base) / row["value"]


def tables(record: Record) -> list[Table]:
    """Seconds and memory against intervals."""
    head = (
        "intervals", "unknowns", "rows", "set-up [s]", "solve [s]", "iterations",
        "us per interval and iteration", "set-up / solve",
        "memory [MiB]", "above imports, KiB an interval", "",
    )  # fmt: skip
    return [
        Table(
            "Problem B on fixed uniform meshes (degree 4), no refinement, medians",
            head,
            [_cells(row) for row in record["rows"]],
            ("seconds of processor time; set-up: statement to functions; solve: IPOPT.",),
        )
    ]


def _cells(row: Mapping[str, Any]) -> tuple[str, ...]:
    each, set_up, solve = per_interval(row), median(row, "set_up"), median(row, "solve")
    status = row["failure"] or str(first(row, "status"))
    return (
        str(row["value"]),
        *shown(row, "unknowns", "rows", digits=7),
        *shown(row, "set_up", "solve", "iterations"),
        number(each and 1e6 * each, 3),
        number(set_up / solve if set_up and solve else None, 2),
        *shown(row, "memory"),
        number(memory_per_interval(row), 3),
        "" if status == "Solve_Succeeded" else status,
    )


def draw(record: Record) -> Figure:
    """Seconds per interval and iteration, set-up beside solve, memory."""
    from studies.speed.plots import panels

    rows = [row for row in record["rows"] if row["runs"]]
    n = [row["value"] for row in rows]
    return panels(
        "Problem B on fixed uniform meshes",
        "intervals",
        {
            "solve [µs per interval and iteration]": {
                "": (n, [1e6 * (per_interval(row) or math.nan) for row in rows])
            },
            "processor time [s]": {
                name: (n, [median(row, key) for row in rows])
                for name, key in (
                    ("set-up", "set_up"), ("solve", "solve"),
                )
            },
            "peak memory [MiB]": {"": (n, [median(row, "memory") for row in rows])},
        },
    )  # fmt: skip
