"""The one verb: `solve` a problem, refine its mesh, verify the answer."""

from __future__ import annotations

import dataclasses
import itertools
import logging
import time as clock
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ocp.assess import Assessment, assess
from ocp.attempts import solve_round
from ocp.budget import Budget
from ocp.chains import first_degree
from ocp.diagnose import collapsed, failure
from ocp.errors import BudgetSpent, Interrupted, StatementError, Unverified
from ocp.evaluate import Evaluator
from ocp.ipopt import Listener, NlpResult
from ocp.iterate import trajectory_of
from ocp.mesh import Mesh, bisected, uniform
from ocp.multipliers import multipliers, solved_program
from ocp.refine import next_mesh
from ocp.replay import Replay, replay, replayed
from ocp.sense import check_sense
from ocp.settings import Settings
from ocp.solution import Round, Solution, Verification
from ocp.statement import Problem
from ocp.symbols import Constant
from ocp.trajectory import Trajectory
from ocp.transcribe import Method, Transcription
from ocp.verify import unverified, verify
from ocp.warm import Origin

Array = NDArray[np.float64]
Progress = Callable[[str], None]
_STRICTER_GOES = 3
_INFORMED = ("radau", "gauss")  # whose multipliers tell what finer controls gain
log = logging.getLogger(__name__)


@dataclass(frozen=True)
class _Solved:
    """One solved mesh round."""

    transcription: Transcription
    result: NlpResult
    trajectory: Trajectory
    assessment: Assessment
    objective: float
    controls_refined: bool = False

    @property
    def origin(self) -> Origin:
        """The round as the start of the next one."""
        program = solved_program(self.transcription, self.result)
        return Origin(self.trajectory, program, self.objective)


@dataclass(frozen=True)
class _Task:
    """What stays the same in all rounds of a solve, and their record."""

    problem: Problem
    settings: Settings
    constants: dict[str, float]
    evaluator: Evaluator
    budget: Budget
    bound: float | None
    progress: Progress | None
    record: list[Round] = field(default_factory=list)

    @property
    def iterations(self) -> int:
        """Iterations so far."""
        return sum(r.iterations for r in self.record)

    @property
    def spent(self) -> bool:
        """Whether the budget is used up."""
        return self.budget.spent(self.iterations)


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
    task = _Task(problem, settings, values, Evaluator(problem), budget, bound, progress)
    strict, checking = settings, 0.0
    for _ in range(_STRICTER_GOES):
        rounds, converged = _rounds(task, strict, origin, mesh)
        last = _best(rounds, strict)
        if not converged and not _holds(last, strict):
            raise _spent(task, last.trajectory, last)
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
    return _finished(task, last, dataclasses.replace(checked, verification=verification), converged)


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
    task = _Task(problem, settings, values, Evaluator(problem), Budget.of(settings), None, progress)
    mesh = mesh or first_mesh(problem, settings)
    made = origin.transcription(problem, mesh, method_of(settings), values, settings.compile)
    result = solve_round(made, origin, values, settings, task.budget, 0, _listener(made, task))
    found = trajectory_of(made, result.x, values)
    if result.outcome == "interrupted":
        raise Interrupted(f"'{problem.name}' was stopped", found, None, None)
    if result.outcome != "solved":
        raise failure(made, result, made.rows.evaluate(values), found)
    return found, problem.sense * result.objective * made.scales.objective


@dataclass(frozen=True)
class _Checked:
    """The replay of a round and what it says."""

    replay: Replay
    replayed: Trajectory
    verification: Verification


def _checked(task: _Task, last: _Solved) -> _Checked:
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


def method_of(settings: Settings) -> Method:
    """How the settings discretise."""
    return Method(settings.scheme, settings.control_shape)


def first_mesh(problem: Problem, settings: Settings) -> Mesh:
    """The uniform mesh of a first round."""
    return Mesh(tuple(
        uniform(settings.intervals, first_degree(problem, phase, settings))
        for phase in problem.phases
    ))  # fmt: skip


