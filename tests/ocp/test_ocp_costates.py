"""Costates and the Hamiltonian against closed forms; the engine's sign is H = L + lambda . f."""

import math

import casadi as ca
import numpy as np
import pytest

from ocp import (
    TIME,
    Accuracy,
    Bound,
    Control,
    Gauss,
    Ipopt,
    Lobatto,
    Mesh,
    Phase,
    Problem,
    Radau,
    Settings,
    State,
    solve,
)
from ocp.diagnostics.minimum_principle import minimum_principle
from ocp.mesh.mesh import PhaseMesh, uniform
from ocp.mesh.trajectory import Evaluator
from ocp.optimality.active_set import acting_on_states
from ocp.optimality.control_gains import costate_errors, gains
from ocp.optimality.hamiltonian import hamiltonian_of
from ocp.optimality.multipliers import costates, phase_costates, put_costates
from tests.ocp.iterates import iterate_on
from tests.ocp.problems import (
    bryson_denham,
    certified,
    double_integrator,
    least_effort,
    rest_to_rest,
    solved_on,
)

SCHEMES = [Radau(4), Gauss(4)]


def adjoints(problem, scheme, intervals):
    """Costates (m, n), states (m, n) and the times (m,) of the collocation points of a solve."""
    iterate = iterate_on(Mesh((uniform(intervals, scheme.degree),)), problem, scheme)
    phase = iterate.trajectory.phases[0]
    points = scheme.at(scheme.degree).points
    k, tau = np.repeat(np.arange(intervals), points.size), np.tile(points, intervals)
    times = phase.breakpoints[k] + tau * np.diff(phase.breakpoints)[k]
    return costates(iterate)[0].local(k, tau), phase.local(k, tau), times


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


def squared_effort():
    _, _, u, phase = rest_to_rest()
    return Problem("squared", [phase], minimise=phase.integral(u**2) ** 2)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_running_total_has_the_weight_of_its_integral_as_costate(scheme):
    found, _, t = adjoints(squared_effort(), scheme, 5)
    # d(I^2) = 2 I dI with I = 12; of the least effort itself, -24 and -2 u = -12 + 24 t
    np.testing.assert_allclose(found[:, 2], 24.0, rtol=1e-5)
    np.testing.assert_allclose(found[:, 0], -24.0 * 24, rtol=1e-5)
    np.testing.assert_allclose(found[:, 1], 24 * (-12 + 24 * t), atol=24 * 12e-5)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_multipliers_and_costates_are_each_the_inverse_of_the_other(scheme):
    iterate = iterate_on(Mesh((uniform(5, scheme.degree),)), squared_effort(), scheme)
    (found,), made = costates(iterate), iterate.transcription
    rows, points = np.zeros(made.program.rows), scheme.at(scheme.degree).points
    k, tau = np.repeat(np.arange(5), points.size), np.tile(points, 5)
    put_costates(rows, made, 0, 0, found.local(k, tau).reshape(5, points.size, -1))
    (own,) = made.rows.phases
    for ids in (own.defects[0], own.totals):
        wanted = iterate.row_multipliers[ids]
        # rounding of a few products
        np.testing.assert_allclose(rows[ids], wanted, rtol=0, atol=1e-14 * np.abs(wanted).max())


def costate_misses(found):
    """At 1001 times: lambda_x is 18, 0 and -18, lambda_v = -u with u = -6 (1 - 3 t) up to 1/3."""
    t = np.linspace(0, 1, 1001)
    rest = np.minimum(3 * np.minimum(t, 1 - t), 1.0)
    exact = {"x": 18.0 * ((t < 1 / 3) * 1.0 - (t > 2 / 3) * 1.0), "v": 6.0 * (1 - rest)}
    return np.array(
        [
            np.abs(found.costate(name, t) - value) / np.abs(value).max()
            for name, value in exact.items()
        ]
    )


def jumps(found):
    before, between, after = found.costate("x", [0.2, 0.5, 0.8])
    return [before - between, between - after]


