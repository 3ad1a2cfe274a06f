"""Smooth expressions that change in next to no time: told like steps, and nothing else is."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest

from ocp import TIME, Control, Phase, Problem, State, StatementWarning, certify, solve
from ocp.numerics.steep_search import may_be_steep, steep_changes
from ocp.optimality.steps import steps_along

X, U = State("x", lower=-2, upper=2), Control("u")

# each goes from one value to another as x changes its sign
STEEP = {
    "tanh": lambda x: ca.tanh(1e7 * x),
    "erf": lambda x: ca.erf(1e7 * x),
    "arctangent": lambda x: ca.atan(1e8 * x),
    "root": lambda x: x / ca.sqrt(x**2 + 1e-14),
    "power": lambda x: x * (x**2 + 1e-14) ** -0.5,
}
SMOOTH = {
    "tanh": lambda x: ca.tanh(100 * x),
    "exponential": lambda x: ca.exp(3 * x),
    "root": lambda x: ca.sqrt(x + 2.5),
    "pole beside it": lambda x: 1 / (1.001 + x),
    "kink": lambda x: ca.sqrt(x**2 + 1e-14),
    "known time": lambda x: ca.tanh(1e7 * (TIME.symbol - 0.7)) * ca.exp(x),
}


def crossing(weight: Any) -> Problem:
    """From -1 to 1 in two seconds, and what counts is when x changes its sign."""
    phase = Phase("go", {X: U}, {X: -1}, {X: 1}, end=2.0)
    cost = phase.integral(ca.exp(-TIME.symbol / 2) * (U**2 + 1.5 * weight(X.symbol)))
    return Problem("crossing", phase, minimise=cost)


@pytest.mark.parametrize("name", STEEP)
def test_what_is_steep_where_the_motion_crosses_is_told(name: str) -> None:
    with pytest.warns(StatementWarning, match="changes in next to no time"):
        found = solve(crossing(STEEP[name]))
    assert "which no derivative shows" in found.verdict
    assert not certify(found).passed


@pytest.mark.parametrize("name", SMOOTH)
def test_what_a_mesh_resolves_and_known_times_are_not(name: str) -> None:
    found = solve(crossing(SMOOTH[name]))
    steps = steps_along(found.problem, found.trajectory, found.evaluator)
    assert not any(step.unseen for step in steps)


def test_sums_and_products_are_not_looked_at() -> None:
    x = ca.SX.sym("x")
    assert not may_be_steep([x * (1 + x) ** 2, ca.fabs(x) - ca.sin(x)])
    assert may_be_steep([x, ca.tanh(x)])


def test_the_rounding_of_an_equation_is_no_change() -> None:
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    function = ca.Function("f", [ca.vertcat(a, b)], [ca.exp(a) - b])
    nowhere, places = np.zeros(2, dtype=bool), np.linspace(0.0, 1.0, 200)

    def found(rounding: float) -> int:
        def symbols(at: np.ndarray) -> np.ndarray:
            return np.column_stack([at, np.exp(at) + rounding * (at > 0.4317)])

        return len(list(steep_changes(function, symbols, places, nowhere, nowhere)))

    assert found(1e-12) == 0
    assert found(1e-3) == 1


def test_the_place_and_the_size_of_a_change() -> None:
    x, u = ca.SX.sym("x"), ca.SX.sym("u")
    function = ca.Function("f", [ca.vertcat(x, u)], [ca.vertcat(3 + ca.tanh(1e9 * x), u * x)])
    places = np.linspace(-1.0, 2.0, 40)
    nowhere = np.zeros(2, dtype=bool)

    def symbols(at):
        return np.column_stack([at - 0.3, np.sign(at - 1.0)])

    (found,) = steep_changes(function, symbols, places, np.array([False, True]), nowhere)
    assert found.place == pytest.approx(0.3, abs=1e-6)
    assert (found.column, found.by_place) == (0, False)
    assert found.size == pytest.approx(2.0 / 4.0, rel=1e-6)


def test_a_slope_between_two_places_that_are_next_to_no_way_apart_is_not_steep() -> None:
    """As in a narrow interval between narrower ones: the short way around it holds all of it."""
    t = ca.SX.sym("t")
    function = ca.Function("f", [t], [ca.tanh(400 * (t - 0.5))])
    close = 0.5 + 1e-6 * np.array([-2.7, -2.6, -2.5, 2.5, 2.6, 2.7])
    places = np.sort(np.concatenate([np.linspace(0.0, 1.0, 9)[[0, 1, 7, 8]], close]))
    place = np.array([True])
    assert not list(steep_changes(function, lambda at: at[:, None], places, ~place, place))
