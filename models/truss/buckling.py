"""Buckling of the bars under their axial push, and the angle that play in a link is worth.

Euler's load of a bar that is pinned at both ends is pi^2 E I / l^2. Cross-bars are taken over the
half cross-bar, from bar end to middle joint, and vertical bars over their whole length. All bars
have the section of the assumed tube, and E is assumed, too.

Symbols: E [Pa]; I [m^4]; l [m]; alpha [rad], omega [rad/s], acc [rad/s^2]; T1 [N] motor force.
"""

from __future__ import annotations

import math

import casadi as ca

from models.truss.bar_forces import extreme_bar_forces, extreme_modules_forces
from models.truss.kinematics import Expression, slider_distance_slope
from models.truss.parameters import (
    TUBE_INNER_DIAMETER,
    TUBE_OUTER_DIAMETER,
    TrussParameters,
)
from models.truss.potential import Net

TUBE_SECOND_MOMENT = math.pi / 64 * (TUBE_OUTER_DIAMETER**4 - TUBE_INNER_DIAMETER**4)  # [m^4]


def buckling_load(parameters: TrussParameters, length: Expression) -> Expression:
    """Euler's load of a bar of this length [N]."""
    return math.pi**2 * parameters.elastic_modulus * TUBE_SECOND_MOMENT / length**2


def buckling_shares(
    parameters: TrussParameters,
    alpha: Expression,
    omega: Expression,
    acc: Expression,
    tension: Expression,
    net: Net = "by angle",
) -> dict[str, Expression]:
    """Pushes as parts of the buckling load [-], among which is the largest of the ring, by name.

    For ropes that pull.
    """
    state = (parameters, alpha, omega, acc, tension)
    link = buckling_load(parameters, parameters.link)
    half = buckling_load(parameters, parameters.half_cross_bar)
    bar = buckling_load(parameters, parameters.bar_length)

    pushes = extreme_bar_forces(*state, net)
    shares = {name: push / (link if "link" in name else half) for name, push in pushes.items()}
    # the push in a vertical bar is the step of the shear, which is largest at an end of the ring
    for place, forces in extreme_modules_forces(*state, net):
        if not place.startswith("between"):
            shares[f"vertical_bar_{place}"] = forces.vertical_bar / bar
    return shares


def play_angle(parameters: TrussParameters, alpha: Expression, play: Expression) -> Expression:
    """Angle [rad] that a play of the slider along its bar [m] is worth: play / |e'|."""
    return play / ca.fabs(slider_distance_slope(parameters, alpha))