def test_bryson_denham_with_breakpoints_where_the_roof_is_met():
    # 30 intervals have them at 1/3 and 2/3, so that no interval holds a jump; the barrier's
    # parameter shows along the arc, where rows are touched without a mass: 1e-12 leaves 3e-5
    found = solved_on(30, bryson_denham(), solver=Ipopt(tolerance=1e-14))
    errors = costate_misses(found)
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
    found = solve(bryson_denham(), settings=settings, mesh=first)
    errors = costate_misses(found)
    np.testing.assert_allclose(jumps(found), 18.0, rtol=1e-4)
    times = np.linspace(0, 1, 1001)
    near = np.minimum(np.abs(times - 1 / 3), np.abs(times - 2 / 3)) < share / 4
    assert errors[:, ~near].max() < most


def filled(lag, price):
    """A vessel that a valve with a lag fills for 1 s; what the valve is left open costs a price.

    The motion is constant for as long as the valve is open. It is to be closed in the end.
    """
    flow, level = State("flow"), State("level")
    valve = Control("valve", lower=0, upper=1)
    rates = {flow: (valve - flow) / lag, level: flow}
    fill = Phase("fill", rates, {flow: 1, level: 0}, end=1.0)
    return Problem("filled", fill, minimise=price * fill.at_end(flow) - fill.at_end(level))


def least(lag, price):
    """The optimum: with ``x' = (u - x) / e`` and ``lambda_y = -1``.

    ``lambda_x = (e + c) exp(-s / e) - e`` at the time ``s`` before the end. It is positive, so that
    the valve is shut, from ``s = e ln(1 + c / e)`` on, and this is what is gained of the level 1.
    """
    return lag * math.log(1.0 + price / lag) - 1.0


def coarse(scheme, problem):
    found = solved_on(5, problem, scheme=scheme, verify=False)
    return found.kept_iterate, found.evaluator


@pytest.mark.parametrize("scheme", [Radau(), Gauss()])
def test_costates_follow_their_equation_through_a_layer(scheme):
    lag, price = 0.02, 0.002
    iterate, evaluator = coarse(scheme, filled(lag, price))
    before_end = np.array([0.2, 0.1, 0.04, 0.02, 0.01, 0.005, 0.0])
    intervals, tau = np.full(before_end.size, 4), 1.0 - 5.0 * before_end
    exact = (lag + price) * np.exp(-before_end / lag) - lag

    of_program = phase_costates(iterate, 0).local(intervals, tau)
    lacking = costate_errors(iterate, evaluator, 0, np.zeros(5, dtype=bool))
    off = np.abs(of_program[:, 0] - exact).max()
    # ten time constants in an interval of four points
    assert off > 0.1 * lag
    left = of_program + lacking.local(intervals, tau)
    np.testing.assert_allclose(left[:, 0], exact, atol=0.03 * lag)
    np.testing.assert_allclose(left[-1], [price, -1.0], atol=1e-9)


def test_nothing_is_found_where_it_says_nothing():
    def largest(iterate, evaluator, acting=(False,) * 5):
        return np.abs(costate_errors(iterate, evaluator, 0, np.array(acting)).values).max()

    assert largest(*coarse(Radau(), filled(0.02, 0.002))) > 0.0
    assert largest(*coarse(Radau(), filled(0.02, 0.002)), acting=(True,) * 5) == 0.0
    # these costates meet the principle on any mesh
    assert largest(*coarse(Lobatto(), filled(0.02, 0.002))) == 0.0


def test_costates_that_are_exact_lack_nothing():
    iterate, evaluator = coarse(Radau(), least_effort())
    assert not acting_on_states(iterate)[0].any()
    lacking = costate_errors(iterate, evaluator, 0, np.zeros(5, dtype=bool))
    # of costates of 24 and 12, to the solver's tolerance
    assert np.abs(lacking.values).max() < 1e-6


