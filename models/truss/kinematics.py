"""Kinematics of the ring truss, (16)-(20) of DOI 10.1109/ACCESS.2019.2918614.

Symbols: alpha [rad] deployment angle; omega [rad/s] and acc [rad/s^2] its time derivatives;
e [m] slider-to-end distance; L [m] length of one rope; a, b, c, d [m] bar, half cross-bar,
crank, link; n modules; beta = 2 pi/n. A prime is a derivative with respect to alpha.

Every function takes numbers or CasADi expressions; numbers come back as a float or a DM.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from models.arrays import Array
from models.errors import require
from models.truss.parameters import TrussParameters

Expression = Any  # a CasADi SX, MX, DM or a float; CasADi carries no types


class Node(NamedTuple):
    """A node in its module's plane: x = x_sin sin(alpha), z = z_0 + z_cos cos(alpha) + z_e e."""

    x_sin: Expression
    z_0: Expression
    z_cos: Expression
    z_e: Expression


def module_nodes(parameters: TrussParameters) -> dict[int, Node]:
    """Return the 14 nodes of a module, numbered as in the paper's Fig. 7, lengths in m."""
    a, b, c = parameters.bar_length, parameters.half_cross_bar, parameters.crank
    return {
        1: Node(0, 0, 0, 0),
        2: Node(0, -a, 0, 0),
        3: Node(b, -a, b, 0),
        4: Node(2 * b, -a, 0, 0),
        5: Node(2 * b, 0, 0, 0),
        6: Node(b, 0, -b, 0),
        7: Node(c, 0, -c, 0),
        8: Node(0, 0, 0, -1),
        9: Node(c, -a, c, 0),
        10: Node(0, -a, 0, 1),
        11: Node(2 * b - c, -a, c, 0),
        12: Node(2 * b, -a, 0, 1),
        13: Node(2 * b - c, 0, -c, 0),
        14: Node(2 * b, 0, 0, -1),
    }


def link_ratio(parameters: TrussParameters, alpha: Expression) -> Expression:
    """Turn of the link per alpha, g = c cos(alpha) / sqrt(d^2 - c^2 sin(alpha)^2)."""
    c = parameters.crank
    return c * ca.cos(alpha) / link_height(parameters, alpha)


def slider_distance(parameters: TrussParameters, alpha: Expression) -> Expression:
    """e(alpha) [m], (16)."""
    return parameters.crank * ca.cos(alpha) + link_height(parameters, alpha)


def slider_distance_slope(parameters: TrussParameters, alpha: Expression) -> Expression:
    """e'(alpha) [m/rad] = -c sin(alpha) (1 + g)."""
    return -parameters.crank * ca.sin(alpha) * (1 + link_ratio(parameters, alpha))


def slider_distance_curvature(parameters: TrussParameters, alpha: Expression) -> Expression:
    """e''(alpha) [m/rad^2] = -c cos(alpha) (1 + g) + (c sin(alpha))^2 (1 - g^2) / height."""
    c, g = parameters.crank, link_ratio(parameters, alpha)
    bend = (c * ca.sin(alpha)) ** 2 * (1 - g**2) / link_height(parameters, alpha)
    return bend - c * ca.cos(alpha) * (1 + g)


def slider_distance_third(parameters: TrussParameters, alpha: Expression) -> Expression:
    """e'''(alpha) [m/rad^3] = s (1 + g) + 3 s g (1 - g^2) (1 + s^2 / height^2), s = c sin(alpha).

    The derivative of e'', in which height' = -s g and g' = -s (1 - g^2) / height.
    """
    s, g = parameters.crank * ca.sin(alpha), link_ratio(parameters, alpha)
    square = (s / link_height(parameters, alpha)) ** 2
    return s * (1 + g) + 3 * s * g * (1 - g**2) * (1 + square)


def node_position(
    parameters: TrussParameters, node: int, alpha: Expression, *, module: int | None = None
) -> Expression:
    """Position (3,) [m] of a node, in its module's frame or, with `module`, globally.

    (17)-(19): r = A_i + R_i u for module i = 1..n; the bar 1-2 of module 1 is fixed.

    Raises
    ------
    ModelError
        If there is no such node or module.
    """
    require(node in range(1, 15), f"node is {node!r}; a module has the nodes 1 to 14.")
    place = module_nodes(parameters)[node]
    e = slider_distance(parameters, alpha)

    # u, in the plane of the module
    x = place.x_sin * ca.sin(alpha)
    z = place.z_0 + place.z_cos * ca.cos(alpha) + place.z_e * e
    if module is None:
        return ca.vertcat(x, 0, z)

    along, (g_x, g_y) = module_frame(parameters.modules, module)
    side = 2 * parameters.half_cross_bar * ca.sin(alpha)
    return ca.vertcat(side * g_x + along[0] * x, side * g_y + along[1] * x, z)


