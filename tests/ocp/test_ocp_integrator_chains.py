"""Shapes of controls: on chains of integrators, in curved limits, and in equations of motion."""

import casadi as ca
import numpy as np
import pytest

from ocp import (
    Accuracy,
    Between,
    Bound,
    Constant,
    Control,
    Gauss,
    Lobatto,
    Overdetermined,
    Phase,
    Problem,
    Radau,
    Settings,
    State,
    Trapezoid,
    solve,
)
from ocp.problem.integrator_chains import chain_length, variation_of
from tests.ocp.problems import certified, solved_on


def phase(rates):
    return Phase("p", rates, {}, {}, start=0, end=1)


def test_lengths_of_chains():
    x, v, a, u, w = State("x"), State("v"), State("a"), Control("u"), Control("w")
    gain = Constant("gain", value=2.0)
    assert chain_length(phase({x: v, v: a, a: u}), u) == 3
    assert chain_length(phase({a: 3 * u.symbol + 1, v: -2 * a.symbol, x: v}), u) == 3
    assert chain_length(phase({x: v, v: ca.sin(x) + u}), u) == 0
    assert chain_length(phase({x: ca.cos(v), v: u}), u) == 1
    assert chain_length(phase({x: v, v: u, a: u}), u) == 0  # acts on two states
    assert chain_length(phase({x: v, v: u + w}), u) == 0
    assert chain_length(phase({x: v, v: gain * u}), u) == 2
    assert chain_length(phase({x: v, v: u * u}), u) == 0


def test_automatic_is_linear_only_where_that_is_exact():
    x, v, a, u = State("x"), State("v"), State("a"), Control("u")

    def shape(control, rates, default, scheme, least_degree):
        p = phase(rates)
        problem = Problem("p", p, minimise=p.integral(control**2))
        return variation_of(problem, p, control, default, scheme, least_degree)

    rates = {x: v, v: a, a: u}
    assert shape(u, rates, "automatic", Radau(), 4) == "linear"
    assert shape(u, rates, "automatic", Radau(), 3) == "polynomial"
    assert shape(u, rates, "automatic", Trapezoid(), 2) == "polynomial"
    assert shape(u, rates, "constant", Radau(), 4) == "constant"
    stated = Control("u", piecewise="polynomial")
    assert shape(stated, {x: v, v: stated}, "linear", Radau(), 4) == "polynomial"


@pytest.mark.parametrize("scheme", [Radau(), Gauss(), Lobatto()])
def test_the_chain_is_integrated_without_error_on_any_mesh(scheme):
    x, v, a, u = State("x"), State("v"), State("a"), Control("u", lower=-60, upper=60)
    move = Phase("move", {x: v, v: a, a: u}, {x: 0, v: 0, a: 0}, {x: 1, v: 0, a: 0}, end=1)
    found = solved_on(7, Problem("jerk", move, minimise=move.integral(u**2)), scheme=scheme)
    assert max(r.dynamics_error for r in found.mesh_iterations) <= 1e-12
    # u = 60 - 360 t + 360 t^2 costs 720; a linear control on 7 intervals costs a little more
    assert 720 <= found.objective <= 720 * 1.01
    ends = np.array([found.sample(s, [1.0])[0] for s in (x, v, a)])
    np.testing.assert_allclose(ends, [1, 0, 0], atol=1e-9)


def in_the_plane(limit):
    """Two controls that each drive two integrators, and a limit of both."""
    states = [State(name) for name in ("x", "y", "v", "w")]
    a, b = Control("a"), Control("b")
    rates = dict(zip(states, (*states[2:], a, b), strict=True))
    bounds = [limit(a, b, states[2])]
    start = dict(zip(states, (0, 0, -0.25, 0.5), strict=True))
    final = dict(zip(states, (1, 0.5, 0, 0), strict=True))
    p = Phase("p", rates, start, final, end=Between(0.5, 20), bounds=bounds)
    return Problem("plane", p, minimise=p.end_time)


@pytest.mark.parametrize(
    ("limit", "shape"),
    [
        (lambda a, b, v: a**2 + b**2 <= 1, "polynomial"),
        (lambda a, b, v: a * b <= 1, "linear"),
        (lambda a, b, v: a + b <= 1, "linear"),
        (lambda a, b, v: a**2 <= 1, "linear"),
        (lambda a, b, v: a**2 + b**2 + v <= 1, "linear"),
        (lambda a, b, v: ca.fabs(a) + ca.fabs(b) <= 1, "linear"),
    ],
    ids=["circle", "product", "line", "of one", "of a state", "rhombus"],
)
def test_controls_in_a_curved_limit_are_no_lines(limit, shape):
    problem = in_the_plane(limit)
    (p,) = problem.phases
    control = problem.controls["p"][0]
    assert variation_of(problem, p, control, "automatic", Radau(), 4) == shape


def test_the_fastest_turn_within_a_circle_is_certified():
    # by default a solve may end 1e-6 above the optimum, or a little less, as rounding has it
    settings = Settings(accuracy=Accuracy(objective=1e-7))
    problem = in_the_plane(lambda a, b, v: a**2 + b**2 <= 1)
    certified(problem, 2.30193243, within=2e-7, settings=settings)


def pendulum(implicit, piecewise=None):
    """A pendulum swung to the side and stopped there, with the least effort."""
    q, w = State("q", "rad"), State("w", "rad/s")
    u = Control("u", "rad/s^2", lower=-20, upper=20, piecewise=piecewise)
    a = Control("a", "rad/s^2", piecewise=piecewise)
    pull = u - 9.81 * ca.sin(q)
    rates = {q: w, w: a if implicit else pull}
    bounds = [Bound("motion", a - pull, lower=0, upper=0)] if implicit else []
    swing = Phase("swing", rates, {q: 0, w: 0}, {q: 1, w: 0}, end=1.0, bounds=bounds)
    return Problem("pendulum", swing, minimise=swing.integral(u**2))


def test_a_control_that_an_equation_determines_has_a_value_at_each_point():
    explicit, implicit = solve(pendulum(False)), solve(pendulum(True))
    # both are within their tolerance of 1e-6 of the same optimum
    assert implicit.objective == pytest.approx(explicit.objective, rel=2e-6)
    at = np.linspace(0, 1, 11)
    assert implicit.sample("q", at) == pytest.approx(explicit.sample("q", at), abs=1e-4)


def test_where_it_has_not_the_message_says_how_to_state_it():
    # four points of an interval, and one level each of torque and acceleration
    words = r"in an equation of phase 'swing'.*declare it as Algebraic\("
    with pytest.raises(Overdetermined, match=words):
        solve(pendulum(True, piecewise="constant"))