@pytest.mark.parametrize(
    ("lag", "price", "intervals"),
    [(0.03, 0.003, 5), (0.01, 0.01, 2), (3e-3, 3e-2, 2), (1e-3, 1e-3, 20), (1e-4, 1e-3, 10)],
)
def test_a_control_leaves_its_bound_in_a_layer_at_the_end(lag, price, intervals):
    # open all the time was called optimal: up to two per cent were lost
    certified(filled(lag, price), least(lag, price), settings=Settings(intervals=intervals))


def iterate_of(problem, intervals=5, **settings):
    return solved_on(intervals, problem, verify=False, **settings).kept_iterate


def gained(iterate):
    """What finer controls gain, where no path constraint acts in any interval."""
    nowhere = np.zeros(iterate.trajectory.phases[0].intervals, dtype=bool)
    return gains(iterate, Evaluator(iterate.problem), 0, nowhere)


def along(iterate, index=0):
    """The Hamiltonian and its values at three instants of every interval."""
    evaluator = Evaluator(iterate.problem)
    hamiltonian = hamiltonian_of(evaluator, iterate.transcription, index)
    count = iterate.trajectory.phases[index].intervals
    intervals, tau = np.repeat(np.arange(count), 3), np.tile([0.1, 0.5, 0.8], count)
    costates = phase_costates(iterate, index)
    values = hamiltonian.along(evaluator, iterate.trajectory, costates, intervals, tau)
    times = iterate.trajectory.phases[index].breakpoints[intervals] + tau / count
    return hamiltonian, values, times


def test_least_effort_in_closed_form():
    # u = 6 - 12 t, lambda_x = -24, lambda_v = -2 u: H = u^2 - 24 v - 2 u^2 = -36, H_u = 0
    hamiltonian, values, t = along(iterate_of(least_effort(piecewise="polynomial")))
    u = 6.0 - 12.0 * t
    assert hamiltonian.autonomous
    # the solver's dual tolerance of 1e-6 of scaled multipliers
    np.testing.assert_allclose(values.value, -36.0, rtol=1e-5)
    np.testing.assert_allclose(values.terms.sum(axis=1), values.value, rtol=1e-12)
    np.testing.assert_allclose(values.terms[:, 0], u**2, atol=1e-5)
    np.testing.assert_allclose(values.slope, 0.0, atol=24e-5)
    np.testing.assert_allclose(values.slope_size[:, 0], np.abs(4.0 * u), atol=24e-5)
    np.testing.assert_allclose(values.curvature, 2.0)


def test_paths_and_their_slopes():
    x, v, u, rates = double_integrator(piecewise="polynomial")
    bounds = [Bound("load", 3.0 * u + x * u, upper=100.0), Bound("speed", v, upper=10.0)]
    phase = Phase("move", rates, {x: 0, v: 0}, {x: 1, v: 0}, end=1.0, bounds=bounds)
    iterate = iterate_of(Problem("loaded", phase, minimise=phase.integral(u**2)))
    hamiltonian, values, _ = along(iterate)
    np.testing.assert_array_equal(hamiltonian.limits_controls, [True, False])
    intervals, tau = np.repeat(np.arange(5), 3), np.tile([0.1, 0.5, 0.8], 5)
    x, v, u = iterate.trajectory.phases[0].local(intervals, tau).T
    np.testing.assert_allclose(values.path, np.column_stack([3.0 * u + x * u, v]), rtol=1e-13)
    np.testing.assert_allclose(values.path_slope[:, 0, 0], 3.0 + x, rtol=1e-13)
    np.testing.assert_array_equal(values.path_slope[:, 1, 0], 0.0)


def test_curvature_of_several_controls():
    x, a, b = State("x"), Control("a"), Control("b")
    phase = Phase("go", {x: a + b}, {x: 0}, {x: 1}, end=1.0)
    cost = 2.0 * a**2 + 3.0 * b**2 + a * b
    _, values, _ = along(iterate_of(Problem("go", [phase], minimise=phase.integral(cost))))
    assert values.curvature.shape == (15, 2, 2)
    np.testing.assert_allclose(
        values.curvature, np.broadcast_to([[4.0, 1.0], [1.0, 6.0]], (15, 2, 2))
    )


