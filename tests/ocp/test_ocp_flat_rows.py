"""Equations of squares have no multiplier where they are met: that is named, and not certified."""

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ocp import (
    Bound,
    Control,
    IterationLimit,
    NumericalTrouble,
    Phase,
    Problem,
    Settings,
    State,
    certify,
    solve,
)


def signals():
    return State("x"), State("v"), Control("u")


def cubed_end():
    x, v, u = signals()
    move = Phase("move", {x: v, v: u}, {x: 0, v: 0}, {v: 0}, end=1.0)
    goal = Bound("goal", (move.at_end(x) - 1) ** 3, lower=0, upper=0)
    return Problem("cube", move, minimise=move.integral(u**2), bounds=[goal])


def squared_path():
    x, v, u = signals()
    other = Control("w")
    goal = Bound("goal", (u - 2 * other) ** 2, lower=0, upper=0)
    move = Phase("move", {x: v, v: u + other}, {x: 0, v: 0}, {x: 1, v: 0}, end=1.0, bounds=[goal])
    return Problem("path", move, minimise=move.integral(u**2 + 5 * other**2))


@pytest.mark.slow
@pytest.mark.parametrize("problem", [cubed_end, squared_path])
def test_what_has_no_slope_is_named(problem):
    with pytest.raises((NumericalTrouble, IterationLimit), match="'goal' has no slope where it is"):
        solve(problem(), settings=Settings(intervals=10))


@pytest.mark.slow
def test_what_a_square_is_off_by_counts_by_its_worth():
    """The square is met to 1e-10, and so its root to 1e-5, which is most of the error of 2e-5."""
    x, v, u = signals()
    hold = Bound("hold", (u - ca.sin(x)) ** 2, lower=0, upper=0)
    swing = Phase("swing", {x: v, v: u}, {x: 0, v: 1}, end=1.0, bounds=[hold])
    found = solve(Problem("held", swing, minimise=swing.integral(u**2 + x**2)))

    def rates(_, y):
        return [y[1], np.sin(y[0]), np.sin(y[0]) ** 2 + y[0] ** 2]

    expected = solve_ivp(rates, (0, 1), [0, 1, 0], rtol=1e-11, atol=1e-12).y[2, -1]
    right = found.objective == pytest.approx(expected, rel=1e-5)
    assert certify(found).passed == right
