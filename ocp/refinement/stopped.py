"""The error of a refinement that was stopped before its answer was as accurate as asked for."""

from __future__ import annotations

from ocp.errors import BudgetSpent, Interrupted
from ocp.mesh.trajectory import Trajectory
from ocp.refinement.mesh_solver import MeshSolver
from ocp.refinement.planning import History
from ocp.refinement.solved_mesh import SolvedMesh, iterations_of


def budget_spent(
    meshes: MeshSolver,
    history: History,
    last: Trajectory | None,
    best: SolvedMesh | None,
    reached: object,
) -> BudgetSpent:
    """The error of a budget that ended before a mesh held between its points.

    Parameters
    ----------
    last : Trajectory or None
        Of the last mesh, for inspection.
    best : SolvedMesh or None
        The best one that was solved.
    reached : Refinement or None
        The same with its mesh iterations.
    """
    state = "no mesh iteration was solved"
    if best is not None:
        state = (
            f"the remaining errors between the points are {best.errors.dynamics:.1e} of the "
            f"dynamics and {max(best.errors.excess, 0.0):.1e} of the constraints"
        )
    mesh_iterations = history.mesh_iterations
    return BudgetSpent(
        f"the budget of {meshes.budget} for '{meshes.problem.name}' was reached in mesh iteration "
        f"{len(mesh_iterations)} after {iterations_of(mesh_iterations)} iterations: {state}; "
        "raise the budget, loosen the tolerances or give a better guess",
        last,
        None if best is None else best.iterate.trajectory,
        reached,
    )


def interrupted(
    meshes: MeshSolver,
    history: History,
    last: Trajectory | None,
    best: SolvedMesh | None,
    reached: object,
) -> Interrupted:
    """The error of a solve that the user stopped; the parameters are those of `budget_spent`."""
    return Interrupted(
        f"'{meshes.problem.name}' was stopped in mesh iteration {len(history.solved) + 1}",
        last,
        None if best is None else best.iterate.trajectory,
        reached,
    )
