"""CasADi's functions called with arrays, against calls with matrices."""

import casadi as ca
import numpy as np
import pytest

from ocp.numerics.columnwise import called, columnwise


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
