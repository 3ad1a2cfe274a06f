"""CasADi's expressions as lists of instructions, and its functions called with arrays."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ocp.numerics.columnwise import called, columnwise
from ocp.numerics.expression_graph import ExpressionGraph, Instruction, expression_text, graph_of

X, Y = ca.SX.sym("x"), ca.SX.sym("y")
POINTS = [(0.3, 1.2), (0.7, -0.4), (2.0, 0.5)]

# every elementary function, some of them outside their domain at some of the points
EVERYTHING = [
    ca.if_else(X < 1, ca.sin(X) * Y**3, ca.fabs(Y) ** 2.5),
    1 / X + 1 / (1 + ca.exp(-X)) + ca.atan2(X, Y) + ca.fmax(X, -Y) + ca.fmin(X, Y),
    ca.log1p(X) + ca.expm1(Y) + ca.hypot(X, Y) + ca.erf(X) + ca.fmod(X, Y) + ca.remainder(X, Y),
    ca.erfinv(X) + ca.floor(X) * ca.ceil(Y) + ca.sign(X) + ca.copysign(X, Y) + X**Y,
    ca.logic_or(X <= Y, ca.logic_not(X == Y)) + ca.logic_and(X != Y, X < Y),
    ca.tan(ca.asin(X)) + ca.acos(Y) + ca.atan(X) + ca.sqrt(X) + ca.log(X) + ca.cos(Y),
    ca.sinh(X) + ca.cosh(Y) + ca.tanh(X) + ca.asinh(X) + ca.acosh(Y) + ca.atanh(X),
    ca.SX(3.5),
    ca.SX(0),
    X,
    2 * X - Y / 7,
]


def test_every_function_survives_the_way_there_and_back():
    graph = graph_of(EVERYTHING, [X, Y])
    rebuilt = graph.rebuilt([X, Y])
    before = ca.Function("before", [X, Y], [ca.vertcat(*EVERYTHING)])
    after = ca.Function("after", [X, Y], [ca.vertcat(*rebuilt)])
    for point in POINTS:
        np.testing.assert_array_equal(np.array(after(*point)), np.array(before(*point)))


def test_shared_parts_are_written_once():
    power = X
    for _ in range(30):
        power = ca.sin(power) * power
    assert len(graph_of([power], [X]).instructions) == 61
    assert expression_text(power) == "f(x)"


def test_other_symbols_may_take_the_place_of_the_old_ones():
    (moved,) = graph_of([X - 2 * Y], [X, Y]).rebuilt([Y, X])
    assert expression_text(moved) == "y - 2*x"


@pytest.mark.parametrize(
    ("instructions", "results", "message"),
    [
        ([Instruction("system", (0,))], (0,), "unknown operation 'system'"),
        ([Instruction("symbol", (0,)), Instruction("add", (0,))], (1,), "has 1 operands"),
        ([Instruction("symbol", (0,)), Instruction("sin", (1,))], (1,), "needs a later one"),
        ([Instruction("number")], (1,), "a result is none"),
    ],
)
def test_malformed_lists_are_refused(instructions, results, message):
    with pytest.raises(ValueError, match=message):
        ExpressionGraph(tuple(instructions), results)


@pytest.mark.parametrize(
    ("expression", "text"),
    [
        ((X - Y) - (X + Y), "x - y - (x + y)"),
        (X * (Y + 1) / (2 * X), "x*(y + 1)/(2*x)"),
        (X / (X / Y), "x/(x/y)"),
        (-(X**2), "-x^2"),
        ((-X) ** 2.5, "(-x)^2.5"),
        ((X**2) ** 2.5, "(x^2)^2.5"),
        (X + -2 * Y, "x - 2*y"),
        (-(-2 * X), "-(-2*x)"),
        (ca.fmax(X, -Y) <= 3, "max(x, -y) <= 3"),
        (ca.if_else(X < 1, Y, 0), "if(x < 1, y)"),
    ],
)
def test_text_is_what_one_writes(expression, text):
    assert expression_text(expression) == text


def trees():
    """Random expressions of two symbols and small whole numbers."""
    leaves = st.sampled_from([X, Y]) | st.integers(-3, 3).map(ca.SX)
    pairs = st.sampled_from([ca.plus, ca.minus, ca.times])
    return st.recursive(
        leaves,
        lambda inner: (
            st.builds(lambda f, a, b: f(a, b), pairs, inner, inner) | inner.map(lambda a: -a)
        ),
        max_leaves=12,
    )


@given(trees())
def test_text_means_the_same_to_python(expression):
    text = expression_text(expression, longest=10_000)
    value = eval(text.replace("^", "**"), {"x": 3.0, "y": -5.0})
    assert value == float(ca.Function("f", [X, Y], [expression])(3.0, -5.0))


def function():
    """Of a column of three, a number and a column of none; its second output has zeros inside."""
    x, t, nothing = ca.SX.sym("x", 3), ca.SX.sym("t"), ca.SX.sym("n", 0)
    sparse = ca.SX(4, 1)
    sparse[2] = x[0] * t
    return ca.Function("f", [x, t, nothing], [ca.vertcat(ca.sin(x[1]), x[2] + t), sparse])


@pytest.mark.parametrize("count", [1, 2, 17, 128, 129, 300])
def test_many_columns_are_evaluated_as_one_by_one(count):
    rng = np.random.default_rng(count)
    x, t = rng.normal(size=(count, 3)), rng.normal(size=(count, 1))
    first, second = columnwise(function(), x, t, np.zeros(0))
    for k in range(count):
        one, other = function()(x[k], t[k], ca.DM(0, 1))
        assert first[k] == pytest.approx(one.full().ravel(), abs=0)
        assert second[k] == pytest.approx(other.full().ravel(), abs=0)


def test_a_column_may_be_one_for_all():
    x, t = np.arange(12.0).reshape(4, 3), np.array([2.0])
    shared, _ = columnwise(function(), x, t, np.zeros(0))
    repeated, _ = columnwise(function(), x, np.full((4, 1), 2.0), np.zeros((4, 0)))
    assert np.array_equal(shared, repeated)


def test_no_columns_give_none():
    first, second = columnwise(function(), np.zeros((0, 3)), np.zeros((0, 1)), np.zeros(0))
    assert first.shape == (0, 2)
    assert second.shape == (0, 4)


def test_arrays_need_not_lie_row_by_row():
    x = np.arange(12.0).reshape(3, 4).T
    strided, _ = columnwise(function(), x, np.ones((4, 1)), np.zeros(0))
    straight, _ = columnwise(function(), x.copy(), np.ones((4, 1)), np.zeros(0))
    assert np.array_equal(strided, straight)


def test_matrices_are_transposed():
    a = ca.SX.sym("a", 2, 3)
    double = ca.Function("double", [a], [2 * a])
    given = np.arange(6.0).reshape(3, 2)
    (found,) = called(double, given)
    assert np.array_equal(found, 2 * given)
    assert np.array_equal(found.T, double(given.T).full())


def test_arguments_of_a_wrong_size_are_refused():
    with pytest.raises(ValueError, match=r"input 0 has 2 numbers; .* takes \(3, 1\)"):
        called(function(), np.zeros(2), np.zeros(1), np.zeros(0))
