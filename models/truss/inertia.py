"""Kinetic energy, momentum and reaction of the ring truss, (22)-(23).

Symbols: J [kg m^2] inertia, E = J omega^2 / 2; M [kg] mass; R [m] circumradius; alpha [rad],
omega [rad/s], acc [rad/s^2]; n modules. A prime is a derivative with respect to alpha.

Only A_i' = 2 b cos(alpha) g_i depends on the module, and the g_i are the corners of a regular
n-gon of side 1 seen from its first corner, so the sums over modules in (23) are
sum |g_i|^2 = n / (2 sin(pi/n)^2) and sum g_i . R_i x = -n/2: nothing grows with n.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import casadi as ca

from models.truss.kinematics import (
    Expression,
    module_nodes,
    ring_radius,
    slider_distance_curvature,
    slider_distance_slope,
)
from models.truss.parameters import TrussParameters

# Rods of a module as pairs of nodes, under the name of their length.
RODS = {
    "bar_length": ((1, 2), (4, 5)),
    "half_cross_bar": ((2, 3), (3, 4), (5, 6), (6, 1)),
    "link": ((7, 8), (9, 10), (11, 12), (13, 14)),
}
JOINTS = {
    "bar_end": (1, 2, 4, 5),
    "middle": (3, 6),
    "crank": (7, 9, 11, 13),
    "slider": (8, 10, 12, 14),
}
SHARED = {"bar_length", "bar_end", "slider"}  # by two neighbours each


class InertiaCoefficients(NamedTuple):
    """J = cosine cos^2 + sine sin^2 + slide e'^2 - mixed sin e', all [kg m^2] but slide [kg]."""

    cosine: Expression
    sine: Expression
    slide: Expression
    mixed: Expression


def inertia(parameters: TrussParameters, alpha: Expression) -> Expression:
    """J(alpha) [kg m^2], (23) with the sums over modules in closed form."""
    k = inertia_coefficients(parameters)
    s, slope = ca.sin(alpha), slider_distance_slope(parameters, alpha)
    return k.cosine * ca.cos(alpha) ** 2 + k.sine * s**2 + k.slide * slope**2 - k.mixed * s * slope


def inertia_slope(parameters: TrussParameters, alpha: Expression) -> Expression:
    """J'(alpha) [kg m^2/rad]."""
    k = inertia_coefficients(parameters)
    s, co = ca.sin(alpha), ca.cos(alpha)
    slope = slider_distance_slope(parameters, alpha)
    curvature = slider_distance_curvature(parameters, alpha)
    return (
        2 * (k.sine - k.cosine) * s * co
        + 2 * k.slide * slope * curvature
        - k.mixed * (co * slope + s * curvature)
    )


def kinetic_energy(parameters: TrussParameters, alpha: Expression, omega: Expression) -> Expression:
    """E [J] = J omega^2 / 2, (22)."""
    return inertia(parameters, alpha) * omega**2 / 2


def total_mass(parameters: TrussParameters) -> Expression:
    """M [kg] of bars and joints, under the chosen way of counting."""
    return parameters.modules * sum(mass for mass, _, _ in module_elements(parameters))


def linear_momentum(
    parameters: TrussParameters, alpha: Expression, omega: Expression
) -> Expression:
    """M R' omega [N s], from the fixed bar towards the centre of the ring.

    By n-fold symmetry the centre of mass is the centre of the ring, R from the fixed bar.
    """
    return total_mass(parameters) * _radius_slope(parameters, alpha) * omega


def reaction_force(
    parameters: TrussParameters, alpha: Expression, omega: Expression, acc: Expression
) -> Expression:
    """Force on the truss at its fixed bar [N], towards the centre: the momentum's rate.

    The arm feels the opposite; the moment about the middle of the fixed bar is zero. The motor
    is taken to sit on the truss, so that the forces of the ropes are internal.
    """
    pull = _radius_slope(parameters, alpha) * acc - ring_radius(parameters, alpha) * omega**2
    return total_mass(parameters) * pull


def inertia_coefficients(parameters: TrussParameters) -> InertiaCoefficients:
    """Return the constants of J, summed over rods and joints of a module and over the ring."""
    nodes = module_nodes(parameters)
    n, side = parameters.modules, 2 * parameters.half_cross_bar
    corners = 1 / (2 * math.sin(math.pi / n) ** 2)  # sum |g_i|^2 / n
    edges = -1 / 2  # sum g_i . R_i x / n

    # Squared velocities of a rod, per omega^2, by the terms of its nodes: x_sin with the module's
    # own shift goes with cos^2, z_cos with sin^2, z_e with e'^2, their product with sin e'.
    cosine = sine = slide = mixed = 0.0
    for mass, j, k in module_elements(parameters):
        u, v = nodes[j], nodes[k]

        middle = (u.x_sin + v.x_sin) / 2
        across = _mean_product(u.x_sin, v.x_sin, u.x_sin, v.x_sin)
        cosine += n * mass * (side**2 * corners + 2 * side * edges * middle + across)
        sine += n * mass * _mean_product(u.z_cos, v.z_cos, u.z_cos, v.z_cos)
        slide += n * mass * _mean_product(u.z_e, v.z_e, u.z_e, v.z_e)
        mixed += 2 * n * mass * _mean_product(u.z_cos, v.z_cos, u.z_e, v.z_e)

    return InertiaCoefficients(cosine, sine, slide, mixed)


def module_elements(parameters: TrussParameters) -> list[tuple[Expression, int, int]]:
    """(mass, node, node) of each rod and, with twice the same node, of each joint of a module."""
    # Half of what two neighbours share belongs to each; the paper counts it in both.
    share = dict.fromkeys(SHARED, 0.5 if parameters.counting == "once" else 1.0)

    rods = [
        (share.get(name, 1.0) * parameters.linear_density * getattr(parameters, name), j, k)
        for name, pairs in RODS.items()
        for j, k in pairs
    ]

    joints = [
        (share.get(name, 1.0) * getattr(parameters.joint_masses, name), j, j)
        for name, nodes in JOINTS.items()
        for j in nodes
    ]
    return rods + joints


def _mean_product(p_j: Expression, p_k: Expression, q_j: Expression, q_k: Expression) -> Expression:
    """Mean of p q along a rod on which p and q run linearly from end j to end k."""
    return (2 * p_j * q_j + p_j * q_k + p_k * q_j + 2 * p_k * q_k) / 6


def _radius_slope(parameters: TrussParameters, alpha: Expression) -> Expression:
    """R'(alpha) [m/rad] = b cos(alpha) / sin(pi/n)."""
    return parameters.half_cross_bar * ca.cos(alpha) / math.sin(math.pi / parameters.modules)
