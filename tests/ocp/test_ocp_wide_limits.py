"""Limits of plus and minus a million, which many write for none, change no answer."""

import math

import casadi as ca
import numpy as np
import pytest

from ocp import (
    Between,
    Bound,
    Control,
    FixedMesh,
    Phase,
    Problem,
    Settings,
    State,
    Unknown,
    certify,
    joined,
    solve,
)


def signals(wide):
    x, v = State("x", "m", lower=-wide, upper=wide), State("v", "m/s", lower=-wide, upper=wide)
    return x, v, Control("u", "m/s^2", lower=-wide, upper=wide)


def with_a_pause(wide):
    """A metre in a second from rest to rest, with 0.3 s or more in between without a force."""
    x, v, u = signals(wide)
    ends, begins = Between(0, 2, 0.3), Between(0, 2, 0.6)
    push = Phase("push", {x: v, v: u}, {x: 0, v: 0}, end=ends)
    coast = Phase("coast", {x: v, v: 0 * v}, start=ends, end=begins)
    brake = Phase("brake", {x: v, v: u}, final={x: 1, v: 0}, start=begins, end=1.0)
    return Problem(
        "pause",
        (push, coast, brake),
        minimise=push.integral(u**2) + brake.integral(u**2),
        links=(*joined(push, coast), *joined(coast, brake)),
        bounds=[coast.duration >= 0.3],
    )


@pytest.mark.parametrize("wide", [1e3, 1e6, 1e9])
def test_sizes_of_wide_limits_do_not_hide_the_optimum(wide):
    """A force moves the end by (1/2 - t) of it: J is one over the integral of (1/2 - t)^2 there.

    By sizes of 1e6, 12.55 was certified.
    """
    found = solve(with_a_pause(wide))
    assert found.objective == pytest.approx(1.5 / (0.5**3 - 0.15**3), rel=1e-6)
    assert "size" not in found.verdict
    assert certify(found).passed


@pytest.mark.slow
def test_sizes_that_nothing_tells_are_those_of_the_motion():
    """No number of the statement says how far the pendulum goes: 6,600 was certified for 1.1."""
    x, v, u = signals(1e9)
    goal = Unknown("goal", "m", lower=-1e9, upper=1e9)
    move = Phase(
        "move", {x: v, v: u - ca.sin(x)}, {x: 0, v: 0}, {v: 0}, end=Between(0.1, 1e4, guess=1)
    )
    cost = move.integral(u**2) + move.end_time + (goal - 1) ** 2
    found = solve(Problem("lost", move, minimise=cost, bounds=[move.at_end(x) == goal]))
    assert found.objective == pytest.approx(1.1, rel=1e-3)
    assert "size" not in found.verdict
    assert certify(found).passed


@pytest.mark.parametrize("wide", [1e3, 1e6])
def test_wide_limits_of_a_motion_that_only_the_objective_asks_for(wide):
    """From rest at 0 into the deeper of two valleys: 0.99999, at 0, was certified for -0.226."""
    x, v, u = signals(wide)
    move = Phase("move", {x: v, v: u}, {x: 0, v: 0}, {v: 0}, end=2.0)
    goal = move.at_end(x)
    cost = 0.05 * move.integral(u**2) + (goal**2 - 1) ** 2 + 0.3 * goal
    found = solve(Problem("valleys", move, minimise=cost))
    # a move by x takes an effort of 12 x^2 / T^3 at least
    places = np.roots([4, 0, 2 * 0.075 - 4, 0.3]).real
    least = np.min(0.075 * places**2 + (places**2 - 1) ** 2 + 0.3 * places)
    assert found.objective == pytest.approx(least, rel=1e-8)
    assert certify(found).passed


def test_wide_limits_of_a_free_time_that_only_the_objective_asks_for():
    """By sizes of 1e6, 12.24 was certified for 2.94."""

    def aimed(wide):
        x, v, u = signals(wide)
        rates = {x: v, v: u - ca.sin(x)}
        move = Phase("move", rates, {x: 0, v: 0}, {v: 0}, end=Between(0.1, 20))
        cost = move.integral(u**2) + move.end_time + 10 * (move.at_end(x) - 1) ** 2
        return solve(Problem("aimed", move, minimise=cost))

    found = aimed(1e6)
    assert found.objective == pytest.approx(aimed(math.inf).objective, rel=1e-8)
    assert certify(found).passed


