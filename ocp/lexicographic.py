"""Several objectives in order of importance."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from ocp.errors import SolveFailed, StatementError
from ocp.solution import Solution
from ocp.solve import solve
from ocp.statement import with_objective
from ocp.terms import Bound

_WEIGHTS = (1e-5, 1e-6, 1e-7)


def solve_lexicographic(
    problem: Any, objectives: Sequence[Any], *, slack: float = 1e-6, **options: Any
) -> Solution:
    """Minimise several objectives in order of importance.

    Each one is minimised with all earlier ones held at their optimum, up to a relative `slack`;
    `options` go to `ocp.solve`.  The solution returned is that of the last objective.

    Raises
    ------
    StatementError, SolveFailed
        As `ocp.solve`.
    """
    if not objectives:
        raise StatementError("a lexicographic solve needs at least one objective")
    solution = solve(with_objective(problem, objectives[0]), **options)
    held: list[Bound] = []
    for number, (before, following) in enumerate(itertools.pairwise(objectives), start=1):
        value = solution.objective
        held.append(Bound(f"objective {number}", before, upper=value + slack * abs(value)))
        stage = with_objective(problem, following, held)
        solution = solve(stage, **{**options, "guess": solution})
    return solution


def smoothed(solution: Solution, roughness: Any, *, concession: float, **options: Any) -> Solution:
    """Make a solution smooth wherever its objective leaves it free.

    The roughness is added to the objective with a weight so small that the objective loses at
    most `concession` (relative); smaller weights follow as long as it loses more.  A peak that
    hardly depends on the motion makes a hard limit on it a wall for the solver; a small weight
    does not.

    Returns
    -------
    Solution
        Of the weighted problem; its `objective` is that of the original problem.

    Raises
    ------
    SolveFailed
        If no weight keeps the loss within the concession.
    """
    problem = solution.problem
    objective, value = problem.objective, problem.sense * solution.objective
    size = max(abs(solution.value(roughness)), 1e-300)
    reason = ""
    for weight in _WEIGHTS:
        total = objective / (abs(value) or 1.0) + weight * roughness / size
        try:
            found = solve(with_objective(problem, total), **{"guess": solution, **options})
        except SolveFailed as error:
            reason = str(error)
            continue
        reached = found.value(objective, replayed=True)
        loss = (reached - value) / (abs(value) or 1.0)
        if loss <= concession:
            return replace(found, problem=problem, objective=problem.sense * reached)
        reason = f"the objective would lose {loss:.1e}"
    raise SolveFailed(
        f"'{problem.name}' could not be made smooth within a loss of {concession:.1e}: {reason}; "
        "concede more", solution)  # fmt: skip
