"""A mesh by way of a problem whose kinks are rounded, where the solver is lost among them.

Each step of a solver knows one branch of every kink. Where a step ends on another one it was the
wrong step, and the next one may lead back. So the first mesh fails, or takes thousands of
iterations, although there is nothing wrong with the statement.

Rounded kinks have one branch (`rounded_kinks`). The rounded problem is refined, and its
motion tells where kinks are crossed. With breakpoints there, and the side of each kink given beside
them, the problem itself is smooth, too, and is solved from that motion. A wide rounding may hide
what a motion does near a kink. So where that fails the widths become smaller, each answer the start
of the next.

Controls that rest on a kink of their own gain nothing by this: there the problem is not smooth at
its answer.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from ocp.accuracy import Accuracy
from ocp.errors import Interrupted, SolveFailed
from ocp.estimates.kink_crossings import NEAR_WHILE_ROUGH, kink_crossings
from ocp.estimates.motion_errors import MotionErrors
from ocp.mesh.initial_guess import initial_guess
from ocp.mesh.mesh import Mesh
from ocp.mesh.trajectory import Evaluator, Trajectory
from ocp.nlp.result import NlpResult
from ocp.optimality.iterate import Iterate
from ocp.problem.kinks.surfaces import roundable_kinks
from ocp.problem.parameters import Parameters, parameters_of
from ocp.problem.problem import Problem
from ocp.problem.symbols import Constant
from ocp.refinement.budget import Budget
from ocp.refinement.first_round.starts import MeshAnswer, MeshRound
from ocp.refinement.loop import History, refine_meshes
from ocp.refinement.mesh_iteration import MeshIteration, iterations_of, record_of
from ocp.refinement.mesh_solver import MeshSolver, Start
from ocp.refinement.past_kinks.rounded_kinks import with_rounded_kinks
from ocp.refinement.policies.kink_breakpoints import (
    AwaitedCrossings,
    CrossedMesh,
    with_crossings,
    with_sides,
)
from ocp.refinement.solved_mesh import SolvedMesh
from ocp.scaling.automatic import variations_of
from ocp.scaling.scales import Scales
from ocp.transcription.packing import trajectory_of
from ocp.transcription.transcribe import Transcription

# Iterations after which a first mesh of a problem with kinks counts as lost among them.
PATIENCE = 300

# How far a surface is rounded, by its size: less and less until the problem itself is solved.
_WIDTHS = (3e-2, 1e-2, 3e-3, 1e-3, 3e-4)

# Of the problem itself, once it is smooth: from a motion that is near it takes some dozens.
_FROM_NEAR = 100

# An answer may differ from that of the rounded problem by this part of the objective, and may miss
# its dynamics by this part of the states' sizes.
_APART = 0.1
_NO_MOTION = 1e-2

# Iterations of all rounded problems together
_MOST = 2000

# What a rounded problem is solved to. Its answer is as far off as its kinks are rounded.
_ROUGHLY = Accuracy(dynamics=1e-5, path=1e-4, objective=1e-4, replay=1e-4)

# The name of a constant that no statement has
_WIDTH = "part of their sizes by which kinks are rounded"

log = logging.getLogger(__name__)


def may_be_lost(meshes: MeshSolver, start: Start) -> bool:
    """Whether kinks may keep the solver from an answer of its first mesh.

    Not from an iterate: its multipliers are those of a motion on the right branches.
    """
    if not meshes.settings.refinement.adapts or isinstance(start, Iterate):
        return False
    phases = meshes.problem.phases
    return any(roundable_kinks(meshes.problem, phase.name).values for phase in phases)


def is_lost(result: NlpResult) -> bool:
    """Whether a mesh led to no answer for a reason that kinks may be."""
    return result.outcome in ("infeasible", "failed", "budget")


def lost_until_now(
    meshes: MeshSolver, result: NlpResult, solved: Sequence[SolvedMesh], accuracy: Accuracy
) -> bool:
    """Whether a further mesh failed, maybe among kinks, and none before holds."""
    if not (solved and is_lost(result) and may_be_lost(meshes, None)):
        return False
    return not any(each.is_verifiable(accuracy) for each in solved)


def past_kinks(
    this_round: MeshRound, start: Start, program: Transcription, failed: NlpResult
) -> MeshAnswer:
    """An answer on a mesh with breakpoints where kinks are crossed, or what failed.

    Parameters
    ----------
    this_round : MeshRound
        In which the solver was lost: the first one, or a later one before any motion was found.
    start : Trajectory or None
        From which that mesh failed.
    failed : NlpResult
        What came of it; its iterations are counted on.
    """
    meshes = this_round.meshes
    rounded = _Rounded.of(meshes, program.scales)
    if rounded is None:
        return MeshAnswer(program, failed)

    mesh, tally = _intervals_of(program.mesh), _Tally(this_round, program, failed)
    most = iterations_of(tally.rounds) + _MOST
    for width in _WIDTHS:
        if meshes.spent(tally.rounds):
            break
        try:
            rounded_meshes = rounded.meshes(meshes, width, most)
            motion, rounds = _refined(rounded_meshes, start, mesh, tally.rounds)
        except Interrupted:
            # what was finished until then is of another problem
            tally.failed = replace(tally.failed, outcome="interrupted")
            break
        tally.add(rounds)
        if motion is None:
            break

        tally.starts += rounds[0].starts
        start, mesh = motion, _intervals_of(motion.fixed_mesh)
        found = _smooth_beside_kinks(this_round, mesh, motion, tally.failed)
        if found is None:
            break
        log.info("kinks rounded by %g of their sizes led to: %s", width, found.result.status)
        agrees = found.result.outcome == "solved" and _agrees(meshes, found, motion)
        if agrees or found.result.outcome == "interrupted":
            return replace(found, starts=tally.starts + 1, lost=tally.starts)
        tally.go_on_from(found.result)
    return MeshAnswer(program, tally.failed, tally.starts)


@dataclass(eq=False)
class _Tally:
    """What was spent on the way past kinks, which counts for the mesh on which the solver failed.

    Attributes
    ----------
    this_round, program : of that mesh.
    failed : NlpResult
        What came of it, with all iterations and seconds until now.
    starts : int
        Starts that were tried.
    """

    this_round: MeshRound
    program: Transcription
    failed: NlpResult
    starts: int = 1

    @property
    def rounds(self) -> list[MeshIteration]:
        """Records of all mesh iterations until now."""
        return [*self.this_round.before, record_of(self.program.mesh, self.failed, None)]

    def add(self, rounds: Sequence[MeshIteration]) -> None:
        """Count mesh iterations of a rounded problem."""
        self.failed = replace(
            self.failed,
            iterations=self.failed.iterations + iterations_of(rounds),
            seconds=self.failed.seconds + sum(entry.seconds for entry in rounds),
        )

    def go_on_from(self, result: NlpResult) -> None:
        """Take over the count of a solve that went on from here."""
        self.failed = replace(self.failed, iterations=result.iterations, seconds=result.seconds)


def _refined(
    rounded: MeshSolver, start: Start, mesh: Mesh, before: Sequence[MeshIteration]
) -> tuple[Iterate | None, Sequence[MeshIteration]]:
    """The rounded problem's last motion, None if there is none, and its mesh iterations."""
    history = History(list(before))
    try:
        refine_meshes(rounded, start, mesh, _ROUGHLY, history)
        motion = history.solved[-1].iterate
    except SolveFailed as error:
        log.info("with rounded kinks: %s", error)
        motion = None
    return motion, history.rounds[history.before :]


