"""What users may state: known times, tables, vectors, relations, guesses, intervals by phase."""

import itertools
import math
from dataclasses import replace

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
    Interpolant,
    InvalidNumber,
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
from ocp.numerics.expression_graph import expression_text, graph_of
from ocp.numerics.polynomial_expressions import polynomial_degree
from ocp.problem.instants import stepping_times
from ocp.problem.parameters import parameters_of
from ocp.problem.relations import meant_by
from tests.ocp.problems import certified, double_integrator

EDGES = [1.3, 2.7, 4.1, 5.5, 7.2, 8.9]
PRICES = [3.0, 1.0, 2.5, 0.7, 4.0, 1.4, 2.2]


def charging(price, **options):
    """A leaky store that is charged while energy has a price that steps."""
    energy, power = State("energy", "J"), Control("power", "W", lower=0, upper=2)
    ends = {"initial": {energy: 0}, "final": {energy: 5}, "end": 10.0}
    charge = Phase("charge", {energy: power - 0.1 * energy}, **ends, **options)
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
    x, v, u, rates = double_integrator(lower=-p)
    ends, up = ({x: 0, v: 0}, {x: 1, v: 0}), Bound("up", u, upper=p)
    move = Phase("move", rates, *ends, end=2.0, bounds=[up])
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
    guess = {x: ByFraction(lambda s: s**2), u: ByFraction(([0, 1], [0.0, 0.5]))}
    go = Phase("go", {x: u}, {x: 0}, {x: 1}, end=Between(0.1, 8, 4), guess=guess)
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
        Phase(f"part {i}", {x: drift + u}, start=start, end=end)
        for i, (start, end) in enumerate(zip(phase_times, ends, strict=True))
    ]
    phases[0] = replace(phases[0], initial={x: 0})
    phases[-1] = replace(phases[-1], final={x: 1})
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
    with pytest.warns(StatementWarning, match="the later of which may have zero duration"):
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


POINTS = np.linspace(0, 1, 11)
SMOOTH = ca.interpolant("gain", "bspline", [POINTS], 1 + POINTS**2)  # exact: the spline is cubic
BROKEN = ca.interpolant("broken", "linear", [POINTS], 1 + POINTS**2)


def moved_by(factor, **options):
    """One metre in one second at a speed times a factor, with least effort."""
    x, speed = State("x", "m"), Control("speed", "m/s")
    phase = Phase("move", {x: speed * factor(x)}, initial={x: 0}, final={x: 1}, end=1.0, **options)
    return Problem("table", phase, minimise=phase.integral(speed**2))


def linear_mean(power):
    """Mean over [0, 1] of a power of the broken line, by Gauss quadrature of each piece."""
    nodes, weights = np.polynomial.legendre.leggauss(12)
    inside = 0.05 * (nodes + 1) + POINTS[:-1, None]
    return float((np.interp(inside, POINTS, 1 + POINTS**2) ** power @ weights).sum() * 0.05)


@pytest.mark.parametrize(
    ("problem", "optimum"),
    [
        # by time J = 1 / integral of factor^2, by place the square of the integral of 1 / factor
        (moved_by(lambda _: SMOOTH(TIME)), 1 / (1 + 2 / 3 + 1 / 5)),
        (moved_by(SMOOTH), (math.pi / 4) ** 2),
        (moved_by(lambda _: BROKEN(TIME), breakpoints=POINTS), 1 / linear_mean(2)),
        (moved_by(BROKEN), linear_mean(-1) ** 2),
    ],
    ids=["smooth, time", "smooth, place", "broken, time", "broken, place"],
)
def test_a_table_is_solved_like_a_formula(problem, optimum):
    certified(problem, optimum)


def test_a_table_is_printed_by_its_name():
    assert "gain(x)" in str(moved_by(SMOOTH))


def test_a_solution_with_a_function_of_casadi_is_not_saved(tmp_path):
    found = solve(moved_by(SMOOTH))
    with pytest.raises(TypeError, match=r"'gain' cannot be saved.*make it with ocp\.Interpolant"):
        save(found, tmp_path / "found.zip")


def test_a_table_of_two_axes_has_its_values_in_their_order():
    lift = Interpolant("lift", [[0, 1, 2], [0, 10]], [[0, 10], [1, 11], [2, 12]], kind="linear")
    x = ca.SX.sym("x", 2)
    value = ca.Function("value", [x], [lift(x[0], x[1])])
    assert float(value([1.25, 4.0])) == pytest.approx(5.25, rel=1e-12)  # x + y by its values


def test_a_table_that_is_not_finite_is_named():
    values = np.where(POINTS < 0.5, 1.0, np.nan)
    table = ca.interpolant("torn", "linear", [POINTS], values)
    with pytest.raises(InvalidNumber, match=r"derivative of 'x'.*torn"):
        solve(moved_by(lambda _: table(TIME)))


