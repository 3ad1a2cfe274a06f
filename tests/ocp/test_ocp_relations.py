"""Bounds written as relations: what they mean, and what is answered where they mean nothing."""

import math

import casadi as ca
import numpy as np
import pytest

from ocp.errors import StatementError
from ocp.problem.bounds import Bound
from ocp.problem.phase import Phase
from ocp.problem.problem import Problem
from ocp.problem.relations import meant_by
from ocp.problem.symbols import Constant, Control, State, Unknown

x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "N")
c, t = Constant("c", "m", 2.0), Unknown("T", "s", lower=1.0, upper=9.0)
TRAVEL = Phase("travel", {x: v, v: u}, end=1.0)
INF = math.inf


def bound_of(relation, where):
    return Bound(**vars(meant_by(relation, where)))


def evaluated(expression):
    """An expression of x, v and c at 0.3, 0.7 and 2."""
    symbols = [s.symbol for s in (x, v, c)]
    return float(ca.Function("f", symbols, [ca.SX(expression)])(0.3, 0.7, 2.0))


@pytest.mark.parametrize(
    ("relation", "name", "unit", "lower", "upper"),
    [
        (x <= 2, "x <= 2", "m", -INF, 2.0),
        (x < 2, "x <= 2", "m", -INF, 2.0),
        (x >= 2, "x >= 2", "m", 2.0, INF),
        (np.float64(2) >= x, "x <= 2", "m", -INF, 2.0),
        (x == 2, "x == 2", "m", 2.0, 2.0),
        (x <= c, "x <= c", "m", -INF, 2.0),
        (c + 1 <= x, "x >= c + 1", "m", 3.0, INF),
        (ca.sin(x) >= 0, "sin(x) >= 0", "1", 0.0, INF),
        (-3 * x <= 6, "-3*x <= 6", "1", -INF, 6.0),
        (x - 3 <= 6, "x - 3 <= 6", "m", -INF, 6.0),
        (ca.fabs(x) / 2 <= 6, "abs(x)/2 <= 6", "1", -INF, 6.0),
        (TRAVEL.at_end(x) <= 2, "x at the end of travel <= 2", "m", -INF, 2.0),
        (TRAVEL.peak(u, unit="N") <= 3, "peak of u over travel <= 3", "N", -INF, 3.0),
        (TRAVEL.integral(u**2) <= c, "integral of u^2 over travel <= c", "1", -INF, 2.0),
        (TRAVEL.end_time <= 2 * t, "end of travel <= 2*T", "s", -INF, 0.0),
    ],
)
def test_name_unit_and_limits_are_derived(relation, name, unit, lower, upper):
    bound = bound_of(relation, "phase 'travel'")
    assert (bound.name, bound.unit) == (name, unit)
    assert [evaluated(bound.lower), evaluated(bound.upper)] == [lower, upper]


def test_where_both_sides_vary_their_difference_is_bounded():
    bound = bound_of(x * v <= ca.sin(x), "phase 'travel'")
    assert (bound.lower, bound.upper) == (-INF, 0.0)
    assert evaluated(bound.expression) == 0.3 * 0.7 - math.sin(0.3)
    assert bound_of(x == v, "phase 'travel'").is_equation


def test_a_limit_of_constants_makes_an_equation_too():
    assert bound_of(x == c + 1, "phase 'travel'").is_equation


def test_relations_stand_beside_bounds_in_a_statement():
    phase = Phase("go", {x: v, v: u}, {x: 0}, bounds=[v <= 2, v >= -1], end=1.0)
    problem = Problem("go", phase, maximise=phase.at_end(x), bounds=[phase.at_end(v) == 0])
    assert [b.name for b in phase.bounds] == ["v <= 2", "v >= -1"]
    assert [b.name for b in problem.bounds] == ["v at the end of go == 0"]


@pytest.mark.parametrize(
    ("relation", "message"),
    [
        (x, "'x', which is no relation; write a relation such as x <= 2, or Bound"),
        (x != 2, "'x != 2', which is no relation"),
        (3, "is 3; write a relation such as x <= 2"),
        (True, "is True; write"),
        ("x <= 2", "is 'x <= 2'; write"),
        (ca.logic_and(x <= 2, x >= 0), "joins two relations: 'x <= 2 and 0 <= x'; give each"),
        (x <= x, "always holds"),
        (c <= 2, "relates numbers and constants only"),
        (x <= INF, "'x <= inf' has neither a lower nor an upper limit"),
        (x <= math.nan, "is nan; give a number"),
        (ca.vertcat(x, v) <= 1, "shape 2x1; give one scalar expression an entry"),
        (ca.SX.sym("y") <= 1, "a bound of phase 'travel' contains the symbol 'y', which no State"),
    ],
)
def test_what_is_no_relation_is_answered_with_what_to_write(relation, message):
    with pytest.raises(StatementError, match=message):
        bound_of(relation, "phase 'travel'")


@pytest.mark.parametrize(
    ("relation", "text"),
    [
        (v <= 0.12, r"v <= 0\.12"),
        (ca.logic_and(v <= 1, v >= 0), "v <= 1 and 0 <= v"),
        (TRAVEL.at_end(v) <= 1, r"\(v at the end of travel\) <= 1"),
    ],
)
def test_a_relation_is_no_expression_of_a_bound(relation, text):
    words = (
        f"the expression of the bound 'b' is '{text}', which is 0 or 1; give the relation itself"
    )
    with pytest.raises(StatementError, match=words):
        Bound("b", relation, upper=1)


def test_a_relation_inside_an_expression_may_be_bounded():
    for expression in (ca.if_else(x <= 1, v, u), ca.if_else(x <= 1, 1, 0), x * (v <= 1)):
        assert Bound("b", expression, upper=1).upper == 1


@pytest.mark.parametrize(
    "misuse",
    [lambda: -1 <= x <= 1, lambda: 1 if v >= 2 else 0, lambda: x == 1 and v == 2],
)
def test_a_relation_has_no_truth_value(misuse):
    with pytest.raises(StatementError, match=r"neither true nor false.*one by one.*ca.if_else"):
        misuse()
