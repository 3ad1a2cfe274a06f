"""Where motion laws come from: the paper, a solution, a stored result, a file of the user.

Those that a solver starts from are here too, as functions of time that have all signals.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from models.laws import (
    PAPER_POINTS,
    AngularMotion,
    Bezier,
    Dwell,
    Law,
    Piecewise,
    Step5,
    StraightLine,
    linear_jerk,
    pinned,
)
from models.laws.motion import law_times
from models.truss import TrussParameters
from ocp import Solution
from ocp.arrays import Array
from studies.truss.bounds import least_time
from studies.truss.config import DEPLOYED, TrussStudy
from studies.truss.deployment import Deployment
from studies.truss.problem import Statement, acceleration_in

if TYPE_CHECKING:  # SciPy loads with it, and only where it is needed
    from studies.truss.phase_plane import FastestMotion, LeastForce

SWING = 1.3  # duration of the swing after a dwell, relative to the least the caps allow
LONGEST_SWING = 0.9  # of the duration

JOINT = 1e-9  # of the duration: the largest gap between two phases
SHORTEST = 1e-12  # of the duration: shorter intervals are left out

EXACT = 1e-9  # [rad]: jerks that integrate to the angles this closely are the law's own
LEAST_POINTS = 20  # of a profile, so that the motion between them is known
BACKWARD = 1e-6  # of the peak speed: what rounding leaves of a speed of zero
ANGLES = ("angle", "angle_deg", "rope_length")  # columns of which a profile needs one
JERKS = ("angular_jerk", "angular_jerk_before")


def paper_laws(truss: TrussParameters, duration: float) -> tuple[Deployment, Deployment]:
    """The paper's Bezier law, its ends pinned to the exact angles, and its Step5."""
    return (
        Deployment("Bezier", _bezier(truss, duration), truss),
        Deployment("Step5", Step5(duration, truss.stowed_angle, DEPLOYED), truss),
    )


def _bezier(truss: TrussParameters, duration: float) -> Bezier:
    return Bezier(duration, pinned(PAPER_POINTS, truss.stowed_angle, DEPLOYED))


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


def starting_motion(
    name: str, study: TrussStudy, least_force: Callable[[], LeastForce]
) -> StartingMotion:
    """The motion of one of the study's starts.

    Parameters
    ----------
    least_force : callable
        Computes the phase-plane bound, which takes seconds; called only where it is needed.
    """
    duration, truss = first_duration(study), study.truss
    if name == "phase-plane":
        return _from_phase_plane(least_force().motion, duration, study)
    laws: dict[str, Callable[[], Law]] = {
        "bezier": lambda: _bezier(truss, duration),
        "step5": lambda: Step5(duration, truss.stowed_angle, DEPLOYED),
        "straight": lambda: StraightLine(duration, truss.stowed_angle, DEPLOYED),
        "dwell": lambda: _dwell(study, duration),
    }
    return _from_law(name, laws[name](), study)


def bezier_start(study: TrussStudy) -> StartingMotion:
    """The paper's Bezier law."""
    return _from_law("bezier", _bezier(study.truss, first_duration(study)), study)


def first_duration(study: TrussStudy) -> float:
    """Duration of the starts [s]: the longest allowed, but not far above the least possible."""
    low, high = study.duration
    least = max(low, 2 * least_time(study.stroke, study.caps))
    return float(min(high, least) if least > 0 and "time" in study.objectives else high)


def _dwell(study: TrussStudy, duration: float) -> Law:
    """Wait, then swing about as fast as the caps on the angle's rates allow."""
    swing = max(duration / 3, SWING * least_time(study.stroke, study.caps))
    swing = min(swing, LONGEST_SWING * duration)
    return Dwell(_bezier(study.truss, swing), duration - swing)


def _from_law(name: str, law: Law, study: TrussStudy) -> StartingMotion:
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


def _from_phase_plane(motion: FastestMotion, duration: float, study: TrussStudy) -> StartingMotion:
    """Wait at rest, then the fastest motion at the least force; slowed if it does not fit."""
    wait = max(0.0, duration - motion.duration)
    slowing = (duration - wait) / motion.duration
    times, kept = np.unique(wait + slowing * motion.time, return_index=True)
    angle, force = motion.angle[kept], motion.rope_force[kept]
    speed = (motion.speed / slowing)[kept]
    acceleration = np.gradient(speed, times)

    def interpolated(values: Array) -> Callable[[ArrayLike], Array]:
        return lambda time: np.interp(np.atleast_1d(time), times, values)

    return StartingMotion(
        name="phase-plane",
        duration=duration,
        net_time=float(np.interp(study.truss.net_angle, angle, times)),
        angle=interpolated(angle),
        speed=interpolated(speed),
        acceleration=interpolated(acceleration),
        jerk=lambda time: np.zeros_like(np.atleast_1d(time), dtype=float),
        rope_force=interpolated(force),
    )