def _smooth_beside_kinks(
    this_round: MeshRound, mesh: Mesh, motion: Iterate, spent: NlpResult
) -> MeshAnswer | None:
    """The problem itself from a motion, with breakpoints and sides of kinks where that crosses.

    None where the budget is spent.
    """
    meshes = this_round.meshes
    crossed = mesh_at_crossings(mesh, motion.trajectory, meshes.evaluator)
    program = meshes.first_program(motion.trajectory, crossed)
    point = meshes.starting_point(program, motion.trajectory, meshes.limits(program))
    attempt = [(this_round.solver, point)]
    result = next(this_round.runs(program, attempt, spent, _FROM_NEAR), None)
    return None if result is None else MeshAnswer(program, result)


@dataclass(frozen=True, eq=False, repr=False)
class _Rounded:
    """A problem with rounded kinks.

    Attributes
    ----------
    problem : Problem
    evaluator : Evaluator
        Of that.
    values : mapping of name to number
        Of the constants of the problem as it was stated.
    """

    problem: Problem
    evaluator: Evaluator
    values: Parameters

    @classmethod
    def of(cls, meshes: MeshSolver, scales: Scales) -> _Rounded | None:
        """From the sizes of a first mesh; None where no signal makes a kink."""
        problem, width = meshes.problem, Constant(_WIDTH, value=_WIDTHS[0])
        guess = initial_guess(problem, meshes.parameters)
        widths = {}
        for phase in problem.phases:
            surfaces = roundable_kinks(problem, phase.name).values
            sizes = variations_of(problem, phase.name, surfaces, guess, scales, meshes.parameters)
            widths[phase.name] = [ca.SX(size * width.symbol) for size in sizes]
        if not any(widths.values()):
            return None
        rounded = with_rounded_kinks(problem, widths)
        return cls(rounded, Evaluator(rounded), meshes.parameters)

    def meshes(self, stated: MeshSolver, width: float, most: int) -> MeshSolver:
        """What solves it with a width, in at most so many iterations since the solve began."""
        values, budget = {**self.values.values, _WIDTH: width}, stated.budget
        return replace(
            stated,
            problem=self.problem,
            settings=replace(stated.settings, accuracy=_ROUGHLY),
            parameters=parameters_of(self.problem, values),
            evaluator=self.evaluator,
            budget=Budget(min(budget.iterations, most), budget.seconds, budget.begin),
            prepared=None,
        )


