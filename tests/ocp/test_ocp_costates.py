"""Costates against closed forms; in the sign of the engine, H = L + lambda . f."""

import numpy as np
import pytest

from ocp import (
    Accuracy,
    Control,
    FixedMesh,
    Gauss,
    Ipopt,
    Mesh,
    Phase,
    Problem,
    Radau,
    Settings,
    State,
    solve,
)
from ocp.diagnostics.minimum_principle import active_set_changes
from ocp.mesh.initial_guess import initial_guess
from ocp.mesh.mesh import PhaseMesh, uniform
from ocp.nlp.solver import StartingPoint
from ocp.optimality.iterate import iterate_of
from ocp.optimality.multipliers import costates, put_costates
from ocp.problem.parameters import parameters_of
from ocp.scaling.automatic import scales_of
from ocp.transcription.packing import decision_vector, trajectory_of
from ocp.transcription.transcribe import transcribe

SCHEMES = [Radau(4), Gauss(4)]


def solved_once(problem, scheme, intervals):
    """The iterate of one run of the solver on a uniform mesh."""
    parameters = parameters_of(problem)
    guess = initial_guess(problem, parameters)
    scales = scales_of(problem, guess, parameters)
    mesh = Mesh((uniform(intervals, scheme.degree),))
    made = transcribe(problem, mesh, scheme, "automatic", scales)
    limits = made.limits(parameters)
    start = StartingPoint(decision_vector(made, guess, limits, parameters.vector))
    result = Ipopt().solve(made.program, start, limits, parameters.vector)
    assert result.outcome == "solved"
    return iterate_of(made, result, trajectory_of(made, result.x, parameters))


def adjoints(problem, scheme, intervals):
    """Costates (m, n), states (m, n) and the times (m,) of the collocation points of a solve."""
    iterate = solved_once(problem, scheme, intervals)
    phase = iterate.trajectory.phases[0]
    points = scheme.at(scheme.degree).points
    k, tau = np.repeat(np.arange(intervals), points.size), np.tile(points, intervals)
    times = phase.breakpoints[k] + tau * np.diff(phase.breakpoints)[k]
    return costates(iterate)[0].local(k, tau), phase.local(k, tau), times


@pytest.mark.parametrize("scheme", SCHEMES)
def test_least_effort(scheme):
    # min int u^2: u = 6 - 12 t, lambda_v = -2 u, lambda_x' = 0, lambda_v' = -lambda_x
    x, v, u = State("x"), State("v"), Control("u")
    phase = Phase("move", {x: v, v: u}, initial={x: 0, v: 0}, final={x: 1, v: 0}, end=1.0)
    found, _, t = adjoints(Problem("p", [phase], minimise=phase.integral(u**2)), scheme, 5)
    # quadratic program in the space of trial functions: the solver's dual tolerance of 1e-6 of
    # scaled multipliers
    np.testing.assert_allclose(found[:, 0], -24.0, rtol=1e-5)
    np.testing.assert_allclose(found[:, 1], -12 + 24 * t, atol=12e-5)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("size", [1e-3, 1.0, 1e4])
def test_lq_regulator(scheme, size):
    # min int x^2 + u^2, x' = x + u: J = s(t) x^2 and lambda = 2 s x with Riccati's s
    x, u = State("x"), Control("u")
    phase = Phase("lq", {x: x + u}, initial={x: size}, end=3.0)
    problem = Problem("lq", [phase], minimise=phase.integral(x**2 + u**2))
    found, signals, t = adjoints(problem, scheme, 20)
    w = np.sqrt(2)
    e = np.exp(-2 * w * (3.0 - t))
    s = (1 - e) / ((w - 1) + (w + 1) * e)
    np.testing.assert_allclose(found[:, 0], 2 * s * signals[:, 0], rtol=1e-5, atol=1e-6 * size)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_maximised_objectives_are_adjoined_as_their_negative(scheme):
    # max x(1), x' = u <= 1: the minimum of -x(1) falls by 1 for a unit added to x
    x, u = State("x"), Control("u", lower=-1, upper=1)
    phase = Phase("run", {x: u}, initial={x: 0}, end=1.0)
    found, _, _ = adjoints(Problem("run", [phase], maximise=3 * phase.at_end(x)), scheme, 4)
    np.testing.assert_allclose(found[:, 0], -3.0, rtol=1e-6)  # the solver's dual tolerance


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_running_total_has_the_weight_of_its_integral_as_costate(scheme):
    x, v, u = State("x"), State("v"), Control("u")
    phase = Phase("move", {x: v, v: u}, initial={x: 0, v: 0}, final={x: 1, v: 0}, end=1.0)
    problem = Problem("squared", [phase], minimise=phase.integral(u**2) ** 2)
    found, _, t = adjoints(problem, scheme, 5)
    # d(I^2) = 2 I dI with I = 12
    np.testing.assert_allclose(found[:, 2], 24.0, rtol=1e-5)
    np.testing.assert_allclose(found[:, 0], -24.0 * 24, rtol=1e-5)
    np.testing.assert_allclose(found[:, 1], 24 * (-12 + 24 * t), atol=24 * 12e-5)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_multipliers_and_costates_are_each_the_inverse_of_the_other(scheme):
    x, v, u = State("x"), State("v"), Control("u")
    phase = Phase("move", {x: v, v: u}, initial={x: 0, v: 0}, final={x: 1, v: 0}, end=1.0)
    iterate = solved_once(
        Problem("squared", [phase], minimise=phase.integral(u**2) ** 2), scheme, 5
    )
    (found,), made = costates(iterate), iterate.transcription
    rows, points = np.zeros(made.program.rows), scheme.at(scheme.degree).points
    k, tau = np.repeat(np.arange(5), points.size), np.tile(points, 5)
    put_costates(rows, made, 0, 0, found.local(k, tau).reshape(5, points.size, -1))
    (own,) = made.rows.phases
    for ids in (own.defects[0], own.totals):
        wanted = iterate.row_multipliers[ids]
        # rounding of a few products
        np.testing.assert_allclose(rows[ids], wanted, rtol=0, atol=1e-14 * np.abs(wanted).max())


