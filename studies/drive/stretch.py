"""The stretch of a rope that yields under its tension, wound in beforehand.

A drive that gives at the motor is stretched by the motor's pull. The pulleys take of that pull, so
that the tension falls along the rope: what counts for a rope that gives along its length is its
mean over that length.
A step of the tension would need an infinite speed of the motor. So the stretch that is wound in is
that of a tension which is averaged twice over a time, the ramp: it has a speed and an acceleration.
At the start the average looks back, at the end it looks ahead. So the motor rests at both.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from models.truss import Opening, TrussParameters, rope_length
from ocp.arrays import Array
from studies.common.exit_codes import StudyError
from studies.drive.course import SAMPLES, Course, Stretch
from studies.drive.playback import TrussPlayback, on_the_truss
from studies.drive.schema import Drive
from studies.drive.snap_through import check_rope

PERIODS = 10  # of a ramp, so that straight lines between set-points follow it
SHARE = 0.05  # of the motion, which a ramp that is not stated takes at most
APART = 0.1  # of a ramp: a corner closer to a switch gets no time of its own
MOST = 0.25  # of the motion, beyond which the average is no tension of it any more


def stretched(course: Course, truss: TrussParameters, drive: Drive) -> Course:
    """A course of the rope, and the change of its stretch since the stowed truss was at rest.

    A course that begins elsewhere, as behind a stop, begins with the stretch that its rope has at
    rest there. So the positions of a motion, its stop and the way on are those of one drum.

    Raises
    ------
    StudyError
        If the ramp is longer than `MOST` of the motion, or the truss snaps through on its ropes
        between the angles that the course passes.
    """
    if drive.rope_stiffness is None:
        return course
    _check_rope(course, truss, drive)
    ramp = _ramp(course, drive)
    pull = _tension(course, truss, drive, ramp)
    once = pull.antiderivative()
    twice, slope = once.antiderivative(), pull.derivative()

    # time runs faster inside of the average: from a ramp before the start to one after the end
    gain = 1.0 + 2.0 * ramp / course.duration
    stowed = float(_stretching(on_the_truss(np.zeros((4, 1)), truss), drive)[0])

    def averaged(time: Array) -> Array:
        time = np.asarray(time, dtype=float)
        middle = gain * time - ramp
        sides = middle + ramp, middle, middle - ramp
        rows = [
            (f(sides[0]) - 2.0 * f(sides[1]) + f(sides[2])) / ramp**2
            for f in (twice, once, pull, slope)
        ]
        rows[0] -= stowed
        found = np.stack([row * gain**order for order, row in enumerate(rows)])
        found[1:, (time <= 0.0) | (time >= course.duration)] = 0.0
        return found

    yielding = 1.0 / drive.rope_stiffness

    def rows(time: Array) -> Array:
        found: Array = yielding * averaged(time)
        return found

    time = course.grid(SAMPLES)
    missed = float(np.abs(pull(time) - stowed - averaged(time)[0]).max())
    return dataclasses.replace(
        course,
        switches=_corners(course, ramp, gain),
        derivatives=lambda time: course.derivatives(time) + rows(time),
        note=f"with the stretch of a rope of {drive.rope_stiffness:g} N/m, "
        f"of a tension averaged twice over {ramp:.4g} s",
        stretch=Stretch(rows, missed, yielding * _on_the_drum(course, truss, drive)),
    )


def _check_rope(course: Course, truss: TrussParameters, drive: Drive) -> None:
    """Refuse a rope on which the truss snaps through while it follows a course."""
    ends = course.derivatives(np.array([0.0, course.duration]))
    ends[1:] = 0.0
    start, end = on_the_truss(ends, truss).angle.tolist()
    if start < (end := min(end, math.pi / 2)):  # rounding may end beyond it
        check_rope(truss, drive, Opening(start, end))


def _ramp(course: Course, drive: Drive) -> float:
    if drive.tension_ramp is None:
        return min(PERIODS * drive.period, SHARE * course.duration)
    if drive.tension_ramp > MOST * course.duration:
        raise StudyError(
            f"drive.tension_ramp is {drive.tension_ramp:g} s, but the motion takes "
            f"{course.duration:g} s; give at most {MOST * course.duration:.4g} s"
        )
    return drive.tension_ramp


def _tension(course: Course, truss: TrussParameters, drive: Drive, ramp: float) -> Any:
    """The tension that stretches a rope over time, and that of rest before and after [N].

    It is a curve through samples on both sides of each switch that adds no overshoot to a step.
    """
    from scipy.interpolate import PchipInterpolator

    time = course.grid(SAMPLES)[1:-1]
    tension = _stretching(on_the_truss(course.derivatives(time), truss), drive)
    ends = course.derivatives(np.array([0.0, course.duration]))
    ends[1:] = 0.0
    first, last = _stretching(on_the_truss(ends, truss), drive).tolist()

    beyond = 2.0 * ramp * np.array([1.0, 1e-9])
    before, after = -beyond, course.duration + beyond[::-1]
    return PchipInterpolator(
        np.concatenate([before, time, after]),
        np.concatenate([[first, first], tension, [last, last]]),
    )


def _stretching(found: TrussPlayback, drive: Drive) -> Array:
    """The tension that stretches a rope (m,) [N]."""
    return found.force if drive.rope_yields == "at the motor" else found.mean_tension


def _on_the_drum(course: Course, truss: TrussParameters, drive: Drive) -> float:
    """The most by which tension times share of the rope is off at the motor's drum [N].

    The stretch takes the rope on the drum to have the mean tension that the free rope has now. It
    keeps the tension with which it was wound in. Before the course that is taken as that of rest.
    A rope that gives at the motor only has no stretch on its drum.
    """
    if drive.rope_yields == "at the motor":
        return 0.0
    time = course.grid(SAMPLES)
    motion = course.derivatives(time)
    before = np.zeros((4, SAMPLES))
    before[0] = np.linspace(0.0, motion[0, 0], SAMPLES)

    wound = float(_work(before[0], on_the_truss(before, truss).force)[-1])
    found = on_the_truss(motion, truss)
    kept = wound + _work(motion[0], found.force) - found.mean_tension * motion[0]
    return float(np.abs(kept).max() / rope_length(truss, truss.stowed_angle))


def _work(wound: Array, force: Array) -> Array:
    """The integral of a force over the rope that is wound in, (m,) [J]."""
    steps = (force[1:] + force[:-1]) / 2 * np.diff(wound)
    return np.concatenate([[0.0], np.cumsum(steps)])


def _corners(course: Course, ramp: float, gain: float) -> tuple[float, ...]:
    """Its switches, and when the averaging meets, passes and leaves one of them."""
    kept = list(course.switches)
    for time in sorted((s + k * ramp) / gain for s in course.switches for k in (0.0, 1.0, 2.0)):
        # two that nearly fall together would make a segment too short for a table
        if all(abs(time - other) > APART * ramp for other in kept):
            kept.append(time)
    return tuple(sorted(kept))
