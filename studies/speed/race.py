"""Problems A and B: every contestant as a fresh process, in turn, and its control verified."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from time import perf_counter
from typing import Any

from studies.speed.contestants import Contestant
from studies.speed.environments import NotInstalled, python_of
from studies.speed.fresh import Program
from studies.speed.verify import Check, check

COLUMNS = (
    "start", "solve", "verification", "process", "processor", "common_check", "memory",
)  # fmt: skip


@dataclass
class Row:
    """The runs of one contestant on one problem.

    Attributes
    ----------
    runs : of each run the seconds in `COLUMNS`: from start to the end of imports; statement,
        set-up, solve and refinement; the tool's own verification (None where it has none); the
        whole process without that; its processor time, all included; the common verifier's; and
        the peak memory [MiB].
    check : of the last run.
    failure : why there are no runs.
    note : the tool's own words.
    """

    problem: str
    contestant: Contestant
    size: int = 0
    runs: list[dict[str, float | None]] = field(default_factory=list)
    check: Check | None = None
    failure: str = ""
    note: str = ""

    @property
    def right(self) -> bool:
        """Whether the last answer is right, and no run failed."""
        return not self.failure and self.check is not None and self.check.right

    def median(self, column: str) -> float | None:
        """Median of a column, or None."""
        values = [v for run in self.runs if (v := run[column]) is not None]
        return statistics.median(values) if values else None

    def record(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "problem": self.problem,
            "contestant": self.contestant.name,
            "title": self.contestant.title,
            "size": self.size,
            "right": self.right,
            "why not": self.failure or (self.check.reason if self.check else "not measured"),
            "medians": {column: self.median(column) for column in COLUMNS},
            "runs": self.runs,
            "check": asdict(self.check) if self.check else None,
            "note": self.note,
        }


def programs(
    contestants: Sequence[Contestant],
    environments: Path,
    progress: Callable[[str], None],
) -> Mapping[str, Program | str]:
    """The program of each contestant by name, or why there is none."""
    found: dict[str, Program | str] = {}
    for contestant in contestants:
        try:
            python = None
            if contestant.peer:
                progress(f"{contestant.title}: environment")
                python = python_of(contestant, environments)
            found[contestant.name] = contestant.program(python)
        except NotInstalled as error:
            found[contestant.name] = str(error)
            progress(f"{contestant.title}: {error}")
    return found


def once(row: Row, program: Program | str, limit: float) -> None:
    """Run a contestant once more and add what was found to its row."""
    if isinstance(program, str):
        row.failure = program
        return
    done = program.run(row.problem, row.size, limit=limit)
    if done.answer is None:
        row.failure = done.failure
        return
    answer, begin = done.answer, perf_counter()
    try:
        row.check = check(row.problem, answer)
    except ValueError as error:  # a control that cannot be replayed
        row.failure = f"not to be replayed: {error}"
        return
    own = answer["verification"]
    row.note = answer["note"]
    row.runs.append({
        "start": answer["imported"] - done.started,
        "solve": answer["solved"] - answer["imported"],
        "verification": own,
        "process": done.seconds - (own or 0.0),
        "processor": done.processor,
        "common_check": perf_counter() - begin,
        "memory": answer["memory"],
    })  # fmt: skip


def race(
    rows: Sequence[Row],
    programs: Mapping[str, Program | str],
    repeats: int,
    limit: float,
    progress: Callable[[str], None],
) -> Iterator[Sequence[Row]]:
    """Run all rows in turn, `repeats` times; what fails or is not right is run only once."""
    for turn in range(repeats):
        for row in rows:
            if turn and not row.right:
                continue
            once(row, programs[row.contestant.name], limit)
            progress(f"{row.problem}, {row.contestant.title}, run {turn + 1}: {_said(row)}")
            yield rows


def _said(row: Row) -> str:
    if row.failure or not row.runs or row.check is None:
        return row.failure
    verdict = "right" if row.check.right else row.check.reason
    return f"{row.runs[-1]['process']:.2f} s, {verdict}"
