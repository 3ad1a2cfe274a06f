"""What limits that are backed off keep from the objective.

The multipliers of the solved mesh tell, to first order. Those of the mesh before, by which a
back-off is chosen, may tell far less: a limit with a small multiplier may get a large one once it
is moved.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ocp.arrays import Array
from ocp.optimality.active_set import path_multiplier_sums
from ocp.optimality.iterate import Iterate
from ocp.transcription.path_constraints import PathConstraint


def unit_costs(
    constraints: Sequence[PathConstraint], sums: Mapping[int, Array]
) -> dict[int, Array]:
    """What a unit of back-off costs in each interval of a phase, scaled.

    Parameters
    ----------
    sums : mapping of int to (N,)
        Of the scaled multipliers, by the number of the path constraint.

    Returns
    -------
    dict of int to (N,)
        By the same number [scaled objective per unit of the constraint].
    """
    return {number: sums[number] / constraints[number].scale for number in sums}


def scaled_costs(
    of_unit: Mapping[int, Array], back_off: Mapping[int, Array], intervals: int
) -> Array:
    """What the back-offs of a phase cost in each interval, in the scaled objective, (N,)."""
    cost = np.zeros(intervals)
    for number, distance in back_off.items():
        if number in of_unit:
            cost += of_unit[number] * distance
    return cost


def back_off_costs(iterate: Iterate, index: int) -> Array:
    """What the back-offs cost in each interval of phase number `index`, of the objective, (N,)."""
    mesh, back_off = iterate.mesh.phases[index], iterate.mesh.back_off[index]
    if not back_off:
        return np.zeros(mesh.intervals)
    constraints = iterate.transcription.constraints[index]
    of_unit = unit_costs(constraints, path_multiplier_sums(iterate, index))
    scaled = scaled_costs(of_unit, back_off, mesh.intervals)
    return scaled * (iterate.scales.objective / iterate.objective_size)
