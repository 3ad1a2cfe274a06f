"""The loop of mesh iterations, in which a solver that is lost among kinks is led past them."""

from __future__ import annotations

from ocp.accuracy import Accuracy
from ocp.mesh.mesh import Mesh
from ocp.refinement.endings import Ending
from ocp.refinement.loop import (
    History,
    PlannedMesh,
    first_plan,
    plan_after,
    round_of,
    solve_planned,
)
from ocp.refinement.mesh_solver import MeshSolver, Start
from ocp.refinement.past_kinks.first_motion import first_motion
from ocp.refinement.past_kinks.past_kinks import lost_until_now, past_kinks


def loop_past_kinks(
    meshes: MeshSolver, start: Start, mesh: Mesh, accuracy: Accuracy, history: History
) -> Ending:
    """`ocp.refinement.loop.refine_meshes`, past kinks where the solver is lost among them.

    That is done on the first mesh, and once on a later one while none has led to a motion.
    """
    planned, led = first_plan(meshes, start, mesh), False
    while True:
        if history.solved:
            found = solve_planned(meshes, planned, accuracy, history)
        else:
            this_round = round_of(meshes, planned, accuracy, history)
            found = first_motion(this_round, planned.start, planned.program)

        if not led and lost_until_now(meshes, found.result, history.solved, accuracy):
            this_round, led = round_of(meshes, planned, accuracy, history), True
            motion = history.solved[-1].iterate.trajectory
            found = past_kinks(this_round, motion, planned.program, found.result)

        following = plan_after(meshes, planned, found, accuracy, history)
        if not isinstance(following, PlannedMesh):
            return following
        planned = following
