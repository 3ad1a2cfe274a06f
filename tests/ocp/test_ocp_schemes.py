"""Nodes, weights and derivative matrices of the collocation schemes against what defines them."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ocp import Control, Phase, Problem, Settings, State, StatementError, solve
from ocp.numerics.piecewise_polynomial import derivative_matrix, lagrange, quadrature_weights
from ocp.numerics.schemes import HermiteSimpson, Lobatto, Radau, Trapezoid
from tests.ocp.named_schemes import scheme_named

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


def test_two_radau_points_are_a_third_and_one():
    np.testing.assert_allclose(Radau().at(2).points, [1 / 3, 1], rtol=1e-15)
    np.testing.assert_allclose(Radau().at(2).weights, [3 / 4, 1 / 4], rtol=1e-14)


def test_a_degree_that_a_scheme_does_not_have_is_refused():
    with pytest.raises(StatementError, match=r"1 points.*at least 2"):
        Lobatto(1)


def test_degrees_that_a_rule_does_not_have_are_refused():
    with pytest.raises(StatementError, match=r"0 points.*at least 1"):
        Radau(0)
    with pytest.raises(StatementError, match=r"radau has 2\.5 points.*whole number"):
        Radau(2.5)
    with pytest.raises(StatementError, match=r"trapezoid always has 2 points.*leave it out"):
        Trapezoid(4)
    assert Lobatto(3).at(3).points == pytest.approx(HermiteSimpson().at(3).points)


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
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2")
    phase = Phase("move", {x: v, v: u}, {x: 0, v: 0}, {x: 1, v: 0}, end=1.0)
    problem = Problem("effort", [phase], minimise=phase.integral(u**2))
    # least effort from rest to rest: 12 D^2 / T^3
    assert solve(problem, settings=Settings(scheme=Chebyshev(4))).objective == pytest.approx(12)


@pytest.mark.parametrize("accuracy", [1e-3, 1e-4])
@pytest.mark.parametrize("scheme", [Trapezoid(), HermiteSimpson(), Lobatto()], ids=repr)
def test_a_scheme_without_estimates_states_no_more_than_two_meshes_tell(scheme, accuracy):
    """Its multipliers promise nothing, so that a mesh of half the intervals has to tell."""
    way, speed = State("way", "m"), State("speed", "m/s")
    pull = Control("pull", "m/s^2", lower=-2, upper=1)
    drive = Phase(
        "drive", {way: speed, speed: pull}, initial={way: 0, speed: 0}, final={speed: 0}, end=6
    )
    problem = Problem("longest way", drive, maximise=drive.at_end(way))

    found = solve(problem, settings=Settings(scheme=scheme, accuracy=accuracy, intervals=7))

    # up to a speed of 4 m/s in 4 s, and to rest in 2 s
    assert abs(found.objective - 12) / 12 <= found.accuracy <= accuracy
