"""Least peak acceleration of a rotation with capped jerk, against its closed form."""

import math
import re

import numpy as np
import pytest

from ocp import AdaptiveMesh, Control, Phase, Problem, Radau, Settings, State, solve

DURATION = 140.0  # s
TURN = math.pi / 2 - math.radians(4.4)  # rad


def least_peak(jerk):
    """Bang-zero-bang jerk: ``A = (J T/4) (1 - sqrt(1 - 32 D / (J T^3)))``."""
    return jerk * DURATION / 4 * (1 - math.sqrt(1 - 32 * TURN / (jerk * DURATION**3)))


def turn(cap):
    """The problem and its control."""
    angle, rate, acceleration = State("angle", "rad"), State("rate"), State("acceleration")
    jerk = Control("jerk", "rad/s^3", lower=-cap, upper=cap, piecewise="constant")
    rest = {rate: 0.0, acceleration: 0.0}
    phase = Phase(
        "turn",
        {angle: rate, rate: acceleration, acceleration: jerk},
        initial={angle: 0.0, **rest},
        final={angle: TURN, **rest},
        end=DURATION,
    )
    return Problem("least peak", [phase], minimise=phase.peak(acceleration, absolute=True)), jerk


@pytest.mark.parametrize("intervals", [6, 20, 21, 100, 101])
@pytest.mark.parametrize("dimensionless_jerk", [69.0, 124.2192, 300.0, 1000.0])
def test_peak_acceleration_under_a_jerk_cap(dimensionless_jerk, intervals):
    cap = dimensionless_jerk / DURATION**3
    problem, jerk = turn(cap)
    found = solve(problem, settings=Settings(scheme=Radau(3), intervals=intervals))
    # switches far inside an interval are closed in on by halves, not by the width of a bracket
    assert len(found.mesh_iterations) <= 12
    assert found.verdict == "local: best of 1 start; not confirmed (ocp.certify)"
    # 1e-5: the objective tolerance that `Settings` promises
    assert found.objective == pytest.approx(least_peak(cap), rel=1e-5)
    # piecewise constant jerk on an exact chain: between the points nothing can exceed the peak by
    # more than the path tolerance of 1e-7 of `Settings`, with a factor 10 of the verification
    ((_, stated, dense),) = found.verification.peaks
    assert dense == pytest.approx(stated, rel=1e-6)
    # polynomials of degree 3 are exact: round-off and the solver's 1e-10 are left
    assert np.abs(found.replay.phases[0].miss).max() < 1e-8
    held = found.sample(jerk, np.linspace(0.0, DURATION, 1001))
    assert np.abs(held).max() <= cap * (1 + 1e-9)  # the cap itself: round-off of a bound


def test_a_limit_of_rounds_is_told_and_met_by_a_precise_solve():
    cap = 1000.0 / DURATION**3
    found = solve(
        turn(cap)[0], settings=Settings(scheme=Radau(3), refinement=AdaptiveMesh(rounds=2))
    )
    assert re.fullmatch(
        r"local: best of 1 start; refinement ended after 3 mesh iterations: finer controls "
        r"may improve it by \de-0[12]; not confirmed \(ocp\.certify\)",
        found.verdict,
    )
    assert found.objective > least_peak(cap) * 1.01
    assert np.abs(found.replay.phases[0].miss).max() < 1e-10
