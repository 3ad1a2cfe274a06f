"""Implicit dynamics: accelerations as controls, and the equations of motion as equations."""

import casadi as ca
import numpy as np
import pytest

from ocp import Bound, Control, Overdetermined, Phase, Problem, State, solve


def pendulum(implicit, piecewise=None):
    """A pendulum swung to the side and stopped there, with the least effort."""
    q, w = State("q", "rad"), State("w", "rad/s")
    u = Control("u", "rad/s^2", lower=-20, upper=20, piecewise=piecewise)
    a = Control("a", "rad/s^2", piecewise=piecewise)
    pull = u - 9.81 * ca.sin(q)
    swing = Phase(
        "swing",
        {q: w, w: a if implicit else pull},
        {q: 0, w: 0},
        {q: 1, w: 0},
        end=1.0,
        bounds=[Bound("motion", a - pull, lower=0, upper=0)] if implicit else [],
    )
    return Problem("pendulum", swing, minimise=swing.integral(u**2))


def test_a_control_that_an_equation_determines_has_a_value_at_each_point():
    explicit, implicit = solve(pendulum(False)), solve(pendulum(True))
    # both are within their tolerance of 1e-6 of the same optimum
    assert implicit.objective == pytest.approx(explicit.objective, rel=2e-6)
    at = np.linspace(0, 1, 11)
    assert implicit.sample("q", at) == pytest.approx(explicit.sample("q", at), abs=1e-4)


def test_where_it_has_not_the_message_says_how_to_state_it():
    # four points of an interval, and one level each of torque and acceleration
    with pytest.raises(
        Overdetermined, match=r"in an equation of phase 'swing'.*declare it as Algebraic\("
    ):
        solve(pendulum(True, piecewise="constant"))
