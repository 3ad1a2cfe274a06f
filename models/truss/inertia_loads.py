"""Inertia forces of the ring at its joints, for the balances of its bars.

Each bar's inertia acts as two forces at its ends. Where its ends accelerate by a_j and a_k they are
-m (2 a_j + a_k) / 6 and -m (a_j + 2 a_k) / 6: the resultant and the moment are those of the bar.

Half a module on one face stands for all, here the left one on the upper face, in the plane of the
module: x along the side, from the module's middle, z upward. The middle of a module moves outward
alone.

Symbols: alpha [rad], omega [rad/s], acc [rad/s^2]; b [m] half cross-bar; n modules; M [kg], R [m]
mass and radius of the ring. A prime is a derivative by alpha.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import casadi as ca

from models.truss.inertia import module_elements, total_mass
from models.truss.kinematics import (
    Expression,
    module_nodes,
    slider_distance_curvature,
    slider_distance_slope,
)
from models.truss.parameters import TrussParameters

_BAR_END, _MIDDLE, _CRANK, _SLIDER = 1, 6, 7, 8  # nodes of that half
_LEFT = (1, 2, 3, 6, 7, 8, 9, 10)  # nodes of the left halves of both faces


class InertiaLoads(NamedTuple):
    """Inertia forces of half a module [N], (x, z) each; half of its middle joint is its own."""

    middle: tuple[Expression, Expression]
    crank: tuple[Expression, Expression]
    slider: tuple[Expression, Expression]


def inertia_loads(
    parameters: TrussParameters, alpha: Expression, omega: Expression, acc: Expression
) -> InertiaLoads:
    """Inertia forces at the joints of half a module, but for its bar end."""
    nodes, b = module_nodes(parameters), parameters.half_cross_bar
    wide, high = _rates(alpha, omega, acc)
    slope = slider_distance_slope(parameters, alpha)
    slid = slope * acc + slider_distance_curvature(parameters, alpha) * omega**2

    half = (_BAR_END, _MIDDLE, _CRANK, _SLIDER)
    rates = {
        k: ((nodes[k].x_sin - b) * wide, nodes[k].z_cos * high + nodes[k].z_e * slid) for k in half
    }
    force = {k: [0.0, 0.0] for k in half}
    for mass, j, k in module_elements(parameters):
        if j not in half or k not in half:
            continue
        share = 0.5 if j == k == _MIDDLE else 1.0
        for end, other in ((j, k), (k, j)):
            for axis in (0, 1):
                mean = (2 * rates[end][axis] + rates[other][axis]) / 6
                force[end][axis] -= share * mass * mean
    return InertiaLoads(*((force[k][0], force[k][1]) for k in (_MIDDLE, _CRANK, _SLIDER)))


def inertia_push(
    parameters: TrussParameters, alpha: Expression, omega: Expression, acc: Expression
) -> Expression:
    """Part of the hoop force on one face that the ring's inertia takes [N].

    By the balance of a corner: half of its modules' masses moves outward with them, and along the
    sides with what is left of them to the module's middle. The fixed bar's reaction M R'' presses
    on all corners evenly; what it does beside that moves the whole ring.
    """
    n, b, nodes = parameters.modules, parameters.half_cross_bar, module_nodes(parameters)
    wide, _ = _rates(alpha, omega, acc)
    sine, cosine = math.sin(math.pi / n), math.cos(math.pi / n)
    outward = total_mass(parameters) * b * (1 + cosine**2) / (4 * n * sine**2)
    # the left halves of both faces; the middle joints have no way to go along the side
    along = sum(
        mass * (b - (nodes[j].x_sin + nodes[k].x_sin) / 2) / 2
        for mass, j, k in module_elements(parameters)
        if j in _LEFT and k in _LEFT
    )
    return (outward + along) * wide


def _rates(alpha: Expression, omega: Expression, acc: Expression) -> tuple[Expression, Expression]:
    """Second derivatives by time of sin(alpha) and cos(alpha) [1/s^2]."""
    sine, cosine = ca.sin(alpha), ca.cos(alpha)
    return cosine * acc - sine * omega**2, -sine * acc - cosine * omega**2
