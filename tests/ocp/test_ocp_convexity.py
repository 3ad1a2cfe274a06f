"""Guesses and answers that meet the first-order conditions, and are no minimum."""

import dataclasses
import math
from itertools import chain

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
    Solution,
    State,
    Unbounded,
    Unknown,
    certify,
    family,
    homotopy,
    joined,
    solve,
)
from ocp.analysis.saddles import added_curvature, starts_beside
from ocp.nlp.solver import StartingPoint
from ocp.problem.parameters import parameters_of
from ocp.refinement.convexity import seems_convex
from tests.ocp.problems import certified

x, v = State("x", "m"), State("v", "m/s")
near = State("near", "m", lower=-1, upper=1)
WEIGHT = Constant("weight", value=2.0)
u, limited = Control("u"), Control("limited", lower=-1, upper=1)


def from_rest(dynamics, end, **options):
    """A phase from zero, in which nothing needs to move."""
    return Phase("still", dynamics, initial=dict.fromkeys(dynamics, 0), end=end, **options)


def farthest():
    phase = from_rest({x: limited}, 2.0)
    return Problem("farthest", phase, maximise=phase.at_end(x) ** 2)


def widest():
    phase = from_rest({x: limited}, 2.0, final={x: 0})
    return Problem("widest", phase, maximise=phase.integral(x**2))


def beyond_the_conjugate_point(end, state):
    phase = from_rest({state: u}, end, final={state: 0})
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
    with pytest.raises(Unbounded, match=r"seems unbounded: it is -"):
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


PUSH = Constant("push", "1/s^2", 5.0)

# where standing still stops to be best: half a sine wave costs pi^2 and gains the push
BIFURCATION = math.pi**2


def unstable(*, lowest: float = -1.0, offset: float = 0.0) -> Problem:
    """Leave the origin and return in a second: moving costs, being away gains."""
    x = State("x", "m", lower=lowest, upper=1.0)
    u = Control("u", "m/s", lower=-20.0, upper=20.0)
    phase = Phase("way", {x: u}, {x: 0}, {x: 0}, end=1.0)
    return Problem("unstable", phase, minimise=phase.integral(offset + u**2 - PUSH * x**2))


def least(push: float) -> float:
    """The optimum: sine waves up to the limit 1 m and back, and at the limit between them.

    On the way to the limit ``x = sin(r t)`` with ``r`` the root of the push, for a quarter of a
    period, over which the mean of cosine squared equals that of sine squared.
    """
    if push <= BIFURCATION:
        return 0.0
    quarter = math.pi / 2 / math.sqrt(push)
    return -push * (1.0 - 2.0 * quarter)


def globe() -> tuple[Problem, Constant]:
    """From one point of the equator to another; the pole is closed by a cap of `CAP`."""
    turn = Constant("turn", "rad", 2.0)
    polar, azimuth = State("polar", "rad", lower=CAP, upper=math.pi - CAP), State("azimuth", "rad")
    south, east = Control("south", "rad/s"), Control("east", "rad/s")
    dynamics, equator = {polar: south, azimuth: east}, math.pi / 2
    phase = Phase(
        "way", dynamics, {polar: equator, azimuth: 0}, {polar: equator, azimuth: turn}, end=1.0
    )
    speed = south**2 + ca.sin(polar) ** 2 * east**2
    return Problem("globe", phase, minimise=phase.integral(speed)), turn


CAP = 0.1


@pytest.fixture(scope="module")
def still() -> Solution:
    """The optimum of a push of 5: to stand still."""
    return solve(unstable())


def test_a_family_leaves_an_optimum_that_has_become_a_saddle(still: Solution) -> None:
    found = family(still.problem, PUSH, [5.0, 9.0, 12.0, 20.0])
    assert found.objectives[:2] == pytest.approx([0.0, 0.0], abs=1e-9)
    expected = [least(value) for value in (12.0, 20.0)]
    # members lie on few intervals, and are refined when they are asked for
    assert found.objectives[2:] == pytest.approx(expected, rel=2e-3)
    assert found.solution(3).objective == pytest.approx(expected[1], rel=1e-6)


@pytest.mark.parametrize("lowest", [pytest.param(-0.1, marks=pytest.mark.slow), -3e-4])
def test_the_better_side_of_a_saddle_is_taken(lowest: float) -> None:
    # downwards there is next to no room
    found = family(unstable(lowest=lowest), PUSH, [5.0, 9.0, 12.0])
    assert found.objectives[0] == pytest.approx(0.0, abs=1e-9)
    assert found.solution(2).objective == pytest.approx(least(12.0), rel=2e-6)


