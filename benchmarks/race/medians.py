"""The part "race": A and B on every contestant's own mesh, medians of interleaved processes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from benchmarks.parts import Measured, Setup
from benchmarks.race.contestants import BASELINES, OURS, PEERS, PROBLEMS
from benchmarks.race.runs import measured
from studies.common.console import Table, number

TITLES = {
    "A": "A: T = 140 s, |jerk| <= 124.2192/T^3, least peak acceleration 3.417562e-4 rad/s^2",
    "B": "B: T = 5 s, pulley friction 0.01, |jerk| <= 200/T^3, least peak rope force 44.53360 N",
}
SECONDS = ("start", "solve", "verification", "process", "processor", "common check")
NOTES = (
    "seconds, medians; start: to the end of the imports; solve: statement, set-up, solve and",
    "refinement; verification: the tool's own, where it has one; process: all but verification;",
    "processor: processor time of all of it; common check: the one verifier of all rows, no part.",
    "right: ends within 1e-6 rad, peak between the nodes within 0.1 %, caps exceeded by <= 0.1 %.",
)


def measure(setup: Setup) -> Iterator[Measured]:
    """Run the race, each on its own mesh; see `BenchmarkPart`."""
    return measured(setup, setup.repeats, lambda problem, contestant: (0,))


def tables(record: Measured) -> list[Table]:
    """Return one table for each problem, and the ratios."""
    head = ("contestant", *SECONDS, "memory [MiB]", "end [rad]", "peak", "caps", "")
    by_problem = []
    for problem in PROBLEMS:
        rows = [_cells(row) for row in record["rows"] if row["problem"] == problem]
        by_problem.append(Table(TITLES[problem], head, rows, NOTES))
    return [*by_problem, _ratio_table(record)]


def _cells(row: Measured) -> tuple[str, ...]:
    columns = (*(name.replace(" ", "_") for name in SECONDS), "memory")
    return (
        row["title"],
        *(number(row["medians"][column], 3) for column in columns),
        *error_cells(row["check"]),
        "right" if row["right"] else f"not right: {row['why not']}",
    )


def error_cells(check: Mapping[str, Any] | None) -> tuple[str, str, str]:
    """Return miss of the end, error of the peak and excess of a cap; dashes without a check."""
    if check is None:
        return ("-", "-", "-")
    return (f"{check['miss']:+.0e}", f"{check['peak_error']:+.1e}", f"{check['excess']:.0e}")


def _ratio_table(record: Measured) -> Table:
    by_problem = [_ratios(record, problem) for problem in PROBLEMS]
    rows = [(name, *(number(ratios[name], 3) for ratios in by_problem)) for name in by_problem[0]]
    note = "a dash: one of the two is missing or not right."
    return Table("Ratios of medians", ("ratio", *PROBLEMS), rows, (note,))


def _ratios(record: Measured, problem: str) -> dict[str, float | None]:
    """Ours to the best right baseline and the fastest right peer."""
    right = {
        row["contestant"]: row["medians"]
        for row in record["rows"]
        if row["problem"] == problem and row["right"]
    }
    ours = right.get(OURS.name, {})
    baselines = [right[b.name] for b in BASELINES if b.name in right]
    peers = [right[p.name] for p in PEERS if p.name in right]

    return {
        "our solve / best baseline's solve (aim: at most 2)": _quotient(
            ours.get("solve"), _least(baselines, "solve")
        ),
        "our verification / our solve (aim: at most 1)": _quotient(
            ours.get("verification"), ours.get("solve")
        ),
        "fastest peer's process / our process (aim: at least 4)": _quotient(
            _least(peers, "process"), ours.get("process")
        ),
    }


def _least(medians: Iterable[Mapping[str, Any]], column: str) -> float | None:
    return min((m[column] for m in medians), default=None)


def _quotient(above: float | None, below: float | None) -> float | None:
    return None if above is None or not below else above / below
