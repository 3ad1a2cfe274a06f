"""Expressions that jump: told when they are stated, refused by a certificate, solved as phases."""

import warnings

import casadi as ca
import numpy as np
import pytest

from ocp import (
    TIME,
    Between,
    Bound,
    Constant,
    Control,
    Phase,
    Problem,
    State,
    StatementWarning,
    Unknown,
    certify,
    joined,
    solve,
)
from ocp.analysis.sensitivity import ActiveSetWarning, slopes_by_multipliers
from ocp.numerics.kinks import stepwise_operations
from tests.ocp.problems import certified, check_of, double_integrator

x, speed = State("x", "m"), Control("speed", "m/s")


def crossing(rate, end=1.0):
    """One metre at a rate that depends on the place, with least effort."""
    phase = Phase("move", dynamics={x: rate}, initial={x: 0}, final={x: 1}, end=end)
    return Problem("crossing", phase, minimise=phase.integral(speed**2))


JUMPING = {
    "comparison": speed * ca.if_else(x < 0.5, 1, 2),
    "sign": speed * (1.5 + 0.5 * ca.sign(x - 0.5)),
    "floor": speed * (1 + ca.floor(2 * x + 1e-12)),
    "copysign": speed * (1.5 + 0.5 * ca.copysign(1, x.symbol - 0.5)),
}


@pytest.mark.parametrize("rate", JUMPING.values(), ids=JUMPING)
def test_a_jump_at_a_place_is_told_when_it_is_stated_and_not_certified(rate):
    with pytest.warns(StatementWarning, match="rate of 'x' of phase 'move' jumps where") as told:
        problem = crossing(rate)
    assert "joined(first, second)" in str(told[0].message)
    assert told[0].filename == __file__

    # the solver sees equal speeds in both halves; the optimum is 0.5625
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = solve(problem)
    assert found.objective == pytest.approx(0.625, rel=1e-5)
    assert not check_of(found, "jumps").passed


def test_a_remainder_jumps_too():
    with pytest.warns(StatementWarning, match=r"rate of 'x'.* jumps where .*floor"):
        crossing(speed - 0.5 * ca.fmod(x.symbol, 0.6))


def test_numbers_of_the_whole_motion_are_looked_at():
    phase = Phase("move", {x: speed}, {x: 0}, end=1.0)
    end, p = phase.at_end(x), Unknown("p", lower=-1, upper=2)
    effort = phase.integral(speed**2)
    with pytest.warns(StatementWarning, match="the objective jumps where 'floor"):
        Problem("p", phase, minimise=effort + ca.floor(end))
    with pytest.warns(StatementWarning, match="the objective jumps where 'sign"):
        Problem("p", phase, minimise=effort + ca.sign(p))
    bound = Bound("allowed", end + ca.if_else(end > 0.5, 0.1, 0), upper=2)
    with pytest.warns(StatementWarning, match="the bound 'allowed' jumps where"):
        Problem("p", phase, minimise=effort, bounds=[bound])


def test_the_remedy_finds_the_optimum():
    """With t the time in the first half, J = 0.25 / t + 0.0625 / (1 - t), least at t = 2/3."""
    meeting = Between(0.1, 0.9)
    slow = Phase("slow", dynamics={x: speed}, initial={x: 0}, final={x: 0.5}, end=meeting)
    fast = Phase("fast", dynamics={x: 2 * speed}, final={x: 1}, start=meeting, end=1.0)
    cost = slow.integral(speed**2) + fast.integral(speed**2)
    problem = Problem("crossing", [slow, fast], minimise=cost, links=joined(slow, fast))
    found = certified(problem, 0.5625, within=1e-7)
    assert found.value(slow.end_time) == pytest.approx(2 / 3, abs=1e-4)


CONTINUOUS = {
    "one comparison": ca.if_else(x < 0.5, 1, 2 * x),
    "two that change together": ca.if_else(x < 0.5, 1, 0) + ca.if_else(x - 0.5 >= 0, 2 * x, 0),
    "kink": ca.fabs(x - 0.3) + 1,
    "series": ca.if_else(x < 1e-2, 1 - x**2 / 6 + x.symbol**4 / 120, ca.sin(x) / x),
}


@pytest.mark.parametrize("factor", CONTINUOUS.values(), ids=CONTINUOUS)
def test_branches_that_agree_where_they_change_are_no_jump(factor):
    # the optimum has x' / factor constant, and J is the square of the integral of 1 / factor
    at = np.linspace(0, 1, 200_001)
    middle = 0.5 * (at[1:] + at[:-1])
    values = ca.Function("factor", [x.symbol], [factor])(middle[None, :])
    certified(crossing(speed * factor), float(np.mean(1 / np.array(values))) ** 2)


def test_a_known_time_is_no_jump_that_moves_but_its_constant_has_no_slope():
    """J = 1 / (4 - 3 c), whose slope by c = 0.4 is 3 / 2.8^2: multipliers would say 0."""
    change = Constant("change", "s", 0.4)
    found = certified(crossing(speed * ca.if_else(change > TIME, 1, 2)), 1 / 2.8)
    with pytest.warns(ActiveSetWarning, match="'change'.*jump at a movable time"):
        slopes = found.sensitivities()
    assert np.isnan([slopes[name] for name in ("change", "move: start", "move: end")]).all()
    assert slopes["move: x final"] == pytest.approx(2 / 2.8, rel=1e-5)
    assert np.isnan(slopes_by_multipliers(found)["change"])


def test_friction_of_one_sign_is_no_jump_that_is_crossed():
    place, rate, force, _ = double_integrator()
    rates = {place: rate, rate: force - ca.sign(rate)}
    phase = Phase("slide", rates, {place: 0, rate: 0}, {place: 1, rate: 0}, end=2.0)
    cost = phase.integral((force - 1) ** 2)
    with pytest.warns(StatementWarning, match=r"sign\(v\)"):
        problem = Problem("slide", phase, minimise=cost)
    found = solve(problem)
    assert found.objective == pytest.approx(12 / 2**3, rel=1e-6)
    assert not any(check.name == "jumps" for check in certify(found).checks)


def test_stepwise_operations_share_their_parts():
    """Of 40 signs in a chain each is written once, and not once for each of those after it."""
    symbol = ca.SX.sym("s")
    value = symbol
    for k in range(40):
        value = ca.sin(value) + ca.sign(value - 0.01 * k)
    found = stepwise_operations([value], [symbol])
    together = ca.Function("results", [symbol], [ca.vertcat(*found.results)])
    assert together.size1_out(0) == 40
    assert together.n_instructions() < 300
    # with the results of a place the function has the value of the expression there
    results = together(0.5)
    again = ca.Function("value", [symbol], [value])(0.5)
    assert float(found.function(0.5, results)) == pytest.approx(float(again), abs=1e-14)
