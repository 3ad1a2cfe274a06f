"""States that move by a small part of their value."""

import casadi as ca
import numpy as np
import pytest

from ocp import TIME, Bound, Control, Phase, Problem, State, Unverified, certify, joined, solve
from tests.ocp.problems import certified, double_integrator


def moved(origin, *, far=1.0, upper=float("inf"), speed=0.0):
    """A metre from rest to rest, or to and fro under a limit, counted from a far origin."""
    x, v, u = State("x", "m", upper=origin + upper), State("v", "m/s"), Control("u", "m/s^2")
    ends = {x: origin, v: speed}, {x: origin + far, v: -speed}
    move = Phase("move", {x: v, v: u}, *ends, end=1.0)
    return Problem("moved", move, minimise=move.integral(u**2 / 2))


@pytest.mark.parametrize("origin", [0.0, 1e3, 1e6, -1e6])
def test_tolerances_that_see_the_displacement_verify_it(origin):
    certified(moved(origin), 6.0)


@pytest.mark.parametrize("origin", [1e9, -1e12])
def test_a_motion_that_only_its_size_allows_is_refused(origin):
    with pytest.raises(Unverified, match="the replay misses the end state"):
        solve(moved(origin))


@pytest.mark.parametrize("origin", [0.0, 1e6])
def test_a_limit_that_is_near(origin):
    certified(moved(origin, far=0.0, upper=1 / 9, speed=1.0), 4.0)


@pytest.mark.parametrize("apart", [3e-16, 1e-12, 1e-9])
def test_end_values_that_differ_by_rounding_are_one_number(apart):
    # an arm that swings out and back; its end values come from two runs of an iteration
    start = 0.4
    q, w = State("q", "rad"), State("w", "rad/s", lower=-8, upper=8)
    u = Control("u", "N m")
    sill = Bound("over the sill", q - 0.5 * ca.sin(np.pi * TIME), "rad", lower=0)
    ends = {q: start, w: 0}, {q: start * (1 + apart), w: 0}
    swing = Phase("swing", {q: w, w: u - ca.sin(q)}, *ends, end=1.0, bounds=[sill])
    found = solve(Problem("swing", swing, minimise=swing.integral(u**2)))
    assert certify(found).passed


def test_a_joint_that_is_held_has_no_way():
    x, v, u, rates = double_integrator()
    q, w, t = State("q", "rad"), State("w", "rad/s"), Control("t", "N m")
    rates = {q: w, w: t - ca.sin(q) + v, **rates}
    held = Bound("held", w, "rad/s", lower=0, upper=0)
    ends = {q: 0.4, w: 0, x: 0, v: 0}, {q: 0.4 * (1 + 3e-16), w: 0, x: 1, v: 0}
    move = Phase("move", rates, *ends, end=1.0, bounds=[held])
    certified(Problem("held", move, minimise=move.integral(u**2 / 2)), 6.0)


def test_a_displacement_over_several_phases_counts():
    """A metre from rest to rest, of which each phase states one end."""
    x, v, u, rates = double_integrator()
    origin = 1e6
    first = Phase("first", rates, {x: origin, v: 0}, end=0.5)
    second = Phase("second", rates, final={x: origin + 1, v: 0}, start=0.5, end=1.0)
    cost = first.integral(u**2 / 2) + second.integral(u**2 / 2)
    problem = Problem("two", [first, second], minimise=cost, links=joined(first, second))
    certified(problem, 6.0, within=1e-5)
