"""The Hamiltonian of a phase against closed forms, and what finer controls gain by it."""

import casadi as ca
import numpy as np
import pytest

from ocp import TIME, Bound, Control, Phase, Problem, Radau, State
from ocp.diagnostics.minimum_principle import minimum_principle
from ocp.mesh.trajectory import Evaluator
from ocp.optimality.active_set import acting_on_states
from ocp.optimality.control_gains import gains
from ocp.optimality.hamiltonian import hamiltonian_of
from ocp.optimality.multipliers import phase_costates
from tests.ocp.problems import double_integrator, least_effort, solved_on


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
