"""Several objectives in order of importance."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

from ocp.errors import StatementError
from ocp.problem.bounds import Bound
from ocp.problem.problem import with_objective
from ocp.solution.solution import Solution
from ocp.solve import solve


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
