"""Solve a benchmark with default settings and measure the answer.

How far a motion leaves its bounds is evaluated at many times, written apart from the engine.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from typing import Any, cast

import numpy as np

from benchmarks.optima.benchmark import Benchmark
from ocp import (
    Bound,
    Control,
    Interrupted,
    OcpError,
    Phase,
    Settings,
    Solution,
    State,
    StatementWarning,
    Unverified,
    certify,
    solve,
)
from ocp.arrays import Array

POINTS = 10_000  # in each phase, at which bounds are evaluated


@dataclass(frozen=True)
class Measurement:
    """What became of a benchmark; numbers are None where there is no answer.

    Attributes
    ----------
    value, error : of the objective; the error is relative to the optimum, and signed.
    tolerance : of the error.
    passed : whether the answer is verified, and error and violation are within tolerance.
    verdict : the solver's, in words, or why there is none.
    miss : of the replayed end state, relative.
    violation : the larger of solution's and replay's, see `largest_violation`.
    checks, doubts : how many checks the certificate has, and the sentences of those that failed.
    """

    name: str
    optimum: float
    tolerance: float
    source: str
    passed: bool
    verdict: str
    seconds: float
    value: float | None = None
    error: float | None = None
    intervals: int | None = None
    rounds: int | None = None
    iterations: int | None = None
    miss: float | None = None
    violation: float | None = None
    checks: int | None = None
    doubts: tuple[str, ...] = ()

    def as_record(self) -> dict[str, object]:
        """The numbers by name, for JSON."""
        return asdict(self)


def measure(
    benchmark: Benchmark,
    settings: Settings | None = None,
    progress: Callable[[str], None] | None = None,
) -> Measurement:
    """Solve `benchmark` from its stated guess; a failure is measured too, not raised.

    Raises
    ------
    Interrupted
        The user stopped the solve.
    """
    settings = settings or Settings()

    begin = time.perf_counter()
    try:
        with warnings.catch_warnings():
            # statements of the literature carry along what nothing depends on, such as a longitude
            warnings.simplefilter("ignore", StatementWarning)
            solution, verdict = (
                solve(benchmark.problem, settings=settings, progress=progress, partial=False),
                "",
            )
    except Interrupted:
        raise
    except Unverified as error:
        solution, verdict = cast(Solution, error.iterate), f"unverified: {error}"
    except OcpError as error:
        return Measurement(
            name=benchmark.name,
            optimum=benchmark.optimum,
            tolerance=benchmark.tolerance,
            source=benchmark.source,
            passed=False,
            verdict=f"{type(error).__name__}: {error}",
            seconds=time.perf_counter() - begin,
        )

    seconds = time.perf_counter() - begin
    return _measured(benchmark, settings, solution, verdict or solution.verdict, seconds)


def _measured(
    benchmark: Benchmark, settings: Settings, solution: Solution, verdict: str, seconds: float
) -> Measurement:
    error, certificate = benchmark.error(solution.objective), certify(solution)

    violation = max(largest_violation(solution, replayed=replayed) for replayed in (False, True))
    passed = (
        solution.verification.passed
        and abs(error) <= benchmark.tolerance
        and violation <= settings.accuracy.path
    )

    doubts = tuple(
        f"{check.name} {check.value:.1e} of {check.tolerance:.0e} allowed; {check.sentence}"
        for check in certificate.checks
        if check.failed
    )

    return Measurement(
        name=benchmark.name,
        optimum=benchmark.optimum,
        tolerance=benchmark.tolerance,
        source=benchmark.source,
        passed=passed,
        verdict=verdict,
        seconds=seconds,
        value=solution.objective,
        error=error,
        intervals=solution.mesh.intervals,
        rounds=len(solution.mesh_iterations),
        iterations=solution.iterations,
        miss=solution.verification.miss,
        violation=violation,
        checks=len(certificate.checks),
        doubts=doubts,
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
