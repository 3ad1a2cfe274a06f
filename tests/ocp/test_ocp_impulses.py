"""Problems whose best motion would need a control without end for no time."""

from __future__ import annotations

import numpy as np
import pytest

from ocp import TIME, Between, Bound, Control, NumericalTrouble, Phase, Problem, State, solve

X, V = State("x", "m"), State("v", "m/s")


def rocket(**limits):
    """The most height at burnout: all fuel at once would be best."""
    mass, thrust = State("mass", "kg"), Control("thrust", "N", lower=0, **limits)
    phase = Phase(
        "burn",
        {X: V, V: thrust / mass - 1, mass: -thrust},
        initial={X: 0, V: 0, mass: 1},
        final={mass: 0.5, V: 0},
        end=Between(0.1, 10),
    )
    return Problem("rocket", phase, maximise=phase.at_end(X))


@pytest.mark.slow
def test_a_thrust_without_a_limit_is_named_with_the_remedy() -> None:
    with pytest.raises(NumericalTrouble, match=r"give it a limit, as in Control\('thrust', upper"):
        solve(rocket())


def test_with_that_limit_it_is_solved() -> None:
    found = solve(rocket(upper=20))
    all_at_once = np.log(2) ** 2 / 2  # a speed of ln 2, and coasting to rest
    assert 0.95 * all_at_once < found.objective < all_at_once
    assert found.verification.passed


def test_a_lower_side_is_told_from_an_upper_one() -> None:
    """To hold a square small, x goes to zero at once."""
    rate = Control("rate", "m/s")
    phase = Phase("go", {X: rate}, initial={X: 1}, end=1.0)
    with pytest.raises(NumericalTrouble, match=r"as in Control\('rate', lower"):
        solve(Problem("drop", phase, minimise=phase.integral(X**2)))


def test_a_weight_that_vanishes_at_the_start_lets_all_be_done_there() -> None:
    """Weierstrass' kind: the less, the more of the way is gone while the weight is small."""
    rate = Control("rate", "m/s")
    phase = Phase("go", {X: rate}, initial={X: 0}, final={X: 1}, end=1.0)
    with pytest.raises(NumericalTrouble, match="would need an impulse"):
        solve(Problem("weight", phase, minimise=phase.integral(TIME * rate**2)))


def test_a_layer_of_some_width_is_resolved() -> None:
    """A boundary layer of 1e-4 of the motion, with a control that nothing limits."""
    rate = Control("rate", "m/s")
    phase = Phase("go", {X: rate}, initial={X: 1}, end=1e4)
    found = solve(Problem("layer", phase, minimise=phase.integral(X**2 + rate**2)))
    assert found.objective == pytest.approx(1.0, rel=1e-6)  # tanh(1e4)


def test_what_a_solver_leaves_of_zero_is_no_impulse() -> None:
    """Two parts of a modulus, one of which is zero: |x - 1| + u^2 / 2 from 0, never beyond 1."""
    rate, above, below = Control("rate"), Control("above", lower=0), Control("below", lower=0)
    parts = Bound("parts", X - 1 - above + below, lower=0, upper=0)
    phase = Phase("go", {X: rate}, initial={X: 0}, end=3.0, bounds=[parts])
    found = solve(Problem("track", phase, minimise=phase.integral(above + below + rate**2 / 2)))
    assert found.objective == pytest.approx(2 * np.sqrt(2) / 3, rel=1e-6)


def test_a_pole_of_the_control_is_resolved() -> None:
    """x = sqrt(t) under the weight t^2 x'^4: the control is the slope, endless at the start."""
    rate = Control("rate", "m/s", lower=0)
    phase = Phase("go", {X: rate}, initial={X: 0}, final={X: 1}, end=1.0)
    found = solve(Problem("pole", phase, minimise=phase.integral((TIME**1.5) * rate**4)))
    assert found.objective == pytest.approx(0.5**4 * 2, rel=1e-3)
