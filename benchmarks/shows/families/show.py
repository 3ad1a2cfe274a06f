"""The show "families": random variants of the fifteen benchmarks beside a plain collocation.

Case `15 k + i` is draw k of problem i. The engine solves it with its defaults, from a crude guess
and from none. A plain collocation on 200 intervals (`plain.py`) solves it from several starts, and
from the engine's answers. What the engine says is then one of these:

right               no start of the plain collocation is better, and one of them agrees
other optimum       the plain collocation stays there, but knows a better one
honest failure      an error, where the plain collocation found a motion
none found          an error, and the plain collocation found no motion either
none exists         an error, and it is proven that there is no motion
wrong               an answer that was verified, and with which no run of the plain one agrees
"""

from __future__ import annotations

import math
import time
import warnings
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.shows.families.engine_problem import problem_of
from benchmarks.shows.families.plain import Plain, Start, crude_start
from benchmarks.shows.families.variant import Variant, catalogue
from benchmarks.shows.show import Question, Row
from ocp import Settings, Solution, audit, solve
from ocp.errors import OcpError, StatementWarning
from studies.common.console import Table, number

LINE = "random variants of the fifteen benchmarks beside a plain collocation"
LIMIT = 900.0  # [s]

SECONDS = 120.0  # that the engine has for one answer
INTERVALS = 200
RANDOM_STARTS = 3
AUDITED = 8  # starts where another optimum was found
# Relative difference of two values of one optimum: this, or three times what halving the plain
# mesh changes, whichever is more.
SAME, COARSER = 1e-5, 3.0
GUESSES = ("crude", "none")
KINDS = ("right", "other optimum", "honest failure", "none found", "none exists", "wrong")


def question(seed: int, index: int) -> Question:
    """Draw the numbers of a variant."""
    names = list(catalogue())
    name, draw = names[index % len(names)], index // len(names)
    variant = Variant.drawn(name, np.random.default_rng([seed, index]))
    return {"problem": name, "draw": draw, "numbers": dict(variant.numbers), "drawn": [seed, index]}


def answer(question: Question, folder: Path) -> Row:
    """Solve it both ways and compare."""
    del folder
    return compared(Variant.drawn(question["problem"], np.random.default_rng(question["drawn"])))


def compared(variant: Variant, random_starts: int = RANDOM_STARTS) -> dict[str, Any]:
    """The answers of the engine beside those of the plain collocation."""
    plain, half = Plain(variant, INTERVALS), Plain(variant, INTERVALS // 2)
    starts = {"crude": crude_start(variant)} | {
        f"random {k}": crude_start(variant, np.random.default_rng(k))
        for k in range(1, random_starts + 1)
    }
    values = {name: plain.solve(start).objective for name, start in starts.items()}
    coarse = {"crude": half.solve(starts["crude"]).objective}

    answers: dict[str, dict[str, Any]] = {}
    for guess in GUESSES:
        answers[guess], solution = _by_engine(variant, guess)
        if solution is not None:
            start = _start_from(solution)
            values[f"engine, {guess}"] = plain.solve(start, close=True).objective
            coarse[f"engine, {guess}"] = half.solve(start, close=True).objective

    changes = [abs(values[name] - coarse[name]) for name in coarse]
    change = max((c for c in changes if math.isfinite(c)), default=0.0)
    best = min((v for v in values.values() if math.isfinite(v)), default=math.nan)
    same = max(SAME * abs(best), COARSER * change) if math.isfinite(best) else 0.0

    for guess, own in answers.items():
        own["kind"] = _kind(variant, own, list(values.values()), best, same)
        own["audited"] = None
        if own["kind"] == "other optimum":
            own["audited"] = _audited(variant, guess, best, same)
    return {
        "best": None if math.isnan(best) else best,
        "same": same,
        "plain": {k: None if math.isnan(v) else v for k, v in values.items()},
        "answers": answers,
    }


def _by_engine(variant: Variant, guess: str) -> tuple[dict[str, Any], Solution | None]:
    begin = time.process_time()
    row: dict[str, Any] = {"value": None, "words": "", "rounds": 0, "iterations": 0}
    solution = None
    try:
        with warnings.catch_warnings():
            # a state that nothing depends on is stated as the benchmark has it
            warnings.simplefilter("ignore", StatementWarning)
            problem = problem_of(variant, guess == "crude")
            solution = solve(problem, settings=Settings(seconds=SECONDS))
    except OcpError as error:
        row["words"] = f"{type(error).__name__}: {error}"
    else:
        row |= {
            "value": solution.objective,
            "words": solution.verdict,
            "rounds": len(solution.mesh_iterations),
            "iterations": sum(entry.iterations for entry in solution.mesh_iterations),
        }
    return {**row, "processor": time.process_time() - begin}, solution


def _start_from(solution: Solution) -> Start:
    """A start of the plain collocation where the engine ended."""
    motion = solution.trajectory
    peaks = {p.name: v for p, v in zip(solution.problem.peaks, motion.peaks, strict=True)}
    phases = {p.name: (p.start, p.end, p.at_fractions) for p in motion.phases}
    return Start(phases, {**motion.unknowns, **peaks})


def _kind(
    variant: Variant, own: dict[str, Any], values: Sequence[float], best: float, same: float
) -> str:
    """Which of the kinds an answer is."""
    value = own["value"]
    if value is None:
        if variant.proven_without_motion:
            return "none exists"
        return "none found" if math.isnan(best) else "honest failure"
    agrees = any(abs(value - v) <= same for v in values if math.isfinite(v))
    if variant.proven_without_motion or not agrees:
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


def tables(rows: Sequence[Row]) -> list[Table]:
    """Each answer in a row, how many are of each kind, and the median effort of each problem."""
    head = (
        "case",
        "problem",
        "guess",
        "kind",
        "value",
        "plain",
        "rounds",
        "its",
        "CPU [s]",
        "words",
    )
    cells = [line for row in rows for line in _cells(row)]
    answered = [row for row in rows if not row["failure"]]

    counts = []
    for guess in GUESSES:
        kinds = Counter(row["answers"][guess]["kind"] for row in answered)
        counts.append((guess, *(str(kinds[kind]) for kind in KINDS), str(len(answered))))
    notes = tuple(
        f"another optimum that an audit of {AUDITED} starts resolves, guess {guess}: "
        f"{sum(bool(row['answers'][guess]['audited']) for row in answered)}"
        for guess in GUESSES
    )
    return [
        Table("Variants of the benchmarks", head, cells),
        Table("What the answers are", ("guess", *KINDS, "cases"), counts, notes),
    ]


def _cells(row: Row) -> list[tuple[str, ...]]:
    if row["failure"]:
        return [(str(row["index"]), row["problem"], *7 * ("-",), row["failure"][:60])]
    return [
        (
            str(row["index"]),
            row["problem"],
            guess,
            own["kind"] if own["kind"] != "wrong" else "WRONG",
            number(own["value"], 8),
            number(row["best"], 8),
            str(own["rounds"]),
            str(own["iterations"]),
            f"{own['processor']:.1f}",
            own["words"][:90],
        )
        for guess, own in row["answers"].items()
    ]
