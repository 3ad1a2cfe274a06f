"""Equation of motion of the ring truss, (37)-(38), solved for force or acceleration.

Symbols: T1 [N] motor force on one rope; J [kg m^2]; U [J]; D [N m s/rad]; f [m]; alpha [rad],
omega [rad/s], acc [rad/s^2].

    J acc + J' omega^2 / 2 + D omega + C + U' = T1 f

C [N m] is Coulomb friction and a measured load, at rest, too: U' + C is what the ropes have to
overcome to start.
A rotor behind gear and drum acts as a mass m [kg] on each rope. With s [m] rope wound in, a motor
that pulls with F leaves T1 = F - m s'' for the rope, and s'' = s' acc + s'' omega^2 by the angle:

    (J + m f s') acc + (J' / 2 + m f s'') omega^2 + D omega + C + U' = F f

The friction opposes the motion; (38) prints it with the opposite sign if (27) is inserted.
"""

from __future__ import annotations

from typing import NamedTuple

import casadi as ca

from models.numerics import dense_peak
from models.truss.friction import coulomb_torque, joint_damping
from models.truss.inertia import inertia, inertia_slope
from models.truss.kinematics import Expression, rope_acceleration, rope_speed
from models.truss.measured import measured_torque
from models.truss.opening import Opening, whole_opening
from models.truss.parameters import TrussParameters
from models.truss.potential import Net, potential_slope
from models.truss.rope import rope_leverage


class ForceCoefficients(NamedTuple):
    """T1 = static + centrifugal omega^2 + viscous omega + inertial acc, functions of alpha."""

    static: Expression  # c0 = (U' + C)/f [N]
    centrifugal: Expression  # c1 = J'/(2 f) [N s^2]
    viscous: Expression  # c2 = D/f [N s]
    inertial: Expression  # c3 = J/f [N s^2]


def force_coefficients(
    parameters: TrussParameters, alpha: Expression, net: Net = "by angle"
) -> ForceCoefficients:
    """Return the four functions of alpha that make up the rope force, (38)."""
    f = rope_leverage(parameters, alpha)
    return ForceCoefficients(
        static=static_torque(parameters, alpha, net) / f,
        centrifugal=inertia_slope(parameters, alpha) / (2 * f),
        viscous=joint_damping(parameters, alpha) / f,
        inertial=inertia(parameters, alpha) / f,
    )


def rope_force(
    parameters: TrussParameters,
    alpha: Expression,
    omega: Expression,
    acc: Expression,
    net: Net = "by angle",
) -> Expression:
    """T1 [N] that a motion needs, (38); omega >= 0 where mu > 0."""
    c0, c1, c2, c3 = force_coefficients(parameters, alpha, net)
    return c0 + c1 * omega**2 + c2 * omega + c3 * acc


def angular_acceleration(
    parameters: TrussParameters,
    alpha: Expression,
    omega: Expression,
    tension: Expression,
    net: Net = "by angle",
    rotor: float = 0.0,
) -> Expression:
    """Angular acceleration [rad/s^2] under the motor force `tension` [N] on both ropes, (38).

    Parameters
    ----------
    rotor : m, the mass on each rope as which the rotor of its motor acts [kg].
    """
    torque = (
        tension * rope_leverage(parameters, alpha)
        - inertia_slope(parameters, alpha) * omega**2 / 2
        - joint_damping(parameters, alpha) * omega
        - static_torque(parameters, alpha, net)
    )
    mass = inertia(parameters, alpha)
    if rotor:
        lever = rotor * rope_leverage(parameters, alpha)
        # the rope's own rates are those of its length, which falls
        torque = torque + lever * rope_acceleration(parameters, alpha, omega, 0.0)
        mass = mass - lever * rope_speed(parameters, alpha, 1.0)
    return torque / mass


def static_torque(
    parameters: TrussParameters, alpha: Expression, net: Net = "by angle"
) -> Expression:
    """U' + C [N m], what the ropes have to overcome at rest, a measured load included."""
    held = potential_slope(parameters, alpha, net) + coulomb_torque(parameters, alpha)
    return held + measured_torque(parameters, alpha)


def static_force(
    parameters: TrussParameters, alpha: Expression, net: Net = "by angle"
) -> Expression:
    """(U' + C)/f [N], the motor force on each rope that just does not open the truss at rest.

    Without Coulomb friction it is the force that holds the truss.
    """
    return static_torque(parameters, alpha, net) / rope_leverage(parameters, alpha)


class StaticPeak(NamedTuple):
    """Greatest static motor force on each rope [N] and the angle where it is needed [rad]."""

    angle: float
    force: float


def static_peak(parameters: TrussParameters, opening: Opening | None = None) -> StaticPeak:
    """Maximum of (U' + C)/f from stowed to open, or of a motion, at the truss's own friction.

    It is the ridge that every slow deployment has to cross.
    """
    ends = opening or whole_opening(parameters)
    peak = dense_peak(
        lambda alpha: static_force(parameters, ca.DM(alpha)).full().ravel(),
        ends.start,
        ends.end,
        breakpoints=(parameters.net_angle,),  # where the net becomes taut, a kink of U'
    )
    return StaticPeak(angle=peak.where, force=peak.value)
