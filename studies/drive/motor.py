"""What a motor does for a rope: its speed and torque, and what its curve leaves of them.

Symbols: s [m] rope wound in, v [m/s] its speed, F [N] its tension at the drum; r [m] radius of
the drum at the rope's centre line, as `studies.drive.drum` has it, and theta [rad] its turn; N gear
ratio, eta efficiency, I [kg m^2] inertia of the rotor.

    motor speed = N v / r        motor torque = F r / (N eta) + I N theta''

As a force on the rope that torque is F + m r theta'' with m = eta I (N / r)^2: the rotor acts as a
mass on the rope. The rope pulls the gear back at all times, also while the rotor slows down. So the
gear never runs the other way, and eta is the same throughout.

Every function takes numbers, arrays or CasADi expressions.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

from studies.drive.schema import Drive


def motor_speed(drive: Drive, speed: Any, wound: Any) -> Any:
    """Speed of the shaft [rad/s]."""
    return drive.gear_ratio * speed / drive.drum.radius_at(wound)


def rotor_mass(drive: Drive | None, wound: Any) -> Any:
    """The mass m on the rope that the rotor acts as [kg]; 0 without one."""
    if drive is None or drive.motor_inertia == 0.0:
        return 0.0
    return (
        drive.efficiency
        * drive.motor_inertia
        * (drive.gear_ratio / drive.drum.radius_at(wound)) ** 2
    )


def rotor_force(drive: Drive | None, speed: Any, acceleration: Any, wound: Any) -> Any:
    """What the rotor adds to the force of the motor on its rope [N]; 0 without one.

    Parameters
    ----------
    speed, acceleration, wound : of the rope that is wound in [m/s, m/s^2], and its length [m].
    """
    if drive is None or drive.motor_inertia == 0.0:
        return 0.0
    drum = drive.drum
    rim = drum.radius_at(wound) * drum.acceleration_at(wound, speed, acceleration)
    return rotor_mass(drive, wound) * rim


def motor_torque(drive: Drive, force: Any, wound: Any) -> Any:
    """Torque of the shaft [N m] for a force of the motor on its rope, its rotor included."""
    return force * drive.drum.radius_at(wound) / (drive.gear_ratio * drive.efficiency)


def motor_turn(drive: Drive, travel: float) -> float:
    """Angle [rad] by which the shaft turns for a travel of rope."""
    return drive.gear_ratio * float(drive.drum.turn_at(travel))


def rope_force_of(drive: Drive, torque: float) -> float:
    """The most tension [N] that a torque of the shaft ever gives, with the least radius."""
    return torque * drive.gear_ratio * drive.efficiency / drive.radius


def rope_force_at(drive: Drive, speed: Any, wound: Any) -> list[Any]:
    """What the limits of a motor leave for its rope [N]: the least of what is returned.

    The lines of the torque-speed curve go on beyond their corners. The curve is concave, so that
    none of them is below it there; a speed above its last corner is a limit of its own.

    Parameters
    ----------
    speed, wound : of the shaft [rad/s] and rope on the drum [m].
    """
    torques: list[Any] = [] if drive.motor_torque is None else [drive.motor_torque]
    corners = drive.torque_speed or ()
    if corners and (corners[0][0] > 0.0 or len(corners) == 1):
        torques.append(corners[0][1])
    for (slow, high), (fast, low) in pairwise(corners):
        torques.append(high - (high - low) / (fast - slow) * (speed - slow))
    leverage = drive.gear_ratio * drive.efficiency / drive.drum.radius_at(wound)
    return [torque * leverage for torque in torques]


def shares_of_the_curve(drive: Drive, speed: Any, torque: Any) -> tuple[Any, ...]:
    """How much of each line of the torque-speed curve is used; 1 is on the curve.

    Parameters
    ----------
    speed, torque : of the shaft [rad/s, N m].

    Returns
    -------
    tuple
        One share for each line; the curve is kept where all are at most 1. Empty without a curve.
    """
    if drive.torque_speed is None:
        return ()
    corners = drive.torque_speed
    shares = []
    if corners[0][0] > 0.0 or len(corners) == 1:
        shares.append(torque / corners[0][1])
    for (slow, high), (fast, low) in pairwise(corners):
        fall = (high - low) / (fast - slow)
        shares.append((torque + fall * speed) / (high + fall * slow))
    if corners[-1][1] > 0.0:
        shares.append(speed / corners[-1][0])
    return tuple(shares)
