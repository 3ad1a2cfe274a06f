"""Least times from rest and under way, against a linear program that knows no ramps."""

import math

import numpy as np
import pytest
from scipy.optimize import linprog

from models.errors import ModelError
from models.laws import (
    RateCaps,
    Step5,
    UnderWay,
    greatest_start_speed,
    least_cap,
    least_jerk_cap,
    least_peak_acceleration,
    least_time,
)

STEPS = 200
SHORT = 1e-3  # what steps of constant jerk cannot cover of a stroke
LONG = 1e-5  # and what is more, as the speed keeps its cap at the steps only


def longest_stroke(duration: float, caps: RateCaps, start_speed: float) -> float:
    """The longest way to rest in a time, with a jerk that is constant in each of `STEPS`.

    Unknowns are the acceleration at the start and the jerks. Under way the first one is free.
    """
    h = duration / STEPS
    way, speed, acceleration = (np.zeros((STEPS + 1, STEPS + 1)) for _ in range(3))
    acceleration[:, 0] = 1.0
    for k, jerk in enumerate(np.eye(STEPS + 1)[1:]):
        way[k + 1] = way[k] + h * speed[k] + h**2 / 2 * acceleration[k] + h**3 / 6 * jerk
        speed[k + 1] = speed[k] + h * acceleration[k] + h**2 / 2 * jerk
        acceleration[k + 1] = acceleration[k] + h * jerk
    at_ends = [speed[-1], acceleration[-1]] + ([] if start_speed else [acceleration[0]])
    none = np.full(STEPS + 1, start_speed)
    top = np.full(STEPS + 1, min(caps.speed, 1e3) - start_speed)
    most = np.full(2 * STEPS + 2, min(caps.acceleration, 1e6))
    found = linprog(
        -way[-1],
        np.vstack([-speed, speed, acceleration, -acceleration]),
        np.concatenate([none, top, most]),
        np.vstack(at_ends),
        [-start_speed] + [0.0] * (len(at_ends) - 1),
        bounds=[(None, None)] + [(-min(caps.jerk, 1e6), min(caps.jerk, 1e6))] * STEPS,
    )
    assert found.status == 0
    return float(start_speed * duration - found.fun)


@pytest.mark.parametrize("seed", range(12))
def test_least_times_are_those_of_a_linear_program(seed: int) -> None:
    rng = np.random.default_rng(seed)
    speed, acceleration, jerk = 10 ** rng.uniform([-0.3, -1.0, -0.5], [0.7, 1.0, 1.5])
    caps = [
        RateCaps(speed, acceleration, jerk),
        RateCaps(acceleration=acceleration, jerk=jerk),
        RateCaps(jerk=jerk),
        RateCaps(speed, jerk=jerk),
    ][seed % 4]
    fastest = min(greatest_start_speed(1.0, caps), caps.speed)
    start = 0.0 if seed in (0, 5) else rng.uniform(0.0, 1.0) * fastest

    time = least_time(1.0, caps, start)

    assert 1.0 - SHORT < longest_stroke(time, caps, start) < 1.0 + LONG


@pytest.mark.parametrize(
    "caps", [RateCaps(jerk=3.0), RateCaps(acceleration=0.7), RateCaps(math.inf, 0.7, 3.0)]
)
def test_a_start_that_is_too_fast_has_no_time(caps: RateCaps) -> None:
    fastest = greatest_start_speed(1.0, caps)

    assert math.isfinite(least_time(1.0, caps, (1 - 1e-9) * fastest))
    assert math.isinf(least_time(1.0, caps, (1 + 1e-9) * fastest))


def test_least_caps_from_rest_are_the_closed_forms() -> None:
    assert least_cap("jerk", RateCaps(), 1.5, 2.0, 0.0) == pytest.approx(least_jerk_cap(1.5, 2.0))
    found = least_cap("acceleration", RateCaps(jerk=8.0), 1.5, 3.0, 0.0)
    assert found == pytest.approx(least_peak_acceleration(1.5, 3.0, jerk=8.0))


def test_least_acceleration_of_a_motion_under_way() -> None:
    # v0 - A t to zero just at the end of the stroke, then at rest
    assert least_cap("acceleration", RateCaps(), 1.0, 60.0, 0.5) == pytest.approx(0.5**2 / 2)
    # up by A and down again: v0 t + A t^2/2 - A (T - t)^2 / 2 in sum, with v0 + A t = A (T - t)
    A, T, v0 = 0.8, 2.0, 0.5
    t = (A * T - v0) / (2 * A)
    stroke = v0 * t + A * t**2 / 2 + A * (T - t) ** 2 / 2
    assert least_cap("acceleration", RateCaps(), stroke, T, v0) == pytest.approx(A)


def test_a_law_under_way_is_the_sum_of_both() -> None:
    law = UnderWay(Step5(4.0, 0.5, 1.5), start_speed=0.3, fading=2.5)
    time = np.linspace(0.0, 4.0, 4001)
    motion = law.motion(time)

    assert motion.angle[0] == pytest.approx(law.start_angle) == pytest.approx(0.25)
    assert (motion.speed[0], motion.angle[-1], motion.speed[-1]) == (0.3, 1.5, 0.0)
    assert motion.speed.min() >= 0.0
    for rate, of in ((motion.speed, motion.angle), (motion.acceleration, motion.speed)):
        assert np.gradient(of, time)[1:-1] == pytest.approx(rate[1:-1], abs=1e-3)
    assert 2.5 in law.breakpoints
    with pytest.raises(ModelError, match="fading is 0; give a finite value above zero"):
        UnderWay(Step5(4.0, 0.5, 1.5), 0.3, 0.0)
