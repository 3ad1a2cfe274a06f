"""Collocation schemes: what defines their nodes, and that they converge as declared."""

from functools import cache

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from ocp import Control, Phase, Problem, Settings, State, solve
from ocp.numerics.piecewise_polynomial import derivative_matrix, lagrange, quadrature_weights
from ocp.numerics.schemes import HermiteSimpson, Lobatto, Radau, Trapezoid
from tests.ocp.named_schemes import scheme_named
from tests.ocp.problems import least_effort, solved_on

ALL = [
    *[("radau", s) for s in range(2, 9)],
    *[("gauss", s) for s in range(1, 9)],
    *[("lobatto", s) for s in range(2, 9)],
    ("hermite-simpson", 3),
    ("trapezoid", 2),
]
# Polynomials of degree up to 16 on [0, 1] and well-spread points: round-off, amplified by the
# condition of the interpolation (below 1e3 for these degrees).
ROUND_OFF = 1e-12


@pytest.mark.parametrize(("name", "degree"), ALL)
def test_quadrature_is_exact_up_to_the_order_and_no_further(name, degree):
    method = scheme_named(name, degree).at(degree)
    for power in range(method.order):
        assert method.weights @ method.points**power == pytest.approx(
            1 / (power + 1), abs=ROUND_OFF
        )
    # the error of the first power it misses is 1 / binomial-like: far above round-off
    miss = method.weights @ method.points**method.order - 1 / (method.order + 1)
    assert abs(miss) > 100 * np.finfo(float).eps


@pytest.mark.parametrize(("name", "degree"), ALL)
def test_points_lie_inside_and_increase(name, degree):
    method = scheme_named(name, degree).at(degree)
    assert method.points.shape == method.weights.shape == (method.degree,)
    assert method.support.shape == method.end.shape == (method.degree + 1,)
    assert np.all(np.diff(method.points) > 0)
    assert np.all(np.diff(method.support) > 0)
    assert method.support[0] == 0.0
    assert 0.0 <= method.points[0] <= method.points[-1] <= 1.0
    assert np.all(method.weights > 0)
    np.testing.assert_array_equal(method.support[method.own], method.points)
    assert method.ends_on_support == (method.points[-1] == 1.0)


@pytest.mark.parametrize(("name", "degree"), ALL)
def test_derivative_and_end_value_are_exact_for_the_state_polynomial(name, degree):
    method = scheme_named(name, degree).at(degree)
    for power in range(method.degree + 1):
        values = method.support**power
        slope = power * method.points ** max(power - 1, 0)
        # the derivative matrix has entries up to degree^2: two more digits of round-off
        np.testing.assert_allclose(method.derivative @ values, slope, atol=100 * ROUND_OFF)
        assert method.end @ values == pytest.approx(1.0, abs=ROUND_OFF)


@pytest.mark.parametrize("degree", range(2, 9))
@pytest.mark.parametrize(("ours", "theirs"), [("radau", "radau"), ("gauss", "legendre")])
def test_points_agree_with_casadi(ours, theirs, degree):
    # CasADi tabulates its points to 16 digits
    np.testing.assert_allclose(
        scheme_named(ours, degree).at(degree).points,
        ca.collocation_points(degree, theirs),
        atol=1e-15,
    )


def test_named_schemes_are_the_textbook_ones():
    trapezoid, simpson = Trapezoid().at(7), HermiteSimpson().at(7)
    assert trapezoid.order == 2
    assert simpson.order == 4
    np.testing.assert_allclose(trapezoid.points, [0, 1], atol=0)
    np.testing.assert_allclose(trapezoid.weights, [1 / 2, 1 / 2], rtol=1e-15)
    np.testing.assert_allclose(simpson.points, [0, 1 / 2, 1], rtol=1e-15)
    np.testing.assert_allclose(simpson.weights, [1 / 6, 4 / 6, 1 / 6], rtol=1e-14)

    assert Lobatto(3).at(3).points == pytest.approx(simpson.points)
    np.testing.assert_allclose(Radau().at(2).points, [1 / 3, 1], rtol=1e-15)
    np.testing.assert_allclose(Radau().at(2).weights, [3 / 4, 1 / 4], rtol=1e-14)


