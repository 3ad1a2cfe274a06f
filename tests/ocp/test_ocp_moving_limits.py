"""Limits of controls that change in time, that controls share, and that are sought."""

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve

from ocp import (
    TIME,
    Between,
    Bound,
    Control,
    HermiteSimpson,
    Phase,
    Problem,
    Settings,
    State,
    Unknown,
    solve,
)
from ocp.numerics.piecewise_polynomial import bernstein, elevation
from tests.ocp.problems import certified

X, V, U = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2")


def dash(share, rate, way):
    """Least time over a way from rest to rest, with |u| <= 1 + share sin(rate t)."""
    limit = 1 + share * ca.sin(rate * TIME)
    bounds = [Bound("push", U - limit, upper=0), Bound("brake", U + limit, lower=0)]
    ends, end = ({X: 0, V: 0}, {X: way, V: 0}), Between(0.5, 12)
    phase = Phase("dash", {X: V, V: U}, *ends, end=end, bounds=bounds)
    return Problem("dash", phase, minimise=phase.duration)


def driven_by(share, rate, switch, end):
    """Speed and way at the end of a push at the limit up to a switch, and of a brake behind it."""

    def speed(t):
        return t + share * (1 - np.cos(rate * t)) / rate

    def moment(t):
        return t**2 / 2 + share * (t - np.sin(rate * t) / rate) / rate

    way = 2 * moment(switch) + 2 * speed(switch) * (end - switch) - moment(end)
    return 2 * speed(switch) - speed(end), way


def least_time(share, rate, way):
    """With one switch."""

    def missed(times):
        final_speed, reached = driven_by(share, rate, *times)
        return final_speed, reached - way

    return fsolve(missed, [np.sqrt(way), 2 * np.sqrt(way)], xtol=1e-12)[1]


@pytest.mark.parametrize(
    ("share", "rate", "way"), [(0.5, 3.0, 3.0), pytest.param(0.8, 6.0, 4.0, marks=pytest.mark.slow)]
)
def test_a_control_follows_a_limit_that_waves(share, rate, way) -> None:
    certified(dash(share, rate, way), least_time(share, rate, way), 2e-6)


@pytest.mark.slow
def test_schemes_without_telling_multipliers_are_held_against_a_mesh_of_halves() -> None:
    found = solve(dash(0.5, 3.0, 3.0), settings=Settings(scheme=HermiteSimpson()))
    assert found.objective == pytest.approx(least_time(0.5, 3.0, 3.0), rel=1e-5)


def test_a_peak_relative_to_a_limit_that_waves() -> None:
    """The least largest |u| / (1 + sin(3 t) / 2) over 1 m in 2 s: one switch, both sides equal."""
    limit = 1 + 0.5 * ca.sin(3 * TIME)
    phase = Phase("move", {X: V, V: U}, {X: 0, V: 0}, {X: 1, V: 0}, end=2.0)
    problem = Problem("move", phase, minimise=phase.peak(U / limit, absolute=True))

    switch = brentq(lambda t: driven_by(0.5, 3, t, 2)[0], 0, 2)
    certified(problem, 1 / driven_by(0.5, 3, switch, 2)[1], 2e-6)


@pytest.mark.slow
def test_an_arc_on_a_limit_that_waves_and_holds_a_state() -> None:
    """A drive of at most 2 m/s^2, whose power is limited by 1 + 0.6 sin 3t."""
    fast, push = State("v", "m/s", lower=0), Control("u", "m/s^2", lower=-2, upper=2)
    power = Bound("power", push * fast - 0.6 * ca.sin(3 * TIME), upper=1)
    ends, end = ({X: 0, fast: 0}, {X: 3, fast: 0}), Between(0.5, 9)
    phase = Phase("haul", {X: fast, fast: push}, *ends, end=end, bounds=[power])

    def driven(t, y):
        return [y[1], min(2.0, (1 + 0.6 * np.sin(3 * t)) / max(y[1], 1e-9))]

    at = solve_ivp(driven, (0, 6), [0, 0], rtol=1e-9, atol=1e-12, max_step=0.01, dense_output=True)
    brake = brentq(lambda t: at.sol(t)[0] + at.sol(t)[1] ** 2 / 4 - 3, 0.1, 6)
    problem = Problem("haul", phase, minimise=phase.duration)
    certified(problem, brake + at.sol(brake)[1] / 2, 4e-6)


