"""Mesh rounds: solve, assess, refine, until all tolerances are met."""

from __future__ import annotations

import dataclasses
import itertools
import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ocp.errors import BudgetSpent, Interrupted
from ocp.mesh.evaluation import Evaluator
from ocp.mesh.mesh import Mesh, bisected
from ocp.mesh.trajectory import Trajectory
from ocp.nlp.failures import failure
from ocp.nlp.ipopt import Duals, Listener, NlpResult
from ocp.nlp.retries import solve_round
from ocp.optimality.multipliers import solved_program
from ocp.optimality.warm_start import Origin
from ocp.problem.statement import Problem
from ocp.refinement.budget import Budget
from ocp.refinement.error_estimate import Assessment, assess
from ocp.refinement.policy import next_mesh
from ocp.settings import Settings
from ocp.solution.solution import Round
from ocp.transcription.packing import trajectory_of
from ocp.transcription.transcribe import Method, Transcription

Array = NDArray[np.float64]
Progress = Callable[[str], None]
Ending = Literal["tolerances", "rounds", "failure", "budget"]
_INFORMED = ("radau", "gauss")  # whose multipliers tell what finer controls gain
_LOOSE = 1e-7  # IPOPT's tolerance while the last mesh was
_FAR = 1e-3  # this wrong or more: the digits beyond are lost with the next mesh
log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class Solved:
    """One solved mesh round.

    Attributes
    ----------
    violation : of the program's rows, scaled.
    tight : whether it was solved to the tolerance asked for.
    controls_refined : whether its mesh has more intervals than the one before.
    """

    transcription: Transcription
    result: NlpResult
    trajectory: Trajectory
    assessment: Assessment
    objective: float
    violation: float
    tight: bool
    controls_refined: bool = False

    @property
    def origin(self) -> Origin:
        """The round as the start of the next one."""
        program = solved_program(self.transcription, self.result)
        return Origin(self.trajectory, program, self.objective)


@dataclass(frozen=True, eq=False)
class Task:
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


def method_of(settings: Settings) -> Method:
    """How the settings discretise."""
    return Method(settings.scheme, settings.control_shape)


def solve_rounds(
    task: Task, settings: Settings, origin: Origin, mesh: Mesh
) -> tuple[list[Solved], Ending]:
    """Solve, assess and refine until all tolerances are met or rounds or budget are used up.

    Returns
    -------
    The solved rounds, and what ended them.
    """
    solved: list[Solved] = []
    record, most, finer = task.record, len(task.record) + settings.rounds, False
    far = settings.refine and origin.program is None
    try:
        while True:
            transcription = origin.transcription(
                task.problem, mesh, method_of(settings), task.constants, settings.compile
            )
            options = settings.ipopt.loosened(_LOOSE) if far else settings.ipopt
            result = solve_round(
                transcription, origin, task.constants, dataclasses.replace(settings, ipopt=options),
                task.budget, task.iterations, listener(transcription, task),
            )  # fmt: skip
            if result.outcome == "solved":
                tight = options is settings.ipopt
                solved.append(_examined(transcription, result, task, tight, finer))
                record.append(_round(solved[-1]))
                log.info("round %d: %s", len(record), record[-1])
                following = _following(solved, settings) if settings.refine else None
                far = following is not None and _error(solved[-1]) >= _FAR
                if not tight and (following is None or len(record) >= most):
                    following = mesh  # once more, to the tolerance asked for
                    far = False
            else:
                record.append(_failed_round(transcription, result))
                _raise_without_rounds(task, transcription, result, solved)
                if task.spent:
                    return solved, "budget"
                if not any(m.movable for m in mesh.phases):
                    return solved, "failure"
                # moving breakpoints led astray: hold them still and bisect from the last round
                settings = dataclasses.replace(settings, move_breakpoints=False)
                following = _frozen(_next_or_same(solved[-1], settings))
            if following is None:
                return solved, "tolerances"
            if len(record) >= most and following is not mesh:
                return solved, "rounds"
            if task.spent:
                return solved, "budget"
            finer = following.intervals > mesh.intervals
            mesh, origin = following, solved[-1].origin
    except KeyboardInterrupt as stop:
        raise _interrupted(task.problem, solved, settings, None) from stop


