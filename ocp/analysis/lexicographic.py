"""Several objectives in order of importance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Any

from ocp.errors import Interrupted, OcpError, SolveFailed, StatementError
from ocp.keywords import checked_keywords
from ocp.mesh.mesh import Mesh
from ocp.mesh.trajectory import Trajectory
from ocp.nlp.interrupts import noted_interrupts
from ocp.problem.bounds import Bound
from ocp.problem.display import text_of
from ocp.problem.problem import Problem, with_objective
from ocp.problem.symbols import Constant
from ocp.progress import Progress, shown
from ocp.settings import Settings
from ocp.solution.solution import Solution
from ocp.solve import solve


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
    """

    objective: Any
    value: float | None = None
    held: float | None = None
    solution: Solution | None = None
    error: OcpError | None = None

    def __repr__(self) -> str:
        outcome = f"= {self.value:.8g}" if self.value is not None else f"failed, {self.error}"
        return f"PriorityLevel({text_of(self.objective, 60)} {outcome})"


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
    then is returned.

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
    levels: list[PriorityLevel] = []
    held: list[Bound] = []
    solution = first
    with shown(progress) as say, noted_interrupts() as interrupts:
        for i, objective in enumerate(objectives):
            try:
                if i > 0 or solution is None:
                    solution = solve(
                        with_objective(problem, objective + terms[i], held),
                        settings=all_settings[i],
                        guess=guess if i == 0 else solution,
                        mesh=mesh if i == 0 else None,
                        constants=constants,
                        progress=say and _prefixed(say, f"objective {i + 1} of {count}: "),
                    )
            except (SolveFailed, Interrupted) as error:
                if solution is None:
                    raise
                levels.append(PriorityLevel(objective, error=error))
                return Lexicographic(solution, tuple(levels), isinstance(error, Interrupted))

            is_last = i + 1 == count
            level = _reached(objective, solution, None if is_last else slacks[i])
            levels.append(level)
            if level.held is not None:
                held.append(Bound(f"objective {i + 1}", objective, upper=level.held))
            if interrupts.asked:
                # it came too late to stop this solve
                return Lexicographic(solution, tuple(levels), not is_last)

    assert solution is not None
    return Lexicographic(solution, tuple(levels), False)


def _reached(objective: Any, solution: Solution, slack: float | None) -> PriorityLevel:
    """What an objective has reached; without a slack it is not held afterwards."""
    # the replay is what is reported, and the program cannot get below its own value
    value = solution.value(objective)
    if solution.replay.phases:
        value = max(value, solution.value(objective, replayed=True))

    limit = None if slack is None else value + slack * abs(value)
    return PriorityLevel(objective, value, limit, solution)


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
