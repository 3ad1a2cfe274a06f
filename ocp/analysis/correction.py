"""Deferred correction: what a fuller model misses becomes the next target of a simpler one."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from ocp.analysis.solve_options import SolveOptions
from ocp.errors import StatementError, Unverified
from ocp.keywords import checked_keywords
from ocp.mesh.mesh import Mesh
from ocp.mesh.trajectory import Trajectory
from ocp.problem.parameters import parameters_of
from ocp.problem.problem import Problem, check_is_problem
from ocp.problem.symbols import Constant, is_real
from ocp.progress import Progress
from ocp.settings import Settings
from ocp.solution.solution import Solution

Replay = Callable[[Solution], Mapping[Constant, float]]


@dataclass(frozen=True, eq=False, repr=False)
class Corrected:
    """A solution whose replay on a fuller model meets the targets.

    Attributes
    ----------
    solution : Solution
        Of the problem with corrected targets.
    targets : mapping of Constant to float
        The corrected ones, with which it was solved [unit of each].
    misses : tuple of mapping of Constant to float
        Of each solve in order: value wanted less value reached on the fuller model [unit of each].
    """

    solution: Solution
    targets: Mapping[Constant, float]
    misses: tuple[Mapping[Constant, float], ...]

    def __repr__(self) -> str:
        return (
            f"Corrected('{self.solution.problem.name}': {len(self.misses)} solves, misses "
            f"{_listed(self.misses[-1])})"
        )


@checked_keywords()
def corrected(
    problem: Problem,
    replay: Replay,
    tolerances: Mapping[Constant, float],
    *,
    solves: int = 8,
    settings: Settings | None = None,
    guess: Solution | Trajectory | None = None,
    mesh: Mesh | None = None,
    constants: Mapping[Constant, float] | None = None,
    progress: Progress | bool | None = None,
) -> Corrected:
    """Solve a problem on a simple model so that a fuller model reaches its targets.

    Each answer is replayed on the fuller model, and what that misses a target by is added to the
    target of the next solve, which starts from this answer (deferred correction: Stetter, The
    Defect Correction Principle and Discretization Methods, Numer. Math. 29, 1978,
    doi:10.1007/BF01432879). The misses shrink by about the relative difference of the two models
    each time. The answer is the optimum of the simple model among the motions that the fuller one
    can end with, and not the optimum of the fuller model.

    Parameters
    ----------
    problem : Problem
        Its targets are constants, such as ``final={x: goal}`` with ``goal = Constant("goal")``.
    replay : callable
        Gets a `Solution` and returns the value that the fuller model reaches for each target.
    tolerances : mapping of Constant to positive float
        The targets, and by how much the fuller model may miss each [unit of each].
    solves : int
        Most solves.
    settings, guess, mesh, constants, progress : optional
        As of `ocp.solve`. What is wanted of a target is its value in `constants`, else that of the
        statement.

    Raises
    ------
    StatementError
        A target is no constant of the problem, a tolerance is not positive, or the replay returns
        no finite number for a target.
    Unverified
        The fuller model still misses a target after the last solve; ``error.iterate`` is the
        solution that came nearest.
    SolveFailed, Interrupted
        As `ocp.solve`.
    """
    check_is_problem(problem)
    if solves < 1:
        raise StatementError(f"the argument 'solves' is {solves!r}; give a positive integer")
    given = dict(constants or {})
    wanted = _wanted(problem, tolerances, given)
    targets, misses, answers = dict(wanted), list[Mapping[Constant, float]](), list[Solution]()

    options = SolveOptions(settings or Settings(), given, progress)
    for _ in range(solves):
        guess = options.solved(problem, guess, None if answers else mesh, targets)
        answers.append(guess)
        reached = _reached(replay, guess, wanted)
        misses.append({target: wanted[target] - reached[target] for target in wanted})
        if _largest(misses[-1], tolerances) <= 1.0:
            return Corrected(guess, targets, tuple(misses))
        targets = {target: targets[target] + misses[-1][target] for target in targets}

    nearest = min(range(len(misses)), key=lambda k: _largest(misses[k], tolerances))
    raise Unverified(
        f"the fuller model of '{problem.name}' still misses its targets after {solves} solves, at "
        f"best {_listed(misses[nearest])}; use a more accurate model in the problem, allow more "
        "solves or a larger tolerance",
        answers[nearest],
    )


def _wanted(
    problem: Problem, tolerances: Mapping[Constant, float], given: Mapping[Constant, float]
) -> dict[Constant, float]:
    """The values that the fuller model is to reach."""
    if not tolerances:
        raise StatementError(
            "there is no target to correct; give a tolerance for at least one target"
        )
    parameters = parameters_of(problem, given)
    for target, tolerance in tolerances.items():
        if target not in set(problem.constants):
            name = getattr(target, "name", target)
            raise StatementError(
                f"'{name}' is not a constant of problem '{problem.name}'; specify the target as a "
                "Constant, such as final={x: goal}"
            )
        if not (is_real(tolerance) and 0.0 < tolerance < math.inf):
            raise StatementError(
                f"the tolerance of '{target.name}' is {tolerance!r}; give a positive number"
            )
    return {target: parameters.values[target.name] for target in tolerances}


def _reached(
    replay: Replay, solution: Solution, wanted: Mapping[Constant, float]
) -> Mapping[Constant, float]:
    """What the fuller model reaches, if that is a finite number for each target."""
    reached = replay(solution)
    for target in wanted:
        value: Any = reached.get(target)
        if not (is_real(value) and math.isfinite(value)):
            raise StatementError(
                f"the replay gives {value!r} for '{target.name}'; let it return a mapping with a "
                "finite number for each target"
            )
    return reached


def _largest(misses: Mapping[Constant, float], tolerances: Mapping[Constant, float]) -> float:
    """The largest miss, as a multiple of its tolerance."""
    return max(abs(misses[target]) / tolerances[target] for target in tolerances)


def _listed(misses: Mapping[Constant, float]) -> str:
    return ", ".join(f"'{t.name}' by {miss:.2g} {t.unit}" for t, miss in misses.items())
