"""A solver that is lost among kinks finds its way by a problem that is smooth."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from ocp import (
    TIME,
    Between,
    BudgetSpent,
    Constant,
    Control,
    Phase,
    Problem,
    Settings,
    State,
    certify,
    joined,
    peak,
    solve,
)
from ocp.numerics.kinks import KinkSurfaces
from ocp.problem.kinks import roundable_kinks
from ocp.refinement.past_kinks.past_kinks import PATIENCE
from ocp.refinement.past_kinks.rounded_kinks import with_rounded_kinks

x, v = State("x", "m"), State("v", "m/s")
u = Control("u", "m/s^2")


def pushed(force, final, **options):
    phase = Phase("push", {x: v, v: u - force}, {x: 0, v: 2}, final, end=2.0, **options)
    return Problem("push", phase, minimise=phase.integral(u**2))


def into_a_stop(stiffness):
    """Into a stop and back. Without its help the way lasts just as long, with u = -2 and J = 8."""
    return pushed(stiffness * ca.fmax(x - 1, 0), {x: 0, v: -2})


def into_a_moving_stop():
    """On the first mesh IPOPT's steps lead from one branch to the other for 1,000 iterations."""
    force = 20 * ca.fmax(x - 0.5 - 0.2 * ca.sin(3 * TIME), 0)
    phase = Phase("push", {x: v, v: u - force}, {x: 0, v: 1}, {x: 0, v: -2}, end=2.0)
    return Problem("push", phase, minimise=phase.integral(u**2))


@pytest.mark.parametrize(
    "expression",
    [
        lambda a: ca.fabs(a),
        lambda a: a * ca.sign(a),
        lambda a: ca.fmax(3 * a, a),
        lambda a: ca.fmin(3 * a, a),
        lambda a: ca.if_else(a > 0, 2 * a, a),
        lambda a: ca.if_else(a >= 0, 2 * a, a),
        lambda a: ca.if_else(ca.logic_and(a > 0, a > -1), 2 * a, ca.if_else(a > -1, a, a)),
        lambda a: ca.if_else(ca.logic_or(a > 0, a > 1), 2 * a, a),
    ],
    ids=["fabs", "sign", "fmax", "fmin", "lt", "le", "and", "or"],
)
def test_a_rounded_expression_is_smooth_and_the_same_far_from_its_kink(expression):
    a, width = ca.SX.sym("a"), 1e-3
    kinks = KinkSurfaces.of([expression(a)])
    (rounded,) = kinks.rounded([expression(a)], ca.SX([width] * len(kinks.values)))
    both = ca.Function("both", [a], [expression(a), rounded, ca.gradient(rounded, a)])

    for value in (-0.6, -0.2, 0.3, 0.8):
        stated, found, _ = (float(part) for part in both(value))
        assert found == pytest.approx(stated, abs=3e-3)
    # the slope goes over from one side to the other without a jump
    slopes = np.array([float(both(value)[2]) for value in np.linspace(-5e-3, 5e-3, 401)])
    assert abs(slopes[-1] - slopes[0]) > 0.8
    assert np.abs(np.diff(slopes)).max() < 0.1


def test_only_the_surfaces_that_are_given_are_rounded():
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    kinks = KinkSurfaces.of([ca.fabs(a)])
    (rounded,) = kinks.rounded([ca.fabs(a) + ca.fabs(b)], ca.SX([0.3]))
    value = ca.Function("value", [a, b], [rounded])
    assert float(value(0.4, -0.2)) == pytest.approx(0.5 + 0.2)


