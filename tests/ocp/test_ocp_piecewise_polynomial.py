"""Piecewise polynomials against NumPy's own, and expressions that are polynomials."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ocp.numerics.piecewise_polynomial import (
    Bernstein,
    Lagrange,
    Piece,
    PiecewisePolynomial,
    to_bernstein,
    to_powers,
)
from ocp.numerics.polynomial_expressions import is_linear, is_quadratic

BREAKPOINTS = np.array([1.0, 1.5, 3.0, 4.0])
TAU = np.linspace(0.0, 1.0, 13)
ROUND_OFF = 1e-12  # polynomials of degree up to 6 on [0, 1], coefficients of size 1

bases = st.one_of(
    st.integers(1, 7).map(Bernstein),
    st.lists(st.integers(0, 20), min_size=1, max_size=7, unique=True).map(
        lambda places: Lagrange(tuple(sorted(place / 20.0 for place in places)))
    ),
)


def powers_of(basis, coefficients):
    """Coefficients of powers of local time, by fitting the values at many points."""
    return np.polynomial.polynomial.polyfit(TAU, basis.values(TAU) @ coefficients, basis.count - 1)


@given(basis=bases, seed=st.integers(0, 100))
def test_bases_change_into_each_other(basis, seed):
    coefficients = np.random.default_rng(seed).uniform(-1, 1, basis.count)
    values = basis.values(TAU) @ coefficients
    size = np.abs(values).max() + 1.0
    as_bernstein = Bernstein(basis.count).values(TAU) @ (to_bernstein(basis) @ coefficients)
    # nodes 0.05 apart amplify round-off by up to 1e5
    np.testing.assert_allclose(as_bernstein, values, atol=1e-9 * size)
    as_powers = np.vander(TAU, basis.count, increasing=True) @ (to_powers(basis) @ coefficients)
    np.testing.assert_allclose(as_powers, values, atol=1e-9 * size)


@given(count=st.integers(1, 7), seed=st.integers(0, 100))
def test_values_and_rates_of_bernstein_polynomials(count, seed):
    coefficients = np.random.default_rng(seed).uniform(-1, 1, (3, count, 2))
    polynomial = PiecewisePolynomial(
        BREAKPOINTS, (Piece(np.arange(3), Bernstein(count), coefficients),)
    )
    for k in range(3):
        values = polynomial.value(np.full(TAU.size, k), TAU)
        rates = polynomial.rate(np.full(TAU.size, k), TAU)
        for j in range(2):
            powers = powers_of(Bernstein(count), coefficients[k, :, j])
            own = np.polynomial.Polynomial(powers)
            np.testing.assert_allclose(values[:, j], own(TAU), atol=ROUND_OFF)
            width = BREAKPOINTS[k + 1] - BREAKPOINTS[k]
            np.testing.assert_allclose(rates[:, j], own.deriv()(TAU) / width, atol=1e-10)


@given(seed=st.integers(0, 100))
def test_pieces_of_several_bases(seed):
    random = np.random.default_rng(seed)
    support = Lagrange((0.0, 0.4, 1.0))
    polynomial = PiecewisePolynomial(
        BREAKPOINTS,
        (
            Piece(np.array([0, 2]), Bernstein(2), random.uniform(-1, 1, (2, 2, 1))),
            Piece(np.array([1]), support, random.uniform(-1, 1, (1, 3, 1))),
        ),
    )
    np.testing.assert_array_equal(polynomial.orders, [1, 2, 1])
    k, tau = random.integers(0, 3, 40), random.uniform(0, 1, 40)
    values = polynomial.value(k, tau)[:, 0]

    # the power form, the range and the ends say the same
    table = polynomial.powers()[:, 0]
    np.testing.assert_allclose(values, (table[k] * tau[:, None] ** np.arange(3)).sum(axis=1))
    lower, upper = polynomial.range()
    assert np.all(values >= lower[k, 0] - ROUND_OFF)
    assert np.all(values <= upper[k, 0] + ROUND_OFF)
    ends = polynomial.ends()
    assert ends.shape == (3, 2, 1)
    np.testing.assert_allclose(ends[:, 0, 0], polynomial.value(np.arange(3), np.zeros(3))[:, 0])


def test_a_breakpoint_belongs_to_its_right():
    steps = Piece(np.arange(3), Bernstein(1), np.array([[[1.0]], [[2.0]], [[3.0]]]))
    polynomial = PiecewisePolynomial(BREAKPOINTS, (steps,))
    values = polynomial.at(np.array([1.0, 1.5, 2.9, 3.0, 4.0]))[:, 0]
    assert values == pytest.approx([1.0, 2.0, 2.0, 3.0, 3.0])


def test_components_stand_alone():
    random = np.random.default_rng(2)
    both = Piece(np.arange(3), Bernstein(3), random.uniform(-1, 1, (3, 3, 2)))
    polynomial = PiecewisePolynomial(BREAKPOINTS, (both,))
    second = polynomial.part([1])
    k, tau = np.array([0, 1, 2]), np.array([0.1, 0.5, 0.9])
    expected = polynomial.value(k, tau)[:, 1]
    np.testing.assert_allclose(second.value(k, tau)[:, 0], expected, atol=ROUND_OFF)


X, Y = ca.SX.sym("x"), ca.SX.sym("y")
BOTH = ca.vertcat(X, Y)


@pytest.mark.parametrize(
    ("expression", "linear", "quadratic"),
    [
        (2 * X - Y, True, True),
        (X * Y, False, True),
        (X**3, False, False),
        (ca.if_else(X > 1, 2, 3), False, False),
        (X + ca.floor(Y), False, False),
        (X**2 + ca.sign(X), False, False),
        (Y + ca.fmod(Y, 2), False, False),
        (ca.fabs(X) + Y**2, False, False),
        (ca.fmax(X, Y), False, False),
        (X**2 / ca.fabs(X), False, False),
    ],
)
def test_an_expression_that_steps_is_neither(expression, linear, quadratic) -> None:
    assert is_linear(expression, BOTH) == linear
    assert is_quadratic(expression, BOTH) == quadratic


def test_several_expressions_are_linear_if_all_are() -> None:
    assert is_linear(ca.vertcat(X, X + Y), BOTH)
    assert not is_linear(ca.vertcat(X, ca.ceil(Y)), BOTH)
    assert is_linear(ca.SX(0, 1), BOTH)


def test_a_step_by_what_is_no_variable_is_a_number() -> None:
    assert is_linear(Y * ca.if_else(X > 1, 2, 3), Y)
    assert not is_linear(Y * ca.if_else(X > 1, 2, 3), X)
