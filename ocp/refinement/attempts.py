"""One program solved in as many attempts as it takes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

from ocp.nlp.solver import NlpResult, NlpSolver, StartingPoint
from ocp.refinement.budget import Budget
from ocp.refinement.mesh_iteration import MeshIteration, iterations_of

Run = Callable[[NlpSolver, StartingPoint], NlpResult]

# A warm start from the mesh iteration before takes some dozens of iterations. Near a degenerate
# optimum it can wander from there for a thousand, where another line search or a start without
# multipliers ends soon. Where that happened on the mesh before, it is not waited for again.
_PATIENCE = 300
_PATIENCE_AFTER_RETRIES = 60


def with_retries(
    run: Run,
    solver: NlpSolver,
    start: StartingPoint,
    budget: Budget,
    before: Sequence[MeshIteration],
    *,
    most: float = math.inf,
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
        Of all attempts, those of earlier mesh iterations included.
    before : sequence of MeshIteration
        The mesh iterations before this one.
    most : float
        Iterations of all attempts together, beside the budget.
    """
    already = iterations_of(before)
    iterations, seconds, attempts = 0, 0.0, 0
    for choice, point in _attempts(solver, start, before):
        left = choice if math.isinf(most) else choice.within(most - iterations, math.inf)
        result = run(budget.within(left, already + iterations), point)
        iterations, seconds = iterations + result.iterations, seconds + result.seconds
        attempts += 1
        if result.outcome in ("solved", "interrupted") or budget.spent(already + iterations):
            break
        if iterations >= most:
            break

    if attempts == 1:
        return result
    return replace(result, iterations=iterations, seconds=seconds, attempts=attempts)


def _attempts(
    solver: NlpSolver, start: StartingPoint, before: Sequence[MeshIteration]
) -> Iterator[tuple[NlpSolver, StartingPoint]]:
    """Solvers and starting points of the attempts, in order.

    With known multipliers the first attempt is a warm start. In later mesh iterations one that
    takes long has lost its way, and is made once more with other options. Then follow starts
    without multipliers, in later mesh iterations first with the options that stray less from a good
    start.
    """
    bare = StartingPoint(start.x)

    if start.multipliers is not None and not before:
        yield solver, start
    elif start.multipliers is not None:
        retried = before[-1].attempts > 1
        patience = _PATIENCE_AFTER_RETRIES if retried else _PATIENCE
        yield solver.within(patience, float("inf")), start
        patient = solver.within(_PATIENCE, float("inf"))
        for other in patient.alternatives(warm=True):
            yield other, start

    if before:
        for other in solver.alternatives(warm=False):
            yield other, bare
    yield solver, bare
