"""Where the nodes are and how they move, in numbers, for pictures and for Fig. 13 of the paper.

Symbols: alpha [rad], omega [rad/s], acc [rad/s^2]; a prime is a derivative by alpha.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from models.arrays import Array, elementwise
from models.truss.kinematics import node_position
from models.truss.parameters import TrussParameters


@dataclass(frozen=True, eq=False)
class NodeMotion:
    """Global position [m], velocity [m/s], acceleration [m/s^2] of a node, all (m, 3)."""

    position: Array
    velocity: Array
    acceleration: Array


def node_motion(
    parameters: TrussParameters,
    node: int,
    angle: ArrayLike,
    speed: ArrayLike,
    acceleration: ArrayLike,
    *,
    module: int = 1,
) -> NodeMotion:
    """Motion of a node of a module, (17)-(19), under alpha, omega, acc of shape (m,).

    Raises
    ------
    ModelError
        If there is no such node or module.
    """
    alpha = np.atleast_1d(np.asarray(angle, dtype=float))
    omega, acc = (np.asarray(values, dtype=float)[..., None] for values in (speed, acceleration))

    # chain rule: r' omega and r' acc + r'' omega^2
    place, slope, bend = elementwise(_kernel(parameters, node, module), alpha)
    return NodeMotion(place, slope * omega, slope * acc + bend * omega**2)


def ring_positions(parameters: TrussParameters, angle: float) -> Array:
    """Global positions [m] of all nodes, shape (n, 14, 3): module, node less one, axis."""
    places = [
        [node_position(parameters, node, ca.DM(angle), module=module) for node in range(1, 15)]
        for module in range(1, parameters.modules + 1)
    ]
    return np.array([[place.full().ravel() for place in row] for row in places])


@functools.lru_cache(maxsize=128)
def _kernel(parameters: TrussParameters, node: int, module: int) -> ca.Function:
    """Compile alpha -> r, r', r'' of a node."""
    alpha = ca.SX.sym("alpha")
    place = node_position(parameters, node, alpha, module=module)
    slope = ca.densify(ca.jacobian(place, alpha))
    bend = ca.densify(ca.jacobian(slope, alpha))
    kernel: ca.Function = ca.Function("node", [alpha], [ca.densify(place), slope, bend])
    return kernel
