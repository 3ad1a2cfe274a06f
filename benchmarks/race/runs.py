"""Runs of the race: every contestant as a fresh process, in turn, and its control judged."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from time import perf_counter
from typing import Any

from benchmarks.parts import Measured, Setup
from benchmarks.processes import Answered, FreshProcess
from benchmarks.race.contestants import PROBLEMS, Contestant, taking_part
from benchmarks.race.environments import NotInstalled, python_of
from benchmarks.race.verifier import Judgement, judge

COLUMNS = ("start", "solve", "verification", "process", "processor", "common_check", "memory")

Progress = Callable[[str], None]
Processes = Mapping[str, FreshProcess | str]  # by contestant; a text says why there is none


@dataclass
class RaceRun:
    """A contestant on one problem, and its runs so far.

    Attributes
    ----------
    problem : str
    contestant : Contestant
    size : int
        Of the mesh; 0 is the contestant's own choice.
    runs : list
        Of each run the seconds in `COLUMNS`: from start to the end of imports; statement, set-up,
        solve and refinement; the tool's own verification (None where it has none); the whole
        process without that; its processor time, all included; the common verifier's; and the
        peak memory [MiB].
    judgement : Judgement or None
        Of the last run.
    failure : str
        Why there are no runs.
    note : str
        The tool's own words.
    """

    problem: str
    contestant: Contestant
    size: int = 0
    runs: list[dict[str, float | None]] = field(default_factory=list)
    judgement: Judgement | None = None
    failure: str = ""
    note: str = ""

    @property
    def right(self) -> bool:
        """Whether the last answer is right, and no run failed."""
        return not self.failure and self.judgement is not None and self.judgement.right

    def median(self, column: str) -> float | None:
        """Return the median of a column, or None."""
        values = [value for run in self.runs if (value := run[column]) is not None]
        return statistics.median(values) if values else None

    def record(self) -> dict[str, Any]:
        """Return what is kept as JSON."""
        return {
            "problem": self.problem,
            "contestant": self.contestant.name,
            "title": self.contestant.title,
            "size": self.size,
            "right": self.right,
            "why not": self.failure
            or (self.judgement.reason if self.judgement else "not measured"),
            "medians": {column: self.median(column) for column in COLUMNS},
            "runs": self.runs,
            "check": asdict(self.judgement) if self.judgement else None,
            "note": self.note,
        }


def measured(
    setup: Setup, repeats: int, sizes: Callable[[str, Contestant], Sequence[int]]
) -> Iterator[Measured]:
    """Run all who take part, on meshes of the sizes that each has for a problem."""
    contestants, progress = taking_part(setup.peers), setup.console.progress
    processes = processes_of(contestants, setup.environments, progress)
    entries = [
        RaceRun(problem, contestant, size)
        for problem in PROBLEMS
        for contestant in contestants
        for size in sizes(problem, contestant)
    ]
    for state in race(entries, processes, repeats, setup.limit, progress):
        rows = [entry.record() for entry in state]
        yield {"repeats": repeats, "limit": setup.limit, "rows": rows}


def processes_of(
    contestants: Sequence[Contestant], environments: Path, progress: Progress
) -> Processes:
    """Return the process of each contestant by name, or why there is none.

    The peers are installed first, each in an environment of its own below `environments`.
    """
    processes: dict[str, FreshProcess | str] = {}
    for contestant in contestants:
        try:
            python = None
            if contestant.peer:
                progress(f"{contestant.title}: environment")
                python = python_of(contestant, environments)
            processes[contestant.name] = contestant.process(python)
        except NotInstalled as error:  # a row that says so; the others still race
            processes[contestant.name] = str(error)
            progress(f"{contestant.title}: {error}")
    return processes


def race(
    entries: Sequence[RaceRun],
    processes: Processes,
    repeats: int,
    limit: float,
    progress: Progress,
) -> Iterator[Sequence[RaceRun]]:
    """Run all entries in turn, `repeats` times; what fails or is not right is run only once.

    Turns are interleaved, so that a machine that is busy for a while slows down all alike.
    """
    for turn in range(repeats):
        for entry in entries:
            if turn and not entry.right:
                continue
            run_once(entry, processes[entry.contestant.name], limit)
            title = entry.contestant.title
            progress(f"{entry.problem}, {title}, run {turn + 1}: {_outcome(entry)}")
            yield entries


def run_once(entry: RaceRun, process: FreshProcess | str, limit: float) -> None:
    """Run a contestant once more, and add its seconds and its judgement to the entry."""
    if isinstance(process, str):
        entry.failure = process
        return
    answered = process.run(entry.problem, entry.size, limit=limit)
    if answered.answer is None:
        entry.failure = answered.failure
        return

    begin = perf_counter()
    try:
        entry.judgement = judge(entry.problem, answered.answer)
    except ValueError as error:  # a control that cannot be replayed
        entry.failure = f"not to be replayed: {error}"
        return
    entry.note = answered.answer["note"]
    entry.runs.append(_columns(answered, answered.answer, perf_counter() - begin))


def _columns(
    answered: Answered, answer: Mapping[str, Any], common_check: float
) -> dict[str, float | None]:
    """The numbers in `COLUMNS` of one run.

    A verification of its own is a service that few contestants have. It is shown beside, and is
    no part of the process's seconds.
    """
    verification = answer["verification"]
    return {
        "start": answer["imported"] - answered.started,
        "solve": answer["solved"] - answer["imported"],
        "verification": verification,
        "process": answered.seconds - (verification or 0.0),
        "processor": answered.processor,
        "common_check": common_check,
        "memory": answer["memory"],
    }


def _outcome(entry: RaceRun) -> str:
    if entry.failure or not entry.runs or entry.judgement is None:
        return entry.failure
    verdict = "right" if entry.judgement.right else entry.judgement.reason
    return f"{entry.runs[-1]['process']:.2f} s, {verdict}"