@pytest.mark.parametrize(("count", "higher"), [(1, 1), (1, 4), (2, 5), (3, 4)])
def test_elevated_coefficients_are_the_same_polynomial(count, higher):
    coefficients = np.arange(1.0, count + 1) ** 2
    tau = np.linspace(0, 1, 7)
    raised = elevation(count, higher) @ coefficients
    assert bernstein(higher, tau) @ raised == pytest.approx(bernstein(count, tau) @ coefficients)


def spring(limited):
    """Rest to rest of a damped mass on a spring within 2 s, by the least largest thrust."""
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2")
    p = Unknown("p", "m/s^2", lower=0, upper=10, guess=5)
    rates, bounds = {x: v, v: u - 0.3 * v - x}, [u <= p, u >= -p] if limited else ()
    move = Phase("move", rates, {x: 0, v: 0}, {x: 1, v: 0}, end=2.0, bounds=bounds)
    return Problem("spring", move, minimise=p if limited else move.peak(u, absolute=True)), u


def least_thrust():
    """Bang-bang with one switch: the end is linear in thrust and switching time alone sets it."""
    slopes = np.array([[0.0, 1.0], [-1.0, -0.3]])
    rates, vectors = np.linalg.eig(slopes)

    def driven(seconds):
        # integral of e^{A s} B over [0, seconds]
        grown = (np.exp(rates * seconds) - 1) / rates
        return (vectors @ np.diag(grown) @ np.linalg.inv(vectors) @ [0, 1]).real

    def end(switch):
        # thrust +1 until the switch, then -1
        return driven(2.0) - 2 * driven(2.0 - switch)

    return 1 / end(brentq(lambda switch: end(switch)[1], 0.0, 2.0, xtol=1e-14))[0]


@pytest.mark.parametrize("limited", [True, False])
def test_a_largest_thrust_takes_few_rounds_and_never_leaks(limited):
    problem, u = spring(limited)
    solution = certified(problem, least_thrust(), 2e-6)
    # point by point it took twelve
    assert len(solution.mesh_iterations) <= 4
    thrust = solution.sample(u, np.linspace(0, 2, 20001))
    assert np.abs(thrust).max() <= solution.objective * (1 + 1e-7)


def test_a_drive_gives_room_to_another_where_they_share_a_limit():
    # the second drive is worth half as much for the first state but pays nothing: all thrust goes
    # to the first as long as it pays, and the sum is always used up
    x, v = State("x"), State("v")
    a, b = Control("a", lower=0, upper=2), Control("b", lower=0, upper=2)
    rates, end = {x: v, v: a + 0.5 * b}, Between(0.1, 9, 2)
    go = Phase("go", rates, {x: 0, v: 0}, {x: 1}, end=end, bounds=[a + b <= 1])
    solution = solve(Problem("go", go, minimise=go.end_time))
    # a = 1, b = 0: x = t^2 / 2
    assert solution.objective == pytest.approx(np.sqrt(2.0), rel=1e-6)
    times = np.linspace(0, solution.objective, 101)
    assert np.all(solution.sample(a, times) + solution.sample(b, times) <= 1 + 1e-7)


def test_a_limit_of_other_signals_keeps_its_points():
    x, v, u = State("x"), State("v"), Control("u", lower=-2, upper=2)
    bounds = [u * v <= 0.5, ca.sin(u) <= 0.9, u - v <= 1]
    move = Phase("move", {x: v, v: u}, {x: 0, v: 0}, {x: 1, v: 0}, end=2.5, bounds=bounds)
    solution = solve(Problem("power", move, minimise=move.integral(u**2)))
    constraints = solution.iterate.transcription.constraints[0]
    assert not any(constraint.of_controls for constraint in constraints)
