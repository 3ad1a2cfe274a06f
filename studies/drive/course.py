"""The position that a drive has to follow over time: rope, turn of a drum, or angle of a joint."""

from __future__ import annotations

import dataclasses
import functools
import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from models.laws import Hermite, Law, Piecewise
from models.truss import (
    TrussParameters,
    rope_length,
    slider_distance_curvature,
    slider_distance_slope,
    slider_distance_third,
)
from ocp.arrays import Array
from studies.common.exit_codes import StudyError
from studies.drive.drum import Drum

RESTING = 1e-9  # of the peak speed: below it nothing moves
JUMP = 1e-3  # of the peak: a step of jerk or acceleration that is a switch, not a mesh point
SAMPLES = 4001  # of a course, for its peaks
ANGLE_STEP = 1e-4  # [rad], half width of the difference that gives a third derivative to 1e-8

DRUM = "drum"  # the signal of a course that is the turn of a drum
PREDICTED = "predicted angle: the motion was found for a torque, and its angle follows the model"


@dataclass(frozen=True, eq=False)
class Stretch:
    """What a yielding rope is wound in more than the mechanism takes.

    Attributes
    ----------
    derivatives : maps times (m,) to the rope's stretch since the stowed truss was at rest, with
        three derivatives, (4, m) [m].
    missed : the most of the tension that it does not account for [N]: a step takes no time.
    on_the_drum : about the most that it leaves out [m]: wound in, a rope keeps the stretch that
        it had at the motor.
    """

    derivatives: Callable[[Array], Array]
    missed: float
    on_the_drum: float


@dataclass(frozen=True, eq=False)
class Course:
    """A position over time with three derivatives, to rest and, but for its start speed, from rest.

    Attributes
    ----------
    signal : what moves, such as "rope", "drum" or "elbow".
    unit : "m" or "rad".
    duration : [s].
    switches : times from 0 to the duration between which the third derivative is smooth [s].
    derivatives : maps times (m,) to position, velocity, acceleration and jerk, (4, m).
    note : what a reader has to know of the positions; empty where there is nothing.
    stretch : of the rope, which is in the positions; None of a rope that does not yield.
    """

    signal: str
    unit: str
    duration: float
    switches: tuple[float, ...]
    derivatives: Callable[[Array], Array]
    note: str = ""
    stretch: Stretch | None = None

    @property
    def travel(self) -> float:
        """From the first position to the last, without its sign."""
        first, last = self.derivatives(np.array([0.0, self.duration]))[0]
        return float(abs(last - first))

    @functools.cached_property
    def start_speed(self) -> float:
        """Velocity at the start, zero but for a motion that is under way there."""
        speed = float(self.derivatives(np.zeros(1))[1, 0])
        return speed if abs(speed) > RESTING * self.peaks[0] else 0.0

    @functools.cached_property
    def peaks(self) -> tuple[float, float, float]:
        """Greatest speed, acceleration and jerk, without their signs.

        Where the jerk is not given, it is the steepest slope of the acceleration between switches.
        """
        time = self.grid(SAMPLES)
        _, speed, acceleration, jerk = np.abs(self.derivatives(time))
        if not np.isfinite(jerk).all():
            rows = self.derivatives(time)[2]
            inside = ~np.isin(time[:-1], self._last_inside)
            jerk = np.abs(np.diff(rows) / np.diff(time))[inside]
        return float(speed.max()), float(acceleration.max()), float(jerk.max())

    @property
    def _last_inside(self) -> Array:
        """The last time of the grid before each switch, and the start: a jump may follow them."""
        pieces = itertools.pairwise(self.switches)
        return np.array([0.0, *(_inside(a, b)[1] for a, b in pieces)])

    @functools.cached_property
    def jump(self) -> float:
        """Greatest jump of the acceleration at a switch; zero where the jerk is bounded."""
        edges = np.array(self.switches)
        inner, near = edges[1:-1], 1e-9 * self.duration
        after = np.concatenate([[0.0], inner, [self.duration]])
        steps = self.derivatives(np.minimum(after + near, self.duration))[2]
        steps = steps - self.derivatives(np.maximum(after - near, 0.0))[2]
        # from rest and to rest: the acceleration at the ends is a jump, too
        ends = self.derivatives(edges[-1:] if self.start_speed else edges[[0, -1]])[2]
        peak, jerk = self.peaks[1:]
        worst = float(max(np.abs(steps).max(), np.abs(ends).max()))
        return worst if worst > 1e-6 * peak + 4 * near * jerk else 0.0

    def grid(self, samples: int) -> Array:
        """About as many times, each side of a switch included."""
        pieces = [
            np.linspace(*_inside(a, b), max(5, round(samples * (b - a) / self.duration)))
            for a, b in itertools.pairwise(self.switches)
        ]
        return np.concatenate([[0.0], *pieces, [self.duration]])


def _inside(left: float, right: float) -> tuple[float, float]:
    """The interval without its ends, at which a derivative may jump."""
    edge = 1e-9 * (right - left)
    return left + edge, right - edge


