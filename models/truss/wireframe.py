"""The antenna as points and lines, for pictures: bars, ropes, net, motor and the arm's end.

Every point is a fixed combination of four functions of the angle, `p = sum_k w_k(alpha) S_k` with
w = (1, sin, cos, e): (16)-(19) of DOI 10.1109/ACCESS.2019.2918614. So the points of a whole motion
are a constant array and four numbers for each angle.

Symbols: alpha [rad]; e [m] slider-to-end distance; n modules; a [m] vertical bar.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from models.arrays import Array
from models.truss.kinematics import module_frame, module_nodes, slider_distance
from models.truss.parameters import TrussParameters

NODES = 14  # of a module
WEIGHTS = ("1", "sin", "cos", "e")

# rods between the nodes of a module; the left vertical bar is the right one of the module before
RODS: Mapping[str, tuple[tuple[int, int], ...]] = {
    "vertical bars": ((1, 2),),
    "cross-bars": ((2, 3), (3, 4), (5, 6), (6, 1)),
    "links": ((7, 8), (9, 10), (11, 12), (13, 14)),
}
# nodes of a module that each rope passes: slider, bar end, middle joint, bar end, slider
ROPES = ((8, 1, 6, 5, 14), (10, 2, 3, 4, 12))
NET_RINGS = (1 / 3, 2 / 3)  # of the way from the centre to the ring
ARM_END = 1.2  # [m] of the supporting arm that is drawn
MOTOR_SIZE = (0.16, 0.16, 0.12)  # [m] of the box that stands for it


@dataclass(frozen=True, eq=False)
class Wireframe:
    """Points as combinations of four functions of the angle, and what is drawn between them.

    Attributes
    ----------
    shapes : (4, p, 3) [m] for the weights 1, sin, cos and [-] for e; the nodes 1 to 14 of the
        modules come first, in order.
    lines : by kind, (m, 2) indices of points.
    ropes : (2, 4 n + 1) indices of the points along each rope, from the motor.
    centre : index of the point in the middle of the ring, at half height.
    """

    shapes: Array
    lines: Mapping[str, Array]
    ropes: Array
    centre: int

    def points(self, weights: ArrayLike) -> Array:
        """Positions (m, p, 3) [m] at the weights (m, 4) of `shape_weights`."""
        return np.tensordot(np.atleast_2d(np.asarray(weights, dtype=float)), self.shapes, axes=1)


def shape_weights(parameters: TrussParameters, angle: ArrayLike) -> Array:
    """Weights w = (1, sin, cos, e), shape (m, 4), at angles (m,) [rad]."""
    alpha = np.atleast_1d(np.asarray(angle, dtype=float))
    e = slider_distance(parameters, ca.DM(alpha)).full().ravel()
    return np.stack([np.ones_like(alpha), np.sin(alpha), np.cos(alpha), e], axis=1)


def wireframe(parameters: TrussParameters) -> Wireframe:
    """The antenna of these parameters.

    The paper fixes the motor to the truss without saying where: it is drawn at the middle of the
    fixed bar, as is the end of the arm. The net, n springs k2 on either face (25), is drawn as
    spokes with two rings.
    """
    n = parameters.modules
    shapes = [_module_shapes(parameters, module) for module in range(1, n + 1)]
    nodes = np.concatenate(shapes, axis=1)

    def place(node: int, module: int) -> int:
        return NODES * (module % n) + node - 1

    lines = {
        kind: np.array([[place(i, m), place(j, m)] for m in range(n) for i, j in rods])
        for kind, rods in RODS.items()
    }
    ropes = np.array(
        [
            [place(path[0], 0), *(place(node, m) for m in range(n) for node in path[1:])]
            for path in ROPES
        ]
    )
    extra, lines["net"] = _net(nodes, n)
    fixed, lines["arm"], lines["motor"] = _fixed_parts(parameters, nodes.shape[1] + extra.shape[1])
    centre = (extra[:, :1] + extra[:, 1:2]) / 2
    count = nodes.shape[1] + extra.shape[1] + fixed.shape[1]
    return Wireframe(np.concatenate([nodes, extra, fixed, centre], axis=1), lines, ropes, count)


def _module_shapes(parameters: TrussParameters, module: int) -> Array:
    """Shapes (4, 14, 3) of the nodes of a module, (17)-(19)."""
    along, (g_x, g_y) = module_frame(parameters.modules, module)
    side = 2 * parameters.half_cross_bar

    shapes = np.zeros((4, NODES, 3))
    for node, at in module_nodes(parameters).items():
        shapes[:, node - 1, 2] = at.z_0, 0.0, at.z_cos, at.z_e
        shapes[1, node - 1, :2] = side * g_x + along[0] * at.x_sin, side * g_y + along[1] * at.x_sin
    return shapes


def _net(nodes: Array, modules: int) -> tuple[Array, Array]:
    """Points of both nets, the two centres first, and their lines."""
    faces = [nodes[:, node - 1 :: NODES] for node in (1, 2)]  # bar ends above and below
    centres = np.stack([face.mean(axis=1) for face in faces], axis=1)
    points, lines, first = [centres], [], nodes.shape[1]

    count = first + 2
    for k, face in enumerate(faces):
        lines += [[NODES * m + k, first + k] for m in range(modules)]  # spokes
        for share in NET_RINGS:
            points.append(centres[:, k : k + 1] + share * (face - centres[:, k : k + 1]))
            lines += [[count + m, count + (m + 1) % modules] for m in range(modules)]
            count += modules
    return np.concatenate(points, axis=1), np.array(lines)


def _fixed_parts(parameters: TrussParameters, first: int) -> tuple[Array, Array, Array]:
    """Points that stay, and the lines of the arm and of the motor; the ring opens along +y."""
    middle = -parameters.bar_length / 2
    x, y, z = MOTOR_SIZE
    corners = [
        (i * x / 2, j * y - y, middle + k * z / 2) for i in (-1, 1) for j in (0, 1) for k in (-1, 1)
    ]
    edges = [
        (i, j) for i in range(8) for j in range(i) if bin(i ^ j).count("1") == 1
    ]  # corners that differ in one direction

    points = np.zeros((4, 10, 3))
    points[0] = [(0.0, 0.0, middle), (0.0, -ARM_END, middle), *corners]
    return points, np.array([[first, first + 1]]), first + 2 + np.array(edges)


def tension_exponents(parameters: TrussParameters) -> Array:
    """ln(T_k / T1) of segment k of a rope as `w_0 + w_1 alpha`, shape (4 n, 2), (29)."""
    turns = np.array([(math.pi, -1.0), (math.pi, -2.0), (math.pi, -1.0), (math.pi, 0.0)])
    mu = np.full((parameters.modules, 4), parameters.pulley_friction)
    for module, pulley, own in parameters.other_pulleys:
        mu[module - 1, pulley - 1] = own
    steps = (mu[:, :, None] * turns).reshape(-1, 2)
    return -np.concatenate([np.zeros((1, 2)), np.cumsum(steps[:-1], axis=0)])
