"""Where a motion is aimed, so that the full model and not B21 comes to rest at the lock.

The full model replays the optimal torque and ends beside rest, because B21's frequencies are a
little off and the mesh resolves the modes a little wrong. The next solve aims B21 by as much to the
other side. Only slow modes are corrected: of the fast ones both models have nothing in common but
the energy.

Symbols: q, v coordinates and rates of B21; e node coordinates of the full model.
"""

from __future__ import annotations

import casadi as ca
import numpy as np

from models.ancf.assembly import dense
from models.ancf.joints import Free
from models.ancf.motion import MinimalCoordinates
from models.arm.reduced_simulation import reduced_modes
from ocp.arrays import Array
from studies.arm.replay.full_model import LockedMotion

SLOW = 15.0  # [Hz], up to which modes are corrected


def beside_rest(replayed: LockedMotion) -> Array:
    """By how much a stage ends beside rest, in B21's q and v (2 n,), its fast modes left out.

    The full model's deviation is projected so that its momentum is kept: `J^T M J q = J^T M e`.
    """
    stage, run = replayed.motion.stage, replayed.run.before
    model, chain = stage.model, run.chain
    rest = model.at(*stage.end)

    q = ca.SX.sym("q", model.size)
    nodes = model.node_coordinates(q, chain.elements)
    place, tangent = (
        x.full() for x in ca.Function("nodes", [q], [nodes, ca.jacobian(nodes, q)])(rest)
    )
    assembly = MinimalCoordinates(chain, [Free()] * len(chain.links)).assembly
    tangent = np.column_stack([assembly.gather(column) for column in tangent.T])
    momentum = tangent.T @ dense(assembly.mass)
    off = np.column_stack(
        [assembly.gather(run.final.q - place[:, 0]), assembly.gather(run.final.v)]
    )
    deviation = np.linalg.solve(momentum @ tangent, momentum @ off)

    frequencies, shapes = reduced_modes(model, rest)
    fast = shapes[:, frequencies > SLOW]
    deviation -= fast @ (fast.T @ (model.linear(rest)[0].full() @ deviation))
    return np.asarray(deviation.T.ravel())
