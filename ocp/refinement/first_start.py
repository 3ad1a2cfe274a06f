"""The first mesh from more than one start, where the statement leads nowhere or may be far off.

A guess without any motion in it, as a straight line from start to end, may lead a solver to a point
where the violation of the constraints cannot be made smaller by small changes. That says nothing of
the problem. Here the solver starts anew: with another line search, with the barrier that strays
less, and from motions that are simulated under controls drawn at random
(`ocp.mesh.simulated_guess`). The best of the first few that it finds is the answer of the first
mesh. The draws are the same in every run.

The controls of no guess are zero. There the slope of a root may be infinite, which ends a run at
once. So other starts are made after an invalid number, too, unless a motion is stated, until a few
have shown that the expression has no value elsewhere either.

Controls of a few intervals may also be too coarse for any motion, where the limits leave little
room. So the same is tried on a finer mesh, and on a still finer one if that is nearly enough.

Who states no guess, or one in which a state that must move stays, says nothing of which optimum is
near. So an answer from there is held against those of other starts (`search`). The same is done
for straight lines that a user states, if they lead nowhere or far round about. Where the problem
seems convex it is not: then there is one optimum.
"""

from __future__ import annotations

import math

import numpy as np

from ocp.mesh.initial_guess import states_a_motion, states_only_lines
from ocp.mesh.trajectory import Trajectory
from ocp.nlp.failures import collapses, counted
from ocp.nlp.solver import NlpResult
from ocp.refinement.convexity import seems_convex
from ocp.refinement.mesh_solver import PATIENCE, MeshSolver
from ocp.refinement.search import HOPEFUL, FirstMesh, MeshAnswer, best_of_several
from ocp.refinement.sizes_after import OUTSIZED
from ocp.scaling.scales import SHRUNK
from ocp.transcription.packing import trajectory_of
from ocp.transcription.transcribe import Transcription

# Scaled violation of rows that counts as none on the way to a motion of no time: its control is
# millions of times its size, and rounding with it.
_MET = 1e-2

# Iterations from which on a straight line that a user stated has led far round about. From guesses
# that are near, a solver takes some dozens.
_ROUND_ABOUT = 150


def first_answer(first_mesh: FirstMesh, program: Transcription, result: NlpResult) -> MeshAnswer:
    """What came of the first mesh from the stated guess, or something better from other starts.

    Parameters
    ----------
    result : NlpResult
        What came of the stated guess; its iterations are counted on.
    """
    meshes = first_mesh.meshes
    if result.outcome == "invalid number":
        # a motion that the user states is the user's choice
        if states_a_motion(meshes.problem, meshes.parameters):
            return MeshAnswer(program, result)
    elif result.outcome != "solved":
        hopeful = _hopeful(meshes, program, result)
        if hopeful or _seems_to_shrink(meshes, program, result):
            program, result = _in_its_sizes(first_mesh, program, result)
        if not hopeful and result.outcome != "solved":
            return MeshAnswer(program, result)
    far = _may_be_far(meshes, result)
    if result.outcome in ("solved", "interrupted") and not far:
        return MeshAnswer(program, result)
    return best_of_several(first_mesh, program, result, far=far)


def _in_its_sizes(
    first_mesh: FirstMesh, program: Transcription, failed: NlpResult
) -> tuple[Transcription, NlpResult]:
    """What comes of the point where the solver failed in sizes taken from there, or as it was.

    A statement without scales may mean values of any size. Where they turn out to be far from those
    of the guess, rounding alone keeps the solver from its tolerance.
    """
    largest = max(abs(failed.objective), float(np.abs(failed.x).max(initial=0.0)))
    if not OUTSIZED < largest < math.inf:
        return program, failed
    meshes = first_mesh.meshes
    found = trajectory_of(program, failed.x, meshes.parameters)
    if _backwards(found):
        return program, failed
    again = meshes.first_program(found, program.mesh)
    point = meshes.starting_point(again, found, meshes.limits(again))
    for result in first_mesh.runs(again, [(first_mesh.solver, point)], failed):
        if result.outcome in ("solved", "interrupted"):
            return again, result
    return program, failed


def _hopeful(meshes: MeshSolver, program: Transcription, failed: NlpResult) -> bool:
    """Whether another start may lead to an answer where one has failed."""
    limits = meshes.limits(program)
    free, equations = counted(limits)
    motion = trajectory_of(program, failed.x, meshes.parameters)
    met = float(limits.excess(failed.rows).max(initial=0.0)) < _MET
    if met and not _backwards(motion) and collapses(program, motion, failed.x):
        return False  # it is the statement that leads there
    short = failed.outcome == "budget" and failed.iterations < PATIENCE
    return failed.outcome in HOPEFUL and not short and equations <= free


def _seems_to_shrink(meshes: MeshSolver, program: Transcription, failed: NlpResult) -> bool:
    """Whether a motion counts as one on its way to no time, and yet takes some.

    Sizes that wide limits of its times gave do not tell whether it shrinks further, its own do.
    """
    motion = trajectory_of(program, failed.x, meshes.parameters)
    on_its_way = collapses(program, motion, failed.x)
    longest = max(phase.end - phase.start for phase in motion.phases)
    return on_its_way and not _backwards(motion) and longest > SHRUNK * program.scales.time


def _backwards(motion: Trajectory) -> bool:
    """Whether a phase ends before it begins: what it costs then has the wrong sign, and no size."""
    return any(phase.end < phase.start for phase in motion.phases)


def _may_be_far(meshes: MeshSolver, result: NlpResult) -> bool:
    """Whether the guess may be far from the best optimum of several."""
    problem, parameters = meshes.problem, meshes.parameters
    if seems_convex(problem, parameters):
        return False
    if not states_a_motion(problem, parameters):
        return True
    long = result.outcome != "solved" or result.iterations > _ROUND_ABOUT
    return long and states_only_lines(problem, parameters)