def test_a_function_of_several_numbers_goes_there_and_back():
    a, b = ca.SX.sym("a", 2), ca.SX.sym("b")
    several = ca.Function("several", [a, b], [a * b, ca.sin(a[0])], {"never_inline": True})
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    first, second = several(ca.vertcat(x, x * y), y)
    expression = first[1] + 2 * second
    graph = graph_of([expression, x], [x, y])

    rebuilt = ca.Function("rebuilt", [x, y], graph.rebuilt([x, y]))
    assert [float(value) for value in rebuilt(0.3, 0.7)] == pytest.approx(
        [0.3 * 0.7**2 + 2 * math.sin(0.3), 0.3]
    )
    assert expression_text(second) == "several(x, x*y, y)"
    assert polynomial_degree(expression, [x], [1]) is None
    assert polynomial_degree(several(ca.vertcat(x, 1), 2)[0][1] + y, [y], [3]) == 3


def turned(q, w):
    """Rate of a quaternion under an angular velocity in the body's axes."""
    return 0.5 * ca.vertcat(
        -q[1] * w[0] - q[2] * w[1] - q[3] * w[2],
        q[0] * w[0] + q[2] * w[2] - q[3] * w[1],
        q[0] * w[1] - q[1] * w[2] + q[3] * w[0],
        q[0] * w[2] + q[1] * w[1] - q[2] * w[0],
    )


def test_an_attitude_turns_by_a_right_angle_with_least_effort():
    q, w = State("attitude", shape=4), State("rate", "rad/s", shape=3)
    torque = Control("torque", "rad/s^2", shape=3, lower=-5, upper=[5, 5, 6])
    end = np.cos(np.pi / 4)
    slew = Phase(
        "slew",
        dynamics={q: turned(q, w), w: torque},
        initial={q: [1, 0, 0, 0], w: 0},
        # the last entry follows from the norm
        final={q[1]: 0, q[2]: 0, q[3]: end, w: [0, 0, 0]},
        end=2.0,
        guess={q: lambda t: np.array([1 + 0 * t, 0 * t, 0 * t, end * t / 2])},
    )
    found = solve(Problem("slew", slew, minimise=slew.integral(ca.sumsqr(torque))))
    # about one axis: 12 (angle)^2 / T^3
    assert found.objective == pytest.approx(12 * (np.pi / 2) ** 2 / 8, rel=1e-8)
    places = found.sample(q, [0.0, 1.0, 2.0])
    assert places.shape == (4, 3)
    np.testing.assert_allclose(
        places[:, 1], [np.cos(np.pi / 8), 0, 0, np.sin(np.pi / 8)], atol=1e-6
    )
    np.testing.assert_allclose(found.sample("attitude[3]", [2.0]), [end], atol=1e-9)


def test_functions_of_casadi_and_relations_take_vectors():
    q, v = State("q", shape=2), State("v", "1/s", shape=2)
    u, k = Control("u", shape=2), Unknown("k", shape=2, lower=0, upper=[1, 2], guess=[0.5, 1])
    a, b = ca.SX.sym("a", 2), ca.SX.sym("b", 2)
    rate = ca.Function("rate", [a, b], [a - 2 * b])
    phase = Phase("p", {q: rate(v, q), v: u}, bounds=[q <= 3, ca.dot(q, v) <= 1], end=1.0)
    assert [bound.name for bound in phase.bounds[:2]] == ["q[0] <= 3", "q[1] <= 3"]
    assert str(phase.dynamics[q[1]]) == "(v[1]-(2.*q[1]))"
    assert (k[0].upper, k[1].upper, k[1].guess) == (1, 2, 1)
    assert repr(q) == "State('q', '1', shape=2)"


def test_pairs_and_tables_of_a_vector():
    q, u = State("q", shape=2), Control("u", shape=2)
    phase = Phase(
        "p",
        {q: u},
        {q: [0, 0]},
        {q: ([1, 2], [3, 4])},
        end=1.0,
        guess={q: ([0, 1], [[0, 0], [2, 3]]), u: [1, 2]},
    )
    assert [phase.final[c] for c in q] == [(1, 3), (2, 4)]
    assert [phase.guess[c] for c in u] == [1, 2]
    assert [phase.guess[c][1].tolist() for c in q] == [[0, 2], [0, 3]]


x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "N")
c, t = Constant("c", "m", 2.0), Unknown("T", "s", lower=1.0, upper=9.0)
TRAVEL = Phase("travel", {x: v, v: u}, end=1.0)
INF = math.inf


def bound_of(relation, where):
    return Bound(**vars(meant_by(relation, where)))


def evaluated(expression):
    """An expression of x, v and c at 0.3, 0.7 and 2."""
    symbols = [s.symbol for s in (x, v, c)]
    return float(ca.Function("f", symbols, [ca.SX(expression)])(0.3, 0.7, 2.0))


