"""What no motion beats, and caps that no motion meets: in closed form or from the phase plane.

Symbols: D [rad] stroke; T [s] longest duration; v, A, j caps on speed, acceleration and jerk;
r = 2 |L'| / f the motor's work per work on the truss, at least 1 and falling with the angle.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from models.laws import least_jerk_cap, least_peak_acceleration
from models.truss import (
    TrussParameters,
    far_end_ratio,
    joint_damping,
    least_peak_reaction,
    least_peak_rope_acceleration,
    potential_slope,
    rope_leverage,
    rope_speed,
    static_force,
)
from studies.common.exit_codes import ExitCode, StudyError
from studies.truss.config import DEPLOYED, Caps, TrussStudy

if TYPE_CHECKING:  # SciPy loads with it, and only where it is needed
    from studies.truss.motions.phase_plane import FastestMotion, LeastForce

GAUSS_POINTS = 60
BETWEEN = 1.01  # what a peak may be above that of the points of a phase plane
ROUNDING = 1e-12  # relative: a cap set to the printed bound itself passes


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
    study: TrussStudy,
    force: LeastForce | None,
    least_time_of_force: float = 0.0,
    longest: float | None = None,
) -> dict[str, float]:
    """What no motion of at most a duration beats, by quantity.

    Parameters
    ----------
    force : LeastForce or None
        The phase-plane bound of the force, where it is known.
    least_time_of_force : float
        T_min of the force cap, from the phase plane [s].
    longest : float, optional
        The duration [s]; by default the longest one of the study.
    """
    caps = study.caps
    duration = study.duration[1] if longest is None else longest
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


def check_feasible(study: TrussStudy, least_force: Callable[[], LeastForce]) -> None:
    """Raise StudyError if a closed form or the phase plane shows that no motion meets the caps.

    Parameters
    ----------
    least_force : callable
        Computes the phase-plane bound; called only if a force cap makes it matter.
    """
    _check_jerk(study)
    _check_kinematics(study)
    _check_tension(study)
    if study.caps.force is not None:
        _check_end_forces(study, study.caps.force)
        try:
            least = least_force()
        except StudyError:  # no bound to be had
            return
        _check_force(study, study.caps.force, least)


def keeps_the_caps(study: TrussStudy, motion: FastestMotion) -> bool:
    """Whether a motion of the phase plane, whose force jumps, keeps all caps of a study."""
    caps = study.caps
    rates = ((caps.speed, motion.peak_speed), (caps.acceleration, motion.peak_acceleration))
    kept = all(cap is None or cap > BETWEEN * value for cap, value in rates)
    in_force = caps.force is None or caps.force >= motion.force
    return kept and in_force and caps.jerk is None and caps.least_tension == 0.0


def _infeasible(sentence: str) -> StudyError:
    return StudyError(sentence, ExitCode.INFEASIBLE)


def _check_jerk(study: TrussStudy) -> None:
    jerk, duration = study.caps.jerk, study.duration[1]
    least = least_jerk_cap(study.stroke, duration)
    if jerk is not None and jerk < least * (1 - ROUNDING):
        raise _infeasible(
            f"no motion deploys in {duration:g} s with a jerk cap of {jerk:.6g} rad/s^3; "
            f"the least feasible cap is 32 D/T^3 = {least:.6g} rad/s^3, or lengthen the duration"
        )


def _check_kinematics(study: TrussStudy) -> None:
    caps, duration = study.caps, study.duration[1]
    least = least_time(study.stroke, caps)
    if least > duration * (1 + ROUNDING):
        # only the caps that are stated are named
        named = [
            f"{name} {value:g} {unit}"
            for name, value, unit in (
                ("speed", caps.speed, "rad/s"),
                ("acceleration", caps.acceleration, "rad/s^2"),
                ("jerk", caps.jerk, "rad/s^3"),
            )
            if value is not None
        ]
        raise _infeasible(
            f"no motion deploys in {duration:g} s under the caps on {', '.join(named)}; "
            f"they need at least {least:.6g} s: lengthen the duration or raise a cap"
        )


def end_forces(truss: TrussParameters) -> tuple[tuple[str, float, float], ...]:
    """Where the truss stands still, its static rope force [N] and the far end's share of it."""
    return tuple(
        (where, float(static_force(truss, angle)), float(far_end_ratio(truss, angle)))
        for where, angle in (("start", truss.stowed_angle), ("end", DEPLOYED))
    )


def _check_tension(study: TrussStudy) -> None:
    floor = study.caps.least_tension
    for where, force, share in end_forces(study.truss):
        tension = force * share

        if study.caps.jerk is not None and floor > tension * (1 + ROUNDING):
            raise _infeasible(
                f"no motion keeps every rope segment above {floor:g} N: at rest at the {where} "
                f"statics fix the tension of the last one to {tension:.6g} N; lower least_tension "
                "to that, or remove the jerk cap, with which the acceleration is zero there"
            )
        if study.caps.force is not None and floor / share > study.caps.force:
            raise _infeasible(
                f"a least tension of {floor:g} N needs a motor force of {floor / share:.6g} N at "
                f"the {where}, above the force cap of {study.caps.force:g} N; lower the one or "
                "raise the other"
            )


def _check_end_forces(study: TrussStudy, cap: float) -> None:
    where, least, _ = max(end_forces(study.truss), key=lambda end: end[1])
    if study.caps.jerk is not None and cap < least * (1 - ROUNDING):
        raise _infeasible(
            f"no motion meets the force cap of {cap:g} N: at rest at the {where} statics need "
            f"{least:.6g} N on each rope; raise the cap to more than that, or remove the jerk cap"
        )


def _check_force(study: TrussStudy, cap: float, least: LeastForce) -> None:
    if cap >= least.force * (1 - ROUNDING) and (least.attained or cap > least.force):
        return
    limit = "" if least.attained else ", a limit that no motion attains"
    raise _infeasible(
        f"no motion deploys in {study.duration[1]:g} s with at most {cap:g} N on each rope; the "
        f"least force without other caps is {least.force:.6g} N{limit} (phase plane, global)"
    )
