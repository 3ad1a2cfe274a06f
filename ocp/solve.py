"""The one verb: `solve` a problem, refine its mesh, verify the answer."""

from __future__ import annotations

import dataclasses
import time as clock
from collections.abc import Mapping
from dataclasses import dataclass

from ocp.errors import Interrupted, StatementError, Unverified
from ocp.mesh.evaluation import Evaluator
from ocp.mesh.mesh import Mesh, uniform
from ocp.mesh.trajectory import Trajectory
from ocp.nlp.failures import collapsed, failure
from ocp.nlp.retries import solve_round
from ocp.optimality.multipliers import multipliers, solved_program
from ocp.optimality.warm_start import Origin
from ocp.problem.integrator_chains import first_degree
from ocp.problem.sense import check_sense
from ocp.problem.statement import Problem
from ocp.problem.symbols import Constant
from ocp.refinement.budget import Budget
from ocp.refinement.loop import (
    Ending,
    Progress,
    Solved,
    Task,
    best,
    budget_error,
    holds,
    listener,
    method_of,
    solve_rounds,
)
from ocp.settings import Settings
from ocp.solution.solution import Solution, Verification
from ocp.transcription.packing import trajectory_of
from ocp.verification.simulation import Replay, replay, replayed
from ocp.verification.verify import unverified, verify

_STRICTER_GOES = 3


def solve(
    problem: Problem,
    *,
    settings: Settings | None = None,
    guess: Solution | Trajectory | None = None,
    mesh: Mesh | None = None,
    constants: Mapping[Constant, float] | None = None,
    bound: float | None = None,
    progress: Progress | None = None,
) -> Solution:
    """Solve an optimal control problem and verify the answer.

    Parameters
    ----------
    guess : Solution or Trajectory, optional
        Where to start instead of the guess in the statement; its mesh may differ.  A solution of
        the same problem (for other `constants`, say) gives its multipliers and its scales too,
        and on its own mesh its nonlinear program, which then is not built again.
    mesh : Mesh, optional
        First mesh; by default that of the guess if it is a `Solution`, else a uniform one.
    constants : mapping of Constant to number, optional
        Values that replace those of the statement.
    bound : float, optional
        A proven bound of the optimum: a lower one when minimising, an upper one when maximising.
    progress : callable, optional
        Receives one line of text per iteration.

    Raises
    ------
    StatementError
        The statement contradicts itself.
    SolveFailed
        No solution was found; the message names the worst constraint.
    Unverified
        The solver's answer did not pass its verification; ``error.iterate`` holds it.
    BudgetSpent
        The budget of the settings ended before any round held between its points.
    Interrupted
        The user stopped the solve.
    """
    settings = settings or Settings()
    if mesh is None:
        mesh = guess.mesh if isinstance(guess, Solution) else first_mesh(problem, settings)
    origin = origin_of(problem, settings, guess)
    return solve_from(origin, problem, settings, mesh, constants, bound, progress)


def solve_from(
    origin: Origin, problem: Problem, settings: Settings, mesh: Mesh,
    constants: Mapping[Constant, float] | None = None, bound: float | None = None,
    progress: Progress | None = None,
) -> Solution:  # fmt: skip
    """`solve` from a given origin and mesh."""
    budget, values = Budget.of(settings), constant_values(problem, constants)
    check_sense(problem, values)
    task = Task(problem, settings, values, Evaluator(problem), budget, bound, progress)
    strict, checking = settings, 0.0
    for _ in range(_STRICTER_GOES):
        rounds, ending = solve_rounds(task, strict, origin, mesh)
        last = best(rounds, strict)
        if ending == "budget" and not holds(last, strict):
            raise budget_error(task, last.trajectory, last)
        checked = _checked(task, last)
        checking += checked.verification.seconds
        if not (settings.refine and settings.verify) or task.spent:
            break
        if checked.replay.miss <= settings.replay_tolerance:
            break
        # every interval meets its tolerance, yet their errors add up to a miss
        strict = dataclasses.replace(strict, dynamics_tolerance=strict.dynamics_tolerance / 30.0)
        mesh, origin = last.transcription.mesh, last.origin
    verification = dataclasses.replace(checked.verification, seconds=checking)
    return _finished(task, last, dataclasses.replace(checked, verification=verification), ending)


