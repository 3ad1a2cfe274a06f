"""Kinks times what is never negative: the factor goes inside, and nothing else does."""

import casadi as ca
import numpy as np
import pytest

from ocp import Control, Phase, Problem, State, certify, solve
from ocp.problem.kinks.signal_factors import with_signals_inside

force, speed, mass = symbols = [ca.SX.sym(name) for name in ("force", "speed", "mass")]
SIGNALS = [0, 1, 2]
POSITIVE = [1, 2]  # speed and mass


def top(expression):
    function = ca.Function("f", symbols, [expression])
    names = {ca.OP_FMAX: "fmax", ca.OP_FMIN: "fmin", ca.OP_FABS: "fabs"}
    codes = [function.instruction_id(k) for k in range(function.n_instructions())]
    # the last but one: the last one is the output
    return names.get(codes[-2])


def same_everywhere(one, other):
    points = np.random.default_rng(2).normal(scale=3.0, size=(200, 3))
    points[:, POSITIVE] = np.abs(points[:, POSITIVE])
    both = ca.Function("both", symbols, [one, other])
    return all(float(a) == pytest.approx(float(b), abs=1e-9) for a, b in map(both.call, points))


@pytest.mark.parametrize(
    ("stated", "operation"),
    [
        (ca.fmax(0, force) * speed, "fmax"),
        (speed * ca.fmin(0, force), "fmin"),
        (speed * ca.fabs(force), "fmax"),
        (-2 * ca.fmax(0, force) * speed, "fmin"),
        (3 * speed * ca.fabs(force - mass), "fmax"),
        (ca.fabs(force) * (speed**2 / mass + 1), "fmax"),
        (speed * (mass * ca.fmax(force, -1)), "fmax"),
        (ca.fabs(force) / (mass + 1), "fmax"),
        (speed * (ca.fmax(0, force) / -2), "fmin"),
    ],
    ids=str,
)
def test_a_factor_that_is_never_negative_goes_inside(stated, operation):
    written = with_signals_inside(stated, symbols, SIGNALS, POSITIVE)
    assert top(written) == operation
    assert same_everywhere(written, stated)


@pytest.mark.parametrize(
    "stated",
    [
        ca.fmax(0, mass) * force,
        ca.fmax(0, force) * (speed - mass),
        ca.fmax(0, force) + speed,
        2 * ca.fabs(force),
        mass / ca.fmax(0, force),
    ],
    ids=str,
)
def test_any_other_factor_stays_where_it_is(stated):
    assert with_signals_inside(stated, symbols, SIGNALS, POSITIVE) is stated


def test_without_a_sign_nothing_is_made_anew():
    stated = ca.fmax(0, force) * speed
    assert with_signals_inside(stated, symbols, SIGNALS, []) is stated


def test_a_square_needs_no_limit_and_a_factor_that_is_no_signal_stays_outside():
    stated = ca.fabs(force) * speed**2
    assert top(with_signals_inside(stated, symbols, SIGNALS, [])) == "fmax"
    # as of time, or of constants
    assert with_signals_inside(stated, symbols, [0], []) is stated
    # nor is a kink of what is no signal made one of a signal
    assert with_signals_inside(stated, symbols, [1], [1]) is stated


@pytest.mark.parametrize(
    "cost",
    [
        lambda u, v: ca.fmax(0, u) * v,
        lambda u, v: ca.if_else(u > 0, u * v, 0),
        lambda u, v: ca.fmax(0, u * v),
    ],
    ids=["factor", "choice", "product"],
)
def test_power_of_a_positive_force_alone(cost):
    """1 m from rest to rest in 3 s with |u| <= 1: thrust, coast, and brake for nothing."""
    x, v = State("x", "m"), State("v", "m/s", lower=0)
    u = Control("u", "m/s^2", lower=-1, upper=1)
    move = Phase("move", {x: v, v: u}, {x: 0, v: 0}, {x: 1, v: 0}, end=3.0)
    found = solve(Problem("least", move, minimise=move.integral(cost(u.symbol, v.symbol))))
    # the speed of the coast solves v (3 - v) = 1, and is all that is paid for
    assert found.objective == pytest.approx(((3 - np.sqrt(5)) / 2) ** 2 / 2, rel=3e-6)
    assert certify(found).passed
