"""The attempts at one nonlinear program, within the budget of all programs of a solve."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

from ocp.nlp.result import NlpResult
from ocp.nlp.solver import NlpSolver, StartingPoint

# A warm start from the mesh round before takes some dozens of iterations. Near a degenerate optimum
# it can wander from there for a thousand, where another line search or a start without multipliers
# ends soon.
_PATIENCE = 300

Run = Callable[[NlpSolver, StartingPoint], NlpResult]


@dataclass(frozen=True)
class Budget:
    """Iterations and seconds of a whole solve; infinite where none were stated.

    The clock runs from the making of the budget. It counts everything but the closing
    verification, which is never cut short.

    Attributes
    ----------
    iterations : float
        Of all mesh rounds together.
    seconds : float
        Of all mesh rounds together [s].
    begin : float
        Reading of the clock when it was made [s].
    """

    iterations: float = math.inf
    seconds: float = math.inf
    begin: float = field(default_factory=clock.perf_counter)

    @property
    def elapsed(self) -> float:
        """Time since the budget was made [s]."""
        return clock.perf_counter() - self.begin

    def spent(self, iterations: int) -> bool:
        """Whether nothing is left after that many iterations."""
        return iterations >= self.iterations or self.elapsed >= self.seconds

    def within(self, solver: NlpSolver, iterations: int) -> NlpSolver:
        """A solver that begins after that many iterations, cut to what is left."""
        if math.isinf(self.iterations) and math.isinf(self.seconds):
            return solver
        # a solver may take no seconds at all for no limit
        seconds = max(self.seconds - self.elapsed, 1e-3)
        return solver.within(max(self.iterations - iterations, 0), seconds)

    def __str__(self) -> str:
        parts = []
        if math.isfinite(self.iterations):
            parts.append(f"{self.iterations} iterations")
        if math.isfinite(self.seconds):
            parts.append(f"{self.seconds:g} s")
        return " or ".join(parts)


def with_retries(
    run: Run, solver: NlpSolver, start: StartingPoint, budget: Budget, before: int
) -> NlpResult:
    """Solve one program by as many attempts as it takes; what every attempt took is counted.

    Parameters
    ----------
    run : callable
        Runs a solver from a starting point.
    solver : NlpSolver
        As the user chose it.
    start : StartingPoint
        Where the first attempt starts.
    budget : Budget
        Of all attempts, those of earlier mesh rounds included.
    before : int
        Iterations of the mesh rounds before this one; 0 for the first.
    """
    iterations, seconds = 0, 0.0
    for choice, point in _attempts(solver, start, first=before == 0):
        result = run(budget.within(choice, before + iterations), point)
        iterations, seconds = iterations + result.iterations, seconds + result.seconds
        if result.outcome in ("solved", "interrupted") or budget.spent(before + iterations):
            break
    return replace(result, iterations=iterations, seconds=seconds)


def _attempts(
    solver: NlpSolver, start: StartingPoint, first: bool
) -> Iterator[tuple[NlpSolver, StartingPoint]]:
    """Solvers and starting points of the attempts, in order.

    With known multipliers the first attempt is a warm start. In later mesh rounds one that takes
    long has lost its way, and is made once more with other options. Then follow starts without
    multipliers, in later mesh rounds first with the options that stray less from a good start.
    """
    bare = StartingPoint(start.x)

    if start.multipliers is not None and first:
        yield solver, start
    elif start.multipliers is not None:
        patient = solver.within(_PATIENCE, float("inf"))
        yield patient, start
        for other in patient.alternatives(warm=True):
            yield other, start

    if not first:
        for other in solver.alternatives(warm=False):
            yield other, bare
    yield solver, bare
