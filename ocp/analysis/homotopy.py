"""From an easy value of a constant to a hard one, in steps as long as the solver takes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from ocp.analysis.saddles import lower_beside
from ocp.analysis.solve_options import SolveOptions
from ocp.errors import HomotopyStopped, SolveFailed, StatementError, Unverified
from ocp.keywords import checked_keywords
from ocp.problem.parameters import parameters_of
from ocp.problem.problem import Problem
from ocp.problem.symbols import Constant
from ocp.progress import Progress
from ocp.settings import Settings
from ocp.solution.solution import Solution

_GROWTH = 2.0  # of a step after one that succeeded
_SHRINKING = 0.5  # of a step that failed


class Step(NamedTuple):
    """One attempt of a homotopy, at a value of the constant [its unit]."""

    value: float
    solved: bool


@dataclass(frozen=True, eq=False, repr=False)
class Homotopy:
    """A path of solutions.

    Attributes
    ----------
    solutions : tuple of Solution
        At the values that were asked for, in their order, verified.
    steps : tuple of Step
        All attempts, those in between and the failed ones included.
    """

    solutions: tuple[Solution, ...]
    steps: tuple[Step, ...]

    @property
    def solution(self) -> Solution:
        """The last solution."""
        return self.solutions[-1]

    def __repr__(self) -> str:
        objectives = ", ".join(f"{solution.objective:.8g}" for solution in self.solutions)
        failed = sum(not step.solved for step in self.steps)
        return (
            f"Homotopy of '{self.solution.problem.name}': objectives {objectives}; "
            f"{len(self.steps)} steps, {failed} failed"
        )


@checked_keywords()
def homotopy(
    problem: Problem,
    constant: Constant,
    values: float | Sequence[float],
    *,
    settings: Settings | None = None,
    guess: Solution | None = None,
    constants: Mapping[Constant, float] | None = None,
    least_step: float = 1 / 64,
    progress: Progress | bool | None = None,
) -> Homotopy:
    """Solve a problem for one value of a constant after the other.

    Each solve starts from the primal and dual variables of the one before.  The way to the next
    value is tried in one step.  A step that fails is halved, one that succeeds lets the next be
    twice as long.  Solutions between the values asked for are not replayed.

    Parameters
    ----------
    problem : Problem
    constant : Constant
        The one that changes.
    values : number or sequence of numbers
        Where the constant goes, one value or several in order [its unit].
    settings : Settings, optional
        As of `ocp.solve`.
    guess : Solution, optional
        Where to start, at the value of the constant that it was solved for; by default the
        problem is first solved as stated, or with the value in `constants`.
    constants : mapping of Constant to number, optional
        Values of other constants.
    least_step : float
        Shortest step, as a fraction of the way to the next value.
    progress : bool or callable, optional
        As of `ocp.solve`.

    Raises
    ------
    HomotopyStopped
        No step was short enough; the error tells the last value reached and holds its solution.
    Unverified
        The answer at a value that was asked for did not pass its verification.
    StatementError, SolveFailed, Interrupted
        As `ocp.solve`, of the first solve.
    """
    targets = [float(value) for value in np.atleast_1d(np.asarray(values, dtype=float))]
    parameters_of(problem, {constant: constant.value})  # or the problem does not use it
    if not targets:
        raise StatementError(
            f"the homotopy in '{constant.name}' has no target value; give at least one"
        )
    if not 0 < least_step <= 1:
        raise StatementError(
            f"the minimum step of a homotopy is {least_step!r}; give 0 < step <= 1"
        )

    options = SolveOptions(settings or Settings(), constants or {}, progress)
    last = guess or options.solved(problem, verify=False)
    solver = _HomotopySolver(options, problem, constant, least_step)
    solutions, steps = list[Solution](), list[Step]()
    for target in targets:
        last = _at_target(solver, last, target, steps)
        solutions.append(last)
    return Homotopy(tuple(solutions), tuple(steps))


class _HomotopySolver(NamedTuple):
    """Solves a problem at values of a constant; what stays the same on the way."""

    options: SolveOptions
    problem: Problem
    constant: Constant
    least_step: float

    def solved(self, value: float, last: Solution, *, final: bool) -> Solution:
        """The solution at a value of the constant, from another one; replayed if it is final."""
        solved = partial(
            self.options.solved,
            self.problem,
            constants={self.constant: value},
            verify=self.options.settings.verify and final,
        )
        found = solved(guess=last)
        # beyond a bifurcation a saddle may follow on a minimum
        if final and (lower := lower_beside(found.kept_iterate, found.evaluator)):
            found = solved(guess=lower.trajectory)
        return found


def _at_target(
    solver: _HomotopySolver, last: Solution, target: float, steps: list[Step]
) -> Solution:
    """The solution at a value of the constant, by steps from another one, which are noted."""
    first = float(last.trajectory.constants[solver.constant.name])
    reached, step = 0.0, 1.0  # fractions of the way
    while reached < 1.0:
        fraction = min(reached + step, 1.0)
        value = target if fraction == 1.0 else first + fraction * (target - first)
        try:
            found = solver.solved(value, last, final=fraction == 1.0)
        except Unverified:
            # shorter steps lead to the same answer
            raise
        except SolveFailed as error:
            steps.append(Step(value, False))
            step = _SHRINKING * (fraction - reached)
            if step < solver.least_step:
                at, named = first + reached * (target - first), solver.constant
                raise HomotopyStopped(
                    f"the homotopy in '{named.name}' stopped at {at:.6g} {named.unit} before "
                    f"{target:.6g} {named.unit}: even steps of {solver.least_step:.2g} of the "
                    f"interval fail ({error}); accept this value, allow smaller steps "
                    "(least_step) or change another constant first",
                    at,
                    last,
                    tuple(steps),
                ) from error
            continue
        steps.append(Step(value, True))
        last, step, reached = found, _GROWTH * (fraction - reached), fraction
    return last