def test_a_problem_of_several_phases_is_rounded_as_a_whole():
    meet, stiff = Between(0.5, 1.5), Constant("stiffness", "1/s^2", value=20.0)
    first = Phase(
        "first", {x: v, v: u - stiff * ca.fmax(x - 1, 0)}, {x: 0, v: 1}, end=meet, bounds=[v <= 3]
    )
    second = Phase(
        "second",
        {x: v, v: u - ca.if_else(TIME < 1.7, 0.1, 0.2)},
        final={x: 0, v: -2},
        start=meet,
        end=2.0,
        bounds=[ca.fabs(u) + 0.1 * ca.fabs(x) <= 9],
    )
    cost = first.integral(u**2 + v * ca.fabs(v)) + second.integral(u**2) + second.at_end(ca.fabs(v))
    highest = peak((first, ca.fabs(x)), (second, x))
    problem = Problem("both", (first, second), minimise=cost + highest, links=joined(first, second))

    assert [len(roundable_kinks(problem, name).values) for name in ("first", "second")] == [3, 3]
    width = Constant("width", value=1e-6)
    rounded = with_rounded_kinks(
        problem, {"first": [width.symbol] * 3, "second": [width.symbol] * 3}
    )
    assert {c.name for c in rounded.constants} == {"stiffness", "width"}
    assert [p.name for p in rounded.phases] == ["first", "second"]
    assert len(rounded.functionals) == len(problem.functionals)
    assert not any(roundable_kinks(rounded, name).values for name in ("first", "second"))
    # a comparison of time alone is at a known instant, and stays
    assert len(KinkSurfaces.of([rounded.phases[1].dynamics[v]]).values) == 1


@pytest.mark.parametrize(
    ("problem", "softer", "objective"),
    [
        (into_a_moving_stop(), None, 4.697968),
        # a softer stop leads to the motion that uses it
        (into_a_stop(1000), into_a_stop(70), 5.670356),
        pytest.param(
            pushed(1000 * ca.fmax(x - 1, 0), {x: 0.5, v: -3}),
            None,
            16.694963,
            marks=pytest.mark.slow,
        ),
    ],
    ids=["moving", "stiff", "twice"],
)
def test_a_first_mesh_lost_among_kinks_is_solved(problem, softer, objective):
    solution = solve(problem, guess=softer and solve(softer).trajectory)
    first = solution.mesh_iterations[0]
    assert first.iterations > PATIENCE, "nothing was lost, so that this shows nothing"
    assert first.iterations < 4 * PATIENCE
    assert certify(solution).passed, certify(solution)
    assert solution.objective == pytest.approx(objective, rel=1e-6)
    assert solution.trajectory.phases[0].intervals <= 60
    assert solution.problem is problem
    assert set(solution.trajectory.constants) == set()


def test_a_slope_that_begins_and_ends_is_found_by_its_comparisons():
    s, fast = State("s", "m"), State("fast", "m/s", lower=0.5)
    push = Control("push", "m/s^2", lower=-3, upper=2)
    height = ca.if_else(s < 3, 0, ca.if_else(s < 6, (s - 3) * 0.3, 0.9))
    rates = {s: fast, fast: push - height - 0.1 * fast**2}
    phase = Phase("road", rates, {s: 0, fast: 1}, {s: 10, fast: 1}, end=8.0)
    solution = solve(Problem("road", phase, minimise=phase.integral(push**2)))
    assert certify(solution).passed
    assert solution.objective == pytest.approx(3.9590418, rel=1e-6)
    assert sum(entry.iterations for entry in solution.mesh_iterations) < 1000


@pytest.mark.slow
def test_a_later_mesh_that_is_lost_is_solved_too():
    push = Control("u", "m/s^2", lower=-20, upper=20)
    force = 50 * ca.fmax(x - 1, 0) - 50 * ca.fmax(-x - 1, 0)
    phase = Phase("swing", {x: v, v: push - force}, {x: 0, v: 2}, {x: 0, v: 3}, end=4.0)
    solution = solve(Problem("swing", phase, minimise=phase.integral(push**2)))
    assert certify(solution).passed


def test_a_guess_that_is_lost_is_followed_as_well():
    problem = into_a_moving_stop()
    guess = solve(pushed(0.0, {x: 0, v: -2})).trajectory
    solution = solve(problem, guess=guess)
    assert certify(solution).passed
    assert solution.objective == pytest.approx(4.697968, rel=1e-6)


def test_a_budget_ends_it_as_it_ends_everything():
    with pytest.raises(BudgetSpent, match="60 iterations"):
        solve(into_a_moving_stop(), settings=Settings(iterations=60))
