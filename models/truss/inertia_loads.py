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
from collections.abc import Iterator
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

_LEFT = (1, 2, 3, 6, 7, 8, 9, 10)  # nodes of the left halves of both faces
# each part of the left half of the upper face: its two nodes, and whose load its forces there are
_PARTS = {
    (1, 7): ("bar_end", "inner"),
    (7, 6): ("outer", "middle"),
    (7, 8): ("crank", "slider"),
    (6, 6): ("middle", "middle"),
    (7, 7): ("crank", "crank"),
    (8, 8): ("slider", "slider"),
}

Force = tuple[Expression, Expression]  # (x, z) [N]


class InertiaLoads(NamedTuple):
    """Inertia forces of half a module [N]; half of its middle joint is its own.

    The half cross-bar counts as two parts that meet at the crank, so that a cut there is exact.
    """

    bar_end: Force  # of the inner part of the half cross-bar
    inner: Force  # of the inner part, at the crank
    outer: Force  # of the outer part, at the crank
    crank: Force  # of link and joint, at the crank
    middle: Force
    slider: Force


def inertia_loads(
    parameters: TrussParameters, alpha: Expression, omega: Expression, acc: Expression
) -> InertiaLoads:
    """Inertia forces at the joints of half a module."""
    nodes, b = module_nodes(parameters), parameters.half_cross_bar
    wide, high = _rates(alpha, omega, acc)
    slope = slider_distance_slope(parameters, alpha)
    slid = slope * acc + slider_distance_curvature(parameters, alpha) * omega**2

    rates = {
        k: ((nodes[k].x_sin - b) * wide, nodes[k].z_cos * high + nodes[k].z_e * slid)
        for k in (1, 6, 7, 8)
    }
    force = {name: [0.0, 0.0] for name in InertiaLoads._fields}
    for mass, j, k in _parts(parameters):
        for (end, other), name in zip(((j, k), (k, j)), _PARTS[j, k], strict=True):
            for axis in (0, 1):
                force[name][axis] -= mass * (2 * rates[end][axis] + rates[other][axis]) / 6
    return InertiaLoads(**{name: (x, z) for name, (x, z) in force.items()})


def _parts(parameters: TrussParameters) -> Iterator[tuple[Expression, int, int]]:
    """(mass, node, node) of each of `_PARTS`."""
    inner = parameters.crank / parameters.half_cross_bar
    for mass, j, k in module_elements(parameters):
        if (j, k) == (6, 1):
            yield inner * mass, 1, 7
            yield (1 - inner) * mass, 7, 6
        elif (j, k) in _PARTS:
            yield (mass / 2 if j == k == 6 else mass), j, k


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
