"""States that move by a small part of their value."""

import casadi as ca
import numpy as np
import pytest

from ocp import (
    TIME,
    Bound,
    Control,
    Phase,
    Problem,
    State,
    Unverified,
    certify,
    joined,
    solve,
)


def moved(origin, *, far=1.0, slope=0.0, upper=float("inf"), speed=0.0):
    """A metre from rest to rest, or to and fro under a limit, counted from a far origin."""
    x, v, u = State("x", "m", upper=origin + upper), State("v", "m/s"), Control("u", "m/s^2")
    move = Phase(
        "move",
        {x: v, v: u - slope * ca.sin(x - origin)},
        {x: origin, v: speed},
        {x: origin + far, v: -speed},
        end=1.0,
    )
    return Problem("moved", move, minimise=move.integral(u**2 / 2))


@pytest.mark.parametrize("origin", [0.0, 1e3, 1e6, 1e8, -1e6])
def test_tolerances_that_see_the_displacement_verify_it(origin):
    found = solve(moved(origin))
    assert found.objective == pytest.approx(6.0, rel=1e-6)
    assert certify(found).passed


@pytest.mark.parametrize("origin", [1e9, 1e10, -1e12])
def test_a_motion_that_only_its_size_allows_is_refused(origin):
    with pytest.raises(Unverified, match="measure 'x' from a nearer origin") as told:
        solve(moved(origin))
    # it stays where it is
    assert told.value.iterate.objective == pytest.approx(0.0, abs=1e-6)


@pytest.mark.slow
def test_curved_dynamics_are_refused_as_well():
    with pytest.raises(Unverified, match="measure 'x' from a nearer origin"):
        solve(moved(1e8, slope=1.0))


@pytest.mark.parametrize("origin", [0.0, 1e6])
def test_a_limit_that_is_near(origin):
    found = solve(moved(origin, far=0.0, upper=1 / 9, speed=1.0))
    assert found.objective == pytest.approx(4.0, rel=1e-6)
    assert certify(found).passed


def test_a_value_that_hardly_changes_and_is_exact_passes():
    # a tank from which a billionth is used
    m, x, v, u = State("m", "kg"), State("x", "m"), State("v", "m/s"), Control("u", "m/s^2")
    move = Phase(
        "move",
        {x: v, v: u, m: -1e-6 + 0 * u},
        {x: 0, v: 0, m: 1000},
        {x: 1, v: 0, m: 1000 - 1e-6},
        end=1.0,
    )
    found = solve(Problem("tank", move, minimise=move.integral(u**2 / 2)))
    assert found.objective == pytest.approx(6.0, rel=1e-8)
    assert certify(found).passed


@pytest.mark.parametrize("apart", [3e-16, 1e-12, 1e-9])
def test_end_values_that_differ_by_rounding_are_one_number(apart):
    # an arm that swings out and back; its end values come from two runs of an iteration
    start = 0.4
    q, w = State("q", "rad"), State("w", "rad/s", lower=-8, upper=8)
    u = Control("u", "N m")
    swing = Phase(
        "swing",
        {q: w, w: u - ca.sin(q)},
        {q: start, w: 0},
        {q: start * (1 + apart), w: 0},
        end=1.0,
        bounds=[Bound("over the sill", q - 0.5 * ca.sin(np.pi * TIME), "rad", lower=0)],
    )
    found = solve(Problem("swing", swing, minimise=swing.integral(u**2)))
    assert certify(found).passed


def test_a_joint_that_is_held_has_no_way():
    q, w, x, v = State("q", "rad"), State("w", "rad/s"), State("x", "m"), State("v", "m/s")
    t, u = Control("t", "N m"), Control("u", "m/s^2")
    start = {q: 0.4, w: 0, x: 0, v: 0}
    move = Phase(
        "move",
        {q: w, w: t - ca.sin(q) + v, x: v, v: u},
        start,
        {q: 0.4 * (1 + 3e-16), w: 0, x: 1, v: 0},
        end=1.0,
        bounds=[Bound("held", w, "rad/s", lower=0, upper=0)],
    )
    found = solve(Problem("held", move, minimise=move.integral(u**2 / 2)))
    assert found.objective == pytest.approx(6.0, rel=1e-6)
    assert certify(found).passed


def in_two_phases(origin):
    """A metre from rest to rest, of which each phase states one end."""
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2")
    rates = {x: v, v: u}
    first = Phase("first", rates, {x: origin, v: 0}, end=0.5)
    second = Phase("second", rates, final={x: origin + 1, v: 0}, start=0.5, end=1.0)
    cost = first.integral(u**2 / 2) + second.integral(u**2 / 2)
    return Problem("two", [first, second], minimise=cost, links=joined(first, second))


def apart(origin):
    """A metre at least, by a bound of the problem."""
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2")
    move = Phase("move", {x: v, v: u}, {x: origin, v: 0}, {v: 0}, end=1.0)
    bound = Bound("way", move.at_end(x) - move.at_start(x), "m", lower=1)
    return Problem("apart", move, minimise=move.integral(u**2 / 2), bounds=[bound])


def test_a_displacement_over_several_phases_counts():
    found = solve(in_two_phases(1e8))
    assert found.objective == pytest.approx(6.0, rel=1e-5)
    with pytest.raises(Unverified, match="'x' in phase 'second' is off by") as told:
        solve(in_two_phases(1e10))
    # it stays where it is
    assert told.value.iterate.objective == pytest.approx(0.0, abs=1e-6)


def test_a_displacement_that_a_bound_states_counts():
    found = solve(apart(0.0))
    assert found.objective == pytest.approx(6.0, rel=1e-6)
    assert certify(found).passed