def law_of(study: TrussStudy, statement: Statement, solution: Solution) -> Law:
    """The law of a solution.

    With jerk as the control it is the exact integral of that jerk, piecewise linear in time, from
    rest, whatever the collocation polynomials say; else it is the engine's independent replay.
    """
    jerk = statement.signals.jerk
    if jerk is None:
        return ReplayedLaw(study, statement, solution)

    edges: list[float] = [0.0]
    ramps: list[tuple[float, float]] = []
    for phase in solution.trajectory.phases:
        shortest = SHORTEST * phase.breakpoints[-1]
        values = phase.polynomial(jerk.name).ends()[:, :, 0]
        for (begin, end), (first, last) in zip(
            itertools.pairwise(phase.breakpoints), values, strict=True
        ):
            if end - begin > shortest:
                edges.append(float(end))
                ramps.append((float(first), float(last)))
    return linear_jerk(tuple(edges), tuple(ramps), start_angle=study.truss.stowed_angle)


@dataclass(frozen=True, eq=False)
class ReplayedLaw:
    """The replayed states of a solution whose control is a force or an acceleration.

    Its jerk is not defined and given as NaN.
    """

    study: TrussStudy
    statement: Statement
    solution: Solution

    @property
    def duration(self) -> float:
        """T [s]."""
        return float(self.solution.replayed.phases[-1].end)

    @property
    def start_angle(self) -> float:
        """At time 0 [rad]."""
        return float(self.motion(0.0).angle[0])

    @property
    def end_angle(self) -> float:
        """At T [rad]."""
        return float(self.motion(self.duration).angle[0])

    @cached_property
    def breakpoints(self) -> tuple[float, ...]:
        """Times at which the control jumps [s]."""
        return tuple(float(t) for t in self.solution.breakpoints[1:-1])

    def motion(self, time: ArrayLike) -> AngularMotion:
        """Motion at times (m,) in [0, T]."""
        t = law_times(time, self.duration)
        signals = self.statement.signals
        return AngularMotion(
            time=t,
            angle=self._sample(signals.angle, t),
            speed=np.maximum(self._sample(signals.speed, t), 0.0),
            acceleration=self._acceleration(t),
            jerk=np.full_like(t, np.nan),
        )

    def _sample(self, expression: Any, time: Array, phase: str | None = None) -> Array:
        return self.solution.sample(expression, time, phase, replayed=True)

    def _acceleration(self, time: Array) -> Array:
        values = np.full_like(time, np.nan)
        replayed, stated = self.solution.replayed.phases, self.statement.phases
        slack = JOINT * self.duration  # phases meet to the solver's tolerance only

        for span, phase, net in zip(replayed, stated, self.statement.nets, strict=True):
            inside = (time >= span.start - slack) & (time <= span.end + slack)
            if inside.any():
                expression = acceleration_in(self.study, self.statement.signals, net)
                values[inside] = self._sample(expression, time[inside], phase.name)
        return values


@dataclass(frozen=True, eq=False)
class SampledLaw:
    """A law of which only a profile is left, linear between its rows: enough to draw it.

    Attributes
    ----------
    time, angle, speed, acceleration, jerk : shape (m,) [s, rad, rad/s, rad/s^2, rad/s^3].
    """

    time: Array
    angle: Array
    speed: Array
    acceleration: Array
    jerk: Array
    breakpoints: tuple[float, ...] = ()

    @property
    def duration(self) -> float:
        """T [s]."""
        return float(self.time[-1])

    @property
    def start_angle(self) -> float:
        """At time 0 [rad]."""
        return float(self.angle[0])

    @property
    def end_angle(self) -> float:
        """At T [rad]."""
        return float(self.angle[-1])

    def motion(self, time: ArrayLike) -> AngularMotion:
        """Motion at times (m,) in [0, T]."""
        t = law_times(time, self.duration)
        rows = (self.angle, self.speed, self.acceleration, self.jerk)
        angle, speed, acceleration, jerk = (np.interp(t, self.time, row) for row in rows)
        return AngularMotion(time=t, angle=angle, speed=speed, acceleration=acceleration, jerk=jerk)


def knots(law: Law) -> dict[str, Array]:
    """What a law of piecewise linear jerk is made of, shape (m,) each; empty for other laws."""
    if not isinstance(law, Piecewise):
        return {}
    edges = np.array(law.edges)
    after = law.motion(edges)
    return {
        "knot": edges,
        "knot_angle": after.angle,
        "knot_jerk": after.jerk,
        "knot_jerk_before": law.motion(np.nextafter(edges, 0.0)).jerk,
    }


def stored_law(columns: Mapping[str, Array]) -> Law:
    """The law of the columns of a result: exact where there are knots that give its angles."""
    if "knot" in columns:
        renamed = (columns["knot"], columns["knot_jerk"], columns["knot_jerk_before"])
        jerks = dict(zip(("time", *JERKS), renamed, strict=True))
        exact = _exact_law(jerks, columns["knot_angle"])
        if exact is not None:
            return exact

    return SampledLaw(
        time=columns["time"],
        angle=columns["angle"],
        speed=columns["angular_speed"],
        acceleration=columns["angular_acceleration"],
        jerk=columns["angular_jerk"],
    )


def _exact_law(columns: Mapping[str, Array], angles: Array) -> Piecewise | None:
    """The law of piecewise linear jerk, if the columns of jerks reproduce the angles."""
    after, before = (columns.get(name) for name in JERKS)
    if after is None or before is None or not np.isfinite([after, before]).all():
        return None
    ramps = tuple(zip(after[:-1].tolist(), before[1:].tolist(), strict=True))
    law = linear_jerk(tuple(columns["time"].tolist()), ramps, start_angle=float(angles[0]))
    miss = np.abs(law.motion(columns["time"]).angle - angles).max()
    return law if miss <= EXACT else None
