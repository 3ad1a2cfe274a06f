"""Linear and quadratic expressions, and those that only seem so because they step."""

import casadi as ca
import pytest

from ocp.numerics.polynomial_expressions import is_linear, is_quadratic

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
