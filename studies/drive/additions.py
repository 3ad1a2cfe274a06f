"""What interpolation, rounding and the position loop may add to the peaks of a course, at most.

The proofs are in docs/explanation/drive.md. A course is meant whose acceleration does not jump,
which is so where its jerk is capped; a jump of another one is part of what is added.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from ocp.arrays import Array
from studies.common.exit_codes import StudyError
from studies.drive.course import SAMPLES, Course
from studies.drive.drum import Drum
from studies.drive.interpolation import (
    ERROR_CONSTANTS,
    VELOCITY_JERK,
    acceleration_bound,
    jerk_gain,
)
from studies.drive.loop import Loop
from studies.drive.playback import loop_of
from studies.drive.schema import Drive
from studies.drive.setpoints import SetPoints


@dataclass(frozen=True)
class Additions:
    """What a peak may become: `gain` times that of the course, and so much more.

    Attributes
    ----------
    speed : more speed [m/s or rad/s].
    acceleration_gain, acceleration : of and beside the acceleration [m/s^2 or rad/s^2].
    jerk_gain, jerk : of and beside the jerk [m/s^3 or rad/s^3], infinite where it has no bound.
    """

    speed: float
    acceleration_gain: float
    acceleration: float
    jerk_gain: float
    jerk: float


def additions(course: Course, points: SetPoints, drive: Drive, kind: str) -> Additions:
    """What may be added to the peaks of a course by its table.

    Raises
    ------
    StudyError
        If the acceleration has no bound between the points.
    """
    loop = loop_of(drive)
    gain, added = _acceleration(course, points, loop, kind)
    jerk_factor, jerk = _jerk(course, points, loop, kind)
    return Additions(_speed(points, loop, added), gain, added, jerk_factor, jerk)


def on_the_rope(turned: Additions, course: Course, drum: Drum) -> Additions:
    """The same of the rope, from those of the turn of its drum.

    In a climb the rope's acceleration has the term (dr / dtheta) speed^2. What is played may enter
    or leave the climb at another moment, so that all of that term may be wrong for a while.
    """
    speed, acceleration, _ = course.peaks
    radius = float(drum.radius_at(wound_peaks(course, drum)[0]))
    climb = (speed + turned.speed) ** 2 * drum.steepest
    more = (turned.acceleration_gain - 1.0) * acceleration + turned.acceleration
    layered = drum.growth > 0.0
    return Additions(
        speed=radius * turned.speed,
        acceleration_gain=1.0,
        acceleration=radius * more + climb,
        jerk_gain=math.inf if layered else turned.jerk_gain,
        jerk=math.inf if layered else radius * turned.jerk,
    )


def wound_peaks(course: Course, drum: Drum) -> tuple[float, float, float]:
    """The most rope, rope speed and rope acceleration of the turn of a drum [m, m/s, m/s^2]."""
    rows: Array = abs(drum.wound(course.derivatives(course.grid(SAMPLES))))
    return float(rows[0].max()), float(rows[1].max()), float(rows[2].max())


def _acceleration(
    course: Course, points: SetPoints, loop: Loop | None, kind: str
) -> tuple[float, float]:
    bound = acceleration_bound(course, points, kind)
    if bound is None or (kind == "linear" and loop is None):
        raise StudyError(
            f"the interpolation {kind} has no bounded acceleration; give drive.bandwidth, or the "
            "interpolation hermite, spline or quintic",
        )
    if loop is None:
        return 1.0, bound.interpolation + bound.rounding

    rounded = loop.curvature * ERROR_CONSTANTS[kind].position * (points.count or 0.0)
    if kind == "linear":
        # impulses at the points, the largest as far apart as the longest step
        uneven = points.longest / points.shortest
        return max(1.0, loop.impulses(points.shortest) * uneven), rounded
    return 1.0, bound.interpolation + min(rounded, loop.overshoot * bound.rounding)


def _speed(points: SetPoints, loop: Loop | None, added: float) -> float:
    """Without counts what the acceleration may add within a step; else a count a step, or less."""
    if points.count is None:
        return added * points.longest
    by_step = 2 * points.count / points.shortest
    if loop is None:
        return by_step + added * points.longest
    return min(by_step, 2 * loop.frequency * loop.overshoot * points.count)


def _jerk(course: Course, points: SetPoints, loop: Loop | None, kind: str) -> tuple[float, float]:
    constants, step = ERROR_CONSTANTS[kind], points.shortest
    count = points.count or 0.0
    slope = constants.rounded_speed * count / step + points.velocity_step / 2
    if kind == "linear" and loop is not None:
        # the loop makes a jerk of what its command's speed is off
        off = points.longest * course.peaks[1] / 2 + slope
        return loop.overshoot, loop.curvature * off

    gain = jerk_gain(points, kind)
    if not math.isfinite(gain):
        return math.inf, math.inf
    rounded = constants.rounded_jerk * count / step**3
    rounded += VELOCITY_JERK * points.velocity_step / step**2
    if loop is None:
        return gain, rounded

    gain *= loop.overshoot
    if kind == "hermite":
        # its acceleration jumps at the points; each jump is an impulse of the jerk, or else what
        # the speed is off by between two points counts, at both of which it is exact
        jump = 2 * constants.jerk * points.longest
        off = constants.jerk * points.longest**2 / 2
        gain += min(loop.impulses(step) / step * jump, loop.curvature * off)
    by_speed = loop.curvature * slope
    # rounded velocities make such jumps as well, rounded positions alone do not
    return gain, by_speed if points.velocity_step else min(loop.overshoot * rounded, by_speed)
