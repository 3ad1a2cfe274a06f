"""A guess that meets the first-order conditions is no answer where the problem is not convex."""

import math

import casadi as ca
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
    Unbounded,
    Unknown,
    certify,
    joined,
    solve,
)
from ocp.refinement.first_round.convexity import seems_convex

x, v = State("x", "m"), State("v", "m/s")
near = State("near", "m", lower=-1, upper=1)
WEIGHT, FORWARD = Constant("weight", value=2.0), Control("forward", lower=0)
u, limited = Control("u"), Control("limited", lower=-1, upper=1)


def still(dynamics, end, **options):
    """A phase from zero, in which nothing needs to move."""
    return Phase("still", dynamics, initial=dict.fromkeys(dynamics, 0), end=end, **options)


def farthest():
    phase = still({x: limited}, 2.0)
    return Problem("farthest", phase, maximise=phase.at_end(x) ** 2)


def widest():
    phase = still({x: limited}, 2.0, final={x: 0})
    return Problem("widest", phase, maximise=phase.integral(x**2))


def beyond_the_conjugate_point(end, state):
    phase = still({state: u}, end, final={state: 0})
    return Problem("spring", phase, minimise=phase.integral(u**2 - state**2))


@pytest.mark.parametrize(
    ("problem", "optimum"),
    [
        (farthest(), 4),  # at full speed, to either side
        (widest(), 2 / 3),
        # along a sine to the limit, a quarter of a turn at each end, and there for the rest
        (beyond_the_conjugate_point(6.0, near), math.pi - 6),
    ],
    ids=["end value", "integral", "conjugate point"],
)
def test_standing_still_is_not_the_best_motion(problem, optimum):
    found = solve(problem)
    assert found.objective == pytest.approx(optimum, rel=1e-6)
    assert certify(found).passed


@pytest.mark.parametrize("end", [3.3, 6.0])
def test_beyond_the_conjugate_point_there_is_no_minimum(end):
    with pytest.raises(Unbounded, match=r"ran away to -"):
        solve(beyond_the_conjugate_point(end, x))


def test_before_the_conjugate_point_standing_still_is_best():
    found = solve(beyond_the_conjugate_point(3.0, x))
    assert found.objective == pytest.approx(0, abs=1e-9)


def test_a_rate_times_an_unknown_is_not_linear():
    """x'' = -k x from 1 at rest to 0 in a second: the root of k is pi/2, 3/2 pi or 5/2 pi."""
    stiffness = Unknown("stiffness", "1/s^2", lower=0, upper=100)
    phase = Phase("swing", {x: v, v: -stiffness * x}, {x: 1, v: 0}, {x: 0}, end=1.0)
    found = solve(Problem("stiffest", phase, maximise=stiffness))
    assert found.objective == pytest.approx((2.5 * math.pi) ** 2, rel=1e-6)


def moving(objective=None, bounds=(), rate=u):
    phase = Phase("move", {x: v, v: rate}, {x: 0, v: 0}, {x: 1, v: 0}, end=1.0, bounds=bounds)
    return Problem("move", phase, minimise=phase.integral(u**2) if objective is None else objective)


def priced(price, effort=u**2):
    phase = Phase("move", {x: u}, {x: 0}, {x: 1}, end=1.0)
    return Problem("priced", phase, minimise=phase.integral(price * effort + u**2 * 0.1))


def two_phases():
    meeting = Between(0.1, 0.9)
    first = Phase("first", {x: u}, {x: 0}, end=meeting)
    second = Phase("second", {x: 2 * u}, final={x: 1}, start=meeting, end=1.0)
    cost = first.integral(u**2) + second.integral(u**2)
    return Problem("two", [first, second], minimise=cost, links=joined(first, second))


STATEMENTS = {
    "effort": (moving(), True),
    "an upper limit of a convex expression": (moving(bounds=[x**2 + u**2 <= 9]), True),
    "a lower limit of it": (moving(bounds=[Bound("outside", x**2 + v**2, lower=-1)]), False),
    "a limit that moves": (moving(bounds=[x <= 2 + TIME**2]), True),
    "a rate that is not linear": (moving(rate=u - ca.sin(x)), False),
    "phases that meet at a free time": (two_phases(), False),
    "a maximum of what is convex": (farthest(), False),
    "a constant that is not negative": (moving(bounds=[WEIGHT * v**2 <= 4]), True),
    "a price that rises with time": (priced(TIME + 0.1), True),
    "a price that falls below zero": (priced(0.5 - TIME), False),
    "a cube of what is not negative": (priced(1, FORWARD**3), True),
}


@pytest.mark.parametrize(("problem", "expected"), STATEMENTS.values(), ids=STATEMENTS)
def test_what_seems_convex(problem, expected):
    assert seems_convex(problem) == expected