supports = st.lists(st.integers(0, 40), min_size=2, max_size=8, unique=True).map(
    lambda k: np.sort(np.array(k)) / 40.0
)


@given(support=supports, at=st.floats(-0.2, 1.2))
def test_lagrange_basis_is_a_partition_of_unity(support, at):
    basis = lagrange(support, np.array([at]))[0]
    # barycentric formula: round-off grows with the largest basis value (Lebesgue's function)
    assert basis.sum() == pytest.approx(1.0, abs=1e-14 * np.abs(basis).sum() * support.size)


@given(support=supports, at=st.floats(0.0, 1.0), power=st.integers(0, 7))
def test_interpolation_reproduces_polynomials(support, at, power):
    power = min(power, support.size - 1)
    basis = lagrange(support, np.array([at]))[0]
    tolerance = 1e-13 * np.abs(basis).sum()  # round-off times Lebesgue's function
    assert basis @ support**power == pytest.approx(at**power, abs=tolerance)


@given(support=supports)
def test_derivative_of_a_constant_vanishes(support):
    matrix = derivative_matrix(support, np.array([0.1, 0.77]))
    # rows add up entries of alternating sign: round-off of the largest one
    assert np.abs(matrix.sum(axis=1)).max() <= 1e-11 * np.abs(matrix).max()


@given(support=supports)
def test_quadrature_on_any_points_integrates_their_polynomials(support):
    weights = quadrature_weights(support)
    for power in range(support.size):
        tolerance = 1e-13 * np.abs(weights).sum()  # round-off times the size of the weights
        assert weights @ support**power == pytest.approx(1 / (power + 1), abs=tolerance)


class Chebyshev(Radau):
    """Points of Chebyshev, the end among them; a user's own scheme."""

    name = "chebyshev"

    @classmethod
    def points_and_order(cls, degree):
        points = 0.5 - 0.5 * np.cos(np.pi * np.arange(1, degree + 1) / degree)
        return points, degree


def test_a_scheme_of_ones_own_solves():
    found = solve(least_effort(), settings=Settings(scheme=Chebyshev(4)))
    assert found.objective == pytest.approx(12)


@pytest.mark.parametrize("accuracy", [1e-3, 1e-4])
@pytest.mark.parametrize("scheme", [Trapezoid(), HermiteSimpson(), Lobatto()], ids=repr)
def test_a_scheme_without_estimates_states_no_more_than_two_meshes_tell(scheme, accuracy):
    """Its multipliers estimate no gain, so that a mesh of half the intervals has to tell."""
    way, speed = State("way", "m"), State("speed", "m/s")
    pull = Control("pull", "m/s^2", lower=-2, upper=1)
    drive = Phase(
        "drive", {way: speed, speed: pull}, initial={way: 0, speed: 0}, final={speed: 0}, end=6
    )
    problem = Problem("longest way", drive, maximise=drive.at_end(way))

    found = solve(problem, settings=Settings(scheme=scheme, accuracy=accuracy, intervals=7))

    # up to a speed of 4 m/s in 4 s, and to rest in 2 s
    assert abs(found.objective - 12) / 12 <= found.accuracy <= accuracy


METHODS = [
    *[("radau", s) for s in (1, 2, 3, 4)],
    *[("gauss", s) for s in (1, 2, 3)],
    *[("lobatto", s) for s in (2, 3, 4)],
    ("hermite-simpson", 3),
    ("trapezoid", 2),
]
SPAN, LQ_SPAN = 2.0, 3.0
# number of intervals: few for the high orders, so that errors stay above the solver's tolerance
MESHES = {
    1: (40, 80, 160),
    2: (20, 40, 80),
    3: (8, 16, 32),
    4: (6, 12, 24),
    5: (4, 8, 16),
    6: (6, 12, 24),
    7: (8, 12, 24),
}
LQ_MESHES = {**MESHES, 6: (4, 8, 16), 7: (3, 6, 12)}
FLOOR = 2e-12  # errors below are round-off: Newton's last step squares the solver's 1e-10


