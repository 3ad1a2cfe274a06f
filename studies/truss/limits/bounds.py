"""What no motion beats, in closed form or from the phase plane.

Symbols: D [rad] stroke; T [s] longest duration; v, A, j caps on speed, acceleration and jerk;
r = 2 |L'| / f the motor's work per work on the truss, at least 1 and falling with the angle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import casadi as ca
import numpy as np

from models.errors import ModelError
from models.laws import (
    RateCaps,
    least_cap,
    least_jerk_cap,
    least_peak_acceleration,
    least_time,
)
from models.truss import (
    Opening,
    TrussParameters,
    centre_travel,
    joint_damping,
    kinetic_energy,
    linear_momentum,
    rope_leverage,
    rope_speed,
    rope_taken,
    rope_travel,
    static_force,
    static_torque,
    total_mass,
)
from studies.drive.motor import motor_torque, motor_turn, rotor_mass
from studies.margin.loads import least_static_need
from studies.margin.schema import MarginRequirements
from studies.truss.config import TrussStudy
from studies.truss.limits.caps import CAPPED, CURVE, cap_on
from studies.truss.limits.pull import least_time_of_pull
from studies.truss.limits.ridge import ridge_force, ridge_need
from studies.truss.quantities import QUANTITIES

if TYPE_CHECKING:  # SciPy loads with it, and only where it is needed
    from studies.truss.motions.phase_plane import FastestMotion, LeastForce

GAUSS_POINTS = 60
BETWEEN = 1.01  # what a peak may be above that of the points of a phase plane
ROUNDING = 1e-12  # relative: a cap set to the printed bound itself passes


class Path(NamedTuple):
    """What has to come to rest at the end of a way, and how fast it is at first."""

    way: float
    start_speed: float


def path_of_angle(study: TrussStudy) -> Path:
    """The angle [rad, rad/s]."""
    return Path(study.stroke, study.opening.rate)


def path_of_rope(study: TrussStudy) -> Path:
    """One rope, wound in [m, m/s]."""
    truss, opening = study.truss, study.opening
    winding = -float(rope_speed(truss, opening.start, opening.rate)) if opening.rate else 0.0
    return Path(rope_travel(truss, opening), winding)


def path_of_centre(study: TrussStudy) -> Path:
    """The ring's centre, times its mass, whose second rate is the reaction [kg m, N s]."""
    truss, opening = study.truss, study.opening
    momentum = float(linear_momentum(truss, opening.start, opening.rate))
    return Path(float(total_mass(truss)) * centre_travel(truss, opening), momentum)


def rate_caps(
    speed: float | None = None, acceleration: float | None = None, jerk: float | None = None
) -> RateCaps:
    """Caps on rates, of which None is no limit."""
    return RateCaps(*(math.inf if cap is None else cap for cap in (speed, acceleration, jerk)))


def least_time_of_angle(study: TrussStudy) -> float:
    """Least time [s] under the caps on the rates of the angle alone."""
    caps, path = study.caps, path_of_angle(study)
    return least_time(path.way, rate_caps(caps.speed, caps.acceleration, caps.jerk), path[1])


def least_work(study: TrussStudy, duration: float) -> float:
    """Lower bound on the motor's work in `duration` [J].

    The work is the integral over the angle of r (U' + C + D omega + K'), and that of r K' is at
    least -r K of the start, because r falls with the angle; the friction term is at least what an
    angle-wise optimal speed would need (Cauchy and Schwarz).
    """
    static, friction = _parts_of_the_work(study.truss, study.opening)
    return static + friction / duration


def _parts_of_the_work(truss: TrussParameters, opening: Opening) -> tuple[float, float]:
    """What the least work is but for friction [J], and what that adds, times the duration [J s]."""
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    static, friction = 0.0, 0.0
    net = min(max(truss.net_angle, opening.start), opening.end)
    for low, high in ((opening.start, net), (net, opening.end)):
        alpha = ca.DM((low + high) / 2 + (high - low) / 2 * nodes)
        ratio = (-2 * rope_speed(truss, alpha, 1.0) / rope_leverage(truss, alpha)).full().ravel()
        slope = static_torque(truss, alpha).full().ravel()
        damping = joint_damping(truss, alpha).full().ravel()
        static += (high - low) / 2 * float(weights @ (ratio * slope))
        friction += (high - low) / 2 * float(weights @ np.sqrt(ratio * damping))
    if opening.rate:
        ratio = -2 * rope_speed(truss, opening.start, 1.0) / rope_leverage(truss, opening.start)
        static -= float(ratio * kinetic_energy(truss, opening.start, opening.rate))
    return static, friction**2