def collocate(
    problem: Problem, *, settings: Settings | None = None, guess: Trajectory | None = None,
    mesh: Mesh | None = None, progress: Progress | None = None,
) -> tuple[Trajectory, float]:  # fmt: skip
    """Solve on one mesh and return what IPOPT found, neither refined nor verified.

    For callers who replay the answer on models of their own; others want `solve`. Arguments and
    errors are those of `solve`.

    Returns
    -------
    The trajectory and the objective's value.
    """
    settings, values, origin = settings or Settings(), constant_values(problem, None), Origin(guess)
    task = Task(problem, settings, values, Evaluator(problem), Budget.of(settings), None, progress)
    mesh = mesh or first_mesh(problem, settings)
    made = origin.transcription(problem, mesh, method_of(settings), values, settings.compile)
    result = solve_round(made, origin, values, settings, task.budget, 0, listener(made, task))
    found = trajectory_of(made, result.x, values)
    if result.outcome == "interrupted":
        raise Interrupted(f"'{problem.name}' was stopped", found, None, None)
    if result.outcome != "solved":
        raise failure(made, result, made.rows.evaluate(values), found)
    return found, problem.sense * result.objective * made.scales.objective


@dataclass(frozen=True, eq=False)
class _Checked:
    """The replay of a round and what it says."""

    replay: Replay
    replayed: Trajectory
    verification: Verification


def _checked(task: Task, last: Solved) -> _Checked:
    if not task.settings.verify:
        return _Checked(Replay(()), last.trajectory, unverified(last.objective))
    before = clock.perf_counter()
    done = replay(task.problem, last.trajectory, dict(last.transcription.scales.signals))
    again = replayed(last.trajectory, done)
    found = verify(task.settings, last.transcription, last.trajectory, done, again,
                   task.evaluator, last.objective)  # fmt: skip
    seconds = clock.perf_counter() - before
    return _Checked(done, again, dataclasses.replace(found, seconds=seconds))


def constant_values(problem: Problem, changed: Mapping[Constant, float] | None) -> dict[str, float]:
    """Values of the constants by name, those that are changed in their place."""
    values = {c.name: float(c.value) for c in problem.constants}
    for constant, value in (changed or {}).items():
        if constant.name not in values:
            raise StatementError(
                f"problem '{problem.name}' does not use the constant '{constant.name}'"
            )
        values[constant.name] = float(value)
    return values


def origin_of(problem: Problem, settings: Settings, guess: Solution | Trajectory | None) -> Origin:
    """Where to start; with multipliers if the guess is a solution of the very problem."""
    if not isinstance(guess, Solution):
        return Origin(guess)
    program = guess.program
    if program is None or program.problem is not problem or program.method != method_of(settings):
        return Origin(guess.trajectory)
    return Origin(guess.trajectory, program)


def first_mesh(problem: Problem, settings: Settings) -> Mesh:
    """The uniform mesh of a first round."""
    return Mesh(tuple(
        uniform(settings.intervals, first_degree(problem, phase, settings))
        for phase in problem.phases
    ))  # fmt: skip


def _finished(task: Task, last: Solved, checked: _Checked, ending: Ending) -> Solution:
    if error := collapsed(last.transcription, last.trajectory):
        raise error
    program = solved_program(last.transcription, last.result)
    verdict = _verdict(task, last.objective)
    if short := _short(task, last, ending):
        verdict += f"; {short}"
    solution = Solution(
        task.problem, last.objective, last.trajectory, checked.replayed, checked.replay,
        checked.verification, last.transcription.mesh, tuple(task.record),
        verdict if checked.verification.passed else "unverified", task.evaluator,
        clock.perf_counter() - task.budget.begin, multipliers(program, last.trajectory), program,
    )  # fmt: skip
    if not checked.verification.passed and task.settings.refine and task.settings.verify:
        ended = f" when the budget of {task.budget} was used up" if ending == "budget" else ""
        raise Unverified(
            f"the answer for '{task.problem.name}' did not pass its verification{ended}: "
            + "; ".join(checked.verification.reasons) + "; loosen the tolerance named, allow more "
            "rounds or intervals, or look at the unverified answer in error.iterate",
            solution)  # fmt: skip
    return solution


def _short(task: Task, last: Solved, ending: Ending) -> str:
    """Why the refinement ended short of its tolerances, if it did."""
    if ending == "budget":
        return f"the budget of {task.budget} ended the refinement"
    if not task.settings.refine or ending == "tolerances":
        return ""
    gain = last.assessment.gain
    found = f"finer controls promise a gain of {gain:.0e}"
    if gain <= task.settings.objective_tolerance:
        found = "the errors between the points were not all below tolerance"
    where = f"{len(task.record)} mesh rounds" if ending == "rounds" else "a mesh that failed"
    return f"refinement ended after {where}, when {found}"


def _verdict(task: Task, objective: float) -> str:
    if task.bound is not None:
        gap = abs(objective - task.bound) / max(abs(task.bound), 1e-300)
        if gap <= max(10 * task.settings.objective_tolerance, 1e-5):
            return f"global: bound met (gap {gap:.1e})"
    return "local: best of 1 start"
