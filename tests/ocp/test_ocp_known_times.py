"""Known times, limits of unknowns, guesses by fraction and intervals by phase: what users state."""

import itertools
import math

import casadi as ca
import numpy as np
import pytest
from scipy import optimize

from ocp import (
    TIME,
    Between,
    Bound,
    ByFraction,
    Constant,
    Control,
    Phase,
    Problem,
    Settings,
    State,
    StatementError,
    StatementWarning,
    Unknown,
    joined,
    load,
    save,
    solve,
)
from ocp.algorithm import first_mesh
from ocp.mesh.initial_guess import initial_guess
from ocp.problem.instants import stepping_times
from ocp.problem.parameters import parameters_of
from tests.ocp.problems import certified

EDGES = [1.3, 2.7, 4.1, 5.5, 7.2, 8.9]
PRICES = [3.0, 1.0, 2.5, 0.7, 4.0, 1.4, 2.2]


def charging(price, **options):
    """A leaky store that is charged while energy has a price that steps."""
    energy, power = State("energy", "J"), Control("power", "W", lower=0, upper=2)
    charge = Phase(
        "charge",
        dynamics={energy: power - 0.1 * energy},
        initial={energy: 0},
        final={energy: 5},
        end=10.0,
        **options,
    )
    cost = charge.integral(price * power + 0.3 * power**2)
    return Problem("tariff", charge, minimise=cost)


def exact_cost():
    """The optimum by the minimum principle: power = clip((k e^{t/10} - price) / 0.6, 0, 2)."""
    t = np.concatenate(
        [np.linspace(a, b, 20001)[:-1] for a, b in zip([0, *EDGES], [*EDGES, 10], strict=True)]
    )
    width = np.diff(np.append(t, 10.0))
    middle = t + 0.5 * width
    price = np.array(PRICES)[np.searchsorted(EDGES, middle)]

    def power(k):
        return np.clip((k * np.exp(0.1 * middle) - price) / 0.6, 0, 2)

    def reached(k):
        return np.sum(power(k) * np.exp(0.1 * (middle - 10)) * width)

    u = power(optimize.brentq(lambda k: reached(k) - 5, 0, 10, xtol=1e-14))
    return float(np.sum((price * u + 0.3 * u**2) * width))


def test_a_stepping_tariff_takes_two_rounds():
    problem = charging(ca.pw_const(TIME.symbol, ca.DM(EDGES), ca.DM(PRICES)))
    assert problem.steps["charge"] == tuple(EDGES)
    # midpoint rule of 140,000 intervals, its error below 1e-8
    solution = certified(problem, exact_cost())
    assert len(solution.mesh_iterations) <= 3


def test_stated_breakpoints_stay_in_every_mesh():
    problem = charging(1 + 0 * TIME, breakpoints=[4.0, 7.25])
    solution = solve(problem)
    points = 10.0 * solution.mesh.phases[0].breakpoints
    for time in (4.0, 7.25):
        assert np.abs(points - time).min() < 1e-8


def test_smooth_tables_have_no_steps():
    smooth = charging(2 + ca.sin(TIME))
    assert smooth.steps["charge"] == ()


def test_a_divisor_of_time_alone_tells_where_it_vanishes():
    quotients = [ca.atan(0.1 / (2 * TIME - 3)), 1 / (TIME - 0.25), 2 / (TIME**2 - 0.5)]
    found = stepping_times(quotients, 0.0, 2.0)
    assert found == pytest.approx((0.25, math.sqrt(0.5), 1.5), abs=1e-15)


def test_steps_are_read_off_functions_of_time_alone():
    t = TIME.symbol
    several = [
        ca.if_else(2 * t - 1 < 5, 0, 1),
        ca.fabs((t - 4) / 2),
        ca.sign(-t + 1),
        ca.fmax(t, 0.5),
        ca.if_else(ca.sin(t) > 0, 1, 0),
        ca.if_else(t < 20, 1, 0),  # outside
    ]
    expected = (0.5, 1.0, 3.0, math.pi, 4.0, 2 * math.pi, 3 * math.pi)
    assert stepping_times(several, 0.0, 10.0) == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize(
    ("step", "times"),
    [
        (lambda t: ca.if_else((t - 0.4321) ** 2 < 25e-8, 1, 0), (0.4316, 0.4326)),
        (lambda t: ca.fmax(0, 1e-3 - ca.fabs(t - 0.4321)), (0.4311, 0.4321, 0.4331)),
        (lambda t: ca.fmod(t, 0.3), (0.3, 0.6, 0.9)),
        (lambda t: ca.remainder(t, 0.3), (0.15, 0.45, 0.75)),
        (lambda t: ca.ceil(4 * t**2), (0.5, math.sqrt(0.5), math.sqrt(0.75))),
        (lambda t: ca.fmax(t**2 - 1, 0), ()),  # at an end
        (lambda t: ca.sign(ca.sin(1e4 * t)), ()),  # too many
        (lambda t: ca.sign(t**2 - Constant("c", "s", 0.5)), ()),  # at a constant
    ],
)
def test_pulses_and_periods_of_time_are_found(step, times):
    found = stepping_times([ca.SX(step(TIME.symbol))], 0.0, 1.0)
    assert found == pytest.approx(times, abs=1e-15)


