"""The parts "states" and "phases": default settings on problems of growing size.

Whole answers are timed, each in a fresh process: refinement, replay and certificate. Larger
problems may take more mesh iterations, so the seconds of the solve are also divided by the work
done, which is the sum of iterations times intervals over the mesh iterations. `... size KIND NUMBER
FILE` measures one.
"""

from __future__ import annotations

import json
import statistics
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from time import process_time
from typing import Any

from benchmarks.parts import Measured, Setup
from benchmarks.processes import FreshProcess
from benchmarks.race.rows.row import memory
from benchmarks.records import ROOT
from benchmarks.speed.size_problems import heated_rod, slalom
from ocp import Problem, certify, solve
from studies.common.console import Table, number

LONGEST = 900.0  # [s], the least limit of a run
KINDS = {"states": heated_rod, "phases": slalom}


@dataclass(frozen=True)
class Size:
    """A part: one problem at several sizes.

    Attributes
    ----------
    kind : of `KINDS`; also what grows.
    title : of the table.
    values : the sizes.
    """

    kind: str
    title: str
    values: tuple[int, ...]

    def measure(self, setup: Setup) -> Iterator[Measured]:
        """Measure all sizes in turn, several times; a failure is not repeated.

        Each row has its value, runs (what `solve_whole` gives, and the memory [MiB]) and failure.
        """
        command = (sys.executable, "-m", "benchmarks.speed.size", self.kind)
        process = FreshProcess(command, {"PYTHONPATH": str(ROOT)})
        limit = max(setup.limit, LONGEST)
        rows: list[dict[str, Any]] = [{"value": v, "runs": [], "failure": ""} for v in self.values]
        for turn in range(setup.repeats):
            for row in (row for row in rows if not row["failure"]):
                answered = process.run(row["value"], limit=limit)
                row["failure"] = answered.failure
                if answered.answer is not None:
                    row["runs"].append(answered.answer)
                outcome = answered.failure or f"{answered.seconds:.1f} s"
                setup.console.progress(f"{self.kind} {row['value']}, run {turn + 1}: {outcome}")
                yield {"kind": self.kind, "limit": limit, "rows": rows}

    def tables(self, record: Measured) -> list[Table]:
        """Return seconds, work and memory against the size."""
        head = (
            self.kind,
            "unknowns",
            "intervals",
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


def _cells(row: Measured) -> tuple[str, ...]:
    if not row["runs"]:
        return (str(row["value"]), *("-",) * 9, row["failure"])
    sizes = ("unknowns", "intervals", "rounds", "iterations")
    solved = _median(row, "solve")
    return (
        str(row["value"]),
        *(number(_median(row, name), 6) for name in sizes),
        number(solved, 3),
        number(1e3 * solved / _median(row, "work"), 3),
        number(_median(row, "certificate"), 3),
        number(_median(row, "memory"), 4),
        "yes" if row["runs"][0]["certified"] else "NO",
        row["failure"],
    )


def _median(row: Measured, name: str) -> float:
    return float(statistics.median(run[name] for run in row["runs"]))


def solve_whole(problem: Problem) -> dict[str, Any]:
    """Default settings: refinement, replay and certificate, each with its processor seconds."""
    begin, imported = process_time(), memory()
    solution = solve(problem)
    solved = process_time()
    certificate = certify(solution)
    rounds = solution.mesh_iterations
    return {
        "solve": solved - begin,
        "certificate": process_time() - solved,
        "certified": certificate.passed,
        "rounds": len(rounds),
        "intervals": rounds[-1].intervals,
        "unknowns": int(solution.kept_iterate.x.size),
        "iterations": sum(entry.iterations for entry in rounds),
        "work": sum(entry.iterations * entry.intervals for entry in rounds),
        "objective": solution.objective,
        "imports": imported,
        "memory": memory(),
    }


STATES = Size("states", "Heated rod of any number of states", (10, 20, 40, 100))
PHASES = Size("phases", "Run through gates in any number of phases", (2, 5, 10, 20))


def main() -> None:
    """Measure and write."""
    kind, value, path = sys.argv[1:]
    Path(path).write_text(json.dumps(solve_whole(KINDS[kind](int(value)))), "utf-8")


if __name__ == "__main__":
    main()
