"""A guess that meets the first-order conditions is no answer where the problem is not convex."""

import math

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import minimize_scalar

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
    joined,
    solve,
)
from ocp.problem.parameters import parameters_of
from ocp.refinement.convexity import seems_convex
from tests.ocp.problems import certified

x, v = State("x", "m"), State("v", "m/s")
near = State("near", "m", lower=-1, upper=1)
WEIGHT = Constant("weight", value=2.0)
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
    certified(problem, optimum)


@pytest.mark.parametrize("end", [3.3, pytest.param(6.0, marks=pytest.mark.slow)])
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


def least_time():
    phase = Phase("go", {x: v, v: limited}, {x: 0, v: 0}, {x: 1, v: 0}, end=Between(0.5, 9))
    return Problem("go", phase, minimise=phase.end_time)


def ending(bound):
    phase = Phase("end", {x: u}, {x: 0.3}, end=1.0)
    return Problem("end", phase, minimise=phase.integral((u + 0.9) ** 2), bounds=[bound(phase)])


def near_an_energy():
    phase = Phase("near", {x: u}, {x: 0.3}, end=1.0)
    return Problem("near", phase, minimise=(phase.integral(x**2) - 0.5) ** 2)


STATEMENTS = {
    "effort": (moving(), True),
    "an upper limit of a convex expression": (moving(bounds=[x**2 + u**2 <= 9]), True),
    "a lower limit of a convex expression": (
        moving(bounds=[Bound("outside", x**2 + v**2, lower=-1)]),
        False,
    ),
    "a limit that moves": (moving(bounds=[x <= 2 + TIME**2]), True),
    "a rate that is not linear": (moving(rate=u - ca.sin(x)), False),
    "phases that meet at a free time": (two_phases(), False),
    "a maximum of what is convex": (farthest(), False),
    "a constant that is not negative": (moving(bounds=[WEIGHT * v**2 <= 4]), True),
    "a price that rises with time": (priced(TIME + 0.1), True),
    "a price that falls below zero": (priced(0.5 - TIME), False),
    "a free end": (least_time(), False),
    "a lower limit of a squared end value": (ending(lambda p: p.at_end(x**2) >= 1), False),
    "an upper limit of it": (ending(lambda p: p.at_end(x**2) <= 1), True),
    "a lower limit of a modulus": (ending(lambda p: p.at_end(ca.fabs(x)) >= 1), False),
    "an upper limit of an effort": (ending(lambda p: p.integral(u**2) <= 3), True),
    "a lower limit of it": (ending(lambda p: p.integral(u**2) >= 3), False),
    "a square of what an integral misses": (near_an_energy(), False),
    "a wave that is convex near zero": (priced(1, 1 - ca.cos(x)), False),
    "what is neither linear nor quadratic": (priced(1, ca.cosh(x) + x**4), False),
}


@pytest.mark.parametrize(("problem", "expected"), STATEMENTS.values(), ids=STATEMENTS)
def test_what_seems_convex(problem, expected):
    assert seems_convex(problem, parameters_of(problem)) == expected


def outside(start, end, weights, gate):
    """Least effort past a gate in the middle: at least one away from zero on either side."""
    phase = Phase("pass", {x: u}, {x: start}, {x: end}, end=1.0, breakpoints=[0.5])
    first, second = weights
    cost = phase.integral(ca.if_else(TIME.symbol < 0.5, first, second) * u**2)
    return Problem("pass", phase, minimise=cost, bounds=[gate(phase)])


@pytest.mark.parametrize(
    "gate",
    [lambda p: p.at(0.5, x**2) >= 1, lambda p: p.at(0.5, ca.fabs(x)) >= 1],
    ids=["square", "modulus"],
)
def test_a_gate_of_two_sides_is_passed_on_the_better_one(gate):
    """From 2 to -1.5: 52 by way of 1, and 20 by way of -1."""
    found = solve(outside(2.0, -1.5, (1.0, 4.0), gate))
    assert found.objective == pytest.approx(20.0, rel=1e-6)


def test_a_valley_beyond_a_ridge_is_found_without_limits():
    """Start and end lie before the ridge at pi of a wave; the best motion goes beyond it."""

    def visiting(position):
        cost = u**2 + 4 * (1 - ca.cos(position)) + 0.03 * (position - 6) ** 2
        phase = Phase("visit", {position: u}, {position: 2.9}, {position: 2.9}, end=10.0)
        return solve(Problem("visit", phase, minimise=phase.integral(cost)))

    found, limited = visiting(x), visiting(State("x", "m", lower=-20, upper=20))
    assert found.objective == pytest.approx(limited.objective, rel=1e-7)
    # to stay before the ridge costs 29.1
    assert found.objective < 26
    assert found.sample(x, 5.0) == pytest.approx(2 * math.pi, abs=0.1)


def test_a_window_of_time_is_found_anywhere():
    """A metre in a second, which may begin when it costs least."""

    def cost(start):
        rate = quad(lambda t: 1 / (2 + math.sin(t) + 0.05 * t), start, start + 1)[0]
        return 1 / rate

    grid = np.linspace(0, 30, 601)
    best = grid[np.argmin([cost(start) for start in grid])]
    exact = minimize_scalar(cost, bounds=(best - 0.1, best + 0.1), options={"xatol": 1e-10}).fun
    phase = Phase("go", {x: u}, {x: 0}, {x: 1}, start=Between(0, 30), end=Between(0.5, 31))
    effort = phase.integral((2 + ca.sin(TIME) + 0.05 * TIME) * u**2)
    lasts = Bound("lasts", phase.duration, "s", lower=1, upper=1)
    found = solve(Problem("window", phase, minimise=effort, bounds=[lasts]))
    assert found.objective == pytest.approx(exact, rel=1e-8)


def test_half_a_swing_is_not_taken_for_three():
    """x'' = -x + u from 1 to -1: free after half a period, and after three halves."""
    phase = Phase("swing", {x: v, v: u - x}, {x: 1, v: 0}, {x: -1, v: 0}, end=Between(0.5, 20))
    found = solve(Problem("swing", phase, minimise=phase.integral(u**2) + 0.01 * phase.end_time))
    assert found.value(phase.end_time) == pytest.approx(math.pi, rel=1e-2)
    assert found.objective < 0.01 * math.pi


def test_constants_count_at_the_values_that_are_solved_for():
    """Two wells at the end, by a weight that is declared as nothing."""
    weight = Constant("weight of the wells", value=0.0)
    phase = Phase("go", {x: u}, {x: 0.2}, end=1.0)
    end = phase.at_end(x)
    wells = 20 * ((end**2 - 1) ** 2 + 0.5 * end)
    problem = Problem("wells", phase, minimise=phase.integral(u**2) + weight * wells)
    found = solve(problem, constants={weight: 1.0})

    # the control is constant: the least over all ends
    ends = np.linspace(-2, 2, 400_001)
    least = ((ends - 0.2) ** 2 + 20 * ((ends**2 - 1) ** 2 + 0.5 * ends)).min()
    assert found.objective == pytest.approx(least, rel=1e-6)