def test_a_motion_that_vanishes_gives_the_objective_no_size() -> None:
    found = solve(unstable(lowest=-0.1))
    assert found.objective == pytest.approx(0.0, abs=1e-9)
    assert found.kept_iterate.scales.objective > 1.0


def test_a_homotopy_leaves_a_great_circle_that_is_no_shortest_way() -> None:
    # beyond half a turn the equator is a saddle. The best way touches the cap a quarter of a turn
    # from both ends: each side of that triangle is a quarter of a great circle
    problem, turn = globe()
    path = homotopy(problem, turn, [2.9, 4.7])
    short, long = path.solutions
    assert short.objective == pytest.approx(2.9**2, rel=1e-7)
    assert long.objective == pytest.approx(
        (math.pi + math.sin(CAP) * (4.7 - math.pi)) ** 2, rel=1e-6
    )


def test_a_certificate_refuses_a_saddle(still: Solution) -> None:
    saddle = solve(still.problem, guess=still, constants={PUSH: 20.0})
    assert saddle.objective == pytest.approx(0.0, abs=1e-9)
    refused = [check for check in certify(saddle).checks if not check.passed]
    assert [check.name for check in refused] == ["a second solve"]
    assert refused[0].start is not None


def test_a_certificate_is_refused_if_the_objective_runs_away(
    still: Solution,
) -> None:
    assert certify(still).passed
    x, u = State("x", "m"), Control("u", "m/s")
    ends = Phase("way", {x: u}, end=1.0, guess={x: 0.0, u: 0.0})
    returns = Bound("returns", ends.at_end(x) - ends.at_start(x), "m", lower=0, upper=0)
    problem = Problem("away", ends, minimise=ends.integral(u**2 - 5 * x**2), links=[returns])
    certificate = certify(solve(problem))
    (second,) = (check for check in certificate.checks if check.name == "a second solve")
    assert second.failed
    assert "diverges" in second.sentence
    assert not certificate.passed


def test_curvature_is_added_at_a_saddle_alone(still: Solution) -> None:
    def added(push: float) -> float:
        iterate = still.kept_iterate
        point = StartingPoint(iterate.x, (iterate.bound_multipliers, iterate.row_multipliers))
        program = iterate.transcription.program
        return added_curvature(program, point, iterate.limits, np.array([push]))

    # standing still is stationary for every push
    assert added(0.9 * BIFURCATION) == 0.0
    assert added(1.1 * BIFURCATION) > 0.0


def test_starts_beside_a_point_keep_to_its_limits(still: Solution) -> None:
    iterate = still.kept_iterate
    lower, upper = iterate.limits.columns
    point = StartingPoint(np.where(np.isfinite(lower), lower, iterate.x))
    for start in chain.from_iterable(starts_beside(point, iterate.limits)):
        assert np.all((start.x >= lower) & (start.x <= upper))
        # what lies on a limit stays, the rest does not
        assert np.array_equal(start.x == point.x, point.x == lower)


def test_an_optimum_costs_no_further_solve(still: Solution) -> None:
    again = solve(still.problem, guess=still)
    assert len(again.mesh_iterations) == 1
    assert dataclasses.asdict(again.verification)["passed"]


def test_what_limits_of_times_leave_no_room_for_is_certified() -> None:
    """The start of the second phase hardly matters, and lies between limits of its duration."""
    x, v, m = State("x"), State("v"), State("m", lower=0.2)
    u, meeting = Control("u", lower=0.0, upper=3.0), Between(0.05, 5)
    burn = Phase(
        "burn", {x: v, v: u / m - 1 - 0.1 * v**2, m: -0.3 * u}, {x: 0, v: 0, m: 1}, end=meeting
    )
    y, w = State("y"), State("w")
    coast = Phase(
        "coast",
        {y: w, w: -1 - 0.02 * w**2},
        final={y: 1, w: 0},
        start=meeting,
        end=Between(0.1, 10),
    )
    links = [
        Bound("x", coast.at_start(y) - burn.at_end(x), lower=0, upper=0),
        Bound("v", coast.at_start(w) - burn.at_end(v), lower=0, upper=0),
    ]
    cost = 0.05 * coast.end_time - burn.at_end(m)
    found = solve(Problem("unlinked times", [burn, coast], minimise=cost, links=links))
    assert certify(found).passed
