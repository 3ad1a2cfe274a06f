"""The parts "states" and "phases": default settings on problems of growing size.

Whole answers are timed: refinement, replay and certificate. Larger problems may take more rounds,
so the seconds of the solve are also divided by the work done, which is the sum of iterations times
intervals over the rounds.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from benchmarks.parts import Measured, Setup
from benchmarks.speed.sweep import first, median, median_cells, sweep
from studies.common.console import Table, number

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Size:
    """A part: one problem at several sizes.

    Attributes
    ----------
    kind : of the measurement in `benchmarks.speed.process.child`; also what grows.
    title : of table and figure.
    values : the sizes.
    """

    kind: str
    title: str
    values: tuple[int, ...]

    def measure(self, setup: Setup) -> Iterator[Measured]:
        """Measure; see `BenchmarkPart`."""
        return sweep(self.kind, self.values, setup)

    def tables(self, record: Measured) -> list[Table]:
        """Return seconds, work and memory against the size."""
        head = (
            self.kind,
            "unknowns",
            "rounds",
            "iterations",
            "solve [s]",
            "ms per interval and iteration",
            "certificate [s]",
            "memory [MiB]",
            "certified",
            "",
        )
        return [Table(f"{self.title}, medians", head, [_cells(row) for row in record["rows"]])]

    def draw(self, record: Measured) -> Figure:
        """Draw seconds, those for equal work, and memory."""
        from benchmarks.speed.plots import panels

        rows = [row for row in record["rows"] if row["runs"]]
        sizes = [row["value"] for row in rows]

        def curve(name: str) -> tuple[list[float], list[float | None]]:
            return sizes, [median(row, name) for row in rows]

        return panels(
            self.title,
            self.kind,
            {
                "computing time [s]": {
                    "solve": curve("solve"),
                    "certificate": curve("certificate"),
                },
                "solve [ms per interval and iteration]": {
                    "": (sizes, [_milliseconds(row) for row in rows])
                },
                "memory [MiB]": {"": curve("memory")},
            },
        )


def _cells(row: Measured) -> tuple[str, ...]:
    certified = first(row, "certified")
    return (
        str(row["value"]),
        *median_cells(row, "unknowns", "rounds", "iterations", digits=6),
        *median_cells(row, "solve"),
        number(_milliseconds(row), 3),
        *median_cells(row, "certificate", "memory"),
        "-" if certified is None else "yes" if certified else "NO",
        row["failure"],
    )


def _milliseconds(row: Measured) -> float:
    solve, work = median(row, "solve"), median(row, "work")
    return 1e3 * solve / work if solve and work else math.nan


STATES = Size("states", "Heated rod of any number of states", (10, 20, 40, 100))
PHASES = Size("phases", "Run through gates in any number of phases", (2, 5, 10, 20))
