"""The error of a refinement that was stopped, or ended without an answer."""

from __future__ import annotations

from collections.abc import Sequence

from ocp.accuracy import Accuracy
from ocp.errors import BudgetSpent, Interrupted
from ocp.mesh.trajectory import Trajectory
from ocp.nlp.failures import failure
from ocp.nlp.result import NlpResult
from ocp.problem.problem import Problem
from ocp.refinement.mesh_iteration import MeshIteration, iterations_of
from ocp.refinement.mesh_solver import MeshSolver
from ocp.refinement.raised_peaks import verifiable
from ocp.refinement.solved_mesh import SolvedMesh, best_of
from ocp.transcription.packing import trajectory_of
from ocp.transcription.transcribe import Transcription


def check_failure(
    meshes: MeshSolver,
    program: Transcription,
    result: NlpResult,
    solved: Sequence[SolvedMesh],
    rounds: Sequence[MeshIteration],
) -> None:
    """The error of a failed round, raised where it leaves nothing to go on from.

    Raises
    ------
    Interrupted
        The user stopped the run.
    BudgetSpent
        The budget is used up, and no round held between its points.
    SolveFailed
        No round was solved.
    """
    accuracy = meshes.settings.accuracy
    last = trajectory_of(program, result.x, meshes.parameters)
    if result.outcome == "interrupted":
        raise interrupted(meshes.problem, solved, accuracy, last)
    if meshes.spent(rounds) and not (
        solved and verifiable(meshes, solved, accuracy).is_verifiable(accuracy)
    ):
        raise budget_spent(meshes, rounds, last, solved[-1] if solved else None)
    if not solved:
        raise failure(program, result, meshes.parameters, last)


def budget_spent(
    meshes: MeshSolver,
    rounds: Sequence[MeshIteration],
    last: Trajectory,
    finished: SolvedMesh | None,
) -> BudgetSpent:
    """The error of a budget that ended before a round held between its points."""
    state = "no mesh iteration was solved"
    if finished is not None:
        state = (
            f"the errors between the points were still {finished.errors.dynamics:.1e} of the "
            f"dynamics and {max(finished.errors.excess, 0.0):.1e} of the constraints"
        )
    return BudgetSpent(
        f"the budget of {meshes.budget} for '{meshes.problem.name}' ended in mesh iteration "
        f"{len(rounds)} after {iterations_of(rounds)} iterations: {state}; "
        "raise the budget, loosen the tolerances or "
        "give a better guess",
        last,
        None if finished is None else finished.iterate.trajectory,
    )


def interrupted(
    problem: Problem,
    solved: Sequence[SolvedMesh],
    accuracy: Accuracy,
    last: object | None,
) -> Interrupted:
    """The error of a stopped solve, with the last iterate and the best round that holds."""
    finished, verified = None, None
    if solved:
        best = best_of(solved, accuracy)
        finished = best.iterate.trajectory
        verified = finished if best.is_verifiable(accuracy) else None
    kept = "the best one so far is kept" if verified else "none had met its tolerances"
    return Interrupted(
        f"'{problem.name}' was stopped in mesh iteration {len(solved) + 1}; {kept}",
        last,
        finished,
        verified,
    )
