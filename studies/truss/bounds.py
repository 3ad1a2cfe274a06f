"""Bounds that no motion beats, in closed form or from the phase plane.

Symbols: D [rad] stroke; T [s] longest duration; v, A, j caps on speed, acceleration and jerk;
r = 2 |L'| / f the motor's work per work on the truss, at least 1 and falling with the angle.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from models.laws import least_jerk_cap, least_peak_acceleration
from models.truss import (
    joint_damping,
    least_peak_reaction,
    least_peak_rope_acceleration,
    potential_slope,
    rope_leverage,
    rope_speed,
)
from studies.truss.config import DEPLOYED, Caps, TrussStudy

if TYPE_CHECKING:  # SciPy loads with it, and only where it is needed
    from studies.truss.phase_plane import LeastForce

GAUSS_POINTS = 60


def least_time(stroke: float, caps: Caps) -> float:
    """Least time [s] from rest to rest under the caps on speed, acceleration and jerk alone."""
    if caps.speed is None and caps.acceleration is None and caps.jerk is None:
        return 0.0
    speed = _top_speed(stroke, caps)
    cruise = 0.0 if math.isinf(speed) else (stroke - speed * _ramp_time(speed, caps)) / speed
    return cruise + 2 * _ramp_time(speed, caps)


def _ramp_time(speed: float, caps: Caps) -> float:
    """Least time from rest to `speed`, the acceleration zero at both ends if jerk is capped."""
    acceleration, jerk = caps.acceleration, caps.jerk
    if jerk is None:
        return 0.0 if acceleration is None else speed / acceleration
    if acceleration is None or acceleration**2 >= speed * jerk:
        return 2 * math.sqrt(speed / jerk)
    return speed / acceleration + acceleration / jerk


def _top_speed(stroke: float, caps: Caps) -> float:
    """Speed reached when the stroke is covered as fast as possible [rad/s]."""
    cap = math.inf if caps.speed is None else caps.speed
    if caps.acceleration is None and caps.jerk is None:
        return cap
    low, high = 0.0, min(cap, 1e9)
    if high * _ramp_time(high, caps) <= stroke:
        return high
    for _ in range(200):  # bisection of the increasing speed * ramp time
        middle = (low + high) / 2
        low, high = (middle, high) if middle * _ramp_time(middle, caps) < stroke else (low, middle)
    return low


def least_work(study: TrussStudy, duration: float) -> float:
    """Lower bound on the motor's work in `duration` [J].

    The work is the integral over the angle of r (U' + D omega + K'), and that of r K' is not
    negative because r falls with the angle; the friction term is at least what an angle-wise
    optimal speed would need (Cauchy and Schwarz).
    """
    truss = study.truss
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    static, friction = 0.0, 0.0
    for low, high in ((truss.stowed_angle, truss.net_angle), (truss.net_angle, DEPLOYED)):
        alpha = ca.DM((low + high) / 2 + (high - low) / 2 * nodes)
        ratio = (-2 * rope_speed(truss, alpha, 1.0) / rope_leverage(truss, alpha)).full().ravel()
        slope = potential_slope(truss, alpha).full().ravel()
        damping = joint_damping(truss, alpha).full().ravel()
        static += (high - low) / 2 * float(weights @ (ratio * slope))
        friction += (high - low) / 2 * float(weights @ np.sqrt(ratio * damping))
    return static + friction**2 / duration


def lower_bounds(
    study: TrussStudy, force: LeastForce | None, least_time_of_force: float = 0.0
) -> dict[str, float]:
    """What no motion of at most the longest duration beats, by quantity.

    Parameters
    ----------
    force : LeastForce or None
        The phase-plane bound of the force, where it is known.
    least_time_of_force : float
        T_min of the force cap, from the phase plane [s].
    """
    duration, caps = study.duration[1], study.caps
    work = least_work(study, duration)
    bounds = {
        "peak-acceleration": least_peak_acceleration(study.stroke, duration, jerk=caps.jerk),
        "peak-rope-acceleration": least_peak_rope_acceleration(study.truss, duration),
        "peak-reaction": least_peak_reaction(study.truss, duration),
        "peak-speed": study.stroke / duration,
        "peak-power": work / duration,
        "energy": work,
        "time": max(study.duration[0], least_time(study.stroke, caps), least_time_of_force),
    }
    if caps.jerk is not None:
        bounds["peak-jerk"] = least_jerk_cap(study.stroke, duration)
    if force is not None:
        bounds["peak-force"] = force.force
    return bounds