def ring_radius(parameters: TrussParameters, alpha: Expression) -> Expression:
    """Circumradius R [m] of the ring, b sin(alpha) / sin(pi/n); its diameter is 2 R."""
    return parameters.half_cross_bar * ca.sin(alpha) / math.sin(math.pi / parameters.modules)


def rope_length(parameters: TrussParameters, alpha: Expression) -> Expression:
    """L [m] of one rope: the last expression of (20), 2 n (e + b); the middle one is twice that."""
    e = slider_distance(parameters, alpha)
    return 2 * parameters.modules * (e + parameters.half_cross_bar)


def rope_speed(parameters: TrussParameters, alpha: Expression, omega: Expression) -> Expression:
    """dL/dt [m/s], from (20); negative while the rope is wound in."""
    return 2 * parameters.modules * slider_distance_slope(parameters, alpha) * omega


def rope_acceleration(
    parameters: TrussParameters, alpha: Expression, omega: Expression, acc: Expression
) -> Expression:
    """d^2L/dt^2 [m/s^2], from (20)."""
    slope = slider_distance_slope(parameters, alpha)
    curvature = slider_distance_curvature(parameters, alpha)
    return 2 * parameters.modules * (slope * acc + curvature * omega**2)


def rope_jerk(
    parameters: TrussParameters,
    alpha: Expression,
    omega: Expression,
    acc: Expression,
    jerk: Expression,
) -> Expression:
    """d^3L/dt^3 [m/s^3] under an angular jerk [rad/s^3], from (20)."""
    slope = slider_distance_slope(parameters, alpha)
    curvature = slider_distance_curvature(parameters, alpha)
    third = slider_distance_third(parameters, alpha)
    rate = slope * jerk + 3 * curvature * omega * acc + third * omega**3
    return 2 * parameters.modules * rate


def angle_from_rope_length(parameters: TrussParameters, length: ArrayLike) -> Array:
    """Angle [rad] at which one rope is `length` [m] long, by the law of cosines behind (16).

    Numbers only; any shape, returned in the same shape.

    Raises
    ------
    ModelError
        If a length lies outside the mechanism's reach, alpha in [0, pi].
    """
    c, d, b, n = (
        parameters.crank,
        parameters.link,
        parameters.half_cross_bar,
        parameters.modules,
    )
    e = np.asarray(length, dtype=float) / (2 * n) - b

    # At either end of the reach crank and link are in line, and rounding may pass it.
    reached = np.all((e >= (d - c) * (1 - 1e-12)) & (e <= (d + c) * (1 + 1e-12)))
    low, high = 2 * n * (b + d - c), 2 * n * (b + d + c)
    worst = float(np.ravel(length)[np.argmax(np.abs(np.ravel(e) - d))])
    require(
        bool(reached),
        f"the rope length {worst:g} m is out of reach; give lengths from {low:g} to {high:g} m.",
    )

    cosine = (e**2 + c**2 - d**2) / (2 * e * c)
    return np.arccos(np.clip(cosine, -1.0, 1.0))


def link_height(parameters: TrussParameters, alpha: Expression) -> Expression:
    """Axial extent of the link, sqrt(d^2 - c^2 sin(alpha)^2) [m]."""
    return ca.sqrt(parameters.link**2 - (parameters.crank * ca.sin(alpha)) ** 2)


def module_frame(modules: int, module: int) -> tuple[tuple[float, float], tuple[float, float]]:
    """R_i x and g_i of (18)-(19), both (2,): A_i = 2 b sin(alpha) g_i."""
    require(
        module in range(1, modules + 1),
        f"module is {module!r}; the ring has the modules 1 to {modules}.",
    )

    # g_i is the sum of the unit sides of all modules before
    turns = 2 * math.pi / modules * np.arange(module)
    sides = np.stack([np.cos(turns), np.sin(turns)])
    origin = sides[:, :-1].sum(axis=1)
    return (float(sides[0, -1]), float(sides[1, -1])), (float(origin[0]), float(origin[1]))
