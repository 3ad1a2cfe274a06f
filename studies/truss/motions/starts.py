"""Motions that a solver starts from, as functions of time that have all signals."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from models.laws import AngularMotion, BetweenRests, Law, Step5, StraightLine, UnderWay
from models.truss import Opening
from ocp.arrays import Array
from studies.common.exit_codes import StudyError
from studies.truss.config import TrussStudy
from studies.truss.limits.bounds import least_time_of_angle
from studies.truss.motions.deployment import Deployment
from studies.truss.motions.laws import pinned_bezier

if TYPE_CHECKING:  # SciPy loads with it, and only where it is needed
    from studies.truss.motions.phase_plane import FastestMotion

SWING = 1.3  # duration of the swing after a dwell, relative to the least the caps allow
LONGEST_SWING = 0.9  # of the duration
FADING = 0.5  # of the stroke, the most that a speed at the start covers in a motion to start from

PHASE_PLANE = "phase-plane"  # the start that is no law

# how a motion gets over the ridge of the static force: at rest on it, or with momentum
KINDS = {
    "bezier": "ridge",
    "step5": "ridge",
    "straight": "ridge",
    "dwell": "swing-through",
    PHASE_PLANE: "swing-through",
}
NEIGHBOUR = "neighbour"  # the start from a like study's motion


@dataclass(frozen=True)
class StartingMotion:
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

    @property
    def law(self) -> Law:
        """The same as a law of the angle."""
        return _LawOfStart(self)


@dataclass(frozen=True)
class _LawOfStart:
    """A motion to start from as a law; nothing is known of where its pieces meet."""

    start: StartingMotion
    breakpoints: tuple[float, ...] = ()

    @property
    def duration(self) -> float:
        """T [s]."""
        return self.start.duration

    @property
    def start_angle(self) -> float:
        """Angle at time 0 [rad]."""
        return float(self.start.angle(0.0)[0])

    @property
    def end_angle(self) -> float:
        """Angle at T [rad]."""
        return float(self.start.angle(self.duration)[0])

    def motion(self, time: ArrayLike) -> AngularMotion:
        """Motion at times (m,) in [0, T]."""
        start, t = self.start, np.atleast_1d(np.asarray(time, dtype=float))
        return AngularMotion(
            t, start.angle(t), start.speed(t), start.acceleration(t), start.jerk(t)
        )


def starting_motion(name: str, study: TrussStudy) -> StartingMotion:
    """The motion of one of the laws that a study starts from."""
    return start_from_law(name, _under_way(name, study, first_duration(study)), study)


def starting_laws(study: TrussStudy) -> list[str]:
    """The laws to start from where several trusses move alike.

    Raises
    ------
    StudyError
        If there is none but the phase plane, which is that of one truss.
    """
    laws = [name for name in study.solver.starts if name != PHASE_PLANE]
    if not laws:
        raise StudyError(
            "solver.starts has no law but phase-plane, which is that of one truss; add bezier"
        )
    return laws


def _under_way(name: str, study: TrussStudy, duration: float) -> Law:
    """A law between the study's angles, and if the motion is under way the speed at its start."""
    opening = study.opening
    if not opening.rate:
        return _from_rest(name, study, opening, duration)
    # that speed covers at most a share of the stroke, and the law from rest what is left
    fading = min(duration, 3 * FADING * opening.stroke / opening.rate)
    rest = Opening(opening.start + opening.rate * fading / 3, opening.end)
    return UnderWay(_from_rest(name, study, rest, duration), opening.rate, fading)


def _from_rest(name: str, study: TrussStudy, opening: Opening, duration: float) -> Law:
    laws: dict[str, Callable[[], Law]] = {
        "bezier": lambda: pinned_bezier(study.truss, duration, opening),
        "step5": lambda: Step5(duration, opening.start, opening.end),
        "straight": lambda: StraightLine(duration, opening.start, opening.end),
        "dwell": lambda: _dwell(study, opening, duration),
    }
    return laws[name]()


def in_order(names: Sequence[str], switching_force: bool) -> list[str]:
    """The starts in their order, but the first of each kind before the others.

    Parameters
    ----------
    names : sequence of str
    switching_force : bool
        Whether the rope force jumps between its bounds, as it does in the phase plane: its motion
        is then about the optimum, and comes before all others.
    """
    first = first_of_each_kind(names)
    optimum = PHASE_PLANE if switching_force else None
    return sorted(names, key=lambda name: (name != optimum, name not in first))