def least_time_of_the_mechanism(study: TrussStudy) -> float:
    """Least time [s] under the caps of angle, rope, motors and arm, each kind by itself."""
    truss, caps, drive = study.truss, study.caps, study.drive
    travel, winding = path_of_rope(study)
    speeds = [caps.rope_speed]
    if caps.motor_speed is not None and drive is not None:  # at the mean radius of the drum
        speeds.append(caps.motor_speed * travel / motor_turn(drive, travel))
    fastest = min((cap for cap in speeds if cap is not None), default=None)
    of_the_rope = rate_caps(fastest, caps.rope_acceleration, caps.rope_jerk)
    times = [least_time_of_angle(study), least_time(travel, of_the_rope, winding)]
    if caps.reaction is not None:
        way, momentum = path_of_centre(study)
        times.append(least_time(way, RateCaps(acceleration=caps.reaction), momentum))
    if caps.power is not None:  # static + friction / T = power T
        static, friction = _parts_of_the_work(truss, study.opening)
        root = math.sqrt(static**2 + 4 * caps.power * friction)
        times.append((static + root) / (2 * caps.power))
    return max(times)


@dataclass(frozen=True)
class Way:
    """Least peaks of the rates of what comes to rest at the end of a path, in a duration.

    Attributes
    ----------
    path : Path
    duration : float
        [s].
    speed_cap, jerk_cap : float or None
        Under which the acceleration is least; None for no limit.
    """

    path: Path
    duration: float
    speed_cap: float | None = None
    jerk_cap: float | None = None

    @property
    def speed(self) -> float:
        """Its mean, or the speed at the start."""
        return max(self.path.way / self.duration, self.path.start_speed)

    @property
    def acceleration(self) -> float:
        """Under the caps, or without them if they leave no motion."""
        (way, v0), duration, speed, jerk = self.path, self.duration, self.speed_cap, self.jerk_cap
        if v0:
            least = (
                least_cap("acceleration", others, way, duration, v0)
                for others in (rate_caps(speed, jerk=jerk), RateCaps())
            )
            return next(filter(math.isfinite, least))
        try:
            return least_peak_acceleration(way, duration, jerk=jerk, speed=speed)
        except ModelError:
            return least_peak_acceleration(way, duration)


def has_rotor(study: TrussStudy) -> bool:
    """Whether the motor has a rotor, whose momentum helps the rope."""
    return study.drive is not None and study.drive.motor_inertia > 0.0