def rope_course(law: Law, truss: TrussParameters) -> Course:
    """The rope that one motor has wound in, x = L(alpha_0) - L(alpha), (20).

    It counts from the stowed ring wherever the motion starts, as the drum does.

    Parameters
    ----------
    law : angle over time.
    truss : its parameters.
    """
    stowed = float(rope_length(truss, truss.stowed_angle))

    def derivatives(time: Array) -> Array:
        motion = law.motion(time)
        length = rope_length(truss, ca.DM(motion.angle)).full().ravel()
        first, second = rope_slopes(truss, motion.angle)
        sides = (rope_slopes(truss, motion.angle + h)[1] for h in (ANGLE_STEP, -ANGLE_STEP))
        third = (next(sides) - next(sides)) / (2 * ANGLE_STEP)
        w, a, j = motion.speed, motion.acceleration, motion.jerk
        return np.stack(
            [
                stowed - length,
                -first * w,
                -(first * a + second * w**2),
                -(first * j + 3 * second * w * a + third * w**3),
            ]
        )

    return Course("rope", "m", law.duration, switch_times(law), derivatives)


def rope_slopes(truss: TrussParameters, angle: Array) -> tuple[Array, Array]:
    """First and second derivative of L by the angle, (m,) each [m/rad, m/rad^2]."""
    alpha = ca.DM(angle)
    slope = 2 * truss.modules * slider_distance_slope(truss, alpha)
    curvature = 2 * truss.modules * slider_distance_curvature(truss, alpha)
    return slope.full().ravel(), curvature.full().ravel()


def rope_third(truss: TrussParameters, angle: Array) -> Array:
    """Third derivative of L by the angle, (m,) [m/rad^3]."""
    third = 2 * truss.modules * slider_distance_third(truss, ca.DM(angle))
    row: Array = third.full().ravel()
    return row


def switch_times(law: Law) -> tuple[float, ...]:
    """Start, end and the times at which jerk or acceleration jumps, without points of a mesh."""
    inner = np.array(law.breakpoints)
    if isinstance(law, Piecewise):
        after = law.motion(inner).jerk
        before = law.motion(np.nextafter(inner, 0.0)).jerk
    elif isinstance(law, Hermite):  # of whose rows most are no switches
        after, before = law.accelerations[1:-1], law.before[1:-1]
    else:
        return (0.0, *inner.tolist(), law.duration)

    largest = max(float(np.abs(row).max(initial=0.0)) for row in (after, before))
    kept = inner[np.abs(after - before) > JUMP * largest]
    return (0.0, *kept.tolist(), law.duration)


def drum_course(course: Course, drum: Drum) -> Course:
    """The turn of the drum that winds a rope in as a course says.

    Where a climb begins or ends the drum's acceleration jumps: these times are switches, too.
    """
    from scipy.optimize import brentq

    first, last = course.derivatives(np.array([0.0, course.duration]))[0].tolist()
    ends = sorted((first, last))
    met = [
        brentq(
            lambda t, corner=corner: float(course.derivatives(np.array([t]))[0, 0]) - corner,
            0.0,
            course.duration,
            xtol=1e-14 * course.duration,
        )
        for corner in drum.corners(ends[1])
        if corner > ends[0]
    ]
    return Course(
        signal=DRUM,
        unit="rad",
        duration=course.duration,
        switches=tuple(sorted({*course.switches, *met})),
        derivatives=lambda time: drum.turned(course.derivatives(time)),
        note=course.note,
        stretch=course.stretch,
    )


def joint_course(
    signal: str, time: Array, angle: Array, rate: Array, predicted: bool = False, unit: str = "rad"
) -> Course:
    """The way of a joint or slider from its samples, cubic between two of them."""
    from scipy.interpolate import CubicHermiteSpline

    curve = CubicHermiteSpline(time, angle - angle[0], rate)
    return polynomial_course(signal, unit, curve, (0.0, float(time[-1])), predicted)


def polynomial_course(
    signal: str, unit: str, curve: Any, switches: tuple[float, ...], predicted: bool = False
) -> Course:
    """The course of a SciPy piecewise polynomial that starts at time 0."""

    def derivatives(time: Array) -> Array:
        return np.stack([curve(time, nu=order) for order in range(4)])

    return Course(
        signal=signal,
        unit=unit,
        duration=switches[-1],
        switches=switches,
        derivatives=derivatives,
        note=PREDICTED if predicted else "",
    )


def with_dwells(course: Course, before: float, after: float) -> Course:
    """The same between two rests [s]."""
    if before == 0.0 and after == 0.0:
        return course
    if before and course.start_speed:
        raise StudyError(
            f"drive.start_dwell is {before:g} s, but the motion does not start at rest; remove "
            "start_dwell"
        )
    total = before + course.duration + after

    def between(derivatives: Callable[[Array], Array]) -> Callable[[Array], Array]:
        def rested(time: Array) -> Array:
            inner = np.asarray(time, dtype=float) - before
            rows = derivatives(np.clip(inner, 0.0, course.duration))
            rows[1:, (inner < 0.0) | (inner > course.duration)] = 0.0
            return rows

        return rested

    moved = (before + t for t in course.switches)
    stretch = course.stretch
    return dataclasses.replace(
        course,
        duration=total,
        switches=tuple(sorted({0.0, *moved, total})),
        derivatives=between(course.derivatives),
        stretch=stretch and dataclasses.replace(stretch, derivatives=between(stretch.derivatives)),
    )