def first_of_each_kind(names: Sequence[str]) -> tuple[str, ...]:
    """One start of each kind of `KINDS`, the first one."""
    first = {KINDS[name]: name for name in reversed(names)}
    return tuple(name for name in names if name in first.values())


def first_duration(study: TrussStudy) -> float:
    """Duration of the starts [s]: the longest allowed, but not far above the least possible."""
    low, high = study.duration
    least = max(low, 2 * least_time_of_angle(study))
    return float(min(high, least) if least > 0 and "time" in study.objectives else high)


def _dwell(study: TrussStudy, opening: Opening, duration: float) -> Law:
    """Wait, then swing about as fast as the caps on the angle's rates allow."""
    swing = max(duration / 3, SWING * least_time_of_angle(study))
    swing = min(swing, LONGEST_SWING * duration)
    return BetweenRests(pinned_bezier(study.truss, swing, opening), before=duration - swing)


def start_from_law(name: str, law: Law, study: TrussStudy) -> StartingMotion:
    """A law as a motion to start from."""
    deployment = Deployment(name, law, study.truss)

    def clipped(time: ArrayLike) -> Array:
        # the mesh of a free duration may reach beyond the law
        inside: Array = np.clip(np.asarray(time, dtype=float), 0.0, law.duration)
        return np.atleast_1d(inside)

    def rope_force(time: ArrayLike) -> Array:
        _, truss = deployment.at(clipped(time))
        force: Array = np.maximum(truss.rope_force, 0.0)
        return force

    net_times = [t for t in deployment.edges[1:-1] if t not in law.breakpoints]
    return StartingMotion(
        name=name,
        duration=law.duration,
        net_time=net_times[0] if net_times else law.duration / 2,
        angle=lambda time: law.motion(clipped(time)).angle,
        speed=lambda time: law.motion(clipped(time)).speed,
        acceleration=lambda time: law.motion(clipped(time)).acceleration,
        jerk=lambda time: law.motion(clipped(time)).jerk,
        rope_force=rope_force,
    )


def from_neighbour(law: Law, study: TrussStudy) -> StartingMotion:
    """A motion of a like study, stretched to this one's stroke and, where it is fixed, duration."""
    low, high = study.duration
    duration = min(max(law.duration, low), high)
    begin = float(law.motion(np.zeros(1)).angle[0])
    end = study.opening.end
    pace, reach = law.duration / duration, study.stroke / (law.end_angle - begin)
    start = start_from_law(NEIGHBOUR, law, study)

    def stretched(signal: Callable[[ArrayLike], Array], order: int) -> Callable[[ArrayLike], Array]:
        return lambda time: reach * pace**order * signal(pace * np.asarray(time, dtype=float))

    return replace(
        start,
        duration=duration,
        net_time=start.net_time / pace,
        angle=lambda time: (
            end - reach * (law.end_angle - start.angle(pace * np.asarray(time, dtype=float)))
        ),
        speed=stretched(start.speed, 1),
        acceleration=stretched(start.acceleration, 2),
        jerk=stretched(start.jerk, 3),
        rope_force=lambda time: start.rope_force(pace * np.asarray(time, dtype=float)),
    )


def start_from_phase_plane(motion: FastestMotion, study: TrussStudy) -> StartingMotion:
    """Wait at rest, then the fastest motion at the least force; slowed if it does not fit."""
    duration = first_duration(study)
    wait = 0.0 if study.opening.rate else max(0.0, duration - motion.duration)
    slowing = (duration - wait) / motion.duration
    times, kept = np.unique(wait + slowing * motion.time, return_index=True)
    angle, force = motion.angle[kept], motion.rope_force[kept]
    speed = (motion.speed / slowing)[kept]
    acceleration = np.gradient(speed, times)

    def interpolated(values: Array) -> Callable[[ArrayLike], Array]:
        return lambda time: np.interp(np.atleast_1d(time), times, values)

    return StartingMotion(
        name=PHASE_PLANE,
        duration=duration,
        net_time=float(np.interp(study.truss.net_angle, angle, times)),
        angle=interpolated(angle),
        speed=interpolated(speed),
        acceleration=interpolated(acceleration),
        jerk=lambda time: np.zeros_like(np.atleast_1d(time), dtype=float),
        rope_force=interpolated(force),
    )
