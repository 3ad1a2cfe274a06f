"""Sizes that are stated, and more than the motion has."""

import pytest

from ocp import Control, Phase, Problem, State, certify, solve


def ride(problem_scale=None, **control):
    """Bryson and Denham's ride, whose optimum is 4."""
    x, v, u = State("x", upper=1 / 9), State("v"), Control("thrust", "N", **control)
    phase = Phase("ride", {x: v, v: u}, {x: 0, v: 1}, {x: 0, v: -1}, end=1.0)
    effort = phase.integral(u**2 / 2)
    return solve(Problem("ride", phase, minimise=effort, scale=problem_scale))


def refused(solution):
    return [check.name for check in certify(solution).checks if not check.passed]


def test_a_size_that_is_near_is_as_good():
    found = ride(1e3, scale=1e3)
    assert found.objective == pytest.approx(4.0, rel=1e-5)
    assert not refused(found)


def test_a_signal_that_rests_keeps_its_stated_size():
    """A load that never sways, beside a cart that moves, and a force that is not needed."""
    x, v, u = State("x"), State("v"), Control("u")
    sway, rate = State("sway", scale=0.1), State("rate", scale=0.1)
    trim = Control("trim", lower=-10, upper=10, scale=10.0)
    rates = {x: v, v: u, sway: rate, rate: trim - sway}
    move = Phase("move", rates, dict.fromkeys((x, v, sway, rate), 0), {x: 1, v: 0}, end=1.0)
    cost = move.integral(u**2 + trim**2)
    found = solve(Problem("rest", move, minimise=cost, scale=12.0))
    assert found.objective == pytest.approx(12.0, rel=1e-8)
    assert not refused(found)


def test_an_optimum_of_zero_is_no_objective_of_the_wrong_size():
    x, v, u = State("x", scale=2.0), State("v"), Control("u")
    back = Phase("back", {x: v, v: u}, {x: 0, v: 0}, {v: 0}, end=1.0)
    found = solve(Problem("back", back, minimise=back.integral(u**2 + x**2), scale=5.0))
    assert found.objective == pytest.approx(0.0, abs=1e-8)
    assert not refused(found)