def test_wide_limits_of_unknowns_do_not_hide_the_optimum():
    """The middles of their limits were their sizes: 7.73 was certified for 2 sqrt(12)."""
    x, v, u = State("x"), State("v"), Control("u")
    gear, shift = Unknown("gear", lower=0, upper=1e7), Unknown("shift", lower=0, upper=1e6)
    move = Phase("move", {x: v, v: u * gear}, {x: 0, v: 0}, {x: 1, v: 0}, end=1.0)
    cost = move.integral(u**2) + gear**2 + (shift - 1) ** 4
    found = solve(Problem("geared", move, minimise=cost))
    assert found.objective == pytest.approx(2 * math.sqrt(12), rel=1e-6)
    assert certify(found).passed


def test_an_excess_is_no_part_of_a_limit_far_away():
    """Bryson and Denham's ride with a jerk, below 0.12 m: by parts of 1e6 m it leaked 1e-4."""

    def ride(**lower):
        x, v, a = State("x", "m", upper=0.12, **lower), State("v", "m/s"), State("a", "m/s^2")
        jerk = Control("jerk", "m/s^3")
        phase = Phase(
            "ride", {x: v, v: a, a: jerk}, {x: 0, v: 1, a: 0}, {x: 0, v: -1, a: 0}, end=1.0
        )
        return solve(Problem("ride", phase, minimise=phase.integral(jerk**2)))

    without, found = ride(), ride(lower=-1e6)
    assert found.objective == pytest.approx(without.objective, rel=1e-6)
    assert certify(found).passed


def test_a_bound_of_one_number_is_no_part_of_a_limit_far_away():
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2")
    move = Phase("move", {x: v, v: u}, {x: 0, v: 0}, {v: 0}, end=1.0)
    reach = Bound("reach", move.at_end(x) ** 3, "m^3", lower=1.0, upper=1e9)
    found = solve(Problem("reach", move, minimise=move.integral(u**2), bounds=[reach]))
    assert found.objective == pytest.approx(12.0, rel=1e-7)
    assert certify(found).passed


def test_a_motion_of_zero_within_limits_is_certified():
    """Nothing asks for a motion: sizes stay those of the limits."""
    x, v, u = signals(10.0)
    stay = Phase("stay", {x: v, v: u - x}, {x: 0, v: 0}, {v: 0}, end=1.0)
    found = solve(Problem("stay", stay, minimise=1 + stay.integral(u**2 + x**2)))
    assert found.objective == pytest.approx(1.0, rel=1e-9)
    assert certify(found).passed


def test_a_signal_that_rests_within_its_limits_keeps_its_size():
    """A load that never sways, beside a cart that moves."""
    x, v, u = signals(10.0)
    sway, rate = State("sway", "rad", lower=-1, upper=1), State("rate", "rad/s", lower=-1, upper=1)
    rates = {x: v, v: u, sway: rate, rate: -sway}
    move = Phase("move", rates, dict.fromkeys((x, v, sway, rate), 0), {x: 1, v: 0}, end=1.0)
    found = solve(Problem("rest", move, minimise=move.integral(u**2 + sway**2)))
    assert found.objective == pytest.approx(12.0, rel=1e-8)
    assert found.iterate.scales.signals["sway"] == 1.0
    assert certify(found).passed


def test_one_mesh_with_sizes_of_wide_limits_is_not_certified():
    found = solve(with_a_pause(1e6), settings=Settings(refinement=FixedMesh()))
    assert found.objective > 12.4
    certificate = certify(found)
    assert [check.name for check in certificate.checks if check.failed] == ["a second solve"]
    # a second solve takes its sizes from the motion
    best = 1.5 / (0.5**3 - 0.15**3)
    again = solve(found.problem, guess=certificate.start)
    assert again.objective == pytest.approx(best, rel=1e-6)
