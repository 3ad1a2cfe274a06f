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
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from benchmarks.entry import answer_for, positive
from benchmarks.large.judgement import judged
from benchmarks.large.peer import NAME, motion_of, peer_process
from benchmarks.large.problems import PROBLEMS, Large
from benchmarks.large.work import (
    ACCURACIES,
    Work,
    answers_table,
    markdown,
    ratios_table,
    understated,
)
from benchmarks.processes import FreshProcess
from ocp import FixedMesh, OcpError, Radau, Settings, Solution, solve
from ocp.progress import Progress
from studies.common.configuration import closest
from studies.common.console import Console
from studies.common.exit_codes import StudyError

BUDGET = 150  # iterations, which end most solves on the way
MESHES = (20, 40, 80, 160, 320, 640)
STATED = ("free-flying robot", "orbit transfer", "quadrotor")  # whose solves are stopped


def fixed(problem: Large) -> Iterator[Work]:
    """Uniform meshes of degree 3, each solved once from the guess, until one is right to 1e-4."""
    for intervals in MESHES:
        once = Settings(scheme=Radau(3), intervals=intervals, refinement=FixedMesh(3))
        stated, begin = problem.make(), time.process_time()
        try:
            found = solve(stated, settings=once)
            seconds = time.process_time() - begin
            # its replay is not counted
            error, words = judged(problem, stated, found.objective, found.trajectory), ""
        except OcpError as failure:
            seconds = time.process_time() - begin
            error, words = math.nan, f"{type(failure).__name__}: {failure}"
        yield Work("fixed", f"{intervals} intervals", seconds, error, words=words)
        if error <= min(ACCURACIES):
            return


def by_peer(name: str, process: FreshProcess, limit: float) -> Iterator[Work]:
    """The same meshes by a peer, each within a limit [s]; what is late ends them."""
    problem = PROBLEMS[name]
    for intervals in MESHES:
        answered = process.run(name, intervals, limit=limit)
        found, words = answered.answer, answered.failure
        seconds, error = answered.processor, math.nan
        if found is not None:
            seconds, words = found["seconds"], found["failure"]
        if found is not None and not words:
            stated = problem.make()
            motion = motion_of(stated, found["phases"], intervals)
            error = judged(problem, stated, found["objective"], motion)
        yield Work("yapss", f"{intervals} intervals", seconds, error, words=words)
        if error <= min(ACCURACIES) or found is None:
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
    stated, begin = problem.make(), time.process_time()
    try:
        found = solve(stated, settings=settings, progress=progress)
    except OcpError as failure:
        seconds, words = time.process_time() - begin, f"{type(failure).__name__}: {failure}"
        return Work("engine", how, seconds, math.nan, words=words)
    seconds = time.process_time() - begin
    error = problem.error(found.objective)
    meshes = ", ".join(f"{m.intervals}: {m.iterations}" for m in found.mesh_iterations)
    again = _cold(problem, found, settings) if cold else ""
    return Work("engine", how, seconds, error, found.accuracy, meshes, found.verdict, again)


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


def answers(
    name: str, seconds: float, peer: FreshProcess | None, console: Console
) -> Iterator[Work]:
    """All answers to a problem: on fixed meshes, by the peer if there is one, by the engine."""
    problem = PROBLEMS[name]
    yield from fixed(problem)
    if peer is not None:
        yield from by_peer(name, peer, seconds)
    for accuracy in ACCURACIES:
        console.progress(f"{name}, accuracy={accuracy:g}")
        asked = Settings(accuracy=accuracy, seconds=seconds)
        yield engine(problem, asked, f"accuracy={accuracy:g}", cold=True)
    console.progress(f"{name}, defaults")
    yield engine(problem, Settings(), "defaults")


def _known(path: Path) -> dict[str, list[Work]]:
    """What a file holds of each problem."""
    kept = json.loads(path.read_text("utf-8")) if path.is_file() else {}
    return {name: [Work(**row) for row in rows] for name, rows in kept.items()}


def _write(path: Path, known: Mapping[str, Sequence[Work]]) -> None:
    kept = {name: [row._asdict() for row in rows] for name, rows in known.items()}
    path.write_text(json.dumps(kept, indent=1) + "\n", "utf-8")


def _run(options: argparse.Namespace, console: Console) -> int:
    seconds = positive("--seconds", options.seconds)
    for name in options.problems:
        if name not in PROBLEMS:
            raise StudyError(f"there is no problem {name!r}; {closest(name, PROBLEMS)}")
    if options.stated:
        wrong = 0
        for name in options.problems or STATED:
            rows = list(stopped(PROBLEMS[name]))
            console.say(answers_table(f"{name}: {PROBLEMS[name].source}", rows))
            wrong += understated(rows)
        return 1 if wrong else 0

    peer = peer_process() if options.peer else None
    # what a solve loads counts for none of them
    solve(PROBLEMS["rigid body"].make(), settings=Settings(accuracy=max(ACCURACIES)))

    path = Path(options.output) if options.output else None
    known, measured = _known(path) if path else {}, {}
    for name in options.problems or PROBLEMS:
        measured[name] = list(answers(name, seconds, peer, console))
        console.say(answers_table(f"{name}: {PROBLEMS[name].source}", measured[name]))
        if path:
            _write(path, known | measured)
    console.say(ratios_table(measured))
    console.say(f"rows of the documents' table:\n\n{markdown(known | measured)}")
    return 1 if any(understated(rows) for rows in measured.values()) else 0


def main(arguments: Sequence[str] | None = None) -> int:
    """Solve large problems on fixed meshes and by the engine, and print what each took."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.large", description=__doc__)
    parser.add_argument("problems", nargs="*", metavar="NAME", help=f"of {', '.join(PROBLEMS)}")
    parser.add_argument(
        "--seconds",
        default="120",
        metavar="S",
        help="budget of a solve with a stated accuracy, and of the peer's on each mesh",
    )
    parser.add_argument(
        "--peer", action="store_true", help=f"with {NAME}, installed on its own first"
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