@pytest.mark.parametrize(
    ("relation", "name", "unit", "lower", "upper"),
    [
        (x <= 2, "x <= 2", "m", -INF, 2.0),
        (x < 2, "x <= 2", "m", -INF, 2.0),
        (x >= 2, "x >= 2", "m", 2.0, INF),
        (np.float64(2) >= x, "x <= 2", "m", -INF, 2.0),
        (x == 2, "x == 2", "m", 2.0, 2.0),
        (x <= c, "x <= c", "m", -INF, 2.0),
        (c + 1 <= x, "x >= c + 1", "m", 3.0, INF),
        (ca.sin(x) >= 0, "sin(x) >= 0", "1", 0.0, INF),
        (-3 * x <= 6, "-3*x <= 6", "1", -INF, 6.0),
        (x - 3 <= 6, "x - 3 <= 6", "m", -INF, 6.0),
        (ca.fabs(x) / 2 <= 6, "abs(x)/2 <= 6", "1", -INF, 6.0),
        (TRAVEL.at_end(x) <= 2, "x at the end of travel <= 2", "m", -INF, 2.0),
        (TRAVEL.peak(u, unit="N") <= 3, "peak of u over travel <= 3", "N", -INF, 3.0),
        (TRAVEL.integral(u**2) <= c, "integral of u^2 over travel <= c", "1", -INF, 2.0),
        (TRAVEL.end_time <= 2 * t, "end of travel <= 2*T", "s", -INF, 0.0),
    ],
)
def test_name_unit_and_limits_are_derived(relation, name, unit, lower, upper):
    bound = bound_of(relation, "phase 'travel'")
    assert (bound.name, bound.unit) == (name, unit)
    assert [evaluated(bound.lower), evaluated(bound.upper)] == [lower, upper]


def test_where_both_sides_vary_their_difference_is_bounded():
    bound = bound_of(x * v <= ca.sin(x), "phase 'travel'")
    assert (bound.lower, bound.upper) == (-INF, 0.0)
    assert evaluated(bound.expression) == 0.3 * 0.7 - math.sin(0.3)
    assert bound_of(x == v, "phase 'travel'").is_equation


def test_a_limit_of_constants_makes_an_equation_too():
    assert bound_of(x == c + 1, "phase 'travel'").is_equation


def test_relations_stand_beside_bounds_in_a_statement():
    phase = Phase("go", {x: v, v: u}, {x: 0}, bounds=[v <= 2, v >= -1], end=1.0)
    problem = Problem("go", phase, maximise=phase.at_end(x), bounds=[phase.at_end(v) == 0])
    assert [b.name for b in phase.bounds] == ["v <= 2", "v >= -1"]
    assert [b.name for b in problem.bounds] == ["v at the end of go == 0"]


@pytest.mark.parametrize(
    ("relation", "message"),
    [
        (x, "'x', which is not a relation; write a relation such as x <= 2, or Bound"),
        (x != 2, "'x != 2', which is not a relation"),
        (3, "is 3; write a relation such as x <= 2"),
        (True, "is True; write"),
        ("x <= 2", "is 'x <= 2'; write"),
        (ca.logic_and(x <= 2, x >= 0), "combines two relations: 'x <= 2 and 0 <= x'; give each"),
        (x <= x, "always satisfied"),
        (c <= 2, "relates numbers and constants only"),
        (x <= INF, "'x <= inf' has neither a lower nor an upper limit"),
        (x <= math.nan, "is nan; give a number"),
        (ca.vertcat(x, v) <= 1, "shape 2x1; give one scalar expression for each entry"),
        (ca.SX.sym("y") <= 1, "a bound of phase 'travel' contains the symbol 'y', which no State"),
    ],
)
def test_what_is_no_relation_is_answered_with_what_to_write(relation, message):
    with pytest.raises(StatementError, match=message):
        bound_of(relation, "phase 'travel'")


@pytest.mark.parametrize(
    ("relation", "text"),
    [
        (v <= 0.12, r"v <= 0\.12"),
        (ca.logic_and(v <= 1, v >= 0), "v <= 1 and 0 <= v"),
        (TRAVEL.at_end(v) <= 1, r"\(v at the end of travel\) <= 1"),
    ],
)
def test_a_relation_is_no_expression_of_a_bound(relation, text):
    words = (
        f"the expression of the bound 'b' is '{text}', which is 0 or 1; give the relation itself"
    )
    with pytest.raises(StatementError, match=words):
        Bound("b", relation, upper=1)


def test_a_relation_inside_an_expression_may_be_bounded():
    for expression in (ca.if_else(x <= 1, v, u), ca.if_else(x <= 1, 1, 0), x * (v <= 1)):
        assert Bound("b", expression, upper=1).upper == 1
