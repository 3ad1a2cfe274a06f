"""The part "family": problem A for many jerk caps, each started from the one before.

Three things are timed, in seconds of the processor: the family alone; the refinement and the
verification of all its members; and cold solves of the same members with default settings. Of the
family alone, the time inside IPOPT is what IPOPT spends by itself and in the functions that it
evaluates. What Python adds to it, our watch over its iterations included, is not.
"""

from __future__ import annotations

import contextlib
import functools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from time import process_time
from typing import TYPE_CHECKING, Any
from unittest import mock

import numpy as np

from benchmarks.parts import Measured, Setup
from benchmarks.race.rows.problems import DURATION, END, JERK_CAP, START
from studies.common.console import Table, number

if TYPE_CHECKING:
    from ocp import Constant, Problem, Solution

MEMBERS = 100
LEAST, MOST = 0.5, 2.0  # caps, in those of A: with 0.385 of it a motion has no time for a plateau
OVERHEAD, FASTER = 1.3, 3.0  # what is asked for
AGREEMENT = 1e-5  # of two objectives, relative: the tolerance of a solve with default settings
TOLD = 10  # members between two lines of progress


@dataclass
class Inside:
    """Processor seconds inside IPOPT so far, and its iterations."""

    seconds: float = 0.0
    iterations: int = 0


def statement() -> tuple[Problem, Constant]:
    """Return problem A of the race with its jerk cap as a constant, and the constant."""
    from ocp import Constant, Control, Phase, Problem, State

    cap = Constant("jerk cap", "rad/s^3", JERK_CAP["A"])
    angle, speed = State("angle", "rad"), State("speed", "rad/s")
    acceleration = State("acceleration", "rad/s^2")
    jerk = Control("jerk", "rad/s^3", lower=-cap, upper=cap)
    phase = Phase(
        "deployment",
        dynamics={angle: speed, speed: acceleration, acceleration: jerk},
        initial={angle: START, speed: 0, acceleration: 0},
        final={angle: END, speed: 0, acceleration: 0},
        end=DURATION["A"],
    )
    return Problem("A", (phase,), minimise=phase.peak(acceleration, absolute=True)), cap


def caps(members: int) -> list[float]:
    """Return that many jerk caps [rad/s^3], with equal ratios."""
    return [float(value) for value in JERK_CAP["A"] * np.geomspace(LEAST, MOST, members)]


def optimum(cap: float) -> float:
    """Return the least peak acceleration [rad/s^2] in closed form.

    The jerk is at its cap or zero: ramps of slope `cap` and plateaus of ``a`` and ``-a``. Half the
    way takes half the time, so that ``D = (a T / 2) (T / 2 - a / cap)``.
    """
    duration, way = DURATION["A"], END - START
    root = math.sqrt(duration**2 / 4 - 8 * way / (duration * cap))
    return cap / 2 * (duration / 2 - root)


def measure(setup: Setup, members: int = MEMBERS) -> Iterator[Measured]:
    """Measure; see `BenchmarkPart`."""
    from ocp import family, solve

    problem, cap = statement()
    values = caps(members)
    family(problem, cap, values[:2])  # what the first solve of a process loads is not measured

    begin = process_time()
    with timed_inside() as inside:
        found = family(problem, cap, values)
    seconds = process_time() - begin
    record: dict[str, Any] = {
        "caps": values,
        "family": seconds,
        "inside": inside.seconds,
        "iterations": inside.iterations,
        "alone": sum(member.alone for member in found.members),
        "meshes": len({id(member.iterate.transcription) for member in found.members}),
        "objectives": found.objectives.tolist(),
        "verified": [],
        "cold": [],
    }
    setup.console.progress(
        f"{members} members in {seconds:.2f} s, {inside.seconds:.2f} s of it inside IPOPT"
    )
    yield record

    def solved(what: str, place: int, solution: Callable[[], Solution]) -> None:
        begin = process_time()
        answer = solution()
        taken = process_time() - begin
        row = {"seconds": taken, "objective": answer.objective, "verdict": answer.verdict}
        record[what].append(row)
        if (place + 1) % TOLD == 0 or place + 1 == members:
            setup.console.progress(f"{what}: {place + 1} of {members} members")

    # by turns, so that a machine that slows down does so for both
    for place, value in enumerate(values):
        solved("verified", place, functools.partial(found.solution, place))
        solved("cold", place, functools.partial(solve, problem, constants={cap: value}))
        yield record