def mesh_at_crossings(mesh: Mesh, motion: Trajectory, evaluator: Evaluator) -> Mesh:
    """A mesh with breakpoints where a motion crosses kinks, and their sides given beside them."""
    phases = []
    for own, of_phase in zip(mesh.phases, motion.phases, strict=True):
        crossings = kink_crossings(motion, evaluator, of_phase.name)
        crossed = CrossedMesh(own, of_phase.fractions, crossings)
        known = of_phase.fractions_of(evaluator.problem.instants[of_phase.name])
        placed = with_crossings(
            own, AwaitedCrossings(crossed, crossings.places), known, NEAR_WHILE_ROUGH
        )
        whole = np.ones(crossings.count)
        phases.append(with_sides(placed.mesh, placed.crossings, NEAR_WHILE_ROUGH, whole))
    return Mesh(tuple(phases))


def _agrees(meshes: MeshSolver, answer: MeshAnswer, near: Iterate) -> bool:
    """Whether an answer is about that of the rounded problem from which its sides were taken.

    A rounding that is too wide gives sides on which the problem itself has no motion, or another
    one. Then the answer is not where its sides are, or costs something else.
    """
    program, result = answer.program, answer.result
    found = trajectory_of(program, result.x, meshes.parameters)
    errors = MotionErrors(program, found, meshes.evaluator, meshes.parameters)
    objective = result.objective * program.scales.objective
    # a rounded problem is always minimised
    apart = abs(objective - near.objective) > _APART * near.objective_size
    if apart or errors.worst_dynamics > _NO_MOTION:
        return False
    for phase in meshes.problem.phases:
        before, after = (
            kink_crossings(motion, meshes.evaluator, phase.name)
            for motion in (near.trajectory, found)
        )
        if [c[1:] for c in before.each()] != [c[1:] for c in after.each()]:
            return False
    return True


def _intervals_of(mesh: Mesh) -> Mesh:
    """The intervals of a mesh alone: what leaks there may not leak in another problem."""
    return Mesh(tuple(replace(phase, movable=(), sides=None) for phase in mesh.phases))
