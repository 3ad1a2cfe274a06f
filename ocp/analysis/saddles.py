"""A lower motion beside an answer that is a saddle.

A solver that starts at a stationary point stays there. Along a family, or from a motion that a user
states, that point may be a minimum no longer: beyond a bifurcation it is a saddle, and all
first-order conditions hold at it. Then the solver is run again from points beside it.

At a minimum the objective curves upwards along all small changes that the constraints allow. At a
saddle the matrix of a Newton step has too many negative eigenvalues, and IPOPT adds curvature until
the step leads down (Waechter and Biegler 2006, section 3.1). So what it adds tells which of the two
a point is. At the saddle itself no step leads down, because the slope is zero. From a point beside
it a solver goes down.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache

import numpy as np

from ocp.arrays import Array
from ocp.errors import Unbounded
from ocp.mesh.trajectory import Evaluator
from ocp.nlp.failures import failure
from ocp.nlp.ipopt import Ipopt
from ocp.nlp.solver import NlpSolver, StartingPoint
from ocp.optimality.iterate import Iterate, iterate_of
from ocp.refinement.mesh_solver import MeshSolver
from ocp.refinement.solved_mesh import MeshIteration, iterations_of, record_of
from ocp.settings import Settings
from ocp.transcription.kernels import Program
from ocp.transcription.packing import trajectory_of
from ocp.transcription.transcribe import ProgramLimits, Transcription

# Random changes of scaled unknowns: small ones stay near, large ones get away where the objective
# curves little.
_CHANGES = (1e-3, 3e-2)

# Iterations within which the solver is back, or at a lower point. Most take thirty to fifty.
PATIENCE = 100

# The change where one step is made to see what is added. At the point itself IPOPT may stop before
# it makes any. Small pivots are not worth their speed where the signs of eigenvalues are asked for.
_BESIDE = 1e-8

_ONE_STEP = Ipopt(tolerance=1e-12, max_iterations=1, stall=0, pivot_tolerance=1e-3)


def added_curvature(
    program: Program, point: StartingPoint, limits: ProgramLimits, parameters: Array
) -> float:
    """What IPOPT adds to the Hessian of the Lagrangian for a step from a stationary point, scaled.

    It is 0 at a strict minimum and positive at a saddle. Where some change of the unknowns leaves
    the objective as it is, it may be either.

    Parameters
    ----------
    point : StartingPoint
        With its multipliers.
    parameters : (n_p,)
        Values of the problem's constants.

    Raises
    ------
    KeyboardInterrupt
        The user stopped it.
    """
    change = _BESIDE * _direction(point.x.size)
    step = _ONE_STEP.solve(program, _beside(point, limits, change), limits, parameters)
    if step.outcome == "interrupted":
        raise KeyboardInterrupt
    return step.added_curvature


def starts_beside(
    point: StartingPoint, limits: ProgramLimits
) -> Iterator[tuple[StartingPoint, StartingPoint]]:
    """Pairs of starts on both sides of a point, from which a solver leaves a saddle.

    They are the same in every run.
    """
    random = np.random.default_rng(0)
    for size in _CHANGES:
        change = size * random.standard_normal(point.x.size)
        yield _beside(point, limits, change), _beside(point, limits, -change)


def without_standstill(solver: NlpSolver) -> NlpSolver:
    """A solver that goes on where progress is slow, as it is beside a saddle."""
    return replace(solver, stall=0) if isinstance(solver, Ipopt) else solver


@lru_cache(maxsize=4)
def _direction(size: int) -> Array:
    """A random change of unknowns (size,), the same in every run."""
    return np.random.default_rng(0).standard_normal(size)


def _beside(point: StartingPoint, limits: ProgramLimits, change: Array) -> StartingPoint:
    """A point beside one; unknowns at a limit stay there."""
    lower, upper = limits.columns
    free = (point.x > lower) & (point.x < upper)
    return StartingPoint(np.clip(point.x + change * free, lower, upper), point.multipliers)


# Scaled violation of the rows up to which a motion counts as one of its mesh.
_MET = 1e-8


def lower_motion(
    meshes: MeshSolver, answer: Iterate, mesh_iterations: list[MeshIteration]
) -> Iterate | None:
    """A motion on the same mesh whose objective is lower than that of an answer that is a saddle.

    The solver may still be on its way down. None where no such motion is found.

    Parameters
    ----------
    answer : Iterate
    mesh_iterations : list of MeshIteration
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
        found = [_found(meshes, solver, program, start, mesh_iterations) for start in starts]
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
    mesh_iterations: list[MeshIteration],
) -> Iterate | None:
    """Where a solver comes to from a start, if that meets the rows and the budget lasts.

    It may be on its way down. The record is appended.
    """
    done = iterations_of(mesh_iterations)
    if meshes.budget.spent(done):
        return None
    limits = meshes.limits(program)
    result = meshes.run(
        program, meshes.budget.within(solver, done), start, limits, len(mesh_iterations) + 1
    )
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
    mesh_iterations.append(record_of(program.mesh, result, solved))
    met = float(limits.excess(result.rows).max(initial=0.0)) <= _MET
    return iterate_of(program, result, motion) if met else None
