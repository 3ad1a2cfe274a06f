"""Tables in a statement: solved, printed, saved if `Interpolant` made them."""

import math

import casadi as ca
import numpy as np
import pytest

from ocp import (
    TIME,
    Control,
    Interpolant,
    InvalidNumber,
    Phase,
    Problem,
    State,
    save,
    solve,
)
from ocp.numerics.expression_graph import expression_text, graph_of
from ocp.numerics.polynomial_expressions import polynomial_degree
from tests.ocp.problems import certified

POINTS = np.linspace(0, 1, 11)
SMOOTH = ca.interpolant("gain", "bspline", [POINTS], 1 + POINTS**2)  # exact: the spline is cubic
BROKEN = ca.interpolant("broken", "linear", [POINTS], 1 + POINTS**2)


def moved_by(factor, **options):
    """One metre in one second at a speed times a factor, with least effort."""
    x, speed = State("x", "m"), Control("speed", "m/s")
    phase = Phase("move", {x: speed * factor(x)}, initial={x: 0}, final={x: 1}, end=1.0, **options)
    return Problem("table", phase, minimise=phase.integral(speed**2))


def linear_mean(power):
    """Mean over [0, 1] of a power of the broken line, by Gauss quadrature of each piece."""
    nodes, weights = np.polynomial.legendre.leggauss(12)
    inside = 0.05 * (nodes + 1) + POINTS[:-1, None]
    return float((np.interp(inside, POINTS, 1 + POINTS**2) ** power @ weights).sum() * 0.05)


@pytest.mark.parametrize(
    ("problem", "optimum"),
    [
        # by time J = 1 / integral of factor^2, by place the square of the integral of 1 / factor
        (moved_by(lambda _: SMOOTH(TIME)), 1 / (1 + 2 / 3 + 1 / 5)),
        (moved_by(SMOOTH), (math.pi / 4) ** 2),
        (moved_by(lambda _: BROKEN(TIME), breakpoints=POINTS), 1 / linear_mean(2)),
        (moved_by(BROKEN), linear_mean(-1) ** 2),
    ],
    ids=["smooth, time", "smooth, place", "broken, time", "broken, place"],
)
def test_a_table_is_solved_like_a_formula(problem, optimum):
    certified(problem, optimum)


def test_a_table_is_printed_by_its_name():
    assert "gain(x)" in str(moved_by(SMOOTH))


def test_a_solution_with_a_function_of_casadi_is_not_saved(tmp_path):
    found = solve(moved_by(SMOOTH))
    with pytest.raises(TypeError, match=r"'gain' cannot be saved.*make it with ocp\.Interpolant"):
        save(found, tmp_path / "found.zip")


def test_a_table_of_two_axes_has_its_values_in_their_order():
    lift = Interpolant("lift", [[0, 1, 2], [0, 10]], [[0, 10], [1, 11], [2, 12]], kind="linear")
    x = ca.SX.sym("x", 2)
    value = ca.Function("value", [x], [lift(x[0], x[1])])
    assert float(value([1.25, 4.0])) == pytest.approx(5.25, rel=1e-12)  # x + y by its values


def test_a_table_that_is_not_finite_is_named():
    values = np.where(POINTS < 0.5, 1.0, np.nan)
    table = ca.interpolant("torn", "linear", [POINTS], values)
    with pytest.raises(InvalidNumber, match=r"derivative of 'x'.*torn"):
        solve(moved_by(lambda _: table(TIME)))


def test_a_function_of_several_numbers_goes_there_and_back():
    a, b = ca.SX.sym("a", 2), ca.SX.sym("b")
    several = ca.Function("several", [a, b], [a * b, ca.sin(a[0])], {"never_inline": True})
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    first, second = several(ca.vertcat(x, x * y), y)
    expression = first[1] + 2 * second
    graph = graph_of([expression, x], [x, y])

    rebuilt = ca.Function("rebuilt", [x, y], graph.rebuilt([x, y]))
    assert [float(value) for value in rebuilt(0.3, 0.7)] == pytest.approx(
        [0.3 * 0.7**2 + 2 * math.sin(0.3), 0.3]
    )
    assert expression_text(second) == "several(x, x*y, y)"
    assert polynomial_degree(expression, [x], [1]) is None
    assert polynomial_degree(several(ca.vertcat(x, 1), 2)[0][1] + y, [y], [3]) == 3