def pendulum_end(name, degree, intervals):
    """End of a driven pendulum stated as a problem that has nothing to choose."""
    angle, rate = State("angle", "rad"), State("rate", "rad/s")
    phase = Phase(
        "swing",
        {angle: rate, rate: -4 * ca.sin(angle)},
        initial={angle: 1.0, rate: 0.5},
        end=SPAN,
    )
    problem = Problem("pendulum", [phase], minimise=phase.at_end(angle))
    found = solved_on(intervals, problem, scheme=scheme_named(name, degree))
    return np.array([found.value(phase.at_end(s)) for s in (angle, rate)])


def slope(steps, errors):
    return np.polyfit(np.log(steps), np.log(errors), 1)[0]


@pytest.mark.parametrize(("name", "degree"), METHODS)
def test_end_state_converges_with_the_declared_order(name, degree):
    exact = solve_ivp(
        lambda t, y: [y[1], -4 * np.sin(y[0])],
        (0, SPAN),
        [1.0, 0.5],
        method="DOP853",
        rtol=1e-13,
        atol=1e-14,
    ).y[:, -1]
    order = scheme_named(name, degree).at(degree).order
    meshes = MESHES[order]
    errors = np.array([np.abs(pendulum_end(name, degree, n) - exact).max() for n in meshes])
    seen = errors > FLOOR
    assert seen.sum() >= 2
    # the next power of the step still bends the line: a third of an order on these meshes
    assert slope(1.0 / np.array(meshes)[seen], errors[seen]) == pytest.approx(order, abs=0.35)


@cache
def lq(name, degree, intervals):
    """Minimise int (x^2 + u^2) for x' = x + u from 1, free end."""
    x, u = State("x"), Control("u")
    phase = Phase("lq", {x: x + u}, initial={x: 1.0}, end=LQ_SPAN)
    problem = Problem("lq", [phase], minimise=phase.integral(x**2 + u**2))
    return solved_on(intervals, problem, scheme=scheme_named(name, degree))


@pytest.mark.parametrize(("name", "degree"), METHODS)
def test_optimum_converges_with_the_declared_order(name, degree):
    # Riccati's equation -s' = 2 s + 1 - s^2, s(3) = 0 has the roots 1 -+ sqrt 2
    w = np.sqrt(2)
    e = np.exp(-2 * w * LQ_SPAN)
    exact = (1 - e) / ((w - 1) + (w + 1) * e)
    order = scheme_named(name, degree).at(degree).order
    meshes = LQ_MESHES[order]
    errors = np.array([abs(lq(name, degree, n).objective - exact) for n in meshes])
    assert errors.min() > FLOOR
    # as above
    assert slope(1.0 / np.array(meshes), errors) == pytest.approx(order, abs=0.35)


@pytest.mark.parametrize(("name", "degree"), METHODS)
def test_controls_and_costates_converge_with_their_own_order(name, degree):
    # x' = x - p/2, p' = -2 x - p with p(3) = 0, u = -p/2
    method = scheme_named(name, degree).at(degree)
    times = np.linspace(0.01, 2.99, 97)
    matrix = np.array([[1.0, -0.5], [-2.0, -1.0]])
    at_end = expm(LQ_SPAN * matrix)
    first = np.array([1.0, -at_end[1, 0] / at_end[1, 1]])
    costate = np.array([(expm(t * matrix) @ first)[1] for t in times])
    meshes = LQ_MESHES[method.order]
    found = [lq(name, degree, n) for n in meshes]
    errors = np.array(
        [
            [
                np.abs(f.sample("u", times) + costate / 2).max(),
                np.abs(f.costate("x", times) - costate).max(),
            ]
            for f in found
        ]
    )
    for error in errors.T:
        # the same times lie anywhere in the intervals of three meshes: two thirds of an order
        assert slope(1.0 / np.array(meshes), error) == pytest.approx(method.control_order, abs=0.67)
