"""A failed solve names the expression whose derivative jumps."""

from __future__ import annotations

import casadi as ca
import pytest

from ocp import (
    AdaptiveMesh,
    Control,
    Ipopt,
    Phase,
    Problem,
    Settings,
    SolveFailed,
    State,
    Unverified,
    solve,
)
from ocp.numerics.kinks import kinked_operations

x, v = State("x", "m"), State("v", "m/s")
u = Control("u", "m/s^2", lower=-1, upper=1)


def burn(cost, rate=u):
    phase = Phase("burn", {x: v, v: rate}, {x: 0, v: 0}, {x: 1, v: 0}, end=3.0)
    return Problem("burn", phase, minimise=phase.integral(cost))


def complaint(problem):
    with pytest.raises(SolveFailed) as failed:
        solve(problem, settings=Settings(solver=Ipopt(max_iterations=3)))
    return str(failed.value)


def test_the_operations_are_named():
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    assert kinked_operations(ca.fabs(a) + ca.fmax(a, b)) == ["fabs", "fmax"]
    assert kinked_operations(ca.sqrt(a**2 + b) * ca.sin(a)) == []


@pytest.mark.parametrize(
    ("problem", "words"),
    [
        (burn(v * ca.fabs(u)), "integral of v*abs(u) over burn has a kink, by fabs"),
        (burn(u**2, u - v * ca.fabs(v)), "the rate of 'v' has a kink, by fabs"),
    ],
    ids=["integrand", "rate"],
)
def test_what_has_a_kink_is_named_with_a_remedy(problem, words):
    said = complaint(problem)
    assert words in said
    assert "controls of their own, each not negative" in said


def test_a_choice_that_may_be_a_larger_of_two_is_told_to_be_written_so():
    said = complaint(burn(ca.if_else(u * v > 0, u * v, 0)))
    assert (
        "over burn chooses by if_else: if it is the larger of two values, write it with fmax"
        in said
    )


def test_where_all_is_smooth_nothing_is_said_of_kinks():
    assert "kink" not in complaint(burn(u**4))


def test_an_answer_that_does_not_pass_names_it_too():
    stop = 50 * ca.fmax(0, x - 0.6)
    phase = Phase("stop", {x: v, v: u - stop}, {x: 0, v: 0}, {x: 0.62, v: 0.2}, end=3.0)
    problem = Problem("stop", phase, minimise=phase.integral(u**2))
    coarse = Settings(intervals=2, refinement=AdaptiveMesh(rounds=1))
    with pytest.raises(Unverified, match="the rate of 'v' has a kink, by fmax: state both sides"):
        solve(problem, settings=coarse)
