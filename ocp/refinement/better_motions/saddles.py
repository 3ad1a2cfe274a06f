"""A lower motion beside an answer that is a saddle.

A solver that starts at a stationary point stays there. Along a family, or from a motion that a user
states, that point may be a minimum no longer: beyond a bifurcation it is a saddle, and all
first-order conditions hold at it. Then the solver is run again from points beside it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ocp.arrays import Array
from ocp.errors import Unbounded
from ocp.nlp.failures import failure
from ocp.nlp.inflection import inflection
from ocp.nlp.saddle import (
    PATIENCE,
    added_curvature,
    fall_beside,
    is_degenerate_saddle,
    starts_along,
    starts_beside,
    without_standstill,
)
from ocp.nlp.solver import NlpSolver, StartingPoint
from ocp.optimality.iterate import Iterate, iterate_of
from ocp.problem.kinks import kinks_of
from ocp.refinement.mesh_iteration import MeshIteration, iterations_of, record_of
from ocp.refinement.mesh_solver import MeshSolver
from ocp.transcription.packing import trajectory_of
from ocp.transcription.transcribe import ProgramLimits, Transcription

# Fall of the scaled Lagrangian per scaled change of the unknowns, from which on a point is at a
# concave kink
_FALL = 1e-3

# Scaled violation of the rows up to which a motion counts as one of its mesh.
_MET = 1e-8


@dataclass(frozen=True, eq=False)
class StationaryPoint:
    """What a stationary point is, as far as could be told.

    Attributes
    ----------
    kind : str
    way_down : (n,) or None
        From an inflection: a change of the scaled unknowns.
    """

    kind: Literal["minimum", "saddle", "degenerate saddle", "inflection"]
    way_down: Array | None = None

    @property
    def is_minimum(self) -> bool:
        """Whether nothing else was found."""
        return self.kind == "minimum"


def lower_motion(
    meshes: MeshSolver, answer: Iterate, stationary: StationaryPoint, rounds: list[MeshIteration]
) -> Iterate | None:
    """A motion on the same mesh whose objective is lower than that of an answer that is a saddle.

    The solver may still be on its way down. None where no such motion is found.

    Parameters
    ----------
    answer : Iterate
    stationary : StationaryPoint
        The answer's; no minimum.
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
        stationary = stationary_point(meshes, program, point)
        if stationary.is_minimum:
            return None

    sense = meshes.problem.sense
    least = meshes.settings.accuracy.objective * answer.objective_size
    solver = without_standstill(meshes.settings.solver).within(PATIENCE, math.inf)
    for starts in _starts(point, meshes.limits(program), stationary):
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


def stationary_point(
    meshes: MeshSolver,
    program: Transcription,
    point: StartingPoint,
    *,
    seems_least: bool = False,
) -> StationaryPoint:
    """What a stationary point of a program is.

    It may be a saddle where there is a concave kink, or IPOPT has to add curvature: some change may
    also leave the objective as it is. At a degenerate saddle the objective is flat, and lower
    elsewhere. At an inflection it falls to one side of a time or an unknown, and is flat there.

    Parameters
    ----------
    point : StartingPoint
        With its multipliers.
    seems_least : bool
        Whether the solver has told that no curvature is added. It is not asked again then.

    Raises
    ------
    KeyboardInterrupt
        The user stopped it.
    """
    limits, parameters = meshes.limits(program), meshes.parameters.vector
    if is_degenerate_saddle(program.program, point, limits, parameters):
        return StationaryPoint("degenerate saddle")
    # CasADi takes the slope of a modulus of zero to be zero, so that no curvature is asked for
    kinked = bool(kinks_of(meshes.problem))
    if kinked and fall_beside(program.program, point, limits, parameters) > _FALL:
        return StationaryPoint("saddle")
    way_down = _way_down(meshes, program, point)
    if way_down is not None:
        return StationaryPoint("inflection", way_down)
    if seems_least or added_curvature(program.program, point, limits, parameters) == 0:
        return StationaryPoint("minimum")
    return StationaryPoint("saddle")


def _starts(
    point: StartingPoint, limits: ProgramLimits, stationary: StationaryPoint
) -> Iterator[Sequence[StartingPoint]]:
    """Where the solver is run again from, nearest first."""
    if stationary.way_down is not None:
        return starts_along(point, limits, stationary.way_down)
    return starts_beside(point, limits, degenerate=stationary.kind == "degenerate saddle")


def _way_down(meshes: MeshSolver, program: Transcription, point: StartingPoint) -> Array | None:
    """The way down from an inflection along a free time or an unknown of the problem.

    A phase that hands over to one in which the same control does more has such a point: the slope
    by the time between them goes with the square of the control. It takes two phases, or an
    unknown. The time of a single phase has no such reason to be one, and is not looked at.
    """
    columns = program.columns
    if len(columns.phases) == 1 and columns.unknowns.size == 0:
        return None
    times = [phase.ends for phase in columns.phases if phase.ends is not None]
    ends = np.concatenate([np.zeros(0, dtype=np.int64), *times])
    along = np.concatenate([ends, columns.unknowns])
    whole = float(np.ptp(point.x[ends])) if ends.size else 0.0
    reaches = [np.full(ends.size, whole), np.maximum(np.abs(point.x[columns.unknowns]), 1.0)]
    limits, constants = meshes.limits(program), meshes.parameters.vector
    return inflection(program.program, point, limits, constants, along, np.concatenate(reaches))


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
