"""A refinement: meshes until all tolerances are met, and the best one of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ocp.mesh.mesh import Mesh
from ocp.refinement.accuracy import Accuracy
from ocp.refinement.endings import Ending
from ocp.refinement.loop import History
from ocp.refinement.mesh_iteration import MeshIteration
from ocp.refinement.mesh_solver import MeshSolver, Start
from ocp.refinement.past_kinks.loop_past_kinks import loop_past_kinks
from ocp.refinement.raised_peaks import verifiable
from ocp.refinement.solved_mesh import SolvedMesh
from ocp.refinement.stopped import budget_spent, interrupted


@dataclass(frozen=True, eq=False, repr=False)
class Refinement:
    """The end of a refinement.

    Attributes
    ----------
    best : SolvedMesh
        The best mesh iteration that holds between its points, if need be to a looser tolerance; the
        last one if none does.
    rounds : tuple of MeshIteration
        Records of all, those before this refinement included.
    ending : str
        What ended it.
    """

    best: SolvedMesh
    rounds: tuple[MeshIteration, ...]
    ending: Ending


def refine(
    meshes: MeshSolver,
    start: Start,
    mesh: Mesh,
    accuracy: Accuracy,
    before: Sequence[MeshIteration] = (),
) -> Refinement:
    """Solve, estimate the errors and refine, until all tolerances are met or the budget ends.

    Parameters
    ----------
    meshes : MeshSolver
    start : Iterate, Trajectory or None
        Where the first mesh starts; None for the guess in the statement.
    mesh : Mesh
        The first one.
    accuracy : Accuracy
        May be stricter than that of the settings.
    before : sequence of MeshIteration
        Mesh iterations until then.

    Raises
    ------
    SolveFailed
        No mesh was solved, the budget ended before one held between its points, an angle without
        bounds turns to and fro, or the motion shrinks to next to no time.
    Interrupted
        The user stopped it.
    """
    history = History(list(before))
    try:
        ending = loop_past_kinks(meshes, start, mesh, accuracy, history)
    except KeyboardInterrupt as stop:
        raise interrupted(meshes.problem, history.solved, accuracy, None) from stop

    best = verifiable(meshes, history.solved, accuracy)
    if ending == "budget" and not best.is_verifiable(accuracy):
        raise budget_spent(meshes, history.rounds, best.iterate.trajectory, best)
    return Refinement(best, tuple(history.rounds), ending)
