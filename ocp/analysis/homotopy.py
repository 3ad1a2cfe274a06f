"""From an easy value of a constant to a hard one, in steps as long as the solver takes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from ocp.errors import HomotopyStopped, SolveFailed, StatementError, Unverified
from ocp.problem.problem import Problem
from ocp.problem.symbols import Constant
from ocp.progress import Progress
from ocp.settings import Settings
from ocp.solution.solution import Solution
from ocp.solve import solve

_GROWTH = 2.0


@dataclass(frozen=True)
class Step:
    """One attempt of a homotopy; a failed one has neither iterations nor objective."""

    value: float
    solved: bool
    iterations: int | None = None
    objective: float | None = None


@dataclass(frozen=True, eq=False)
class Homotopy:
    """A path of solutions.

    Attributes
    ----------
    solutions : at the values that were asked for, in their order, verified.
    steps : all attempts, those in between and the failed ones included.
    """

    solutions: tuple[Solution, ...]
    steps: tuple[Step, ...]

    @property
    def solution(self) -> Solution:
        """The last solution."""
        return self.solutions[-1]


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
    value is tried in one step; a step that fails is halved, one that succeeds lets the next be
    twice as long.  Solutions between the values asked for are not replayed.

    Parameters
    ----------
    values : where the constant goes, one value or several in order.
    guess : where to start, at the value of the constant that it was solved for; by default the
        problem is first solved as stated, or with the value in `constants`.
    constants : values of other constants.
    least_step : shortest step, as a fraction of the way to the next value.

    Raises
    ------
    HomotopyStopped
        No step was short enough; the error tells the last value reached and holds its solution.
    Unverified
        The answer at a value that was asked for did not pass its verification.
    StatementError, SolveFailed, Interrupted
        As `ocp.solve`, of the first solve.
    """
    wanted = [float(values)] if isinstance(values, (int, float)) else [float(v) for v in values]
    if not wanted:
        raise StatementError(
            f"the homotopy in '{constant.name}' has no value to go to; give at least one"
        )
    if not 0 < least_step <= 1:
        raise StatementError(f"the least step of a homotopy is {least_step!r}; give 0 < step <= 1")
    settings, others = settings or Settings(), dict(constants or {})
    if guess is None:
        unchecked = replace(settings, verify=False)
        guess = solve(problem, settings=unchecked, constants=others, progress=progress)
    path = _Path(problem, constant, settings, others, least_step, progress)
    solutions, steps = [], []
    for target in wanted:
        guess, taken = path.follow(guess, target)
        solutions.append(guess)
        steps += taken
    return Homotopy(tuple(solutions), tuple(steps))


@dataclass(frozen=True, eq=False)
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
        done, step, steps, last = 0.0, 1.0, [], start
        while True:
            at = min(done + step, 1.0)
            value = target if at == 1.0 else first + at * (target - first)
            try:
                last = self._solved(last, value, final=at == 1.0)
            except Unverified:  # shorter steps lead to the same answer
                raise
            except SolveFailed as error:
                steps.append(Step(value, False))
                step = 0.5 * (at - done)
                if step < self.least:
                    raise self._stopped(first + done * (target - first), target, last, error,
                                        steps) from error  # fmt: skip
                continue
            steps.append(Step(value, True, last.iterations, last.objective))
            if at == 1.0:
                return last, steps
            done, step = at, _GROWTH * (at - done)

    def _solved(self, last: Solution, value: float, final: bool) -> Solution:
        settings = replace(self.settings, verify=final and self.settings.verify)
        constants = {**self.others, self.constant: value}
        return solve(self.problem, settings=settings, guess=last, constants=constants,
                     progress=self.progress)  # fmt: skip

    def _stopped(
        self, reached: float, target: float, last: Solution, error: SolveFailed,
        steps: Sequence[Step],
    ) -> HomotopyStopped:  # fmt: skip
        name, unit = self.constant.name, self.constant.unit
        return HomotopyStopped(
            f"the homotopy in '{name}' stopped at {reached:.6g} {unit} on the way to "
            f"{target:.6g} {unit}: steps of {self.least:.2g} of the way still fail ({error}); "
            "take this value, allow shorter steps (least_step) or change another constant first",
            reached, last, tuple(steps),
        )  # fmt: skip
