"""The review for an answer that is a saddle."""

from __future__ import annotations

from collections.abc import Sequence

from ocp.estimates.other_controls.promise import promise_of_other_valleys
from ocp.nlp.solver import StartingPoint
from ocp.optimality.iterate import Iterate
from ocp.refinement.better_motions.saddles import StationaryPoint, lower_motion, stationary_point
from ocp.refinement.mesh_solver import MeshSolver
from ocp.refinement.reviews.finding import Candidate, Found, Onward
from ocp.refinement.solved_mesh import SolvedMesh

# Part of what controls far away promise that a motion beside a saddle has to bring.
_LITTLE_OF_OTHERS = 0.01


def left_saddle(answer: Candidate) -> Found:
    """A lower motion beside the answer, if there is one."""
    meshes, iterate = answer.meshes, answer.best.iterate
    if answer.ending == "budget":
        return Found()
    stationary = _stationary_point(meshes, answer.best, answer.history.solved)
    if stationary.is_minimum:
        return Found()
    below = lower_motion(meshes, iterate, stationary, answer.history.rounds)
    if below is None or _is_little_beside_others(meshes, iterate, below):
        return Found()
    # on a fixed mesh a saddle may hold better than what is lower, and is no answer
    adapts = meshes.settings.refinement.adapts
    return Found(Onward(below, below.mesh, "as good" if adapts else "none", below.objective))


def _stationary_point(
    meshes: MeshSolver, best: SolvedMesh, solved: Sequence[SolvedMesh]
) -> StationaryPoint:
    """What the best answer is, with what the solver last told on the way to it."""
    until = solved[: solved.index(best) + 1]
    told = [s.seems_least for s in until if s.seems_least is not None]
    program, point = best.iterate.transcription, StartingPoint.at(best.iterate)
    return stationary_point(meshes, program, point, seems_least=bool(told) and told[-1])


def _is_little_beside_others(meshes: MeshSolver, answer: Iterate, below: Iterate) -> bool:
    """Whether a lower motion brings next to nothing of what controls far away promise.

    Other than a motion on a fresh mesh it is known already, and is judged by what it brings.
    """
    sense = meshes.problem.sense
    brought = sense * (answer.objective - below.objective) / answer.objective_size
    promised = promise_of_other_valleys(answer, meshes.evaluator)
    return promised > 0.0 and brought < _LITTLE_OF_OTHERS * promised
