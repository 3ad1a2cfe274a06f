"""Other controls than a motion's own: which are tried, and what they would gain."""

import math
import re

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ocp import (
    TIME,
    Algebraic,
    Between,
    Bound,
    Control,
    Phase,
    Problem,
    State,
    StatementWarning,
    certify,
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
    check = told(found)
    assert not check.passed
    assert "other controls may improve the objective by" in check.sentence
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
    assert not told(found).passed


def test_zero_is_tried_for_a_control_without_limits() -> None:
    """A drive with a dead zone of 2: 4 for half the time costs 8, and 3 all the time 9."""
    u = Control("u")
    rate = ca.fmax(u - 2, 0) + ca.fmin(u + 2, 0)
    phase = Phase("go", {x: rate}, initial={x: 0}, final={x: 1}, end=1.0, guess={u: 3.0, x: (0, 1)})
    found = solve(Problem("dead zone", phase, minimise=phase.integral(u**2)))
    assert found.objective == pytest.approx(9.0, rel=1e-6)
    check = told(found)
    assert "objective by 33 %, such as u = 0 instead of 3 at" in check.sentence
    assert not check.passed


def test_a_cost_with_a_kink_in_the_control_is_no_square() -> None:
    """u^2 - 3 |u| has valleys of -2 at the limit -1, and of -2.25 at 1.5."""
    u = Control("u", lower=-1, upper=2)
    phase = Phase("go", {x: u}, initial={x: 0}, end=1.0, guess={x: (0, -1), u: -1.0})
    cost = phase.integral(u**2 - 3 * ca.fabs(u) + 1e-9 * x)
    found = solve(Problem("two valleys", phase, minimise=cost))
    assert found.objective == pytest.approx(-2.0, rel=1e-6)
    check = told(found)
    assert "u = 1.5 instead of -1" in check.sentence
    assert not check.passed


def test_an_optimum_that_needs_endless_switches_is_not_claimed() -> None:
    """Bolza's example: slopes of 1 and -1 by turns bring the integral to 0, and no motion has 0."""
    slope = Control("u")
    phase = Phase("go", {x: slope}, initial={x: 0}, final={x: 0}, end=1.0)
    found = solve(Problem("bolza", phase, minimise=phase.integral((slope**2 - 1) ** 2 + x**2)))
    assert found.objective > 1e-5
    check = told(found)
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


ENGINE, BATTERY = Control("engine", lower=0, upper=2), Control("battery", lower=-1.6, upper=1.6)

# an engine that is best at none or full of its power
FUEL = ENGINE + 0.45 * ca.sin(ca.pi * ENGINE) ** 2 + 0.3 * ca.sin(ca.pi * ENGINE / 2) ** 2


def driven(demand, battery, **states):
    """A drive that begins with the engine at half its power, and ends with a battery as full."""
    rates, initial = states.get("rates", {}), states.get("initial", {})
    phase = Phase(
        "drive",
        {x: -battery.symbol, **rates},
        initial={x: 0, **initial},
        final={x: 0},
        end=1.0,
        bounds=[demand],
        guess={x: (0, 0), ENGINE: 1, battery: 0, **initial},
    )
    cost = phase.integral(FUEL + 0.1 * battery.symbol**2)
    return solve(Problem("split", phase, minimise=cost))


def told(found):
    """What a certificate says of other controls."""
    return check_of(found, "other controls")


def test_controls_that_share_a_demand_are_tried_together():
    found = driven(
        Bound("demand", ENGINE + BATTERY - 1 - 0.5 * ca.sin(6 * TIME.symbol), lower=0, upper=0),
        BATTERY,
    )
    assert found.objective == pytest.approx(1.316, rel=1e-3)  # and 1.05 by turns
    assert not told(found).passed


SPEED, ALGEBRAIC = State("speed"), Algebraic("battery", lower=-1.6, upper=1.6)
LACKING = ENGINE + BATTERY - 0.5 * SPEED


@pytest.mark.slow
@pytest.mark.parametrize(
    ("demand", "battery", "states"),
    [
        (Bound("demand", ENGINE + BATTERY, lower=1), BATTERY, {}),
        (Bound("demand", ENGINE + ALGEBRAIC, lower=1, upper=1), ALGEBRAIC, {}),
        (
            Bound("demand", LACKING, lower=0, upper=0),
            BATTERY,
            {"rates": {SPEED: LACKING}, "initial": {SPEED: 2}},
        ),
    ],
    ids=["may be exceeded", "an algebraic signal changes with the controls", "depends on a state"],
)
def test_a_demand_is_kept(demand, battery, states):
    found = driven(demand, battery, **states)
    assert found.objective == pytest.approx(1.3, rel=1e-3)  # and 1.1 by turns
    assert not told(found).passed


def test_a_limit_with_a_gap_is_crossed():
    """|u| >= 1: all is linear but the limit, and a guess is on its wrong side."""
    u = Control("u", lower=-2, upper=2)
    gap = Bound("on", u**2, lower=1)
    phase = Phase("go", {x: u}, initial={x: 3}, end=1.0, bounds=[gap], guess={x: (3, 4), u: 1})
    found = solve(Problem("gap", phase, minimise=phase.integral(x)))
    assert found.objective == pytest.approx(3.5, rel=1e-6)  # and 2 with u = -2
    check = told(found)
    assert "u = -2 instead of 1" in check.sentence
    assert not check.passed


def above_a_curve(guessed, slope, beside):
    """A cost above a curve with a valley of 0.397 near -1, and one of nothing at 1."""
    u, cost = Control("u", lower=-2, upper=3), Control("cost", lower=0, upper=20)
    curve = Bound("curve", cost - (u**2 - 1) ** 2 - 0.2 * (1 - u) - slope * x, lower=0)
    guess = {u: guessed, cost: 1, x: (0, guessed)}
    phase = Phase("go", {x: u}, initial={x: 0}, end=1.0, bounds=[curve], guess=guess)
    return solve(Problem("curve", phase, minimise=phase.integral(cost + beside)))


@pytest.mark.slow
def test_a_cost_above_a_curve_of_the_control_follows_it_into_other_valleys():
    found = above_a_curve(-1, 0, 1e-9 * x)
    assert found.objective == pytest.approx(0.397434, rel=1e-5)
    check = told(found)
    assert re.search(r"u = (1|0\.99\d) instead of -0\.974, cost = ", check.sentence)
    assert not check.passed


@pytest.mark.parametrize(
    ("guessed", "best"), [(-1.0, False), pytest.param(1.0, True, marks=pytest.mark.slow)]
)
def test_a_curve_that_depends_on_a_state_has_valleys_too(guessed, best):
    found = above_a_curve(guessed, 0.1, 1e-3 * x**2)
    assert (found.objective < 0.1) == best
    assert told(found).passed == best
    assert certify(found).passed == best


def test_in_a_disc_nothing_better_is_found():
    """A push of one size in any direction: the Hamiltonian is linear, and the limit is convex."""
    y, a, b = State("y"), Control("a"), Control("b")
    disc = Bound("disc", a**2 + b**2, upper=1)
    rates, ends = {x: a + 0.5 * y, y: b}, {x: 2, y: 1}
    phase = Phase("go", rates, {x: 0, y: 0}, ends, end=Between(0.5, 9), bounds=[disc])
    found = solve(Problem("ferry", phase, minimise=phase.duration))
    assert certify(found).passed


def test_controls_that_a_constraint_forbids_are_none():
    forward = two_modes(bounds=[throttle * (1 + 0.1 * throttle**2) >= 0])
    assert told(solve(forward)).passed


def test_a_valley_narrower_than_the_steps_between_what_is_tried_is_found():
    """A lagrangian with two valleys of width 0.1, the second one deeper by 0.2."""
    place, control = State("x", lower=-2, upper=2), Control("u", lower=-1.7, upper=1.7)
    guess = {place: (0, 1), control: 1.0}
    phase = Phase("go", {place: control}, initial={place: 0}, end=1.0, guess=guess)
    cost = phase.integral(40 * (control**2 - 1) ** 2 + 0.1 * control)
    found = solve(Problem("narrow", phase, minimise=cost))
    assert found.objective == pytest.approx(0.1, rel=1e-3)
    check = told(found)
    assert re.search(r"u = -1(\.00\d)? instead of 0\.99", check.sentence)
    assert check.value == pytest.approx(2.0, rel=1e-2)


def wide(limit, guess):
    """Valleys at 1 and, deeper by 0.6, at -1: 33 values between the limits may miss both."""
    control = Control("u", lower=-limit, upper=limit)
    go = Phase("go", {x: control}, {x: 0}, end=1.0, guess={control: guess})
    cost = (control**2 - 1) ** 2 + 0.3 * control + 1e-3 * x
    return solve(Problem("wide", go, minimise=go.integral(cost)))


@pytest.mark.parametrize("limit", [math.inf, 30.0, 1e3, 1e6])
def test_limits_far_wider_than_the_motion_hide_no_valley(limit):
    found = wide(limit, guess=1.0)
    assert found.objective == pytest.approx(0.294, abs=1e-2)
    check = told(found)
    assert "u = -1.0" in check.sentence
    assert check.value > 1.0


@pytest.mark.parametrize("limit", [math.inf, 1e3, 1e6])
def test_wide_limits_do_not_refuse_the_deeper_valley(limit):
    assert told(wide(limit, guess=-1.0)).passed
