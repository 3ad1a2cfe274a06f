"""Work and precision: the cheapest fixed mesh beside the engine, on large problems.

With --stated only what answers to a loose accuracy and of stopped solves say of themselves.
"""

from __future__ import annotations

import argparse
import json
import math
import signal
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.entry import answer_for, closest, positive
from benchmarks.large.problems import PROBLEMS, Large
from ocp import FixedMesh, OcpError, Radau, Settings, Solution, solve
from ocp.progress import Progress
from studies.common.console import Console, Table
from studies.common.exit_codes import StudyError

ACCURACIES = (1e-3, 1e-4)
BUDGET = 150  # iterations, which end most solves on the way
MESHES = (20, 40, 80, 160, 320, 640)
STATED = ("free-flying robot", "orbit transfer", "quadrotor")  # whose solves are stopped


class Work(NamedTuple):
    """What an answer took.

    Attributes
    ----------
    how : str
        What gave it.
    seconds : float
        Of the processor.
    error : float
        Of the objective, relative to the best one known, and of the replay of a fixed mesh; nan
        without an answer.
    stated : float
        What it says that it is accurate to; nan if it says nothing.
    meshes : str
        Intervals and iterations of each: the first starts cold, the others from the one before.
    words : str
        Of the verdict or the error.
    cold : str
        Iterations of the last mesh from the guess, where they are asked for.
    """

    how: str
    seconds: float
    error: float
    stated: float
    meshes: str
    words: str
    cold: str = ""


def fixed(problem: Large) -> Iterator[Work]:
    """Uniform meshes of degree 3, each solved once from the guess, until one is right to 1e-4."""
    for intervals in MESHES:
        once = Settings(scheme=Radau(3), intervals=intervals, refinement=FixedMesh(3))
        stated, begin = problem.make(), time.process_time()
        try:
            found = solve(stated, settings=once)
            seconds = time.process_time() - begin
            # its replay is worked out when it is asked for, and not counted
            error, words = max(problem.error(found.objective), found.verification.miss), ""
        except OcpError as failure:
            seconds = time.process_time() - begin
            error, words = math.nan, f"{type(failure).__name__}: {failure}"
        yield Work(f"{intervals} intervals", seconds, error, math.nan, "", words)
        if error <= min(ACCURACIES):
            return


def engine(
    problem: Large,
    settings: Settings,
    how: str,
    progress: Progress | None = None,
    *,
    cold: bool = False,
) -> Work:
    """The engine from the same guess, its verification included; its last mesh also `cold`."""
    begin = time.process_time()
    try:
        found = solve(problem.make(), settings=settings, progress=progress)
    except OcpError as failure:
        words = f"{type(failure).__name__}: {failure}"
        return Work(how, time.process_time() - begin, math.nan, math.nan, "", words)
    seconds = time.process_time() - begin
    error = problem.error(found.objective)
    meshes = ", ".join(f"{m.intervals}: {m.iterations}" for m in found.mesh_iterations)
    again = _cold(problem, found, settings) if cold else ""
    return Work(how, seconds, error, found.accuracy, meshes, found.verdict, again)


def _cold(problem: Large, found: Solution, settings: Settings) -> str:
    """Iterations of the last mesh of an answer from the guess, to the same tolerance."""
    once = Settings(accuracy=settings.accuracy, refinement=FixedMesh(), seconds=settings.seconds)
    try:
        return str(solve(problem.make(), settings=once, mesh=found.mesh).iterations)
    except OcpError as failure:
        return type(failure).__name__


def stopped(problem: Large) -> Iterator[Work]:
    """Answers to a loose accuracy, after Ctrl-C, and of a spent budget."""
    yield engine(problem, Settings(accuracy=1e-3), "accuracy=0.001")
    yield engine(problem, Settings(), "Ctrl-C in mesh 3", stop_late)
    yield engine(problem, Settings(iterations=BUDGET), f"{BUDGET} iterations")


def stop_late(line: str) -> None:
    """Ctrl-C in the third mesh iteration."""
    if "mesh iteration 3 " in line and line.partition(", iteration ")[2].startswith("0,"):
        signal.raise_signal(signal.SIGINT)


