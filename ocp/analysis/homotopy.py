"""From an easy value of a constant to a hard one, in steps as long as the solver takes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ocp.algorithm import solve
from ocp.errors import HomotopyStopped, SolveFailed, StatementError, Unverified
from ocp.keywords import checked_keywords
from ocp.problem.problem import Problem
from ocp.problem.symbols import Constant
from ocp.progress import Progress
from ocp.refinement.saddles import lower_beside
from ocp.settings import Settings
from ocp.solution.solution import Solution

_GROWTH = 2.0  # of a step after one that succeeded
_SHRINKING = 0.5  # of a step that failed


@dataclass(frozen=True)
class Step:
    """One attempt of a homotopy; a failed one has neither iterations nor objective.

    Attributes
    ----------
    value : float
        Of the constant [its unit].
    solved : bool
    iterations : int or None
        Of the solver.
    objective : float or None
    """

    value: float
    solved: bool
    iterations: int | None = None
    objective: float | None = None


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
    if constant not in set(problem.constants):
        names = ", ".join(f"'{known.name}'" for known in problem.constants) or "none"
        raise StatementError(
            f"problem '{problem.name}' does not use the constant '{constant.name}'; there are: "
            f"{names}"
        )
    if not targets:
        raise StatementError(
            f"the homotopy in '{constant.name}' has no value to go to; give at least one"
        )
    if not 0 < least_step <= 1:
        raise StatementError(f"the least step of a homotopy is {least_step!r}; give 0 < step <= 1")

    settings, others = settings or Settings(), dict(constants or {})
    if guess is None:
        unchecked = replace(settings, verify=False)
        guess = solve(
            problem, settings=unchecked, constants=others, progress=progress, partial=False
        )

    path = _Path(problem, constant, settings, others, least_step, progress)
    solutions, steps = [], []
    for target in targets:
        guess, taken = path.follow(guess, target)
        solutions.append(guess)
        steps += taken
    return Homotopy(tuple(solutions), tuple(steps))


@dataclass(frozen=True, eq=False, repr=False)
class _Path:
    """What all steps have in common."""

    problem: Problem
    constant: Constant
    settings: Settings
    others: dict[Constant, float]
    least: float
    progress: Progress | bool | None

    def follow(self, start: Solution, target: float) -> tuple[Solution, list[Step]]:
        """From a solution to the one at `target`, and the steps taken."""
        first = float(start.trajectory.constants[self.constant.name])
        last, steps = start, list[Step]()
        reached, step = 0.0, 1.0  # fractions of the way
        while True:
            fraction = min(reached + step, 1.0)
            value = target if fraction == 1.0 else first + fraction * (target - first)
            try:
                last = self._solved(last, value, final=fraction == 1.0)
            except Unverified:
                # shorter steps lead to the same answer
                raise
            except SolveFailed as error:
                steps.append(Step(value, False))
                step = _SHRINKING * (fraction - reached)
                if step < self.least:
                    value = first + reached * (target - first)
                    raise self._stopped(value, target, last, error, steps) from error
                continue

            steps.append(Step(value, True, last.iterations, last.objective))
            if fraction == 1.0:
                return last, steps
            reached, step = fraction, _GROWTH * (fraction - reached)

    def _solved(self, last: Solution, value: float, final: bool) -> Solution:
        """The solution at a value, verified only where that was asked for.

        Beyond a bifurcation a saddle may follow on a minimum. It is left where a value was asked
        for.
        """
        solved = partial(
            solve,
            self.problem,
            settings=replace(self.settings, verify=final and self.settings.verify),
            constants={**self.others, self.constant: value},
            progress=self.progress,
        )
        found = solved(guess=last)
        if final and (lower := lower_beside(found.kept_iterate, found.evaluator)):
            return solved(guess=lower.trajectory)
        return found

    def _stopped(
        self,
        reached: float,
        target: float,
        last: Solution,
        error: SolveFailed,
        steps: Sequence[Step],
    ) -> HomotopyStopped:
        name, unit = self.constant.name, self.constant.unit
        return HomotopyStopped(
            f"the homotopy in '{name}' stopped at {reached:.6g} {unit} on the way to "
            f"{target:.6g} {unit}: steps of {self.least:.2g} of the way still fail ({error}); "
            "take this value, allow shorter steps (least_step) or change another constant first",
            reached,
            last,
            tuple(steps),
        )
