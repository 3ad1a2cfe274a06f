"""Points that seem stationary because the slope of a modulus of zero is taken to be zero."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from ocp import Constant, Control, Phase, Problem, State, certify, family, homotopy, solve

PUSH = Constant("push", value=0.0)
x, u = State("x"), Control("u")
BEST = 2 * np.tanh(2.0)  # of x'' = 4 (x - 1) with x(0) = 0 and x'(1) = 0


def between_wells() -> Problem:
    """Two wells at -push and push; to stay between them is stationary."""
    phase = Phase("go", {x: u}, initial={x: 0}, end=1.0)
    cost = phase.integral(u**2 + 4 * (ca.fabs(x) - PUSH) ** 2)
    return Problem("wells", phase, minimise=cost)


def test_a_solve_from_a_concave_kink_leaves_it() -> None:
    problem = between_wells()
    still = solve(problem)
    assert still.objective == pytest.approx(0.0, abs=1e-9)
    found = solve(problem, constants={PUSH: 1.0}, guess=still)
    assert found.objective == pytest.approx(BEST, rel=1e-6)
    assert certify(found).passed


def test_a_homotopy_and_a_family_leave_it() -> None:
    problem, values = between_wells(), [0.0, 0.5, 1.0]
    assert homotopy(problem, PUSH, values).solution.objective == pytest.approx(BEST, rel=1e-6)
    found = family(problem, PUSH, values).objectives
    assert found == pytest.approx([0.0, BEST / 4, BEST], rel=1e-5, abs=1e-9)


def test_the_worst_motion_is_not_taken_for_the_best_one() -> None:
    slope = Control("slope", lower=-1, upper=1)
    phase = Phase("go", {x: slope}, initial={x: 0}, end=2.0, guess={x: 0, slope: 0})
    found = solve(Problem("far", phase, maximise=phase.integral(ca.fabs(x))))
    assert found.objective == pytest.approx(2.0, rel=1e-6)


def test_a_convex_kink_is_a_minimum() -> None:
    """At rest at the least of a modulus all is well."""
    phase = Phase("go", {x: u}, initial={x: 0}, end=1.0)
    found = solve(Problem("rest", phase, minimise=phase.integral(u**2 + ca.fabs(x))))
    assert found.objective == pytest.approx(0.0, abs=1e-9)
    assert certify(found).passed
