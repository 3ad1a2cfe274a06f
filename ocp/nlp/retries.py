"""The attempts at one nonlinear program: other options and other starts where the first fail."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from ocp.nlp.budget import Budget
from ocp.nlp.result import NlpResult
from ocp.nlp.solver import NlpSolver, StartingPoint

# A warm start from the mesh round before takes some dozens of iterations. Near a degenerate optimum
# it can wander from there for a thousand, where another line search or a start without multipliers
# ends soon.
_PATIENCE = 300

Run = Callable[[NlpSolver, StartingPoint], NlpResult]


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
