"""Solve a benchmark with default settings and measure the answer."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import cast

from ocp import (
    Interrupted,
    OcpError,
    Settings,
    Solution,
    StatementWarning,
    Unverified,
    certify,
    solve,
)
from studies.benchmarks.benchmark import Benchmark
from studies.benchmarks.violation import largest_violation


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
            solution, verdict = solve(benchmark.problem, settings=settings, progress=progress), ""
    except Interrupted:
        raise
    except Unverified as error:
        solution, verdict = cast(Solution, error.iterate), f"unverified: {error}"
    except OcpError as error:
        return Measurement(
            benchmark.name, benchmark.optimum, benchmark.tolerance, benchmark.source,
            False, f"{type(error).__name__}: {error}", time.perf_counter() - begin,
        )  # fmt: skip
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
    return Measurement(
        benchmark.name, benchmark.optimum, benchmark.tolerance, benchmark.source,
        passed, verdict, seconds, solution.objective, error, solution.mesh.intervals,
        len(solution.mesh_iterations), solution.iterations, solution.verification.miss, violation,
        len(certificate.checks),
        tuple(f"{c.name} {c.value:.1e} of {c.tolerance:.0e} allowed; {c.sentence}"
              for c in certificate.checks if not c.passed),
    )  # fmt: skip