def _raise_without_rounds(
    task: Task, transcription: Transcription, result: NlpResult, solved: Sequence[Solved]
) -> None:
    """The error of a failed round that leaves nothing to go on from."""
    last = trajectory_of(transcription, result.x, task.constants)
    if result.outcome == "interrupted":
        raise _interrupted(task.problem, solved, task.settings, last)
    if task.spent and not any(holds(s, task.settings) for s in solved):
        raise budget_error(task, last, solved[-1] if solved else None)
    if not solved:
        raise failure(transcription, result, transcription.rows.evaluate(task.constants), last)


def budget_error(task: Task, last: Trajectory, finished: Solved | None) -> BudgetSpent:
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


def _examined(
    transcription: Transcription, result: NlpResult, task: Task, tight: bool, finer: bool
) -> Solved:
    """A solved round with its errors between the points."""
    trajectory = trajectory_of(transcription, result.x, task.constants)
    problem = transcription.problem
    objective = problem.sense * result.objective * transcription.scales.objective
    found = assess(
        transcription, trajectory, task.evaluator, task.settings.path_tolerance,
        Duals(result.bound_multipliers, result.row_multipliers), objective,
    )  # fmt: skip
    lower, upper = transcription.rows.evaluate(task.constants)
    violation = float(np.maximum(lower - result.rows, result.rows - upper).max(initial=0.0))
    return Solved(transcription, result, trajectory, found, objective, violation, tight, finer)


def _next_or_same(last: Solved, settings: Settings) -> Mesh:
    """The next mesh of a solved round, or its own."""
    found = next_mesh(last.transcription, last.trajectory, last.assessment, settings, True)
    return found or last.transcription.mesh


def _following(solved: Sequence[Solved], settings: Settings) -> Mesh | None:
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


def _error(last: Solved) -> float:
    """What is wrong with the mesh of a round, and what a better one gains, relative."""
    found = last.assessment
    return max(found.gain, found.excess, found.dynamics)


def _change(before: Solved, after: Solved) -> float:
    """Relative change of the objective from one round to another."""
    size = max(abs(after.objective), 1e-3 * after.transcription.scales.objective)
    return abs(after.objective - before.objective) / size


def holds(solved: Solved, settings: Settings) -> bool:
    """Whether a round's motion meets the dynamics and all constraints, between its points too."""
    found = solved.assessment
    excess = max(found.excess, solved.violation)
    return found.dynamics <= settings.dynamics_tolerance and excess <= settings.path_tolerance


def best(solved: Sequence[Solved], settings: Settings) -> Solved:
    """The best round that holds between the points; the last one if none does.

    Those solved to the tolerance asked for come first: values of others err by theirs.
    """
    good = [s for s in solved if holds(s, settings)]
    good = [s for s in good if s.tight] or good
    sense = solved[-1].transcription.problem.sense
    return min(good, key=lambda s: sense * s.objective, default=solved[-1])


def _frozen(mesh: Mesh) -> Mesh:
    return Mesh(tuple(m.frozen() for m in mesh.phases), mesh.extra)


def listener(transcription: Transcription, task: Task) -> Listener | None:
    """What passes the solver's progress on, if anybody wants to know."""
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
    problem: Problem, solved: Sequence[Solved], settings: Settings, last: Trajectory | None
) -> Interrupted:
    """The error of a stopped solve, with the last iterate and the best round that holds."""
    last_good = best(solved, settings) if solved else None
    finished = last_good.trajectory if last_good is not None else None
    verified = finished if last_good is not None and holds(last_good, settings) else None
    kept = "the best round so far is kept" if verified else "no round had met its tolerances"
    return Interrupted(
        f"'{problem.name}' was stopped in mesh round {len(solved) + 1}; {kept}",
        last, finished, verified,
    )  # fmt: skip


def _round(solved: Solved) -> Round:
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