def test_costates_are_the_slope_of_the_optimum():
    # the change of the optimum with the initial speed is lambda_v(0) = -12 of least effort
    def optimum(speed):
        x, v, u = State("x"), State("v"), Control("u")
        phase = Phase("move", {x: v, v: u}, initial={x: 0, v: speed}, final={x: 1, v: 0}, end=1.0)
        problem = Problem("p", [phase], minimise=phase.integral(u**2))
        return solve(problem, settings=Settings(intervals=5)).objective

    step = 1e-3  # the optimum is quadratic in the speed: central differences are exact
    assert (optimum(step) - optimum(-step)) / (2 * step) == pytest.approx(-12.0, rel=1e-6)


def bryson_denham(settings, mesh=None):
    """l = 1/9: lambda_x is 18, 0 and -18, lambda_v = -u with u = -6 (1 - 3 t) up to t = 1/3."""
    x, v, u = State("x", "m", upper=1 / 9), State("v", "m/s"), Control("u", "m/s^2")
    phase = Phase("hop", {x: v, v: u}, {x: 0, v: 1}, {x: 0, v: -1}, end=1.0)
    problem = Problem("hop", [phase], minimise=phase.integral(u**2 / 2))
    found = solve(problem, settings=settings, mesh=mesh)
    own = found.trajectory.phases[0]
    t = np.linspace(0, 1, 1001)
    rest = np.minimum(3 * np.minimum(t, 1 - t), 1.0)
    exact = 18.0 * ((t < 1 / 3) * 1.0 - (t > 2 / 3) * 1.0), 6.0 * (1 - rest)
    errors = [
        np.abs(found.costate(name, t) - value) / np.abs(value).max()
        for name, value in zip("xv", exact, strict=True)
    ]
    k, _ = own.locate(t)
    return found, np.array(errors), active_set_changes(found.kept_iterate, 0)[k]


def jumps(found):
    before, between, after = found.costate("x", [0.2, 0.5, 0.8])
    return [before - between, between - after]


def test_bryson_denham_with_breakpoints_where_the_roof_is_met():
    # 30 intervals have them at 1/3 and 2/3, so that no interval holds a jump; the barrier's
    # parameter shows along the arc, where rows are touched without a mass: 1e-12 leaves 3e-5
    settings = Settings(intervals=30, refinement=FixedMesh(), solver=Ipopt(tolerance=1e-14))
    found, errors, _ = bryson_denham(settings)
    np.testing.assert_allclose(jumps(found), 18.0, rtol=1e-5)
    t = np.linspace(0, 1, 1001)
    beside = np.minimum(np.abs(t - 1 / 3), np.abs(t - 2 / 3)) > 1e-9
    assert errors[:, beside].max() < 1e-5


@pytest.mark.parametrize(
    ("objective", "barrier", "uneven", "share", "most"),
    # the defaults; stricter ones; the same where thirds of equal intervals end at the jumps
    [(1e-6, 1e-10, 1.1, 0.25, 2e-4), (1e-9, 1e-13, 1.1, 0.25, 5e-5), (1e-9, 1e-13, 1, 0.35, 1e-5)],
)
def test_bryson_denham_on_a_mesh_that_finds_the_jumps(objective, barrier, uneven, share, most):
    # where the objective may be 1e-6 off a switch may, too; the barrier's parameter acts as above
    settings = Settings(accuracy=Accuracy(objective=objective), solver=Ipopt(tolerance=barrier))
    first = Mesh((PhaseMesh(np.linspace(0.0, 1.0, 21) ** uneven, 4),))
    found, errors, _ = bryson_denham(settings, first)
    np.testing.assert_allclose(jumps(found), 18.0, rtol=1e-4)
    times = np.linspace(0, 1, 1001)
    near = np.minimum(np.abs(times - 1 / 3), np.abs(times - 2 / 3)) < share / 4
    assert errors[:, ~near].max() < most