@pytest.mark.parametrize("where", ["dynamics", "cost", "path"])
def test_time_makes_a_phase_not_autonomous(where):
    x, u = State("x"), Control("u")
    share = {name: TIME if name == where else 0.0 for name in ("dynamics", "cost", "path")}
    bounds = [Bound("path", u + share["path"], upper=100.0)]
    phase = Phase("go", {x: u + share["dynamics"]}, {x: 0}, {x: 1}, bounds=bounds, end=1.0)
    cost = phase.integral(u**2 + share["cost"])
    hamiltonian, _, _ = along(iterate_of(Problem("go", [phase], minimise=cost)))
    assert not hamiltonian.autonomous


def test_it_is_built_once():
    iterate = iterate_of(least_effort(piecewise="polynomial"))
    evaluator = Evaluator(iterate.problem)
    first = hamiltonian_of(evaluator, iterate.transcription, 0)
    (acting,) = acting_on_states(iterate)
    gains(iterate, evaluator, 0, acting)
    minimum_principle(iterate, evaluator, phase_costates(iterate, 0), 0, acting)
    assert hamiltonian_of(evaluator, iterate.transcription, 0) is first


def test_gain_of_a_piecewise_constant_control_is_what_is_lost():
    # the best N steps have the slope c = 12 / (1 - 1 / N^2) and the objective c
    # each interval of h = 1 / N loses int (u - mean u)^2 dt = c^2 h^3 / 12
    iterate = iterate_of(least_effort(piecewise="constant"), intervals=10)
    found = gained(iterate).sum(axis=(1, 2))
    slope = 12.0 / (1.0 - 1.0 / 10**2)
    assert iterate.objective == pytest.approx(slope, rel=1e-9)
    np.testing.assert_allclose(found, slope**2 / 10**3 / 12.0, rtol=1e-6)
    # which is the gain to first order
    assert found.sum() == pytest.approx(iterate.objective - 12.0, rel=0.02)


def test_an_optimal_control_gains_nothing():
    iterate = iterate_of(least_effort(piecewise="polynomial"))
    # H_u to the solver's dual tolerance, squared
    assert gained(iterate).sum() < 1e-9


@pytest.mark.parametrize("limit", ["bound", "path"])
def test_a_control_at_its_limit_gains_nothing_beyond_it(limit):
    # x' = u with x(1) as large as can be: H = -u, whose slope of -1 presses u against its limit
    upper = 1 if limit == "bound" else 2
    x, u = State("x"), Control("u", lower=-1, upper=upper, piecewise="constant")
    bounds = [Bound("cap", 2.0 * u, upper=2.0)] if limit == "path" else []
    phase = Phase("dash", {x: u}, {x: 0}, bounds=bounds, end=1.0)
    iterate = iterate_of(Problem("dash", [phase], maximise=phase.at_end(x)))
    _, values, _ = along(iterate)
    np.testing.assert_allclose(values.slope, -1.0, rtol=1e-6)
    assert gained(iterate).sum() < 1e-6  # the barrier's distance


def test_a_phase_without_controls_gains_nothing():
    x = State("x")
    phase = Phase("decay", {x: -x}, {x: 1}, end=1.0)
    problem = Problem("decay", [phase], minimise=phase.at_end(x))
    iterate = iterate_of(problem, scheme=Radau(3))
    found = gained(iterate)
    np.testing.assert_array_equal(found.sum(axis=(1, 2)), np.zeros(5))
    hamiltonian, values, t = along(iterate)
    assert hamiltonian.controls == ()
    # lambda = exp(t - 1), x = exp(-t): H = -exp(-1), to the order of three points in 5 intervals
    np.testing.assert_allclose(values.value, -np.exp(-1.0), rtol=1e-4)
    assert values.curvature.shape == (t.size, 0, 0)
    assert isinstance(hamiltonian.function, ca.Function)
