"""A playback finds the peaks between the points of a table, however many points there are."""

import math

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from models.laws import JerkLimited
from models.truss import DYNAMIC_SET
from studies.drive import Drive
from studies.drive.course import rope_course
from studies.drive.interpolation import interpolated
from studies.drive.loop import followed
from studies.drive.playback import loop_of, played
from studies.drive.setpoints import SetPoints, sampled, uniform_times

OPEN = math.pi / 2


def long_table(count: float) -> SetPoints:
    """28,001 rounded points of a deployment in 140 s."""
    law = JerkLimited(140.0, DYNAMIC_SET.stowed_angle, OPEN, jerk=124.22 / 140.0**3)
    course = rope_course(law.profile, DYNAMIC_SET)
    return sampled(course, uniform_times(course, 0.005), count)


def test_a_speed_between_two_of_many_points_is_found() -> None:
    law = JerkLimited(140.0, DYNAMIC_SET.stowed_angle, OPEN, jerk=124.22 / 140.0**3)
    course = rope_course(law.profile, DYNAMIC_SET)
    points = long_table(2 * math.pi * 0.02 / 4096)
    found, when = played(course, points, Drive(drum_radius=0.02, counts=4096), "hermite").peak(1)

    # the vertex of the parabola that each segment's speed is: v = v0 + (a0 + j s/2) s
    h, u = np.diff(points.times), points.velocities
    slope = np.diff(points.positions) / h
    start = (6 * slope - 4 * u[:-1] - 2 * u[1:]) / h
    jerk = (6 * u[:-1] + 6 * u[1:] - 12 * slope) / h**2
    inside = np.clip(-start / jerk, 0.0, h)
    speed = u[:-1] + (start + jerk * inside / 2) * inside
    k = int(np.argmax(speed))
    assert speed[k] > 1.02 * u.max()  # rounding shows between the points
    assert found == pytest.approx(speed[k], rel=1e-9)
    assert when == pytest.approx(points.times[k] + inside[k], abs=1e-6)


def test_peaks_of_a_quintic_are_where_its_derivatives_turn() -> None:
    rng = np.random.default_rng(3)
    times = np.arange(21_001) * 0.01
    x, v, a = rng.normal(size=(3, times.size)) * [[1e-6], [1e-4], [1e-2]]
    points = SetPoints(times, x, v, a)
    law = JerkLimited(210.0, DYNAMIC_SET.stowed_angle, OPEN, jerk=124.22 / 210.0**3)
    output = played(rope_course(law.profile, DYNAMIC_SET), points, Drive(), "quintic")

    curve = interpolated(points, "quintic")
    for order in (1, 2, 3):
        found, when = output.peak(order)
        k = int(when / 0.01)
        piece = Polynomial(curve.c[::-1, k]).deriv(order)
        turns = [t.real for t in piece.deriv().roots() if abs(t.imag) < 1e-9 and 0 < t.real < 0.01]
        exact = max(abs(piece(t)) for t in (0.0, 0.01, *turns))
        # a turn is placed by one step of Newton's method inside a quarter of the segment
        assert found == pytest.approx(exact, rel=1e-4)


def test_a_peak_behind_a_loop_is_found_as_on_a_fine_grid() -> None:
    law = JerkLimited(140.0, DYNAMIC_SET.stowed_angle, OPEN, jerk=124.22 / 140.0**3)
    course = rope_course(law.profile, DYNAMIC_SET)
    points = long_table(2 * math.pi * 0.02 / 1000)
    drive = Drive(drum_radius=0.02, counts=1000, bandwidth=50.0)
    loop = loop_of(drive)
    assert loop is not None

    output = played(course, points, drive, "linear")
    exact = followed(interpolated(points, "linear"), loop, float(points.positions[-1]))
    for order in (1, 2):
        found, when = output.peak(order)
        near = np.linspace(when - 0.005, when + 0.005, 20_001)
        assert found == pytest.approx(np.abs(exact.derivatives(near)[order]).max(), rel=1e-4)
