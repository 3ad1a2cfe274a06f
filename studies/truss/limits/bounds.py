"""What no motion beats, in closed form or from the phase plane.

Symbols: D [rad] stroke; T [s] longest duration; v, A, j caps on speed, acceleration and jerk;
r = 2 |L'| / f the motor's work per work on the truss, at least 1 and falling with the angle.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from models.errors import ModelError
from models.laws import least_jerk_cap, least_peak_acceleration
from models.truss import (
    TrussParameters,
    joint_damping,
    least_peak_reaction,
    rope_leverage,
    rope_speed,
    rope_travel,
    static_force,
    static_torque,
)
from studies.drive.motor import motor_torque, motor_turn
from studies.margin.loads import least_static_need
from studies.margin.schema import MarginRequirements
from studies.truss.config import DEPLOYED, TrussStudy
from studies.truss.limits.caps import CAPPED, CURVE, Caps, cap_on
from studies.truss.limits.pull import least_time_of_pull
from studies.truss.limits.ridge import ridge_force, ridge_need

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

    The work is the integral over the angle of r (U' + C + D omega + K'), and that of r K' is not
    negative because r falls with the angle; the friction term is at least what an angle-wise
    optimal speed would need (Cauchy and Schwarz).
    """
    static, friction = _parts_of_the_work(study.truss)
    return static + friction / duration


def _parts_of_the_work(truss: TrussParameters) -> tuple[float, float]:
    """What the least work is at rest [J], and what friction adds, times the duration [J s]."""
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    static, friction = 0.0, 0.0
    for low, high in ((truss.stowed_angle, truss.net_angle), (truss.net_angle, DEPLOYED)):
        alpha = ca.DM((low + high) / 2 + (high - low) / 2 * nodes)
        ratio = (-2 * rope_speed(truss, alpha, 1.0) / rope_leverage(truss, alpha)).full().ravel()
        slope = static_torque(truss, alpha).full().ravel()
        damping = joint_damping(truss, alpha).full().ravel()
        static += (high - low) / 2 * float(weights @ (ratio * slope))
        friction += (high - low) / 2 * float(weights @ np.sqrt(ratio * damping))
    return static, friction**2


def least_time_of_the_mechanism(study: TrussStudy) -> float:
    """Least time [s] under the caps of angle, rope, motors and arm, each kind by itself."""
    truss, caps, drive = study.truss, study.caps, study.drive
    travel = rope_travel(truss)
    speeds = [caps.rope_speed]
    if caps.motor_speed is not None and drive is not None:  # at the mean radius of the drum
        speeds.append(caps.motor_speed * travel / motor_turn(drive, travel))
    of_the_rope = Caps(
        speed=min((cap for cap in speeds if cap is not None), default=None),
        acceleration=caps.rope_acceleration,
        jerk=caps.rope_jerk,
    )
    times = [least_time(study.stroke, caps), least_time(travel, of_the_rope)]
    if caps.reaction is not None:  # 4 M dR / T^2 at least
        times.append(math.sqrt(least_peak_reaction(truss, 1.0) / caps.reaction))
    if caps.power is not None:  # static + friction / T = power T
        static, friction = _parts_of_the_work(truss)
        root = math.sqrt(static**2 + 4 * caps.power * friction)
        times.append((static + root) / (2 * caps.power))
    return max(times)


