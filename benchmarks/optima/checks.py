"""What the answer to a benchmark has to keep beside its certificate.

How far a motion leaves its bounds is evaluated at many times, written apart from the engine.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from benchmarks.optima.benchmark import Benchmark
from ocp import Accuracy, Bound, Control, Phase, Solution, State
from ocp.arrays import Array

POINTS = 10_000  # in each phase, at which bounds are evaluated
OWN_CHECKS = VERIFIED, OPTIMUM, LIMITS = (
    "verification",
    "trusted optimum",
    f"limits at {POINTS:,} times",
)


def held_against(benchmark: Benchmark, solution: Solution) -> tuple[tuple[str, bool], ...]:
    """Names of the checks, and whether an answer with default settings passes them."""
    violation = max(largest_violation(solution, replayed=replayed) for replayed in (False, True))
    # a refinement that ends at a standstill above the default states the violation that it leaves
    stated = max(Accuracy().path, solution.verification.excess)
    return (
        (VERIFIED, solution.verification.passed),
        (OPTIMUM, abs(benchmark.error(solution.objective)) <= benchmark.tolerance),
        (LIMITS, violation <= stated),
    )


def largest_violation(solution: Solution, *, replayed: bool = False) -> float:
    """Largest violation of any bound at `POINTS` equidistant times of each phase.

    Path constraints, bounds of states and controls and peaks (against the value that the solver
    reports) are each taken relative to the largest of their limits and of the values they take,
    equations to the scale they state.
    """
    worst = 0.0
    for phase in solution.problem.phases:
        span = solution.trajectory.phase(phase.name)
        times = np.linspace(span.start, span.end, POINTS)

        for expression, lower, upper, scale in _limits(solution, phase):
            values = solution.sample(expression, times, phase, replayed=replayed)
            worst = max(worst, _violation(values, lower, upper, scale))
    return worst


def _violation(values: Array, lower: float, upper: float, scale: float | None) -> float:
    """Largest excess over the limits, relative."""
    if not np.isfinite(values).all():
        return float("inf")
    excess = float(np.maximum(values - upper, lower - values).max())
    sizes = [abs(limit) for limit in (lower, upper) if np.isfinite(limit)]
    size = scale or max(*sizes, float(np.abs(values).max()), 0.0) or 1.0
    return max(excess, 0.0) / size


def _limits(solution: Solution, phase: Phase) -> Iterator[tuple[Any, float, float, float | None]]:
    """Expressions of a phase with their limits and, of equations, their scale."""
    problem = solution.problem
    for bound in phase.bounds:
        scale = bound.scale or 1.0 if bound.is_equation else None
        yield bound.expression, *_between(solution, bound), scale
    for signal in (*phase.states, *problem.controls[phase.name]):
        yield signal, *_between(solution, signal), None

    # the value that the solver reports is the cap that the motion has to keep
    reported = {name: value for name, value, _ in solution.verification.peaks}
    for peak in problem.peaks:
        for name, expression in peak.pieces:
            if name == phase.name:
                cap = reported[peak.name]
                yield expression, -cap if peak.absolute else -np.inf, cap, None


def _between(solution: Solution, limited: Bound | State | Control) -> tuple[float, float]:
    """Lower and upper limit as numbers."""
    limits = [
        float(limit) if isinstance(limit, int | float) else solution.value(limit)
        for limit in (limited.lower, limited.upper)
    ]
    return limits[0], limits[1]
