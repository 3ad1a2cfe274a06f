"""The least Hamiltonian among all controls, where it has more than one valley."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ocp import (
    TIME,
    Bound,
    Control,
    Phase,
    Problem,
    State,
    StatementWarning,
    solve,
)
from ocp.diagnostics.other_controls import other_controls
from tests.ocp.problems import certified, check_of, least_effort, solved_on

x = State("x")
throttle = Control("throttle", lower=-2, upper=2)
VALUES = np.linspace(-2, 2, 8001)


def two_modes(**options):
    """x' has two hills by the throttle, at -1 and 1: which is higher changes with the sign of x."""
    rate = 1 - (throttle**2 - 1) ** 2 + 0.3 * throttle * x
    phase = Phase("go", {x: rate}, initial={x: -1}, end=2.0, **options)
    return Problem("two modes", phase, maximise=phase.at_end(x))


def greedy():
    """The optimum: x moves one way only, so that the fastest rate is best at any time."""

    def fastest(t, y):
        return [(1 - (VALUES**2 - 1) ** 2 + 0.3 * VALUES * y[0]).max()]

    return solve_ivp(fastest, (0, 2), [-1.0], rtol=1e-10, atol=1e-12, max_step=0.01).y[0, -1]


@pytest.mark.parametrize("guessed", [1.0, -1.0])
def test_a_guess_in_one_mode_stays_there_and_that_is_said(guessed: float) -> None:
    found = solve(two_modes(guess={x: (-1, 1), throttle: guessed}))
    assert found.objective < greedy() - 0.1
    check = check_of(found, "other controls")
    assert not check.passed
    assert "other controls promise to gain" in check.sentence
    assert f"throttle = {-guessed:.0f}"[:12] in check.sentence
    assert check.value > 0.1


def test_a_guess_that_changes_the_mode_is_certified() -> None:
    changing = {x: (-1, 1.3), throttle: lambda t: np.where(t < 0.9, -1.0, 1.0)}
    certified(two_modes(guess=changing), greedy())


def test_an_interval_is_cut_where_the_mode_changes() -> None:
    """The best hill of a cosine that moves with time: a jump inside an interval."""
    control = Control("u", lower=-2, upper=2)
    rate = 1 - (control**2 - 1) ** 2 + 0.5 * (TIME - 0.437) * control
    phase = Phase("go", {x: rate}, initial={x: 0}, end=1.0)
    times = (np.arange(2000) + 0.5) / 2000
    rates = 1 - (VALUES**2 - 1) ** 2 + 0.5 * (times[:, None] - 0.437) * VALUES
    certified(Problem("moving hills", phase, maximise=phase.at_end(x)), rates.max(axis=1).mean())


def test_a_cost_that_steps_with_the_control_is_no_linear_one() -> None:
    """A drive whose brake is open costs 4 a second: half of the time at 2 m/s is the best."""
    speed = Control("speed", "m/s", lower=0, upper=5)
    phase = Phase("go", {x: speed}, initial={x: 0}, final={x: 1}, end=1.0)
    cost = phase.integral(speed**2 + ca.if_else(speed.symbol > 0.01, 4, 0))
    with pytest.warns(StatementWarning, match="jumps where"):
        problem = Problem("brake", phase, minimise=cost)
    found = solve(problem)
    assert found.objective == pytest.approx(5.0, rel=1e-6)  # and 4 is the least
    assert not check_of(found, "other controls").passed


def test_zero_is_tried_for_a_control_without_limits() -> None:
    """A drive with a dead zone of 2: 4 for half the time costs 8, and 3 all the time 9."""
    u = Control("u")
    rate = ca.fmax(u - 2, 0) + ca.fmin(u + 2, 0)
    phase = Phase("go", {x: rate}, initial={x: 0}, final={x: 1}, end=1.0, guess={u: 3.0, x: (0, 1)})
    found = solve(Problem("dead zone", phase, minimise=phase.integral(u**2)))
    assert found.objective == pytest.approx(9.0, rel=1e-6)
    check = check_of(found, "other controls")
    assert "gain 0.33 of the objective, such as u = 0 instead of 3 at" in check.sentence
    assert not check.passed


def test_a_cost_with_a_kink_in_the_control_is_no_square() -> None:
    """u^2 - 3 |u| has valleys of -2 at the limit -1, and of -2.25 at 1.5."""
    u = Control("u", lower=-1, upper=2)
    phase = Phase("go", {x: u}, initial={x: 0}, end=1.0, guess={x: (0, -1), u: -1.0})
    cost = phase.integral(u**2 - 3 * ca.fabs(u) + 1e-9 * x)
    found = solve(Problem("two valleys", phase, minimise=cost))
    assert found.objective == pytest.approx(-2.0, rel=1e-6)
    check = check_of(found, "other controls")
    assert "u = 1.5 instead of -1" in check.sentence
    assert not check.passed


def test_an_optimum_that_needs_endless_switches_is_not_claimed() -> None:
    """Bolza's example: slopes of 1 and -1 by turns bring the integral to 0, and no motion has 0."""
    slope = Control("u")
    phase = Phase("go", {x: slope}, initial={x: 0}, final={x: 0}, end=1.0)
    found = solve(Problem("bolza", phase, minimise=phase.integral((slope**2 - 1) ** 2 + x**2)))
    assert found.objective > 1e-5
    check = check_of(found, "other controls")
    assert "limit how fast" in check.sentence
    assert not check.passed


def test_where_the_hamiltonian_is_convex_nothing_is_tried() -> None:
    assert check_of(solve(least_effort()), "other controls").value == 0.0


def is_tried(least: float, most: float, grip: object = 1.0) -> bool:
    """Whether other thrusts are tried where their size is limited, at a motion as far as can be."""
    a, b = (Control(name, lower=-2, upper=2) for name in "ab")
    y = State("y")
    size = Bound("size", (a**2 + b**2) * grip, lower=least, upper=most)
    phase = Phase(
        "go", {x: a, y: b - y}, {x: 0, y: 0}, bounds=[size], end=1.0, guess={a: 0.6, b: 0.6}
    )
    problem = Problem("go", phase, maximise=phase.at_end(x + y))
    found = solved_on(5, problem, verify=False)
    return bool(list(other_controls(found.kept_iterate, found.evaluator)))


def test_within_a_circle_of_controls_nothing_is_tried() -> None:
    assert not is_tried(-np.inf, 1.0)
    # a circle whose size changes along the motion is one, too
    assert not is_tried(-np.inf, 1.0, 1.0 + 0.5 * TIME)
    assert not is_tried(-1.0, np.inf, -1.0)
    # what is allowed of a ring is no convex set, and neither is what lies outside of a circle
    assert is_tried(0.1, 1.0)
    assert is_tried(-np.inf, -0.5, -1.0)