@dataclass(frozen=True, eq=False)
class LeastValues:
    """What no motion of at most a duration beats, for the rows of quantities; None for no bound.

    Attributes
    ----------
    study : TrussStudy
    duration : float
        [s].
    of_the_rope, of_the_motor : LeastForce or None
        The phase-plane bounds of the rope force, and of the force of a motor with a rotor, where
        they are known.
    time_of_force : float
        T_min of the force cap, from the phase plane [s].
    """

    study: TrussStudy
    duration: float
    of_the_rope: LeastForce | None = None
    of_the_motor: LeastForce | None = None
    time_of_force: float = 0.0

    @cached_property
    def angle(self) -> Way:
        """The way of the angle."""
        caps = self.study.caps
        return Way(path_of_angle(self.study), self.duration, caps.speed, caps.jerk)

    @cached_property
    def rope(self) -> Way:
        """That of one rope."""
        caps = self.study.caps
        return Way(path_of_rope(self.study), self.duration, caps.rope_speed, caps.rope_jerk)

    @property
    def reaction(self) -> float:
        """On the supporting arm [N]."""
        return Way(path_of_centre(self.study), self.duration).acceleration

    @cached_property
    def work(self) -> float:
        """Of the motors [J]."""
        return least_work(self.study, self.duration)

    @property
    def time(self) -> float:
        """Of the motion [s]."""
        study, caps = self.study, self.study.caps
        times = [study.duration[0], least_time_of_the_mechanism(study), self.time_of_force]
        if "time" in study.objectives and study.arm is None:
            times.append(least_time_of_pull(study.truss, caps, caps.force, 0.0, study.opening))
        return max(times)

    @cached_property
    def rope_force(self) -> float | None:
        """Peak of the rope force [N]."""
        if self.study.arm is not None:  # which may push the ring over a ridge
            return least_pull(self.study, self.duration)
        ridge = ridge_force(self.study.truss, self.study.caps, self.study.opening)
        known = (one.force for one in (self.of_the_rope, ridge) if one is not None)
        return max(known, default=None)

    @cached_property
    def motor_force(self) -> float | None:
        """Peak force of a motor with a rotor [N]."""
        if not has_rotor(self.study):
            return None
        known = self.of_the_motor
        return least_pull(self.study, self.duration) if known is None else known.force

    @property
    def _pull(self) -> float | None:
        """Of what moves the rope [N]: a rotor's momentum carries the truss over a ridge."""
        return self.motor_force if has_rotor(self.study) else self.rope_force

    @cached_property
    def need(self) -> float | None:
        """What the motor must be able to pull for its margins [N]."""
        study = self.study
        if study.margin is None:
            return None
        needs = [_least_need(study.margin, study, self._pull)]
        if not has_rotor(study):
            ridge = ridge_need(study.margin, study.truss, study.caps, study.opening)
            needs += [] if ridge is None else [ridge.force]
        return max(needs)

    @property
    def motor_speed(self) -> float | None:
        """Of one motor's shaft [rad/s]."""
        drive = self.study.drive
        if drive is None or drive.drum_radius is None:
            return None
        return motor_turn(drive, self.rope.path.way) / self.duration

    @property
    def motor_torque(self) -> float | None:
        """Of one motor's shaft [N m]."""
        drive = self.study.drive
        if drive is None or drive.drum_radius is None or self._pull is None:
            return None
        return float(motor_torque(drive, self._pull, 0.0))

    def jerk_of(self, way: Way) -> float | None:
        """Of a way, where the acceleration is zero at the ends."""
        return least_jerk(way.path, self.duration) if self.study.jerk_limited else None


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
    force, motor, least_time_of_force : as of `LeastValues`.
    longest : float, optional
        The duration [s]; by default the longest one of the study.
    """
    duration = study.duration[1] if longest is None else longest
    least = LeastValues(study, duration, force, motor, least_time_of_force)
    found = ((key, quantity.bound(least)) for key, quantity in QUANTITIES.items())
    return {key: bound for key, bound in found if bound is not None}


def least_pull(study: TrussStudy, duration: float) -> float:
    """Lower bound on the force of a motor with a rotor [N]: work over travel, and rest at the ends.

    From rest to rest a rotor takes no work in all, and one that turns at first gives what it has.
    Where the acceleration is zero at the ends, the motor holds the truss there by the static force.
    The same holds of a rope whose ring is on an arm: the arm begins at rest, and where the ring is
    open the tip moves it no more (R' = 0).
    """
    opening, (travel, winding) = study.opening, path_of_rope(study)
    rotor = rotor_mass(study.drive, float(rope_taken(study.truss, opening.start)))
    mean = (least_work(study, duration) - rotor * winding**2) / (2 * travel)
    if not study.jerk_limited:
        return mean
    ends = (opening.end,) if opening.rate else (opening.start, opening.end)
    return max(mean, *(float(static_force(study.truss, end)) for end in ends))


def _least_need(margin: MarginRequirements, study: TrussStudy, pull: float | None) -> float:
    """What the motor must be able to pull whatever the motion [N]: at rest, and in the least force.

    No factor is below one, so that a factored force is at least the force itself.
    """
    truss = study.truss
    least = least_static_need(margin, truss, study.opening)
    helping = margin.resistance is not None and min(t for _, t in margin.resistance) < 0.0
    if pull is None or helping:
        return least
    cases = [case for case in margin.load_cases(truss) if not case.changed]
    return max([least, *((1 + margin.required[1]) * pull / c.derating.whole for c in cases)])


def least_jerk(path: Path, duration: float) -> float:
    """Least peak of the jerk, without further caps."""
    if not path.start_speed:
        return least_jerk_cap(path.way, duration)
    return least_cap("jerk", RateCaps(), path.way, duration, path.start_speed)


def keeps_the_caps(study: TrussStudy, motion: FastestMotion) -> bool:
    """Whether a motion of the phase plane, whose force jumps, keeps all caps of a study."""
    caps = study.caps
    rates = ((caps.speed, motion.peak_speed), (caps.acceleration, motion.peak_acceleration))
    kept = all(cap is None or cap > BETWEEN * value for cap, value in rates)
    in_force = caps.force is None or caps.force >= motion.force
    known = {"peak-speed", "peak-acceleration", "peak-force"}
    others = [key for key in (*CAPPED, CURVE) if cap_on(caps, study.drive, key)]
    return kept and in_force and known.issuperset(others)
