"""Motions to start the solver from: the paper's laws and others that lie in other basins."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from models.laws import PAPER_POINTS, Bezier, Dwell, Law, Step5, StraightLine, pinned
from studies.truss.bounds import least_time
from studies.truss.config import DEPLOYED, TrussStudy
from studies.truss.deployment import Deployment

if TYPE_CHECKING:  # SciPy loads with it, and only where it is needed
    from studies.truss.phase_plane import FastestMotion, LeastForce

Array = NDArray[np.float64]

SWING = 1.3  # duration of the swing after a dwell, relative to the least the caps allow
LONGEST_SWING = 0.9  # of the duration


@dataclass(frozen=True)
class Start:
    """A motion to start from, as functions of time.

    Attributes
    ----------
    name : of the law it comes from.
    duration : [s].
    net_time : when the angle passes the net angle [s].
    angle, speed, acceleration, jerk, rope_force : arrays of times (m,) to arrays (m,).
    """

    name: str
    duration: float
    net_time: float
    angle: Callable[[ArrayLike], Array]
    speed: Callable[[ArrayLike], Array]
    acceleration: Callable[[ArrayLike], Array]
    jerk: Callable[[ArrayLike], Array]
    rope_force: Callable[[ArrayLike], Array]


def starts(study: TrussStudy, least_force: Callable[[], LeastForce]) -> list[Callable[[], Start]]:
    """Recipes of the starts that the study names, in its order."""
    duration = first_duration(study)
    stowed = study.truss.stowed_angle
    recipes: dict[str, Callable[[], Start]] = {
        "bezier": lambda: bezier_start(study),
        "step5": lambda: _from_law("step5", Step5(duration, stowed, DEPLOYED), study),
        "straight": lambda: _from_law("straight", StraightLine(duration, stowed, DEPLOYED), study),
        "dwell": lambda: _from_law("dwell", _dwell(study, duration), study),
        "phase-plane": lambda: _from_phase_plane(least_force().motion, duration, study),
    }
    return [recipes[name] for name in study.solver.starts]


def bezier_start(study: TrussStudy) -> Start:
    """The paper's Bezier law."""
    points = pinned(PAPER_POINTS, study.truss.stowed_angle, DEPLOYED)
    return _from_law("bezier", Bezier(first_duration(study), points), study)


def first_duration(study: TrussStudy) -> float:
    """Duration of the starts [s]: the longest allowed, but not far above the least possible."""
    low, high = study.duration
    least = max(low, 2 * least_time(study.stroke, study.caps))
    return min(high, least) if least > 0 and "time" in study.objectives else high


def _dwell(study: TrussStudy, duration: float) -> Law:
    """Wait, then swing about as fast as the caps on the angle's rates allow."""
    swing = max(duration / 3, SWING * least_time(study.stroke, study.caps))
    swing = min(swing, LONGEST_SWING * duration)
    points = pinned(PAPER_POINTS, study.truss.stowed_angle, DEPLOYED)
    return Dwell(Bezier(swing, points), duration - swing)


def _from_law(name: str, law: Law, study: TrussStudy) -> Start:
    deployment = Deployment(name, law, study.truss)

    def clipped(time: ArrayLike) -> Array:
        inside: Array = np.clip(np.asarray(time, dtype=float), 0.0, law.duration)
        return np.atleast_1d(inside)

    def rope_force(time: ArrayLike) -> Array:
        _, truss = deployment.at(clipped(time))
        force: Array = np.maximum(truss.rope_force, 0.0)
        return force

    inner = [t for t in deployment.edges[1:-1] if t not in law.breakpoints]
    return Start(
        name=name,
        duration=law.duration,
        net_time=inner[0] if inner else law.duration / 2,
        angle=lambda time: law.motion(clipped(time)).angle,
        speed=lambda time: law.motion(clipped(time)).speed,
        acceleration=lambda time: law.motion(clipped(time)).acceleration,
        jerk=lambda time: law.motion(clipped(time)).jerk,
        rope_force=rope_force,
    )


def _from_phase_plane(motion: FastestMotion, duration: float, study: TrussStudy) -> Start:
    """Wait at rest, then the fastest motion at the least force; slowed if it does not fit."""
    wait = max(0.0, duration - motion.duration)
    slowing = (duration - wait) / motion.duration
    table = wait + slowing * motion.time
    speed = motion.speed / slowing
    table, kept = np.unique(table, return_index=True)
    angle, speed, force = motion.angle[kept], speed[kept], motion.rope_force[kept]
    acceleration = np.gradient(speed, table)

    def interpolated(values: Array) -> Callable[[ArrayLike], Array]:
        return lambda time: np.interp(np.atleast_1d(time), table, values)

    return Start(
        name="phase-plane",
        duration=duration,
        net_time=float(np.interp(study.truss.net_angle, angle, table)),
        angle=interpolated(angle),
        speed=interpolated(speed),
        acceleration=interpolated(acceleration),
        jerk=lambda time: np.zeros_like(np.atleast_1d(time), dtype=float),
        rope_force=interpolated(force),
    )
