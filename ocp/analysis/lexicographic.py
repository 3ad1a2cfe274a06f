"""Several objectives in order of importance."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Any

from ocp.analysis.exchanged_roles import Held, by_exchanged_roles, largest_value
from ocp.analysis.solve_options import SolveOptions
from ocp.errors import BudgetSpent, Interrupted, OcpError, SolveFailed, StatementError
from ocp.keywords import checked_keywords
from ocp.mesh.mesh import Mesh
from ocp.mesh.trajectory import Trajectory
from ocp.nlp.interrupts import noted_interrupts
from ocp.problem.bounds import Bound
from ocp.problem.problem import Problem, with_objective
from ocp.problem.symbols import Constant
from ocp.problem.texts import SHORT, text_of
from ocp.progress import Progress, shown
from ocp.settings import Settings
from ocp.solution.solution import Solution

# Iterations of one mesh after which a solver has gone astray under the limits of the objectives
# before: from their motion, which keeps them, it takes some dozens.
_PATIENCE = 150


@dataclass(frozen=True, eq=False, repr=False)
class PriorityLevel:
    """One of the objectives, and what came of it.

    Attributes
    ----------
    objective : expression
        As it was given.
    value : float or None
        Its value when it was minimised, the larger one of the solution's and its replay's; None
        if that failed.
    held : float or None
        What it may be from then on; None for the last objective, which is held nowhere.
    solution : Solution or None
    error : OcpError or None
        Why there is no solution.
    gap : float
        How much less the value may be at this optimum, as a part of it, where it was found from
        above only (`ocp.analysis.exchanged_roles`).
    """

    objective: Any
    value: float | None = None
    held: float | None = None
    solution: Solution | None = None
    error: OcpError | None = None
    gap: float = 0.0

    def __repr__(self) -> str:
        outcome = f"= {self.value:.8g}" if self.value is not None else f"failed, {self.error}"
        return f"PriorityLevel({text_of(self.objective, SHORT)} {outcome})"


@dataclass(frozen=True, eq=False, repr=False)
class Lexicographic:
    """The solution of the last objective that was reached, and all levels on the way.

    Attributes
    ----------
    solution : Solution
    levels : tuple of PriorityLevel
        In their order; those after a failure or an interruption are left out.
    interrupted : bool
        Whether the user stopped it.
    """

    solution: Solution
    levels: tuple[PriorityLevel, ...]
    interrupted: bool = False

    def __repr__(self) -> str:
        stopped = ", stopped by the user" if self.interrupted else ""
        lines = [f"  {number}. {level!r}" for number, level in enumerate(self.levels, start=1)]
        return "\n".join([f"Lexicographic of '{self.solution.problem.name}'{stopped}", *lines])


@checked_keywords()
def solve_lexicographic(
    problem: Problem,
    objectives: Sequence[Any],
    *,
    slack: float | Sequence[float] = 1e-6,
    first: Solution | None = None,
    beside: Sequence[Any] | None = None,
    settings: Settings | Sequence[Settings] | None = None,
    guess: Solution | Trajectory | None = None,
    mesh: Mesh | None = None,
    constants: Mapping[Constant, float] | None = None,
    progress: Progress | bool | None = None,
) -> Lexicographic:
    """Minimise several objectives in order of importance.

    Each one is minimised with all earlier ones held at their optimum, up to a concession.  Nothing
    that was found is lost: where a later objective fails, or the user stops it, the solution until
    then is returned.  Where the solver goes astray under the limit of the objective before, the
    roles of the two are exchanged: the least cap on the later one is looked for under which the
    earlier one keeps its limit.

    Parameters
    ----------
    problem : Problem
        Its own objective is not used.
    objectives : sequence of expressions
        To be minimised, the most important one first.
    slack : float or sequence of float
        What is conceded of each objective to those after it, as a part of its optimum.
    first : Solution, optional
        A solution of the first objective, which then is not solved again.
    beside : sequence of expressions, optional
        Terms added to each objective while it is minimised, such as a price of roughness.  They
        are not held afterwards; 0 where there is none.
    settings : Settings or sequence of Settings, optional
        For all objectives, or one for each.
    guess, mesh, constants, progress : optional
        As of `ocp.solve`; guess and mesh for the first objective.

    Raises
    ------
    StatementError
        When there is no objective, or not as many of something else as objectives.
    SolveFailed, Interrupted
        As `ocp.solve`, of the first objective.
    """
    count = len(objectives)
    slacks, all_settings, terms = _for_each_objective(count, slack, settings, beside)
    levels, held = list[PriorityLevel](), list[Held]()
    solution = first
    with shown(progress) as say, noted_interrupts() as interrupts:
        for i, objective in enumerate(objectives):
            prefixed = say and _prefixed(say, f"objective {i + 1} of {count}: ")
            options = SolveOptions(all_settings[i], constants or {}, prefixed)
            try:
                if solution is None:
                    stated = with_objective(problem, objective + terms[i])
                    solution, gap = options.solved(stated, guess, mesh=mesh), 0.0
                else:
                    solution, gap = _next_level(
                        problem, objective, terms[i], held, solution, options
                    )
            except (SolveFailed, Interrupted) as error:
                if solution is None:
                    raise
                levels.append(PriorityLevel(objective, error=error))
                return Lexicographic(solution, tuple(levels), isinstance(error, Interrupted))

            is_last = i + 1 == count
            level = _reached(objective, solution, None if is_last else slacks[i], gap)
            levels.append(level)
            if level.held is not None:
                assert level.value is not None
                held.append(Held(objective, terms[i], level.value, level.held))
            if interrupts.asked:
                # it came too late to stop this solve
                return Lexicographic(solution, tuple(levels), not is_last)

    assert solution is not None
    return Lexicographic(solution, tuple(levels))


def _next_level(
    problem: Problem,
    objective: Any,
    beside: Any,
    held: Sequence[Held],
    solution: Solution,
    options: SolveOptions,
) -> tuple[Solution, float]:
    """The least of an objective while all before keep their limits, and the gap below it.

    With nothing held yet it is the solution that was given.

    Raises
    ------
    SolveFailed, Interrupted
        As `ocp.solve`.
    """
    if not held:
        return solution, 0.0

    limits = [
        Bound(f"objective {number}", level.objective, upper=level.limit)
        for number, level in enumerate(held, start=1)
    ]
    patient = options.settings.solver.within(_PATIENCE, math.inf)
    stated = with_objective(problem, objective + beside, limits)
    try:
        return options.solved(stated, solution, solver=patient), 0.0
    except BudgetSpent:
        raise
    except SolveFailed:
        found = by_exchanged_roles(
            problem, objective, beside, held[-1], solution, limits[:-1], options
        )
        if found is None:
            raise
        return found


def _reached(objective: Any, solution: Solution, slack: float | None, gap: float) -> PriorityLevel:
    """What an objective has reached; without a slack it is not held afterwards."""
    # the replay is what is reported, and the program cannot get below its own value
    value = largest_value(objective, solution)
    limit = None if slack is None else value + slack * abs(value)
    return PriorityLevel(objective, value, limit, solution, gap=gap)


def _for_each_objective(
    count: int,
    slack: float | Sequence[float],
    settings: Settings | Sequence[Settings] | None,
    beside: Sequence[Any] | None,
) -> tuple[list[float], list[Settings], list[Any]]:
    """Slacks, settings and terms beside, one for each objective."""
    if count == 0:
        raise StatementError("a lexicographic solve needs at least one objective")
    return (
        _each(slack, Real, count, "slack"),
        _each(settings or Settings(), Settings, count, "settings"),
        _each(beside if beside is not None else [0.0] * count, (), count, "beside"),
    )


def _each(given: Any, single: Any, count: int, what: str) -> list[Any]:
    """One for each objective, repeated if it is a single one."""
    if single and isinstance(given, single):
        return [given] * count
    each = list(given)
    if len(each) != count:
        raise StatementError(
            f"{what} has {len(each)} entries for {count} objectives; give one for each"
        )
    return each


def _prefixed(say: Progress, prefix: str) -> Progress:
    return lambda line: say(prefix + line)