def table(name: str, rows: Sequence[Work]) -> Table:
    """All answers to a problem; those that say to be better than they are count."""
    lines = [
        (
            row.how,
            f"{row.seconds:.1f}",
            f"{row.error:.0e}",
            f"{row.stated:.0e}",
            row.meshes,
            row.cold,
            row.words[:90],
        )
        for row in rows
    ]
    head = ("how", "processor s", "error", "says", "intervals: iterations", "cold", "words")
    return Table(name, head, lines, (f"errors that are larger than stated: {understated(rows)}",))


def understated(rows: Sequence[Work]) -> int:
    """How many answers are further from the best value than they say."""
    return sum(row.error > row.stated for row in rows)


def ratios(rows: Sequence[Work], accuracy: float, how: str) -> str:
    """Time of the engine by that of the cheapest fixed mesh that is right to an accuracy."""
    least = min((r.seconds for r in rows if not r.stated >= 0 and r.error <= accuracy), default=0.0)
    (taken,) = (r.seconds for r in rows if r.how == how)
    return f"{taken / least:.1f}" if least else "-"


def _keep(path: Path, name: str, rows: Sequence[Work]) -> None:
    """Write what a problem took beside what the file holds of others."""
    known = json.loads(path.read_text("utf-8")) if path.is_file() else {}
    known[name] = [row._asdict() for row in rows]
    path.write_text(json.dumps(known, indent=1) + "\n", "utf-8")


def _run(options: argparse.Namespace, console: Console) -> int:
    seconds = positive("--seconds", options.seconds)
    for name in options.problems:
        if name not in PROBLEMS:
            raise StudyError(f"there is no problem {name!r}; {closest(name, PROBLEMS)}")
    lines, wrong = [], 0
    if options.stated:
        for name in options.problems or STATED:
            rows = list(stopped(PROBLEMS[name]))
            console.say(table(f"{name}: {PROBLEMS[name].source}", rows))
            wrong += understated(rows)
        return 1 if wrong else 0

    for name in options.problems or PROBLEMS:
        problem = PROBLEMS[name]
        rows = list(fixed(problem))
        asked: list[tuple[str, dict[str, Any]]] = [
            (f"accuracy={a:g}", {"accuracy": a, "seconds": seconds}) for a in ACCURACIES
        ]
        for how, keywords in [*asked, ("defaults", {})]:
            rows.append(engine(problem, Settings(**keywords), how, cold=bool(keywords)))
            console.progress(f"{name}, {how}: {rows[-1].seconds:.1f} s")
        wrong += understated(rows)
        if options.output:
            _keep(Path(options.output), name, rows)
        console.say(table(f"{name}: {problem.source}", rows))
        hows = [*((f"accuracy={a:g}", a) for a in ACCURACIES), ("defaults", min(ACCURACIES))]
        lines.append((name, *(ratios(rows, a, how) for how, a in hows)))
    head = ("problem", *(f"accuracy={a:g}" for a in ACCURACIES), "defaults")
    title = "Time by that of the cheapest fixed mesh that is as right (defaults: right to 1e-4)"
    console.say(Table(title, head, lines))
    return 1 if wrong else 0


def main(arguments: Sequence[str] | None = None) -> int:
    """Solve large problems on fixed meshes and by the engine, and print what each took."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.large", description=__doc__)
    parser.add_argument("problems", nargs="*", metavar="NAME", help=f"of {', '.join(PROBLEMS)}")
    parser.add_argument(
        "--seconds", default="120", metavar="S", help="budget of a solve with a stated accuracy"
    )
    parser.add_argument(
        "--stated",
        action="store_true",
        help="only accuracy=1e-3, a spent budget and Ctrl-C, and how accurate answers say they are",
    )
    parser.add_argument(
        "--output",
        metavar="FILE.json",
        help="keep the rows there, which the documents' picture reads",
    )
    return answer_for(parser, _run, arguments)


if __name__ == "__main__":
    sys.exit(main())
