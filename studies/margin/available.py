"""What a motor has for each rope, and what of it the required margins need.

Symbols: A(v) [N] what the motor has at a speed, the least of several lines; F [N] what it needs,
margin and derating counted; A0 [N] the least line at rest with an empty drum.

    margins are kept where F <= A(v), or F + (A0 - A(v)) <= A0

The left side is the stall force that the margins need: that of a motor whose torque falls with the
speed as this one's does. A0 less its peak is what the motor has to spare.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import casadi as ca

from models.truss import Net, Opening, TrussParameters, rope_length, rope_speed
from studies.drive.motor import motor_speed, rope_force_at
from studies.drive.schema import Drive
from studies.margin.loads import Motion, needed_in_motion, needed_of_the_motor, static_needs
from studies.margin.schema import MarginRequirements


def available_forces(
    margin: MarginRequirements, drive: Drive | None, winding: Any, wound: Any
) -> list[Any]:
    """What the motor has for each rope before derating [N]: the least of what is returned.

    Parameters
    ----------
    winding, wound : speed and length of the rope that is wound in [m/s, m].

    Returns
    -------
    list
        Empty where nothing is said of the motor.
    """
    if margin.available is not None:
        return [margin.available]
    if drive is None:
        return []
    limits: list[Any] = [] if drive.force is None else [drive.force]
    if drive.drum_radius is not None:
        limits += rope_force_at(drive, motor_speed(drive, winding, wound), wound)
    return limits


def stall_force(margin: MarginRequirements | None, drive: Drive | None) -> float | None:
    """A0 [N]; None where nothing is said of the motor."""
    limits = [] if margin is None else available_forces(margin, drive, 0.0, 0.0)
    return min(limits, default=None)


def needed_at_standstill(
    margin: MarginRequirements,
    drive: Drive | None,
    truss: TrussParameters,
    motion: Motion,
    net: Net = "by angle",
    opening: Opening | None = None,
) -> tuple[Any, ...]:
    """The stall force that the margins need [N]; the largest counts. Empty without a motor."""
    first = stall_force(margin, drive)
    if first is None:
        return ()
    alpha, omega, _ = motion
    wound = rope_length(truss, truss.stowed_angle) - rope_length(truss, alpha)
    limits = available_forces(margin, drive, -rope_speed(truss, alpha, omega), wound)
    constant = [limit for limit in limits if isinstance(limit, float)]
    falling = [first - limit for limit in limits if not isinstance(limit, float)]

    if not falling:  # then what is needed at rest is the same number for all motions
        return needed_of_the_motor(margin, truss, motion, net, drive, opening)
    needs = (
        *static_needs(margin, truss, alpha, net),
        *needed_in_motion(margin, truss, motion, net, drive),
    )
    drops = [0.0, *falling] if first in constant else falling
    return tuple(need + drop for need in needs for drop in drops)


@lru_cache(maxsize=8)
def standstill_kernel(
    margin: MarginRequirements,
    drive: Drive | None,
    truss: TrussParameters,
    opening: Opening | None = None,
) -> ca.Function | None:
    """Angle, speed and acceleration to the stall forces that the margins need; None without any."""
    symbols = ca.SX.sym("alpha"), ca.SX.sym("omega"), ca.SX.sym("acc")
    needs = needed_at_standstill(margin, drive, truss, symbols, opening=opening)
    return ca.Function("stall", symbols, [ca.vertcat(*needs)], {"cse": True}) if needs else None
