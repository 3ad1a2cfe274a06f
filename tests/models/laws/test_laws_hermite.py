"""A law through rows of angle, speed and acceleration."""

import math

import numpy as np
import pytest

from models.errors import ModelError
from models.laws import Hermite, Step5, constant_acceleration, linear_jerk

LAW = Step5(140.0, 0.0768, math.pi / 2)


def rows_of(law, times):
    after = law.motion(times)
    before = law.motion(np.nextafter(times, 0.0))
    return Hermite(times, after.angle, after.speed, after.acceleration, before.acceleration)


def test_a_polynomial_of_the_fifth_degree_is_the_law_itself() -> None:
    ramped = linear_jerk((0.0, 60.0, 140.0), ((1e-6, -2e-6), (1e-6, 0.0)), 0.1)
    again, t = rows_of(ramped, np.linspace(0, 140, 8)), np.linspace(0, 140, 777)
    # a quartic in the angle: what is left is rounding of angles of 1 rad over pieces of 20 s
    for name, rounding in (("angle", 1e-14), ("speed", 1e-15), ("acceleration", 1e-16)):
        exact = getattr(ramped.motion(t), name)
        assert getattr(again.motion(t), name) == pytest.approx(exact, abs=10 * rounding, rel=1e-12)


def test_the_acceleration_jumps_where_its_rows_do_and_the_jerk_is_none() -> None:
    law = constant_acceleration((0.0, 1.0, 2.0), (1.0, -1.0), 0.1)
    again = rows_of(law, np.linspace(0, 2, 21))
    motion = again.motion([0.999999, 1.0])
    assert motion.acceleration == pytest.approx([1.0, -1.0], abs=1e-9)
    assert np.isnan(motion.jerk).all()
    t = np.linspace(0, 2, 333)
    assert again.motion(t).angle == pytest.approx(law.motion(t).angle, abs=1e-14)


def test_rows_very_close_to_each_other_do_no_harm() -> None:
    times = np.sort(np.concatenate([np.linspace(0, 140, 50), [70.0, 70.0 + 1e-9]]))
    t = np.linspace(69.9, 70.1, 1001)
    motion = rows_of(LAW, times).motion(t)
    assert motion.acceleration == pytest.approx(LAW.motion(t).acceleration, abs=1e-9)


def test_the_speed_does_not_jump_between_rows_very_close_to_each_other() -> None:
    # 10,000 rad/s^2 that end within 5e-5 s of 5 s, as where only rope forces are limited
    times = np.concatenate([np.linspace(0.0, 5e-5, 17), np.linspace(1e-3, 5.0, 100)])
    speed, decay = 0.5, 1e-5
    grown = -np.expm1(-times / decay)
    law = Hermite(
        times,
        speed * (times - decay * grown),
        speed * grown,
        speed / decay * np.exp(-times / decay),
        speed / decay * np.exp(-times / decay),
    )
    inner = times[1:17]
    jump = law.motion(inner).speed - law.motion(np.nextafter(inner, 0.0)).speed
    # a last digit of the time is 7e-21 s, in which the speed changes by 3e-16 rad/s
    assert np.abs(jump).max() < 1e-15


def test_columns_that_make_no_law_are_named() -> None:
    one, three = np.zeros(1), np.arange(3.0)
    with pytest.raises(ModelError, match="columns of one length"):
        Hermite(three, three, three, three, one)
    with pytest.raises(ModelError, match="do not increase from 0"):
        Hermite(three + 1, three, three, three, three)
    with pytest.raises(ModelError, match="not finite"):
        Hermite(three, three, three, three, three * np.nan)


def test_stated_gains_and_turns_keep_the_acceleration_between_close_rows() -> None:
    # an angle of 1 rad is rounded by 1e-16 rad: over 5e-5 s that would be 1e-6 rad/s^2 in quintics
    times = 5.0 + np.linspace(0.0, 8e-4, 17)
    times = np.insert(times, 0, 0.0)
    steps, rate, start = np.diff(times), 0.03, 0.98
    angles, speeds = start + rate * times**2 / 2, rate * times
    constant = np.full(times.size, rate)
    t = np.linspace(5.0, 5.0008, 1001)

    by_rows = Hermite(times, angles, speeds, constant, constant)
    stated = Hermite(times, angles, speeds, constant, constant, rate * steps, rate * steps**2 / 2)
    # and a speed of 0.15 rad/s, by 3e-17 rad/s, that is 2e-12 rad/s^2
    assert 1e-13 < np.abs(by_rows.motion(t).acceleration - rate).max() < 1e-11
    assert np.abs(stated.motion(t).acceleration - rate).max() < 1e-15
    assert stated.motion(t).angle == pytest.approx(by_rows.motion(t).angle, abs=1e-14)