def _rounds(
    task: _Task, settings: Settings, origin: Origin, mesh: Mesh
) -> tuple[list[_Solved], bool]:
    """Solve, assess and refine until all tolerances are met or rounds or budget are used up.

    Returns
    -------
    The solved rounds, and False if the budget ended them.
    """
    solved: list[_Solved] = []
    record, most, finer = task.record, len(task.record) + settings.rounds, False
    try:
        while True:
            transcription = origin.transcription(
                task.problem, mesh, method_of(settings), task.constants, settings.compile
            )
            result = solve_round(transcription, origin, task.constants, settings,
                                 task.budget, task.iterations,
                                 _listener(transcription, task))  # fmt: skip
            if result.outcome == "solved":
                solved.append(_examined(transcription, result, task, finer))
                record.append(_round(solved[-1]))
                log.info("round %d: %s", len(record), record[-1])
                following = _following(solved, settings) if settings.refine else None
            else:
                record.append(_failed_round(transcription, result))
                _raise_without_rounds(task, transcription, result, solved)
                if task.spent:
                    return solved, False
                if not any(m.movable for m in mesh.phases):
                    break
                # moving breakpoints led astray: hold them still and bisect from the last round
                settings = dataclasses.replace(settings, move_breakpoints=False)
                following = _frozen(_next_or_same(solved[-1], settings))
            if following is None or len(record) >= most:
                break
            if task.spent:
                return solved, False
            finer = following.intervals > mesh.intervals
            mesh, origin = following, solved[-1].origin
    except KeyboardInterrupt as stop:
        raise _interrupted(task.problem, solved, settings, None) from stop
    return solved, True


def _raise_without_rounds(
    task: _Task, transcription: Transcription, result: NlpResult, solved: Sequence[_Solved]
) -> None:
    """The error of a failed round that leaves nothing to go on from."""
    last = trajectory_of(transcription, result.x, task.constants)
    if result.outcome == "interrupted":
        raise _interrupted(task.problem, solved, task.settings, last)
    if task.spent and not any(_holds(s, task.settings) for s in solved):
        raise _spent(task, last, solved[-1] if solved else None)
    if not solved:
        raise failure(transcription, result, transcription.rows.evaluate(task.constants), last)


def _spent(task: _Task, last: Trajectory, finished: _Solved | None) -> BudgetSpent:
    """The error of a budget that ended before a round held between its points."""
    done = "no mesh round was solved" if finished is None else (
        f"the errors between the points were still {finished.assessment.dynamics:.1e} of the "
        f"dynamics and {max(finished.assessment.excess, 0.0):.1e} of the constraints"
    )  # fmt: skip
    return BudgetSpent(
        f"the budget of {task.budget} for '{task.problem.name}' ended in mesh round "
        f"{len(task.record)} after {task.iterations} iterations: {done}; raise the budget, loosen "
        "the tolerances or give a better guess",
        last, None if finished is None else finished.trajectory,
    )  # fmt: skip


def _examined(transcription: Transcription, result: NlpResult, task: _Task, finer: bool) -> _Solved:
    """A solved round with its errors between the points."""
    trajectory = trajectory_of(transcription, result.x, task.constants)
    problem = transcription.problem
    objective = problem.sense * result.objective * transcription.scales.objective
    found = assess(
        transcription, trajectory, task.evaluator, task.settings.path_tolerance,
        result.row_multipliers, objective,
    )  # fmt: skip
    return _Solved(transcription, result, trajectory, found, objective, finer)


def _next_or_same(last: _Solved, settings: Settings) -> Mesh:
    """The next mesh of a solved round, or its own."""
    found = next_mesh(last.transcription, last.trajectory, last.assessment, settings, True)
    return found or last.transcription.mesh


def _following(solved: Sequence[_Solved], settings: Settings) -> Mesh | None:
    """The mesh of the next round, or None when the last round meets all tolerances."""
    last = solved[-1]
    pairs = list(itertools.pairwise(solved))
    if settings.scheme not in _INFORMED:  # a change that was small once says nothing later
        pairs = pairs[-1:]
    settled = any(
        after.controls_refined and _change(before, after) <= settings.objective_tolerance
        for before, after in pairs
    )
    following = next_mesh(
        last.transcription, last.trajectory, last.assessment, settings,
        resolve_controls=not settled,
    )  # fmt: skip
    if following is None and not settled and settings.scheme not in _INFORMED:
        # the multipliers of these schemes meet the minimum principle on any mesh: compare two
        return bisected(last.transcription.mesh, settings.most_intervals)
    return following