def lower_bounds(
    study: TrussStudy,
    force: LeastForce | None,
    least_time_of_force: float = 0.0,
    longest: float | None = None,
    motor: LeastForce | None = None,
) -> dict[str, float]:
    """What no motion of at most a duration beats, by quantity.

    Parameters
    ----------
    force, motor : LeastForce or None
        The phase-plane bounds of the rope force, and of the force of a motor with a rotor, where
        they are known.
    least_time_of_force : float
        T_min of the force cap, from the phase plane [s].
    longest : float, optional
        The duration [s]; by default the longest one of the study.
    """
    caps, drive = study.caps, study.drive
    duration = study.duration[1] if longest is None else longest
    work, travel = least_work(study, duration), rope_travel(study.truss)

    bounds = {
        "peak-acceleration": _least_acceleration(study.stroke, duration, caps.jerk, caps.speed),
        "peak-rope-speed": travel / duration,
        "peak-rope-acceleration": _least_acceleration(
            travel, duration, caps.rope_jerk, caps.rope_speed
        ),
        "peak-reaction": least_peak_reaction(study.truss, duration),
        "peak-speed": study.stroke / duration,
        "peak-power": work / duration,
        "energy": work,
        "time": max(study.duration[0], least_time_of_the_mechanism(study), least_time_of_force),
    }
    if "time" in study.objectives and study.arm is None:
        pull = least_time_of_pull(study.truss, caps, caps.force, enough=0.0)
        bounds["time"] = max(bounds["time"], pull)
    if study.jerk_limited:
        bounds["peak-jerk"] = least_jerk_cap(study.stroke, duration)
        bounds["peak-rope-jerk"] = least_jerk_cap(travel, duration)
    forces = _forces(study, force, duration)
    if forces:
        bounds["peak-force"] = max(forces)
    rotor = drive is not None and drive.motor_inertia > 0.0
    if rotor:  # its momentum carries the truss over a ridge, so that the rope's forces say nothing
        forces = [least_pull(study, duration) if motor is None else motor.force]
        bounds["peak-motor-force"] = forces[0]
    if study.margin is not None:
        needs = [_least_need(study.margin, study.truss, forces)]
        need = None if rotor else ridge_need(study.margin, study.truss, caps)
        if need is not None:
            needs.append(need.force)
        # a stall force is what is needed, and more where the motor moves
        bounds["peak-factored-force"] = bounds["peak-stall-force"] = max(needs)
    if drive is not None and drive.drum_radius is not None:
        bounds["peak-motor-speed"] = motor_turn(drive, travel) / duration
        if forces:
            bounds["peak-motor-torque"] = float(motor_torque(drive, max(forces), 0.0))
    return bounds


def _forces(study: TrussStudy, force: LeastForce | None, duration: float) -> list[float]:
    """Lower bounds on the peak of the rope force [N]; there may be none."""
    if study.arm is not None:  # which may push the ring over a ridge
        return [least_pull(study, duration)]
    ridge = ridge_force(study.truss, study.caps)
    return [one.force for one in (force, ridge) if one is not None]


def least_pull(study: TrussStudy, duration: float) -> float:
    """Lower bound on the force of a motor with a rotor [N]: work over travel, and rest at the ends.

    From rest to rest a rotor takes no work in all. Where the acceleration is zero at the ends, the
    motor holds the truss there by the static force. The same holds of a rope whose ring is on an
    arm: the arm begins at rest, and where the ring is open the tip moves it no more (R' = 0).
    """
    mean = least_work(study, duration) / (2 * rope_travel(study.truss))
    if not study.jerk_limited:
        return mean
    ends = study.truss.stowed_angle, DEPLOYED
    return max(mean, *(float(static_force(study.truss, end)) for end in ends))


def _least_need(
    margin: MarginRequirements, truss: TrussParameters, forces: Sequence[float]
) -> float:
    """What the motor must be able to pull whatever the motion [N]: at rest, and in the least force.

    No factor is below one, so that a factored force is at least the force itself.
    """
    least = least_static_need(margin, truss)
    helping = margin.resistance is not None and min(t for _, t in margin.resistance) < 0.0
    if not forces or helping:
        return least
    cases = [case for case in margin.load_cases(truss) if not case.changed]
    return max([least, *((1 + margin.required[1]) * max(forces) / c.derating.whole for c in cases)])


def _least_acceleration(
    stroke: float, duration: float, jerk: float | None, speed: float | None
) -> float:
    """Least peak acceleration under these caps, or without them if they leave no motion."""
    try:
        return least_peak_acceleration(stroke, duration, jerk=jerk, speed=speed)
    except ModelError:
        return least_peak_acceleration(stroke, duration)


def keeps_the_caps(study: TrussStudy, motion: FastestMotion) -> bool:
    """Whether a motion of the phase plane, whose force jumps, keeps all caps of a study."""
    caps = study.caps
    rates = ((caps.speed, motion.peak_speed), (caps.acceleration, motion.peak_acceleration))
    kept = all(cap is None or cap > BETWEEN * value for cap, value in rates)
    in_force = caps.force is None or caps.force >= motion.force
    known = {"peak-speed", "peak-acceleration", "peak-force"}
    others = [key for key in (*CAPPED, CURVE) if cap_on(caps, study.drive, key)]
    return kept and in_force and known.issuperset(others)
