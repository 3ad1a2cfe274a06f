"""An answer of the engine beside those of the plain collocation, and what that makes of it.

The plain collocation (`plain.py`) solves a problem from several starts, and from where the engine
ended. What the engine says is then one of these:

right               no start of the plain collocation is better, and one of them agrees
other optimum       the plain collocation stays there, but knows a better one
honest failure      an error, where the plain collocation found a motion
none found          an error, and the plain collocation found no motion either
none exists         an error, and it is proven that there is no motion
not compared        an answer that was verified, where no run of the plain one ended
wrong               an answer that was verified, and with which no run of the plain one agrees
"""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.shows.engine.engine_problem import problem_of
from benchmarks.shows.engine.plain import Plain, Start, crude_start
from benchmarks.shows.engine.variant import Variant
from ocp import Settings, Solution, audit, certify, solve
from ocp.errors import OcpError, StatementWarning
from studies.common.console import number

SECONDS = 300.0  # that the engine has for one answer, by the clock
AUDITED = 8  # starts where another optimum was found
# Relative difference of two values of one optimum: this, or three times what halving the plain
# mesh changes, whichever is more, but no more than the last: two optima may be as close as that.
SAME, COARSER, MOST = 1e-5, 3.0, 2e-2
FINER = 4  # times as many plain intervals before an answer is called wrong
GUESSES = ("crude", "none")
KINDS = (
    "right",
    "other optimum",
    "honest failure",
    "none found",
    "none exists",
    "not compared",
    "wrong",
)
HEAD = ("guess", "kind", "value", "plain", "rounds", "its", "CPU [s]", "not certified", "words")


@dataclass(frozen=True)
class Reference:
    """What an answer is held against.

    Attributes
    ----------
    intervals : of the plain collocation.
    random_starts : beside the crude one and the engine's answers.
    audits : whether an audit looks for the better optimum where an answer is another one.
    guesses : from which the engine solves.
    """

    intervals: int = 200
    random_starts: int = 3
    audits: bool = True
    guesses: Sequence[str] = GUESSES


