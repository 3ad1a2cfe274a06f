"""Motions that grow without limit."""

import casadi as ca
import pytest

from ocp import Control, Phase, Problem, State, Unbounded, solve

u = Control("u", "1/s", lower=-1, upper=1)


def growing(sign, **limits):
    """x' = x^2 + u from 0.9, or its mirror image, with the least effort over 5 s."""
    x = State("x", **limits)
    phase = Phase("run", {x: sign * x**2 + u}, {x: sign * 0.9}, end=5.0)
    return Problem("growing", phase, minimise=phase.integral(u**2))


@pytest.mark.filterwarnings("ignore:the state")
@pytest.mark.parametrize(("sign", "side"), [(1, "upper"), (-1, "lower")])
def test_a_state_that_leaves_for_infinity_is_named_with_a_remedy(sign, side):
    with pytest.raises(Unbounded, match=rf"'x' of phase 'run' grows .* State\('x', {side}="):
        solve(growing(sign))


def test_with_a_limit_there_is_an_optimum():
    # 0.990516 by Runge-Kutta steps of 4th order and a plain nonlinear program
    assert solve(growing(1, lower=-5, upper=5)).objective == pytest.approx(0.9905151, rel=1e-6)


def test_a_motion_that_grows_and_has_an_end_is_none_of_these():
    x = State("x")
    phase = Phase("run", {x: 3 * x + u}, {x: 1}, end=5.0)
    found = solve(Problem("steep", phase, minimise=-phase.at_end(x) / 1e6))
    # x' = 3 x + 1 from 1
    assert found.objective == pytest.approx((1 - 4 * float(ca.exp(15))) / 3e6, rel=1e-6)
