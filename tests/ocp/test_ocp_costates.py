"""Costates against closed forms, in the sign of `ocp.costates`: H = L + lambda . f."""

import numpy as np
import pytest

from ocp import Control, Mesh, Phase, Problem, Settings, State, solve
from ocp.costates import costates
from ocp.guess import start_of
from ocp.ipopt import IpoptOptions, run
from ocp.iterate import decision_vector, trajectory_of
from ocp.mesh import uniform
from ocp.scaling import scales_of
from ocp.transcribe import Method, transcribe

SCHEMES = ["radau", "gauss"]


def adjoints(problem, name, intervals, degree=4):
    """Costates (m, n), states (m, n) and the times (m,) of the collocation points of a solve."""
    start = start_of(problem, {})
    mesh = Mesh((uniform(intervals, degree),))
    made = transcribe(problem, mesh, Method(name), scales_of(problem, start, {}))
    result = run(
        made.program, decision_vector(made, start, {}), made.columns.evaluate({}),
        made.rows.evaluate({}), np.empty(0), IpoptOptions(),
    )  # fmt: skip
    assert result.outcome == "solved"
    own = trajectory_of(made, result.x, {}).phases[0]
    points = made.layouts[0].groups[0].scheme.points
    k, tau = np.repeat(np.arange(intervals), degree), np.tile(points, intervals)
    times = own.breakpoints[k] + tau * np.diff(own.breakpoints)[k]
    return costates(made, result.row_multipliers)[0].local(k, tau), own.local(k, tau), times


@pytest.mark.parametrize("name", SCHEMES)
def test_least_effort(name):
    # min int u^2: u = 6 - 12 t, lambda_v = -2 u, lambda_x' = 0, lambda_v' = -lambda_x
    x, v, u = State("x"), State("v"), Control("u")
    phase = Phase("move", {x: v, v: u}, initial={x: 0, v: 0}, final={x: 1, v: 0})
    found, _, t = adjoints(Problem("p", [phase], minimise=phase.integral(u**2)), name, 5)
    # quadratic program in the space of trial functions: the solver's dual tolerance of 1e-6 of
    # scaled multipliers
    np.testing.assert_allclose(found[:, 0], -24.0, rtol=1e-5)
    np.testing.assert_allclose(found[:, 1], -12 + 24 * t, atol=12e-5)


@pytest.mark.parametrize("name", SCHEMES)
@pytest.mark.parametrize("size", [1e-3, 1.0, 1e4])
def test_lq_regulator(name, size):
    # min int x^2 + u^2, x' = x + u: J = s(t) x^2 and lambda = 2 s x with Riccati's s
    x, u = State("x"), Control("u")
    phase = Phase("lq", {x: x + u}, initial={x: size}, end=3.0)
    problem = Problem("lq", [phase], minimise=phase.integral(x**2 + u**2))
    found, signals, t = adjoints(problem, name, 20)
    w = np.sqrt(2)
    e = np.exp(-2 * w * (3.0 - t))
    s = (1 - e) / ((w - 1) + (w + 1) * e)
    np.testing.assert_allclose(found[:, 0], 2 * s * signals[:, 0], rtol=1e-5, atol=1e-6 * size)


@pytest.mark.parametrize("name", SCHEMES)
def test_maximised_objectives_are_adjoined_as_their_negative(name):
    # max x(1), x' = u <= 1: the minimum of -x(1) falls by 1 for a unit added to x
    x, u = State("x"), Control("u", lower=-1, upper=1)
    phase = Phase("run", {x: u}, initial={x: 0})
    found, _, _ = adjoints(Problem("run", [phase], maximise=3 * phase.at_end(x)), name, 4)
    np.testing.assert_allclose(found[:, 0], -3.0, rtol=1e-6)  # the solver's dual tolerance


@pytest.mark.parametrize("name", SCHEMES)
def test_a_running_total_has_the_weight_of_its_integral_as_costate(name):
    x, v, u = State("x"), State("v"), Control("u")
    phase = Phase("move", {x: v, v: u}, initial={x: 0, v: 0}, final={x: 1, v: 0})
    problem = Problem("squared", [phase], minimise=phase.integral(u**2) ** 2)
    found, _, t = adjoints(problem, name, 5)
    # d(I^2) = 2 I dI with I = 12
    np.testing.assert_allclose(found[:, 2], 24.0, rtol=1e-5)
    np.testing.assert_allclose(found[:, 0], -24.0 * 24, rtol=1e-5)
    np.testing.assert_allclose(found[:, 1], 24 * (-12 + 24 * t), atol=24 * 12e-5)


def test_costates_are_the_slope_of_the_optimum():
    # the change of the optimum with the initial speed is lambda_v(0) = -12 of least effort
    def optimum(speed):
        x, v, u = State("x"), State("v"), Control("u")
        phase = Phase("move", {x: v, v: u}, initial={x: 0, v: speed}, final={x: 1, v: 0})
        problem = Problem("p", [phase], minimise=phase.integral(u**2))
        return solve(problem, settings=Settings(intervals=5)).objective

    step = 1e-3  # the optimum is quadratic in the speed: central differences are exact
    assert (optimum(step) - optimum(-step)) / (2 * step) == pytest.approx(-12.0, rel=1e-6)