@contextlib.contextmanager
def timed_inside() -> Iterator[Inside]:
    """Time what runs inside IPOPT in the block, without our watch over its iterations."""
    from ocp.nlp.kept import KeptSolver, Watch

    inside, make, watch = Inside(), KeptSolver.of, Watch.eval_buffer

    def watched(self: Watch, arguments: Any, results: Any) -> int:
        begin = process_time()
        answer = watch(self, arguments, results)
        inside.seconds -= process_time() - begin
        inside.iterations += 1
        return answer

    def timed(program: Any, options: Mapping[str, Any]) -> KeptSolver:
        made = make(program, options)

        def evaluate() -> None:
            begin = process_time()
            made.evaluate()
            inside.seconds += process_time() - begin
            inside.iterations -= 1  # the start is watched, too, and is none

        return replace(made, evaluate=evaluate)

    with (
        mock.patch.object(KeptSolver, "of", timed),
        mock.patch.object(Watch, "eval_buffer", watched),
    ):
        yield inside


def overhead(record: Measured) -> float:
    """Return the time of the family alone over that inside IPOPT."""
    return float(record["family"] / record["inside"])


def faster(record: Measured) -> float | None:
    """Return how many times longer the cold solves take than family, refinement and replay."""
    cold, verified = (_total(record[what]) for what in ("cold", "verified"))
    if len(record["verified"]) < len(record["caps"]):
        return None  # interrupted: the family was for all members
    return cold / (record["family"] + verified)


def differences(record: Measured) -> dict[str, float]:
    """Return the largest relative differences of the objectives: of what from what."""
    exact = [optimum(cap) for cap in record["caps"]]
    cold, verified = ([row["objective"] for row in record[what]] for what in ("cold", "verified"))
    return {
        "family and closed form": _apart(record["objectives"], exact),
        "verified and closed form": _apart(verified, exact),
        "verified and cold": _apart(verified, cold),
    }


def _apart(found: Sequence[float], wanted: Sequence[float]) -> float:
    pairs = zip(found, wanted, strict=False)
    return max((abs(a / b - 1) for a, b in pairs), default=math.nan)


def _total(rows: Sequence[Mapping[str, Any]]) -> float:
    return float(sum(row["seconds"] for row in rows))


def tables(record: Measured) -> list[Table]:
    """Return the seconds, their ratios, and how far the answers are apart."""
    members = len(record["caps"])
    rows = [
        ("members", str(members)),
        ("refined on a mesh of their own", str(record["alone"])),
        ("meshes", str(record["meshes"])),
        ("iterations of IPOPT", str(record["iterations"])),
        ("the family [s]", number(record["family"], 3)),
        ("inside IPOPT [s]", number(record["inside"], 3)),
        (f"ratio (at most {OVERHEAD:g})", number(overhead(record), 3)),
        ("refined and verified, beside [s]", number(_total(record["verified"]), 3)),
        ("cold solves [s]", number(_total(record["cold"]), 3)),
        (f"times faster (at least {FASTER:g})", number(faster(record), 3)),
    ]

    rows += [(f"apart: {what}", f"{apart:.0e}") for what, apart in differences(record).items()]
    unverified = sum(
        not row["verdict"].startswith(("local", "global"))
        for what in ("verified", "cold")
        for row in record[what]
    )
    rows.append(("answers that were not verified", str(unverified)))

    notes = (
        "seconds of processor time; the family: without final refinement and verification.",
        "inside IPOPT: its own time and that of the functions that it evaluates.",
        f"cold solves: all {members} members, default settings, verified.",
        f"apart: largest relative difference of two objectives; {AGREEMENT:g} is asked for.",
    )
    title = f"Problem A for {members} jerk caps, {LEAST:g} to {MOST:g} times its own"
    return [Table(title, ("", ""), rows, notes)]
