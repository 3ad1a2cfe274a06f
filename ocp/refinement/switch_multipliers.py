"""Multipliers where a control switches on a breakpoint that does not move.

There the control is at one limit before and at the other one behind, and the program says nothing
of its neighbourhood: many sets of multipliers fit. Those of the problem itself are among them, and
they tell no gain by a move of the switch (Bryson and Ho, "Applied Optimal Control", ch. 3.7: the
Hamiltonian has no jump). So the mesh is solved once more with breakpoints that may move there.
"""

from __future__ import annotations

import numpy as np

from ocp.mesh.mesh import Mesh
from ocp.optimality.hamiltonian import relative_jumps
from ocp.optimality.iterate import Iterate, iterate_of
from ocp.refinement.mesh_solver import MeshSolver
from ocp.refinement.policies.brackets import with_movable_switches
from ocp.transcription.packing import trajectory_of

# Of the Hamiltonian's terms: a jump that is noise of the solver's multipliers.
_NOISE = 1e-6

# Of the objective: a switch that gains more by moving was not where it belongs.
_SAME = 1e-8


def with_free_switches(meshes: MeshSolver, iterate: Iterate) -> Iterate:
    """The same motion with multipliers by which no switch should move; as it is if there is none.

    Costates, Hamiltonian and slopes are those of the problem for the multipliers found here.
    """
    mesh = with_movable_switches(iterate)
    if mesh is None or not _seem_to_gain(meshes, iterate, mesh):
        return iterate
    # it is asked for when the solve is over, and so is that one's budget
    again = meshes.at(meshes.parameters)
    program = again.next_program(iterate, mesh)
    result = again.solve(program, iterate, again.settings.solver)
    if result.outcome != "solved":
        return iterate
    free = iterate_of(program, result, trajectory_of(program, result.x, again.parameters))
    moved = abs(free.objective - iterate.objective) > _SAME * iterate.objective_size
    return iterate if moved else free


def _seem_to_gain(meshes: MeshSolver, iterate: Iterate, free: Mesh) -> bool:
    """Whether the Hamiltonian jumps at breakpoints that move on another mesh only."""
    for index, (new, old) in enumerate(zip(free.phases, iterate.mesh.phases, strict=True)):
        freed = np.array(sorted({*new.movable} - {*old.movable}), dtype=int)
        jumps = relative_jumps(iterate, meshes.evaluator, index)[freed - 1]
        if jumps.max(initial=0.0) > _NOISE:
            return True
    return False