def test_limits_of_signals_and_bounds_may_hold_unknowns():
    # rest to rest over 1 m in 2 s: the least largest thrust is 4 * 1 / 2^2
    p = Unknown("p", "N", lower=0, upper=10, guess=5)
    x, v, u = State("x"), State("v"), Control("u", lower=-p)
    ends = {"initial": {x: 0, v: 0}, "final": {x: 1, v: 0}}
    move = Phase("move", {x: v, v: u}, **ends, end=2.0, bounds=[Bound("up", u, upper=p)])
    assert [bound.name for bound in move.bounds] == ["up", "u lower"]
    solution = solve(Problem("peak", move, minimise=p))
    assert solution.objective == pytest.approx(1.0, abs=1e-7)  # the solver's tolerance


def test_a_bound_with_two_moving_sides_becomes_two():
    p = Unknown("p", guess=1.0)
    x, u = State("x"), Control("u")
    phase = Phase("a", {x: u}, end=1.0, bounds=[Bound("b", u, lower=-p, upper=2 * p)])
    assert [bound.name for bound in phase.bounds] == ["b lower", "b upper"]


def test_a_guess_by_fraction_serves_phases_of_any_duration(tmp_path):
    x, u = State("x"), Control("u", lower=-1, upper=1)
    go = Phase(
        "go",
        {x: u},
        {x: 0},
        {x: 1},
        end=Between(0.1, 8, 4),
        guess={x: ByFraction(lambda s: s**2), u: ByFraction(([0, 1], [0.0, 0.5]))},
    )
    problem = Problem("go", go, minimise=go.end_time)
    motion = initial_guess(problem, parameters_of(problem)).phases["go"]
    values = motion.at_fractions(np.array([0.0, 0.5, 1.0]))
    assert values["x"] == pytest.approx([0, 0.25, 1])
    assert values["u"] == pytest.approx([0, 0.25, 0.5])
    solution = solve(problem)
    save(solution, tmp_path / "go.ocp")
    assert load(tmp_path / "go.ocp").objective == solution.objective


def test_first_intervals_by_phase():
    x, y = State("x"), State("y")
    a = Phase("a", {x: 1}, {x: 0}, end=1.0)
    b = Phase("b", {y: 1}, {y: 0}, start=1.0, end=2.0)
    problem = Problem("two", [a, b], minimise=b.at_end(y) + a.at_end(x))
    mesh = first_mesh(problem, Settings(intervals={"b": 6}))
    assert [phase.intervals for phase in mesh.phases] == [20, 6]
    with pytest.raises(StatementError, match="names the phase 'c'"):
        first_mesh(problem, Settings(intervals={"c": 6}))
    with pytest.raises(StatementError, match="give a positive integer"):
        Settings(intervals={"b": 0})


def wind_over(phase_times):
    """A drift that steps at 0.3 and 0.5 s, in phases between some times; the last end is free."""
    x, u = State("x"), Control("u")
    drift = ca.pw_const(TIME, ca.DM([0.3, 0.5]), ca.DM([1.0, 3.0, 0.2]))
    ends = [*phase_times[1:], Between(phase_times[-1] + 0.01, 1.1)]
    phases = [
        Phase(
            f"part {i}",
            {x: drift + u},
            {x: 0} if i == 0 else {},
            {x: 1} if i == len(ends) - 1 else {},
            start=start,
            end=end,
        )
        for i, (start, end) in enumerate(zip(phase_times, ends, strict=True))
    ]
    links = [link for pair in itertools.pairwise(phases) for link in joined(*pair)]
    cost = sum(phase.integral(u**2) for phase in phases) + 0.01 * phases[-1].end_time
    return Problem("drift", phases, minimise=cost, links=links)


def best_end(low):
    """With the end at T: (1 - W(T))^2 / T + T / 100, and W(T) = 0.9 + 0.2 (T - 0.5)."""

    def cost(t):
        return (0.1 - 0.2 * (t - 0.5)) ** 2 / t + t / 100

    return optimize.minimize_scalar(cost, bounds=(low, 1.1)).fun


def test_a_phase_that_ends_at_a_free_time_is_split_at_known_ones() -> None:
    certified(wind_over([0.0, 0.3, 0.5]), best_end(0.51))


def test_a_step_in_a_phase_with_a_free_time_is_told() -> None:
    with pytest.warns(StatementWarning, match="of which the later one may take no time"):
        problem = wind_over([0.0])
    assert problem.steps["part 0"] == ()


def test_the_later_of_two_phases_may_take_no_time() -> None:
    """Behind 0.9 s each second costs 5 more: without that the motion would end at 1 s."""
    x, u = State("x"), Control("u")
    early = Phase("early", {x: u}, {x: 0}, end=0.9)
    late = Phase("late", {x: u}, final={x: 1}, start=0.9, end=Between(0.9, 3))
    cost = early.integral(u**2) + late.integral(u**2 + 5) + late.end_time
    found = solve(Problem("late", [early, late], minimise=cost, links=joined(early, late)))
    assert found.objective == pytest.approx(1 / 0.9 + 0.9, rel=1e-6)
