"""A safe stop out of a course, and the way on from rest.

The stop lowers the acceleration at a constant jerk, holds it where a limit is reached, and raises
it to zero at the same jerk. With a given greatest jerk nothing stops sooner or in less travel. So
the stop of least jerk is the one that just fits into the time and the travel that are left.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from studies.common.exit_codes import ExitCode, StudyError
from studies.common.rounding import up
from studies.drive.course import RESTING, Course, polynomial_course
from studies.drive.schema import Drive

BISECTIONS = 200
MORE = 2.0  # times the least time of a stop: the least one has jumps of the acceleration

Phases = tuple[tuple[float, float], ...]  # (duration, jerk) one after the other


def stop_course(course: Course, at: float, drive: Drive, within: float | None = None) -> Course:
    """The course until a time, then its least-jerk stop.

    Parameters
    ----------
    at : when the stop begins [s].
    drive : whose limits of acceleration and jerk hold.
    within : time that the stop may take [s]; what is left of the course by default.

    Raises
    ------
    StudyError
        If the time is not inside the course, or no stop keeps the limits.
    """
    _check_inside(course, at)
    position, speed, acceleration, _ = course.derivatives(np.array([at]))[:, 0].tolist()
    time = course.duration - at if within is None else within
    travel = course.derivatives(np.array([course.duration]))[0, 0] - position

    # a stop is worked out for a motion forwards
    sign = 1.0 if speed >= 0 else -1.0
    phases = least_jerk_stop(
        sign * speed, sign * acceleration, time, sign * travel, drive, course.unit
    )
    kept = [t for t in course.switches if t < at]
    return _continued(course, kept, at, [(t, sign * j) for t, j in phases])


def resume_course(
    course: Course,
    at: float,
    drive: Drive,
    within: float | None = None,
    lasting: float | None = None,
) -> Course:
    """From rest where the stop of a course at a time ended, to the course's end.

    It is the rest-to-rest motion of least jerk. It takes the time that the course would have taken
    from there, or longer where a limit asks for it.

    Parameters
    ----------
    at, drive, within : of the stop, see `stop_course`.
    lasting : time that the way on takes instead [s].

    Raises
    ------
    StudyError
        If the time is not inside the course, no stop keeps the limits, or no way on of that time.
    """
    stop = stop_course(course, at, drive, within)
    rest = float(stop.derivatives(np.array([stop.duration]))[0, 0])
    if abs(_end_of(course) - rest) < RESTING * course.travel:
        raise StudyError(
            f"the stop at {at:g} s ends at the end of the motion, so there is nothing to resume; "
            "use a shorter stop time"
        )
    return _way_on(course, rest, course.duration - at, drive, lasting)


def resume_from(
    course: Course, position: float, drive: Drive, lasting: float | None = None
) -> Course:
    """From rest at a position on a course to its end, as `resume_course` does.

    Parameters
    ----------
    position : where the axis stands, wherever it comes from; inside the course [m or rad].
    lasting : time that it takes [s]; by default that of the course from there, or longer where a
        limit asks for it.

    Raises
    ------
    StudyError
        If the limits allow no motion of that time.
    """
    low, high = 0.0, course.duration
    way = _end_of(course) - position
    for _ in range(BISECTIONS):  # for when the course passes the position
        middle = (low + high) / 2
        passed = (course.derivatives(np.array([middle]))[0, 0] - position) * way > 0.0
        low, high = (low, middle) if passed else (middle, high)
    return _way_on(course, position, course.duration - high, drive, lasting)


def _end_of(course: Course) -> float:
    return float(course.derivatives(np.array([course.duration]))[0, 0])


def _way_on(
    course: Course, rest: float, time: float, drive: Drive, lasting: float | None
) -> Course:
    """From rest to the end of a course, in `lasting` or, with the limits of a drive, in `time`."""
    # ramps of j, -j, -j, j of a quarter each: v = 2 D/T, a = 8 D/T^2, j = 32 D/T^3
    travel = _end_of(course) - rest
    size = abs(travel)
    least = [0.0]
    least += [2 * size / drive.speed] if drive.speed else []
    least += [math.sqrt(8 * size / drive.acceleration)] if drive.acceleration else []
    least += [(32 * size / drive.jerk) ** (1 / 3)] if drive.jerk else []
    if lasting is not None and lasting < max(least):
        raise StudyError(
            f"{lasting:g} s are too short for the rest of the motion: the limits of the drive "
            f"need at least {up(max(least))} s; allow this time, or raise the limits",
            ExitCode.INFEASIBLE,
        )
    duration = max(time, *least) if lasting is None else lasting
    jerk = 32 * travel / duration**3
    quarter = duration / 4
    phases = [(quarter, jerk), (quarter, -jerk), (quarter, -jerk), (quarter, jerk)]
    return _from_phases(course, rest, 0.0, 0.0, phases)


def least_jerk_stop(
    speed: float,
    acceleration: float,
    time: float,
    travel: float,
    drive: Drive,
    unit: str = "m",
) -> Phases:
    """The stop of least jerk, as (duration, jerk) of its phases.

    Parameters
    ----------
    speed : at its start, not negative [m/s].
    acceleration : at its start [m/s^2].
    time, travel : at most [s, m].
    drive : whose limits of acceleration and jerk hold.
    unit : of the travel, for sentences.

    Raises
    ------
    StudyError
        If no jerk within the limit stops in that time and travel.
    """
    if speed <= 0.0 and acceleration <= 0.0:
        return ()
    most = drive.acceleration or math.inf
    if -acceleration > most * (1 + 1e-9):
        raise StudyError(
            f"the motion brakes at {-acceleration:.4g} when the stop begins, beyond the drive's "
            f"limit of {most:g}; choose another time"
        )

    def fits(jerk: float) -> bool:
        phases = _stop_phases(speed, acceleration, jerk, most)
        if phases is None:
            return False
        needed, distance = _time_and_travel(speed, acceleration, phases)
        return needed <= time * (1 + 1e-12) and distance <= travel * (1 + 1e-12)

    high = drive.jerk or 1.0
    while drive.jerk is None and not fits(high) and high < 1e12:
        high *= 10
    if not fits(high):
        fastest = _stop_phases(speed, acceleration, high, most) or ()
        needed, distance = _time_and_travel(speed, acceleration, fastest)
        remedy = "stop at an earlier time"
        if fastest and distance <= travel:
            remedy = f"allow more time with --stop-within {up(MORE * needed, 3)}"
        raise StudyError(
            f"no stop within the drive's limits of acceleration and jerk ends within {time:.4g} s "
            f"and {travel:.4g} {unit} of travel; {remedy}, or raise these limits",
            ExitCode.INFEASIBLE,
        )
    low = 0.0
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        low, high = (low, middle) if fits(middle) else (middle, high)
    phases = _stop_phases(speed, acceleration, high, most)
    assert phases is not None  # it fits
    return phases


def _stop_phases(speed: float, acceleration: float, jerk: float, most: float) -> Phases | None:
    """Down, level and up at a given jerk; None if the speed would turn before it is zero."""
    if jerk <= 0.0:
        return None
    # the deepest deceleration from which the ramp up ends at rest
    square = jerk * speed + acceleration**2 / 2
    if acceleration < 0.0 and acceleration**2 / (2 * jerk) > speed * (1 + 1e-9):
        return None
    deepest = math.sqrt(square)
    if deepest <= most:
        down = max(0.0, (acceleration + deepest) / jerk)
        return ((down, -jerk), (deepest / jerk, jerk))

    down, up = (acceleration + most) / jerk, most / jerk
    reached = speed + acceleration * down - jerk * down**2 / 2
    level = (reached - most * up / 2) / most
    return ((down, -jerk), (level, 0.0), (up, jerk))


def _time_and_travel(speed: float, acceleration: float, phases: Phases) -> tuple[float, float]:
    total, distance, v, a = 0.0, 0.0, speed, acceleration
    for dt, j in phases:
        distance += v * dt + a * dt**2 / 2 + j * dt**3 / 6
        v, a = v + a * dt + j * dt**2 / 2, a + j * dt
        total += dt
    return total, distance


def _check_inside(course: Course, at: float) -> None:
    if not 0.0 <= at < course.duration:
        raise StudyError(
            f"the stop begins at {at:g} s, but the motion lasts from 0 to {course.duration:g} s; "
            "choose a time inside"
        )


def _continued(
    course: Course, kept: Sequence[float], at: float, phases: Sequence[tuple[float, float]]
) -> Course:
    """A course until a time, and phases of constant jerk behind it."""
    state = course.derivatives(np.array([at]))[:, 0].tolist()
    position, speed, acceleration, _ = state
    tail = _from_phases(course, position, speed, acceleration, phases) if phases else None
    if tail is None:
        end = max(at, 1e-6)

        def whole(time: Any) -> Any:
            return course.derivatives(np.minimum(time, at))

        return Course(course.signal, course.unit, end, (0.0, end), whole, course.note)

    def derivatives(time: Any) -> Any:
        t = np.asarray(time, dtype=float)
        before = course.derivatives(np.minimum(t, at))
        behind = tail.derivatives(np.clip(t - at, 0.0, tail.duration))
        return np.where(t <= at, before, behind)

    moved = [at + t for t in tail.switches]
    switches = tuple(sorted({0.0, *kept, *moved}))
    return Course(course.signal, course.unit, moved[-1], switches, derivatives, course.note)


def _from_phases(
    course: Course,
    position: float,
    speed: float,
    acceleration: float,
    phases: Sequence[tuple[float, float]],
) -> Course:
    """The course of phases of constant jerk from a state."""
    from scipy.interpolate import PPoly

    rows, edges, x, v, a = [], [0.0], position, speed, acceleration
    for dt, j in phases:
        if dt <= 0.0:
            continue
        rows.append((j / 6, a / 2, v, x))
        x, v, a = x + v * dt + a * dt**2 / 2 + j * dt**3 / 6, v + a * dt + j * dt**2 / 2, a + j * dt
        edges.append(edges[-1] + dt)
    curve = PPoly(np.array(rows).T, np.array(edges))
    again = polynomial_course(course.signal, course.unit, curve, tuple(edges))
    return Course(again.signal, again.unit, again.duration, again.switches, again.derivatives)
