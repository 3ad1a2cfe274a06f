"""What the antenna does under a drive that is known at many times, free of steps of an integrator.

The twist e obeys eddot + w^2 e = betaddot, so that a drive whose acceleration is linear between two
times has a solution in sines: exact, however stiff the arm is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.arrays import Array
from models.errors import require
from models.turn.dynamics import swing_energy, torque
from models.turn.parameters import TurnParameters


@dataclass(frozen=True, eq=False)
class TurnResponse:
    """Histories of a turn, all of shape (m,).

    Attributes
    ----------
    time : [s].
    drive_angle, drive_rate, drive_acceleration : of the drive [rad, rad/s, rad/s^2].
    antenna_angle, antenna_rate : of the antenna [rad, rad/s].
    torque : in the big arm [N m].
    energy : of the swing about the drive's angle [J].
    """

    time: Array
    drive_angle: Array
    drive_rate: Array
    drive_acceleration: Array
    antenna_angle: Array
    antenna_rate: Array
    torque: Array
    energy: Array


def turn_response(turn: TurnParameters, time: Array, before: Array, after: Array) -> TurnResponse:
    """Turn from rest at the angle zero under a drive whose acceleration is linear between times.

    Parameters
    ----------
    time : (m,), rising [s].
    before, after : the drive's acceleration at the end and at the begin of the steps that meet at
        these times, (m,) [rad/s^2]: it may jump.

    Raises
    ------
    ModelError
        If the times do not rise, or the shapes differ.
    """
    require(
        time.ndim == 1
        and time.shape == before.shape == after.shape
        and bool((np.diff(time) > 0).all()),
        "turn_response: give rising times and two accelerations for each of them.",
    )
    w = turn.frequency
    step = np.diff(time)
    u, slope = after[:-1], (before[1:] - after[:-1]) / step
    beta, beta_rate = np.zeros(time.size), np.zeros(time.size)
    beta_rate[1:] = np.cumsum(u * step + slope * step**2 / 2)
    beta[1:] = np.cumsum(beta_rate[:-1] * step + u * step**2 / 2 + slope * step**3 / 6)

    # e - (u + slope t) / w^2 swings freely; a complex number holds it and its rate over w
    turned = np.exp(-1j * w * step)
    twist, rate = np.zeros(time.size), np.zeros(time.size)
    for i in range(step.size):
        free = twist[i] - u[i] / w**2 + 1j * (rate[i] - slope[i] / w**2) / w
        free *= turned[i]
        twist[i + 1] = free.real + (u[i] + slope[i] * step[i]) / w**2
        rate[i + 1] = free.imag * w + slope[i] / w**2
    psi, psi_rate = beta - twist, beta_rate - rate
    return TurnResponse(
        time=time,
        drive_angle=beta,
        drive_rate=beta_rate,
        drive_acceleration=after,
        antenna_angle=psi,
        antenna_rate=psi_rate,
        torque=torque(turn, psi, beta),
        energy=swing_energy(turn, psi, psi_rate, beta),
    )
