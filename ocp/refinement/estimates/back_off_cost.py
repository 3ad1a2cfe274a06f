"""What limits that are backed off keep from the objective.

The multipliers of the solved mesh tell, to first order. Those of the mesh before, by which a
back-off is chosen, may tell far less: a limit that hardly pressed can press once it is moved.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ocp.arrays import Array
from ocp.optimality.active_set import path_forces
from ocp.optimality.iterate import Iterate


def unit_costs(iterate: Iterate, index: int) -> dict[int, Array]:
    """What a unit of back-off costs in each interval of phase number `index`, scaled.

    Returns
    -------
    dict of int to (N,)
        By the number of the path constraint [scaled objective per unit of the constraint].
    """
    constraints = iterate.transcription.constraints[index]
    return {
        number: force / constraints[number].scale
        for number, force in path_forces(iterate, index).items()
    }


def spent(price: Mapping[int, Array], back_off: Mapping[int, Array], intervals: int) -> Array:
    """What the back-offs of a phase cost in each interval, scaled, (N,)."""
    cost = np.zeros(intervals)
    for number, held in back_off.items():
        if number in price:
            cost += price[number] * held
    return cost


def back_off_costs(iterate: Iterate, index: int) -> Array:
    """What the back-offs cost in each interval of phase number `index`, of the objective, (N,)."""
    mesh, back_off = iterate.mesh.phases[index], iterate.mesh.back_off[index]
    if not back_off:
        return np.zeros(mesh.intervals)
    scaled = spent(unit_costs(iterate, index), back_off, mesh.intervals)
    return scaled * (iterate.scales.objective / iterate.objective_size)
