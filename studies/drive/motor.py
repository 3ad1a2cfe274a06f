"""What a motor does for a rope: its speed and torque, and what its curve leaves of them.

Symbols: s [m] rope hauled in, v [m/s] its speed, F [N] its tension at the drum; r [m] radius of
the drum at the rope's centre line; N gear ratio, eta efficiency.

    motor speed = N v / r        motor torque = F r / (N eta)

A drum of several layers is taken as a spiral: w turns of a rope of diameter d raise the radius by
d, so that r^2 = r0^2 + s d / (pi w). The steps of a real drum lie within d of that.

Every function takes numbers, arrays or CasADi expressions.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np

from ocp.arrays import Array
from studies.drive.schema import Drive


def drum_radius(drive: Drive, hauled: Any) -> Any:
    """Radius r [m] when so much rope is on the drum."""
    if drive.rope_diameter is None or drive.layer_turns is None:
        return drive.radius
    growth = drive.rope_diameter / (math.pi * drive.layer_turns)
    return (drive.radius**2 + growth * hauled) ** 0.5


def motor_speed(drive: Drive, speed: Any, hauled: Any) -> Any:
    """Speed of the shaft [rad/s]."""
    return drive.gear_ratio * speed / drum_radius(drive, hauled)


def motor_torque(drive: Drive, force: Any, hauled: Any) -> Any:
    """Torque of the shaft [N m], without that which the inertia of the motor itself takes."""
    return force * drum_radius(drive, hauled) / (drive.gear_ratio * drive.efficiency)


def motor_turn(drive: Drive, travel: float) -> float:
    """Angle [rad] by which the shaft turns for a travel of rope."""
    first = drive.radius
    if drive.rope_diameter is None or drive.layer_turns is None:
        return drive.gear_ratio * travel / first
    growth = drive.rope_diameter / (math.pi * drive.layer_turns)  # integral of ds / r
    return drive.gear_ratio * 2 * (float(drum_radius(drive, travel)) - first) / growth


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
    leverage = drive.gear_ratio * drive.efficiency / drum_radius(drive, hauled)
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
