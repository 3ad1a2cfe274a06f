"""Limits that decide on the objective: a small excess that is worth much of it."""

from __future__ import annotations

import numpy as np
import pytest

from ocp import Control, FixedMesh, Phase, Problem, Settings, State, certify, solve

v, u = State("v", "m/s"), Control("u", "m/s^2")


def landing(height: float, duration: float) -> Problem:
    """A mass that falls at 1 m/s from 0, and has to turn before a floor; then it is free to rise.

    The least effort is 4 / (9 height), with the jerk constant until the floor is touched at rest:
    A. E. Bryson and Y.-C. Ho, "Applied Optimal Control", sec. 3.11, one half of the symmetric
    motion, in which the integrand has a factor of one half.
    """
    x = State("x", "m", lower=-height)
    phase = Phase("land", {x: v, v: u}, {x: 0, v: -1}, end=duration)
    return Problem("landing", phase, minimise=phase.integral(u**2))


@pytest.mark.parametrize("height", [1e-2, 1e-3, 1e-4])
def test_a_floor_far_smaller_than_the_motion_is_kept(height: float) -> None:
    found = solve(landing(height, 10.0))
    assert found.objective == pytest.approx(4 / (9 * height), rel=1e-6)
    times = np.concatenate([np.linspace(0, 20 * height, 20_001), np.linspace(0, 10, 20_001)])
    deepest = -found.sample(found.problem.phases[0].states[0], times).min()
    # the worth of this excess is the same part of the effort
    assert deepest == pytest.approx(height, rel=1e-5)
    assert certify(found).passed


def on_a_fixed_mesh(height: float, duration: float, intervals: int):
    settings = Settings(intervals=intervals, refinement=FixedMesh())
    found = solve(landing(height, duration), settings=settings)
    return found, {check.name: check for check in certify(found).checks}


def test_the_worth_is_what_the_effort_changes_with_the_floor() -> None:
    """The effort is as one over the height, so that their changes are the same parts."""
    found, checks = on_a_fixed_mesh(0.1, 2.0, 10)
    deepest = -found.sample(found.problem.phases[0].states[0], np.linspace(0, 2, 20_001)).min()
    assert checks["effect of the excess"].value == pytest.approx(deepest / 0.1 - 1, rel=0.1)


def test_a_small_excess_of_much_worth_is_not_certified() -> None:
    _, checks = on_a_fixed_mesh(1e-2, 10.0, 40)
    assert checks["path constraints"].value < 1e-5
    assert checks["effect of the excess"].value > 1e-3
    assert not checks["effect of the excess"].passed