def compared(variant: Variant, reference: Reference) -> dict[str, Any]:
    """The answers of the engine beside those of the plain collocation."""
    plain, half = (Plain(variant, reference.intervals // part) for part in (1, 2))
    starts = {"crude": crude_start(variant)} | {
        f"random {k}": crude_start(variant, np.random.default_rng(k))
        for k in range(1, reference.random_starts + 1)
    }
    values = {name: plain.solve(start) for name, start in starts.items()}
    coarse = {"crude": half.solve(starts["crude"])}

    answers: dict[str, dict[str, Any]] = {}
    ends: dict[str, Start] = {}
    for guess in reference.guesses:
        answers[guess], solution = by_engine(variant, guess, Settings(seconds=SECONDS))
        if solution is not None:
            name = f"engine, {guess}"
            ends[name] = start = start_from(solution)
            values[name] = plain.solve(start, close=True)
            coarse[name] = half.solve(start, close=True)

    found = judged(variant, answers, values, coarse)
    if ends and doubted(answers):
        # a start that led nowhere is no better on a mesh four times as fine, and takes longest
        led = {name: start for name, start in starts.items() if math.isfinite(values[name])}
        found = judged_finer(variant, answers, reference.intervals, led, ends)

    for guess, own in answers.items():
        own["audited"] = None
        if own["kind"] == "other optimum" and reference.audits:
            own["audited"] = _audited(variant, guess, found["best"], found["same"])
    return {**found, "answers": answers}


def judged(
    variant: Variant,
    answers: dict[str, dict[str, Any]],
    values: dict[str, float],
    coarse: dict[str, float],
) -> dict[str, Any]:
    """The best plain value, and within what values are the same; says its kind to each answer.

    Parameters
    ----------
    values, coarse : objective of the plain collocation by start, on a mesh and on half of it.
    """
    finite = [value for value in values.values() if math.isfinite(value)]
    changes = [abs(values[name] - coarse[name]) for name in coarse]
    change = max((c for c in changes if math.isfinite(c)), default=0.0)
    best = min(finite, default=math.nan)
    same = min(max(SAME * abs(best), COARSER * change), MOST * abs(best)) if finite else 0.0
    for own in answers.values():
        own["kind"] = kind_of(variant, own, finite, best, same)
    return {
        "best": best if finite else None,
        "same": same,
        "change": change,
        "plain": {k: v if math.isfinite(v) else None for k, v in values.items()},
    }


def doubted(answers: Mapping[str, Mapping[str, Any]]) -> bool:
    """Whether an answer was held against nothing, or agrees with nothing."""
    return any(own["kind"] in ("not compared", "wrong") for own in answers.values())


def judged_finer(
    variant: Variant,
    answers: dict[str, dict[str, Any]],
    intervals: int,
    starts: Mapping[str, Start],
    ends: Mapping[str, Start],
) -> dict[str, Any]:
    """The same on a finer mesh: an answer is wrong only if such a one says so too.

    A mesh may err by more than its half tells. Where nothing is found on its half, and so nothing
    is known of its error, one that is finer still judges, and it is that one's half.

    Parameters
    ----------
    intervals : of the mesh that was not fine enough.
    starts, ends : where runs start, and where the engine ended, by name.
    """
    near, fine = (Plain(variant, intervals * part) for part in (FINER // 2, FINER))
    values = {name: fine.solve(start) for name, start in starts.items()}
    of_ends = {name: fine.solve(start, close=True) for name, start in ends.items()}
    coarse = {name: near.solve(start, close=True) for name, start in ends.items()}
    if not any(math.isfinite(value) for value in coarse.values()):
        finest = Plain(variant, 2 * FINER * intervals)
        coarse = of_ends
        of_ends = {name: finest.solve(start, close=True) for name, start in ends.items()}
    return judged(variant, answers, values | of_ends, coarse)


def by_engine(
    variant: Variant, guess: str, settings: Settings
) -> tuple[dict[str, Any], Solution | None]:
    """What the engine says, and its solution if there is one."""
    begin = time.process_time()
    row: dict[str, Any] = {"value": None, "words": "", "rounds": 0, "iterations": 0, "open": ""}
    solution = None
    try:
        with warnings.catch_warnings():
            # a state that nothing depends on is stated as the benchmark has it
            warnings.simplefilter("ignore", StatementWarning)
            problem = problem_of(variant, guess == "crude")
            solution = solve(problem, settings=settings, partial=False)
    except OcpError as error:
        row["words"] = f"{type(error).__name__}: {error}"
    else:
        row |= {
            "value": solution.objective,
            "words": solution.verdict,
            "rounds": len(solution.mesh_iterations),
            "iterations": sum(entry.iterations for entry in solution.mesh_iterations),
        }
    row["processor"] = time.process_time() - begin
    if solution is not None:
        row["open"] = ", ".join(c.name for c in certify(solution).checks if c.failed)
    return row, solution


def start_from(solution: Solution) -> Start:
    """A start of the plain collocation where the engine ended."""
    motion = solution.trajectory
    peaks = {p.name: v for p, v in zip(solution.problem.peaks, motion.peaks, strict=True)}
    phases = {p.name: (p.start, p.end, p.at_fractions) for p in motion.phases}
    return Start(phases, {**motion.unknowns, **peaks})


def kind_of(
    variant: Variant, own: dict[str, Any], values: Sequence[float], best: float, same: float
) -> str:
    """Which of the kinds an answer is."""
    value = own["value"]
    if value is None:
        if variant.proven_without_motion:
            return "none exists"
        return "none found" if math.isnan(best) else "honest failure"
    if variant.proven_without_motion:
        return "wrong"
    if not values:
        return "not compared"
    if not any(abs(value - v) <= same for v in values):
        return "wrong"
    return "right" if value <= best + same else "other optimum"


def _audited(variant: Variant, guess: str, best: float, same: float) -> bool:
    """Whether an audit of a few starts finds the better optimum."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", StatementWarning)
        problem = problem_of(variant, guess == "crude")
        settings = Settings(seconds=SECONDS)
        found = audit(problem, starts=AUDITED, processes=1, settings=settings)
    return found.best.objective <= best + same


def cells(row: Any) -> list[tuple[str, ...]]:
    """A line of a table for each guess, below `HEAD`."""
    if row["failure"]:
        return [("-",) * (len(HEAD) - 1) + (row["failure"][:60],)]
    return [
        (
            guess,
            own["kind"] if own["kind"] != "wrong" else "WRONG",
            number(own["value"], 9),
            number(row["best"], 9),
            str(own["rounds"]),
            str(own["iterations"]),
            f"{own['processor']:.1f}",
            own["open"],
            own["words"][:90],
        )
        for guess, own in row["answers"].items()
    ]
