"""What a motor does for a rope: its speed and torque, and what its curve leaves of them.

Symbols: s [m] rope hauled in, v [m/s] its speed, F [N] its tension at the drum; r [m] radius of
the drum at the rope's centre line, as `studies.drive.drum` has it; N gear ratio, eta efficiency.

    motor speed = N v / r        motor torque = F r / (N eta)

Every function takes numbers, arrays or CasADi expressions.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from ocp.arrays import Array
from studies.drive.schema import Drive


def motor_speed(drive: Drive, speed: Any, hauled: Any) -> Any:
    """Speed of the shaft [rad/s]."""
    return drive.gear_ratio * speed / drive.drum.radius_at(hauled)


def motor_torque(drive: Drive, force: Any, hauled: Any) -> Any:
    """Torque of the shaft [N m], without that which the inertia of the motor itself takes."""
    return force * drive.drum.radius_at(hauled) / (drive.gear_ratio * drive.efficiency)


def motor_turn(drive: Drive, travel: float) -> float:
    """Angle [rad] by which the shaft turns for a travel of rope."""
    return drive.gear_ratio * float(drive.drum.turn_at(travel))


def rope_force_of(drive: Drive, torque: float) -> float:
    """The most tension [N] that a torque of the shaft ever gives, with the least radius."""
    return torque * drive.gear_ratio * drive.efficiency / drive.radius


def rope_force_at(drive: Drive, speed: Array, hauled: Array) -> list[Array]:
    """What the limits of a motor leave for its rope [N], (m,) for each limit on the torque.

    Parameters
    ----------
    speed, hauled : of the shaft [rad/s] and rope on the drum [m], (m,) each.
    """
    torques = [] if drive.motor_torque is None else [np.full(speed.size, drive.motor_torque)]
    if drive.torque_speed is not None:
        corners = np.array(drive.torque_speed)
        curve = np.interp(speed, *corners.T)
        torques.append(np.where(speed > corners[-1, 0], 0.0, curve))
    leverage = drive.gear_ratio * drive.efficiency / drive.drum.radius_at(hauled)
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
