"""Multipliers where a control switches on a breakpoint that does not move.

There the control is at one limit before and at the other one behind, and the program says nothing
of its neighbourhood: many sets of multipliers fit. Those of the problem itself are among them, and
they tell no gain by a move of the switch (Bryson and Ho, "Applied Optimal Control", ch. 3.7: the
Hamiltonian has no jump). So the mesh is solved once more with breakpoints that may move there.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ocp.arrays import Flags
from ocp.mesh.mesh import Mesh
from ocp.optimality.active_set import AT, share_at_limit
from ocp.optimality.hamiltonian import relative_jumps
from ocp.optimality.iterate import Iterate, iterate_of
from ocp.refinement.mesh_solver import MeshSolver
from ocp.refinement.policies.brackets import with_movable_switches
from ocp.transcription.packing import trajectory_of

# Of the Hamiltonian's terms: a jump that is noise of the solver's multipliers.
_NOISE = 1e-6

# Of the objective: a switch that gains more by moving was not where it belongs.
_SAME = 1e-8


def with_free_switches(meshes: MeshSolver, iterate: Iterate, *, all_of_them: bool) -> Iterate:
    """The same motion with multipliers by which no switch should move; as it is if there is none.

    Costates, Hamiltonian and slopes are those of the problem for the multipliers found here.

    Parameters
    ----------
    all_of_them : bool
        Whether switches are free, too, that should stay by the multipliers that were found. Then no
        others fit the mesh, between which slopes would not be known.
    """
    mesh = _freed(meshes, iterate, all_of_them=all_of_them)
    if mesh is None:
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


def _freed(meshes: MeshSolver, iterate: Iterate, *, all_of_them: bool) -> Mesh | None:
    """A mesh whose breakpoints may move at switches, see `with_free_switches`; None if at none."""
    free = with_movable_switches(iterate)
    if free is None:
        return None
    phases = []
    for index, (new, old) in enumerate(zip(free.phases, iterate.mesh.phases, strict=True)):
        switches = _switches(iterate, index)
        if not all_of_them:
            switches &= relative_jumps(iterate, meshes.evaluator, index) > _NOISE
        at = np.flatnonzero(switches) + 1
        movable = {*old.movable} | ({*new.movable} & {*at.tolist()})
        phases.append(replace(new, movable=tuple(sorted(movable))))
    mesh = replace(free, phases=tuple(phases))
    held = [
        new.movable == old.movable for new, old in zip(phases, iterate.mesh.phases, strict=True)
    ]
    return None if all(held) else mesh


def _switches(iterate: Iterate, index: int) -> Flags:
    """Whether a control goes from one of its limits to the other at inner breakpoints, (N - 1,)."""
    motion = iterate.trajectory.phases[index]
    switch = np.zeros(motion.intervals - 1, dtype=bool)
    for control in motion.controls:
        lower, upper = iterate.parameters.signal_limits[control]
        values, margin = motion.polynomial(control), AT * (upper - lower)
        if np.isfinite(margin):
            low, high = (share_at_limit(values, at, margin) == 1.0 for at in (lower, upper))
            switch |= (low[:-1] & high[1:]) | (high[:-1] & low[1:])
    return switch
