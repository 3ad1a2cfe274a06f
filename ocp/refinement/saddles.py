"""A lower motion beside an answer that is a saddle.

A solver that starts at a stationary point stays there. Along a family, or from a motion that a user
states, that point may be a minimum no longer: beyond a bifurcation it is a saddle, and all
first-order conditions hold at it. Then the solver is run again from points beside it.
"""

from __future__ import annotations

import math

from ocp.errors import Unbounded
from ocp.mesh.trajectory import Evaluator
from ocp.nlp.failures import failure
from ocp.nlp.saddle import (
    PATIENCE,
    added_curvature,
    starts_beside,
    without_standstill,
)
from ocp.nlp.solver import NlpSolver, StartingPoint
from ocp.optimality.iterate import Iterate, iterate_of
from ocp.refinement.mesh_iteration import MeshIteration, iterations_of, record_of
from ocp.refinement.mesh_solver import MeshSolver
from ocp.settings import Settings
from ocp.transcription.packing import trajectory_of
from ocp.transcription.transcribe import Transcription

# Scaled violation of the rows up to which a motion counts as one of its mesh.
_MET = 1e-8


def lower_motion(
    meshes: MeshSolver, answer: Iterate, rounds: list[MeshIteration]
) -> Iterate | None:
    """A motion on the same mesh whose objective is lower than that of an answer that is a saddle.

    The solver may still be on its way down. None where no such motion is found.

    Parameters
    ----------
    answer : Iterate
    rounds : list of MeshIteration
        Until now. What is tried is appended.

    Raises
    ------
    Unbounded
        From beside the answer the objective runs away.
    KeyboardInterrupt
        The user stopped it.
    """
    program, point = answer.transcription, StartingPoint.at(answer)
    if any(phase.movable for phase in answer.mesh.phases):
        # where breakpoints lie alters the objective by errors of the mesh alone, up or down
        program = meshes.next_program(answer, answer.fixed_mesh)
        point = meshes.starting_point(program, answer, meshes.limits(program))
        if not may_be_saddle(meshes, program, point):
            return None

    sense = meshes.problem.sense
    least = meshes.settings.accuracy.objective * answer.objective_size
    solver = without_standstill(meshes.settings.solver).within(PATIENCE, math.inf)
    for starts in starts_beside(point, meshes.limits(program)):
        # one side may lead to a corner nearby, and the other one far down
        found = [_found(meshes, solver, program, start, rounds) for start in starts]
        below = min(
            (each for each in found if each is not None),
            key=lambda each: sense * each.objective,
            default=answer,
        )
        if sense * (answer.objective - below.objective) > least:
            return below
    return None


def lower_beside(iterate: Iterate, evaluator: Evaluator) -> Iterate | None:
    """A lower motion beside a solved one that is a saddle, on its mesh; None where there is none.

    Raises
    ------
    Unbounded, KeyboardInterrupt
        As `lower_motion`.
    """
    problem, parameters = iterate.problem, iterate.parameters
    meshes = MeshSolver.of(problem, Settings(), parameters, evaluator=evaluator)
    if not may_be_saddle(meshes, iterate.transcription, StartingPoint.at(iterate)):
        return None
    return lower_motion(meshes, iterate, [])


def may_be_saddle(meshes: MeshSolver, program: Transcription, point: StartingPoint) -> bool:
    """Whether a stationary point of a program may be a saddle: IPOPT has to add curvature there.

    Some change of the unknowns may also leave the objective as it is.

    Parameters
    ----------
    point : StartingPoint
        With its multipliers.

    Raises
    ------
    KeyboardInterrupt
        The user stopped it.
    """
    limits, parameters = meshes.limits(program), meshes.parameters.vector
    return added_curvature(program.program, point, limits, parameters) > 0.0


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
    limits = meshes.limits(program)
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
