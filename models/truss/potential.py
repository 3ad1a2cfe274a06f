"""Potential energy of springs and cable net, (24)-(26), and of the weight on a test bench.

Symbols: U [J]; e [m] slider distance, l0 [m] free length, k1, k2 [N/m] stiffness of springs and
net; alpha_c [rad] angle from which the net is taut. A prime is a derivative by alpha.

U is C1 but not C2 at alpha_c, an event of the problem: "by angle" switches there, "slack" and
"taut" are its two smooth branches, one for each phase of an optimal control problem.
"""

from __future__ import annotations

import math
from typing import Literal

import casadi as ca

from models.errors import require
from models.truss.gravity import gravity_potential, gravity_slope
from models.truss.kinematics import Expression, slider_distance, slider_distance_slope
from models.truss.parameters import TrussParameters

Net = Literal["by angle", "slack", "taut"]


def potential(parameters: TrussParameters, alpha: Expression, net: Net = "by angle") -> Expression:
    """U(alpha) [J], (26) and that of the weight."""
    squeeze = parameters.spring_free_length - slider_distance(parameters, alpha)
    springs = parameters.modules * parameters.spring_stiffness * squeeze**2  # (24)
    taut = _net_stiffness(parameters) * _taut_stretch(parameters, alpha) ** 2 / 2  # (25)
    weight = gravity_potential(parameters, alpha)
    return springs + weight + _where_taut(parameters, alpha, net, taut)


def potential_slope(
    parameters: TrussParameters, alpha: Expression, net: Net = "by angle"
) -> Expression:
    """U'(alpha) [N m/rad]."""
    squeeze = parameters.spring_free_length - slider_distance(parameters, alpha)
    slope = slider_distance_slope(parameters, alpha)
    springs = -2 * parameters.modules * parameters.spring_stiffness * squeeze * slope
    taut = _net_stiffness(parameters) * _taut_stretch(parameters, alpha) * ca.cos(alpha)
    return springs + gravity_slope(parameters, alpha) + _where_taut(parameters, alpha, net, taut)


def net_stretch(
    parameters: TrussParameters, alpha: Expression, net: Net = "by angle"
) -> Expression:
    """Growth of the ring since its net became taut, per radius of the open ring [-]."""
    return _where_taut(parameters, alpha, net, _taut_stretch(parameters, alpha))


def _net_stiffness(parameters: TrussParameters) -> Expression:
    """2 n k2 b^2 / sin(pi/n)^2 [N m], the stiffness of the net against sin(alpha)."""
    side = parameters.half_cross_bar / math.sin(math.pi / parameters.modules)
    return 2 * parameters.modules * parameters.net_stiffness * side**2


def _taut_stretch(parameters: TrussParameters, alpha: Expression) -> Expression:
    """sin(alpha) - sin(alpha_c), by a product that does not cancel near alpha_c."""
    alpha_c = parameters.net_angle
    return 2 * ca.cos((alpha + alpha_c) / 2) * ca.sin((alpha - alpha_c) / 2)


def _where_taut(
    parameters: TrussParameters, alpha: Expression, net: Net, value: Expression
) -> Expression:
    require(
        net in ("by angle", "slack", "taut"),
        f'net is {net!r}; choose "by angle", "slack" or "taut".',
    )
    if net == "by angle":
        return ca.if_else(alpha >= parameters.net_angle, value, 0)
    return value if net == "taut" else 0
