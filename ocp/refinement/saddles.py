"""A lower motion beside an answer that is a saddle.

A solver that starts at a stationary point stays there. Along a family, or from a motion that a user
states, that point may be a minimum no longer: beyond a bifurcation it is a saddle, and all
first-order conditions hold at it. Then the solver is run again from points beside it.
"""

from __future__ import annotations

import math
from dataclasses import replace

from ocp.errors import Unbounded
from ocp.mesh.mesh import Mesh
from ocp.nlp.failures import failure
from ocp.nlp.saddle import (
    PATIENCE,
    added_curvature,
    fall_beside,
    starts_beside,
    without_standstill,
)
from ocp.nlp.solver import NlpSolver, StartingPoint
from ocp.optimality.iterate import Iterate, iterate_of
from ocp.problem.kinks import kinks_of
from ocp.refinement.mesh_iteration import MeshIteration, iterations_of, record_of
from ocp.refinement.mesh_solver import MeshSolver
from ocp.transcription.packing import trajectory_of
from ocp.transcription.transcribe import Transcription

# Fall of the scaled Lagrangian beside a point, from which on that is a ridge
_RIDGE = 1e-3

# Scaled violation of the rows up to which a motion counts as one of its mesh.
_MET = 1e-8


def lower_motion(
    meshes: MeshSolver, answer: Iterate, rounds: list[MeshIteration]
) -> Iterate | None:
    """A motion on the same mesh whose objective is lower, where the answer is a saddle.

    The solver may still be on its way down.

    Parameters
    ----------
    rounds : list of MeshIteration
        Until now. What is tried is appended.

    Raises
    ------
    Unbounded
        From beside the answer the objective runs away.
    KeyboardInterrupt
        The user stopped it.
    """
    program = answer.transcription
    point = StartingPoint(answer.x, (answer.bound_multipliers, answer.row_multipliers))
    if not may_be_saddle(meshes, program, point):
        return None
    if any(phase.movable for phase in answer.mesh.phases):
        # where breakpoints lie alters the objective by errors of the mesh alone, up or down
        program = meshes.next_program(answer, _held_still(answer))
        point = meshes.starting_point(program, answer, program.limits(meshes.parameters))
        if not may_be_saddle(meshes, program, point):
            return None

    sense = meshes.problem.sense
    least = meshes.settings.accuracy.objective * answer.objective_size
    solver = without_standstill(meshes.settings.solver).within(PATIENCE, math.inf)
    for pair in starts_beside(point, program.limits(meshes.parameters)):
        # one side may lead to a corner nearby, and the other one far down
        found = [_found(meshes, solver, program, start, rounds) for start in pair]
        below = min(
            (each for each in found if each is not None),
            key=lambda each: sense * each.objective,
            default=answer,
        )
        if sense * (answer.objective - below.objective) > least:
            return below
    return None


def may_be_saddle(meshes: MeshSolver, program: Transcription, point: StartingPoint) -> bool:
    """Whether a stationary point of a program may be no minimum.

    It lies on a ridge, or curvature has to be added there: then it is a saddle, or flat.

    Raises
    ------
    KeyboardInterrupt
        The user stopped it.
    """
    parameters = meshes.parameters
    limits = program.limits(parameters)
    if is_on_ridge(meshes, program, point):
        return True
    return added_curvature(program.program, point, limits, parameters.vector) != 0


def is_on_ridge(meshes: MeshSolver, program: Transcription, point: StartingPoint) -> bool:
    """Whether a point of a program lies on a ridge, as that of the negative modulus at zero.

    Its slope is taken to be zero there, so that the point is stationary, and no optimum.
    """
    if not kinks_of(meshes.problem):
        return False
    limits, parameters = program.limits(meshes.parameters), meshes.parameters.vector
    return fall_beside(program.program, point, limits, parameters) > _RIDGE


def _held_still(answer: Iterate) -> Mesh:
    """A mesh of the same intervals as an answer has, which do not move."""
    pairs = zip(answer.mesh.phases, answer.trajectory.phases, strict=True)
    phases = [replace(mesh, breakpoints=motion.fractions, movable=()) for mesh, motion in pairs]
    return replace(answer.mesh, phases=tuple(phases))


def _found(
    meshes: MeshSolver,
    solver: NlpSolver,
    program: Transcription,
    start: StartingPoint,
    rounds: list[MeshIteration],
) -> Iterate | None:
    """Where a solver comes to from a start, if that meets the rows and the budget lasts.

    It may be on its way down. The record is appended.
    """
    done = iterations_of(rounds)
    if meshes.budget.spent(done):
        return None
    limits = program.limits(meshes.parameters)
    result = meshes.run(program, meshes.budget.within(solver, done), start, limits, len(rounds) + 1)
    motion = trajectory_of(program, result.x, meshes.parameters)
    if result.outcome == "interrupted":
        raise KeyboardInterrupt

    solved = None
    if result.outcome == "solved":
        solved = meshes.examined(program, result, tight=True, finer=False)
    else:
        error = failure(program, result, meshes.parameters, motion)
        if isinstance(error, Unbounded):
            raise error
    rounds.append(record_of(program.mesh, result, solved))
    met = float(limits.excess(result.rows).max(initial=0.0)) <= _MET
    return iterate_of(program, result, motion) if met else None
