"""The race: A and B with every contestant's own mesh, medians of interleaved fresh processes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from studies.common.console import Table, number
from studies.speed.contestants import BASELINES, OURS, PEERS, Contestant
from studies.speed.setup import Record, Setup

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PROBLEMS = ("A", "B")
TITLES = {
    "A": "A: T = 140 s, |jerk| <= 124.2192/T^3, least peak acceleration 3.417562e-4 rad/s^2",
    "B": "B: T = 5 s, pulley friction 0.01, |jerk| <= 200/T^3, least peak rope force 44.53360 N",
}
REFERENCE = "rockit"
HEAD = (
    "contestant", "start", "solve", "verification", "process", "processor", "common check",
    "memory [MiB]", "end [rad]", "peak", "caps", "",
)  # fmt: skip
NOTES = (
    "seconds, medians; start: to the end of the imports; solve: statement, set-up, solve and",
    "refinement; verification: the tool's own, where it has one; process: all but verification;",
    "processor: processor time of all of it; common check: the one verifier of all rows, no part.",
    "right: ends within 1e-6 rad, peak between the nodes within 0.1 %, caps exceeded by <= 0.1 %.",
)


def taking_part(setup: Setup) -> tuple[Contestant, ...]:
    """The contestants."""
    return (OURS, *BASELINES, *(PEERS if setup.peers else ()))


def measure(setup: Setup) -> Iterator[Record]:
    """Run the race; see `Part`."""
    from studies.speed.race import Row, programs, race

    contestants = taking_part(setup)
    progress = setup.console.progress
    made = programs(contestants, setup.environments, progress)
    rows = [Row(problem, contestant) for problem in PROBLEMS for contestant in contestants]
    for state in race(rows, made, setup.repeats, setup.limit, progress):
        yield {"repeats": setup.repeats, "limit": setup.limit, "rows": [r.record() for r in state]}


def tables(record: Record) -> list[Table]:
    """One table for each problem, and the ratios."""
    found = []
    for problem in PROBLEMS:
        rows = [row for row in record["rows"] if row["problem"] == problem]
        found.append(Table(TITLES[problem], HEAD, [_cells(row) for row in rows], NOTES))
    return [*found, _ratios(record)]


def _cells(row: Record) -> tuple[str, ...]:
    medians, check = row["medians"], row["check"]
    found = ("-",) * 3
    if check is not None:
        found = (f"{check['miss']:+.0e}", f"{check['peak_error']:+.1e}", f"{check['excess']:.0e}")
    columns = ("start", "solve", "verification", "process", "processor", "common_check", "memory")
    return (
        row["title"],
        *(number(medians[column], 3) for column in columns),
        *found,
        "right" if row["right"] else f"not right: {row['why not']}",
    )


def _ratios(record: Record) -> Table:
    """Our row against the best right baseline, the fastest right peer, and rockit's against all."""
    head = ("ratio", *PROBLEMS)
    by_problem = [_ratios_of(record, problem) for problem in PROBLEMS]
    names = list(by_problem[0])
    return Table(
        "Ratios of medians", head,
        [(name, *(number(found[name], 3) for found in by_problem)) for name in names],
        ("a dash: one of the two is missing or not right.",),
    )  # fmt: skip


def _ratios_of(record: Record, problem: str) -> dict[str, float | None]:
    rows = [row for row in record["rows"] if row["problem"] == problem]
    right = {row["contestant"]: row["medians"] for row in rows if row["right"]}
    ours = right.get(OURS.name, {})
    base = [right[b.name] for b in BASELINES if b.name in right]
    peers = [right[p.name] for p in PEERS if p.name in right]
    solve = _least(base, "solve")
    found = {
        "our solve / best baseline's solve (aim: at most 2)": _over(ours.get("solve"), solve),
        "our verification / our solve (aim: at most 1)": _over(
            ours.get("verification"), ours.get("solve")
        ),
        "fastest peer's process / our process (aim: at least 4)": _over(
            _least(peers, "process"), ours.get("process")
        ),
    }
    reference = right.get(REFERENCE, {}).get("process")
    for baseline in BASELINES:
        name = f"{baseline.title}: process / {REFERENCE}'s"
        found[name] = _over(right.get(baseline.name, {}).get("process"), reference)
    return found


def _least(medians: Sequence[dict[str, Any]], column: str) -> float | None:
    return min((m[column] for m in medians), default=None)


def _over(above: float | None, below: float | None) -> float | None:
    return None if above is None or not below else above / below


def draw(record: Record) -> Figure:
    """Stacked bars: start, solve, verification of each contestant."""
    from studies.speed.plots import bars

    return bars(record["rows"], TITLES)
