"""Friction of joints and sliders: viscous, (27), and Coulomb's, with that of a test bench.

The truss only opens, so that a Coulomb force has one sign and needs no smoothing. It has its full
value at rest: a motor force below that does not start the truss.

Symbols: D [N m s/rad]; xi1 [N m s/rad], xi2 [N s/m]; C [N m]; g link ratio; omega [rad/s].
"""

from __future__ import annotations

import math

import casadi as ca

from models.truss.kinematics import Expression, link_ratio, slider_distance_slope
from models.truss.measured import measured_torque
from models.truss.parameters import TrussParameters


def joint_damping(parameters: TrussParameters, alpha: Expression) -> Expression:
    """D(alpha) [N m s/rad]: the generalised force of the joints is -D omega, (27)."""
    g = link_ratio(parameters, alpha)
    slope = slider_distance_slope(parameters, alpha)
    turning = 4 + 4 * g**2 + 4 * (1 + g) ** 2 + 2 * 2**2
    return parameters.modules * (
        parameters.joint_friction * turning + 2 * parameters.slider_friction * slope**2
    )


def coulomb_torque(parameters: TrussParameters, alpha: Expression) -> Expression:
    """C(alpha) [N m]: the generalised force of all Coulomb friction is -C while the truss opens.

    By virtual work over the turns of the joints in (27), the ways of the 2 n sliders, and the
    chords on which the vertical bars move away from the fixed one.
    """
    turning = (
        4 + 4 * link_ratio(parameters, alpha) + 4 * (1 + link_ratio(parameters, alpha)) + 2 * 2
    )
    sliding = -2 * slider_distance_slope(parameters, alpha)
    hung = off_load_push(parameters) * 4 * parameters.half_cross_bar * ca.cos(alpha)
    return parameters.modules * (
        parameters.joint_coulomb * turning + parameters.slider_coulomb * sliding + hung
    )


def off_load_push(parameters: TrussParameters) -> Expression:
    """Part of the hoop force on one face that the friction of the off-load takes [N].

    A corner of the ring is sin(pi k/n)/sin(pi/n) sides from the fixed one. These chords sum up to
    cot(pi/2n)/sin(pi/n) sides, and a hoop force does work on 2 n sides.
    """
    n = parameters.modules
    chords = 1 / (math.tan(math.pi / (2 * n)) * math.sin(math.pi / n))
    return parameters.off_load_friction * chords / (2 * n)


def joint_loss(parameters: TrussParameters, alpha: Expression, omega: Expression) -> Expression:
    """Power dissipated in joints, sliders, off-load and measured load [W], D omega^2 + C omega."""
    constant = coulomb_torque(parameters, alpha) + measured_torque(parameters, alpha)
    return joint_damping(parameters, alpha) * omega**2 + constant * omega


def one_way(parameters: TrussParameters) -> tuple[str, ...]:
    """Names of the frictions that are modelled for a truss that opens, if there are any."""
    names = (
        "pulley_friction",
        "other_pulleys",
        "joint_coulomb",
        "slider_coulomb",
        "off_load_friction",
        "measured_torque",
    )
    return tuple(name for name in names if getattr(parameters, name))
