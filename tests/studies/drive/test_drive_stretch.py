"""The stretch of a rope: what pulleys and drum do to it, and what the motor pays for it."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from models.laws import JerkLimited
from models.truss import (
    DYNAMIC_SET,
    evaluate_motion,
    rope_length,
    slider_distance,
    tension_ratios,
)
from studies.drive import Drive
from studies.drive.course import rope_course
from studies.drive.playback import on_the_truss
from studies.drive.setpoints import sampled, uniform_times
from studies.drive.stretch import stretched
from studies.export.round_trip import round_trip

RUBBED = dataclasses.replace(DYNAMIC_SET, pulley_friction=0.01)
LAW = JerkLimited(10.0, DYNAMIC_SET.stowed_angle, math.pi / 2, jerk=0.2).profile
RIGID = rope_course(LAW, RUBBED)
K = 500.0  # [N/m]
ALONG = {"rope_stiffness": K, "rope_yields": "along its length"}


def test_pulleys_take_their_share_of_the_stretch() -> None:
    course = stretched(RIGID, RUBBED, Drive(**ALONG, tension_ramp=1e-3))

    def by_segments(time: float) -> float:
        """Sum over the segments of tension times length over that of the whole rope [N]."""
        motion = LAW.motion(np.array([time]))
        rates = (0.0, 0.0) if time in (0.0, 10.0) else (motion.speed, motion.acceleration)
        alpha = float(motion.angle[0])
        force = evaluate_motion(RUBBED, alpha, *rates).rope_force[0]
        e, b = float(slider_distance(RUBBED, alpha)), RUBBED.half_cross_bar
        lengths = np.array([e, b, b, e] * RUBBED.modules)
        ratios = tension_ratios(RUBBED, alpha).full().ravel()
        return float(force * (ratios @ lengths) / lengths.sum())

    for time in (2.0, 6.0, 10.0):
        at = np.array([time])
        more = float((course.derivatives(at) - RIGID.derivatives(at))[0, 0])
        exact = by_segments(time) - by_segments(0.0)
        # the average's times are off by 1 ms of 10 s
        assert K * more == pytest.approx(exact, rel=1e-3, abs=1e-2)
        pulled = on_the_truss(RIGID.derivatives(at), RUBBED).force[0]
        assert 0 < by_segments(time) < 0.6 * pulled


def test_the_rope_on_the_drum_keeps_what_it_had_at_the_motor() -> None:
    # the rope by itself: its segments now, and on the drum the pull of each moment
    course = stretched(RIGID, RUBBED, Drive(**ALONG, tension_ramp=1e-3))
    time = np.linspace(0.0, 10.0, 4001)
    wound, found = RIGID.derivatives(time)[0], on_the_truss(RIGID.derivatives(time), RUBBED)
    whole = float(rope_length(RUBBED, RUBBED.stowed_angle))
    on_drum = cumulative_trapezoid(found.force, wound, initial=0.0)
    exact = (found.mean_tension * (whole - wound) + on_drum) / whole / K
    left_out = exact - found.mean_tension / K
    assert course.stretch is not None
    assert course.stretch.on_the_drum == pytest.approx(np.abs(left_out).max(), rel=1e-2)


def test_the_motor_pays_for_the_stretch_that_it_winds_in() -> None:
    drive = Drive(rope_stiffness=K, interpolation="spline")
    course = stretched(RIGID, RUBBED, drive)
    points = sampled(course, uniform_times(course, 0.01))
    record = round_trip(course, points, drive, None, RUBBED)

    time = np.linspace(0.0, 10.0, 20_001)[1:-1]
    motion = LAW.motion(time)
    force = evaluate_motion(RUBBED, motion.angle, motion.speed, motion.acceleration).rope_force
    power = (2 * force * course.derivatives(time)[1]).max()
    assert record.values["peak motor power [W]"] == pytest.approx(power, rel=1e-3)
    assert power > 1.01 * (2 * force * RIGID.derivatives(time)[1]).max()

    limited = dataclasses.replace(drive, power=0.995 * power)
    broken = round_trip(course, points, limited, None, RUBBED).breaches
    assert [breach.sentence.split(" is ")[0] for breach in broken] == ["the motor power"]