def _change(before: _Solved, after: _Solved) -> float:
    """Relative change of the objective from one round to another."""
    size = max(abs(after.objective), 1e-3 * after.transcription.scales.objective)
    return abs(after.objective - before.objective) / size


def _holds(solved: _Solved, settings: Settings) -> bool:
    """Whether a round's motion meets the dynamics and all constraints between its points."""
    found = solved.assessment
    return found.dynamics <= settings.dynamics_tolerance and found.excess <= settings.path_tolerance


def _best(solved: Sequence[_Solved], settings: Settings) -> _Solved:
    """The best round whose motion holds between the points; the last one if none does."""
    holds = [s for s in solved if _holds(s, settings)]
    sense = solved[-1].transcription.problem.sense
    return min(holds, key=lambda s: sense * s.objective, default=solved[-1])


def _frozen(mesh: Mesh) -> Mesh:
    return Mesh(tuple(m.frozen() for m in mesh.phases), mesh.extra)


def _listener(transcription: Transcription, task: _Task) -> Listener | None:
    progress, number = task.progress, len(task.record)
    if progress is None:
        return None
    scale = transcription.scales.objective * transcription.problem.sense

    def listen(iteration: int, objective: float, x: Array, rows: Array) -> bool:
        progress(
            f"{transcription.problem.name}: mesh round {number + 1} "
            f"({transcription.mesh.intervals} intervals), iteration {iteration}, "
            f"objective {objective * scale:.6g}"
        )
        return False

    return listen


def _interrupted(
    problem: Problem, solved: Sequence[_Solved], settings: Settings, last: Trajectory | None
) -> Interrupted:
    """The error of a stopped solve, with the last iterate and the best round that holds."""
    best = _best(solved, settings) if solved else None
    finished = best.trajectory if best is not None else None
    verified = finished if best is not None and _holds(best, settings) else None
    kept = "the best round so far is kept" if verified else "no round had met its tolerances"
    return Interrupted(
        f"'{problem.name}' was stopped in mesh round {len(solved) + 1}; {kept}",
        last, finished, verified,
    )  # fmt: skip


def _round(solved: _Solved) -> Round:
    mesh = solved.transcription.mesh
    return Round(
        mesh.intervals, sum(e.tau.size for extra in mesh.extra for e in extra),
        sum(len(m.movable) for m in mesh.phases), solved.result.iterations,
        solved.result.seconds, solved.objective, solved.assessment.dynamics,
        solved.assessment.excess, solved.assessment.gain, solved.result.status,
        solved.result.solver,
    )  # fmt: skip


def _failed_round(transcription: Transcription, result: NlpResult) -> Round:
    mesh = transcription.mesh
    return Round(
        mesh.intervals, sum(e.tau.size for extra in mesh.extra for e in extra),
        sum(len(m.movable) for m in mesh.phases), result.iterations, result.seconds,
        float("nan"), float("nan"), float("nan"), float("nan"), result.status,
    )  # fmt: skip


def _finished(task: _Task, last: _Solved, checked: _Checked, converged: bool) -> Solution:
    if error := collapsed(last.transcription, last.trajectory):
        raise error
    program = solved_program(last.transcription, last.result)
    verdict = _verdict(task, last.objective)
    if not converged:
        verdict += f"; the budget of {task.budget} ended the refinement"
    solution = Solution(
        task.problem, last.objective, last.trajectory, checked.replayed, checked.replay,
        checked.verification, last.transcription.mesh, tuple(task.record),
        verdict if checked.verification.passed else "unverified", task.evaluator,
        clock.perf_counter() - task.budget.begin, multipliers(program, last.trajectory), program,
    )  # fmt: skip
    if not checked.verification.passed and task.settings.refine and task.settings.verify:
        ended = "" if converged else f" when the budget of {task.budget} was used up"
        raise Unverified(
            f"the answer for '{task.problem.name}' did not pass its verification{ended}: "
            + "; ".join(checked.verification.reasons) + "; loosen the tolerance named, allow more "
            "rounds or intervals, or look at the unverified answer in error.iterate",
            solution)  # fmt: skip
    return solution


def _verdict(task: _Task, objective: float) -> str:
    if task.bound is not None:
        gap = abs(objective - task.bound) / max(abs(task.bound), 1e-300)
        if gap <= max(10 * task.settings.objective_tolerance, 1e-5):
            return f"global: bound met (gap {gap:.1e})"
    return "local: best of 1 start"
