"""Kinks: where an optimum rests on them, where a motion crosses them, and what is said of them."""

import dataclasses
import math

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import linprog

from ocp import (
    TIME,
    AdaptiveMesh,
    Between,
    Bound,
    Constant,
    Control,
    FixedMesh,
    Ipopt,
    Phase,
    Problem,
    Settings,
    SolveFailed,
    State,
    Unknown,
    Unverified,
    certify,
    joined,
    load,
    save,
    solve,
    with_objective,
)
from ocp.estimates.kink_crossings import KinkCrossings, kink_crossings
from ocp.mesh.dense_integral import dense_integral
from ocp.mesh.mesh import PhaseMesh, uniform
from ocp.mesh.trajectory import Evaluator
from ocp.numerics.kinks import KinkSurfaces, kinked_operations
from ocp.problem.kinks import crossable_kinks
from ocp.refinement.policies.kink_breakpoints import are_met, with_crossings, with_sides
from ocp.reformulate.form import reformulated
from ocp.reformulate.standard import STANDARD_REFORMULATIONS
from tests.ocp.problems import certified

x, v = State("x", "m"), State("v", "m/s")
u = Control("u", "m/s^2", lower=-1, upper=1)
free = Control("u", "m/s^2")


def burn(cost, rate=u):
    phase = Phase("burn", {x: v, v: rate}, {x: 0, v: 0}, {x: 1, v: 0}, end=3.0)
    return Problem("burn", phase, minimise=phase.integral(cost))


def pushed(force, cost=0.0):
    """From the place and speed (0, 1) to (0, -2) in 2 s against a force, with little effort."""
    phase = Phase("push", {x: v, v: free - force}, {x: 0, v: 1}, {x: 0, v: -2}, end=2.0)
    return Problem("push", phase, minimise=phase.integral(free**2 + cost))


def complaint(problem):
    with pytest.raises(SolveFailed) as failed:
        solve(problem, settings=Settings(solver=Ipopt(max_iterations=3)))
    return str(failed.value)


def test_the_operations_are_named():
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    assert kinked_operations(ca.fabs(a) + ca.fmax(a, b)) == ["fabs", "fmax"]
    assert kinked_operations(ca.sqrt(a**2 + b) * ca.sin(a)) == []


PARTS = "separate non-negative controls"


@pytest.mark.parametrize(
    ("problem", "words", "remedy"),
    [
        (burn(v * ca.fabs(u)), "integral of v*abs(u) over burn has a kink, by fabs", PARTS),
        (burn(u**2, u - v * ca.fabs(v)), "the rate of 'v' has a kink, by fabs", PARTS),
        (
            burn(ca.if_else(u * v > 0, u * v, 0)),
            "over burn contains if_else",
            "if it selects the larger of two values, write it with fmax",
        ),
    ],
    ids=["integrand", "rate", "choice"],
)
def test_what_has_a_kink_is_named_with_a_remedy(problem, words, remedy):
    said = complaint(problem)
    assert words in said
    assert remedy in said


def test_where_all_is_smooth_nothing_is_said_of_kinks():
    assert "kink" not in complaint(burn(u**4))


def test_an_answer_that_does_not_pass_names_it_too():
    stop = 50 * ca.fmax(0, x - 0.6)
    phase = Phase("stop", {x: v, v: u - stop}, {x: 0, v: 0}, {x: 0.62, v: 0.2}, end=3.0)
    problem = Problem("stop", phase, minimise=phase.integral(u**2))
    coarse = Settings(intervals=2, refinement=AdaptiveMesh(rounds=1))
    with pytest.raises(Unverified, match="the rate of 'v' has a kink, by fmax: write both sides"):
        solve(problem, settings=coarse)


price = Constant("price", value=2.0)

# 1 m from rest to rest in 3 s with |u| <= 1: thrust up to this speed, coast, brake
COASTING = (3.0 - math.sqrt(5.0)) / 2.0


MOVE = Phase("move", {x: v, v: u}, {x: 0, v: 0}, {x: 1, v: 0}, end=3.0)


def dear_then_cheap():
    """The least fuel of the move at twice the price in the first second.

    Full thrust during a from the start and during b from 1 s on, then coast and brake: a is looked
    for on a fine grid, and b follows from the distance, a quadratic equation.
    """
    a = np.linspace(0.0, COASTING, 400_001)
    # a - a^2/2 + a b + b^2/2 + (a + b) (2 - b - (a + b)/2) = 1
    linear, constant = a + 2 - 2 * a, a - a**2 / 2 + 2 * a - a**2 / 2 - 1
    b = (linear - np.sqrt(linear**2 + 4 * constant)) / 2
    return float(np.min(3 * a + 2 * b))


def least(cost, phase=MOVE, **bounds):
    return Problem("least", phase, minimise=cost, **bounds)


def solved(problem):
    """What is solved in place of a problem."""
    return reformulated(problem, STANDARD_REFORMULATIONS).problem


def controls(problem):
    """Names of the controls that are solved for, in the first phase."""
    return [control.name for control in solved(problem).controls[problem.phases[0].name]]


ON_A_KINK = {
    "fuel": (MOVE.integral(ca.fabs(u)), 2 * COASTING),
    "no recovery": (MOVE.integral(ca.fmax(0, u * v)), COASTING**2 / 2),
    "both ways": (MOVE.integral(ca.fabs(u * v)), COASTING**2),
    "recovery of 0.6": (MOVE.integral(ca.fmax(u * v, 0.6 * u * v)), 0.4 * COASTING**2 / 2),
    "lesser": (MOVE.integral(-ca.fmin(u, -u.symbol)), 2 * COASTING),
    "price": (price * MOVE.integral(ca.fabs(u) / 2), 2 * COASTING),
    "rising": (MOVE.integral((1 + TIME) * ca.fabs(u)), 5 * COASTING),
    "tariff": (MOVE.integral(ca.if_else(TIME < 1, 2, 1) * ca.fabs(u)), dear_then_cheap()),
    "nested": (
        MOVE.integral(3 - 2 * (1 - ca.fmax(ca.fmax(u, -u.symbol), -5))),
        3 + 4 * COASTING,
    ),
}


@pytest.mark.parametrize(("cost", "expected"), ON_A_KINK.values(), ids=ON_A_KINK)
def test_an_optimum_on_a_kink_is_found_and_certified(cost, expected):
    certified(least(cost), expected, 3e-6)


FACTORS = {
    "of both signs": (TIME - 1, False),
    "zero for a while": (ca.if_else(TIME < 1, 0, 1), False),
    "negative for a moment": (1 - 2 * ca.if_else(TIME < 1.0, TIME > 0.9999, 0), False),
    "of a constant and time": (price * (1 + TIME), False),
    "zero at one instant": ((TIME - 1.5) ** 2, True),
}


@pytest.mark.parametrize(("factor", "has_a_sign"), FACTORS.values(), ids=FACTORS)
def test_a_factor_of_time_without_a_sign_keeps_the_kink(factor, has_a_sign):
    problem = least(MOVE.integral(factor * ca.fabs(u)))
    assert controls(problem) == (["u", "abs(u)"] if has_a_sign else ["u"])


def test_a_factor_of_time_needs_an_end_of_it():
    endless = dataclasses.replace(MOVE, end=Between(1, math.inf, 3))
    assert controls(least(endless.integral(TIME * ca.fabs(u)), endless)) == ["u"]


def test_what_is_maximised():
    found = solve(Problem("most", MOVE, maximise=4 - MOVE.integral(ca.fabs(u))))
    assert found.objective == pytest.approx(4 - 2 * COASTING, rel=1e-6)
    assert found.value("objective") == pytest.approx(found.objective, rel=1e-9)


def test_the_statement_stays_and_its_form_shows_what_is_solved():
    stated = least(MOVE.integral(ca.fmax(0, u * v)))
    problem = solved(stated)
    control = problem.controls["move"][-1]
    assert (control.name, control.lower, control.upper) == ("max(0, u*v)", 0.0, math.inf)
    (side,) = problem.phases[0].bounds
    assert side.name == "max(0, u*v), lower limit 2"
    assert "integral of max(0, u*v) over move" in str(problem)
    assert stated.controls["move"] == (u,)
    assert not stated.phases[0].bounds
    # what has no such kinks is solved as it is
    assert solved(problem) is problem
    assert solved(stated) is problem


def test_one_expression_in_two_phases_is_one_control():
    first = Phase("first", {x: v, v: u}, {x: 0, v: 0}, end=1.5)
    second = Phase("second", {x: v, v: u}, final={x: 1, v: 0}, start=1.5, end=3.0)
    cost = sum(p.integral(ca.fabs(u)) for p in (first, second))
    problem = Problem("two", [first, second], minimise=cost, links=joined(first, second))
    form = solved(problem)
    assert len(form.controls["first"]) == 2
    assert form.controls["first"] == form.controls["second"]
    assert solve(problem).objective == pytest.approx(2 * COASTING, rel=1e-6)


def test_a_name_that_is_taken_gets_a_number():
    other = Control("abs(u)", lower=0, upper=1)
    phase = dataclasses.replace(MOVE, bounds=[Bound("other", other + u, lower=-5)])
    assert controls(least(phase.integral(ca.fabs(u)), phase)) == ["u", "abs(u)", "abs(u) (2)"]


def test_a_smaller_limit_is_what_it_costs_by():
    limit = Constant("limit", value=1.0)
    push = Control("u", "m/s^2", lower=-limit, upper=limit)
    phase = Phase("move", {x: v, v: push}, {x: 0, v: 0}, {x: 1, v: 0}, end=3.0)
    found = solve(least(phase.integral(ca.fabs(push)), phase))
    # the speed V satisfies V (3 - V/limit) = 1, and the fuel is 2 V
    slope = 2 * COASTING**2 / (2 * COASTING - 3)
    assert found.sensitivities()["limit"] == pytest.approx(slope, rel=1e-4)


@pytest.mark.parametrize(
    ("cost", "expected"),
    [
        # with breakpoints at the crossings, and a side of the kink given beside each
        (3 * ca.fabs(v.symbol), 10.276459747),
        (3 * ca.fmax(2 * x, 1.5 - x), 13.607320163),
    ],
)
def test_a_kink_may_be_crossed_as_well(cost, expected):
    certified(pushed(0, cost), expected)


@pytest.mark.parametrize("weight", [0.0, 0.01, 0.1])
def test_a_state_rests_on_the_kink_of_its_own_cost(weight):
    """From 1 m with at most 1 m/s to where nothing is paid, and there it stays."""
    speed = Control("speed", "m/s", lower=-1, upper=1)
    go = Phase("go", {x: speed}, {x: 1}, end=3.0)
    # at rest the Hamiltonian is zero, so that x = weight speed^2 where the speed has no limit
    problem = Problem("home", go, minimise=go.integral(ca.fabs(x) + weight * speed**2))
    found = certified(problem, 0.5 + weight - weight**2 / 6)
    assert found.sample(x, [2.5])[0] == pytest.approx(0.0, abs=1e-6)


fuel = ca.fabs(u.symbol)
BURNT, EFFORT = MOVE.integral(fuel), MOVE.integral(u**2)


@pytest.mark.parametrize(
    "stated",
    [
        {"maximise": BURNT},
        {"minimise": MOVE.integral(-fuel)},
        {"minimise": MOVE.integral(ca.fmin(u, 0))},
        {"minimise": MOVE.integral(fuel * v)},
        {"minimise": BURNT**2},
        {"minimise": EFFORT, "bounds": [BURNT >= 1]},
        {"minimise": EFFORT, "bounds": [Bound("b", BURNT, "1", 0, 1)]},
        {"minimise": BURNT, "bounds": [BURNT >= 1]},
        {"minimise": -price * BURNT},
        {"minimise": MOVE.integral((0.0 * price) * fuel)},
        {"minimise": MOVE.integral(ca.fabs(TIME - 1) * u**2)},
        {"minimise": MOVE.integral(ca.fabs(TIME - 1) + u**2)},
        {"minimise": MOVE.integral(fuel - ca.sin(fuel))},
    ],
)
def test_what_may_gain_by_more_is_left_as_it_is(stated):
    problem = Problem("kept", MOVE, **stated)
    assert solved(problem) is problem


def test_a_bound_of_another_integral_is_no_reason_to_leave_it():
    assert controls(least(BURNT, bounds=[MOVE.integral(u) <= 1])) == ["u", "abs(u)"]


def test_a_budget_of_fuel():
    # the least time with less fuel than the fastest motion burns: t1 = F/2, and t1 (T - t1) = 1
    phase = dataclasses.replace(MOVE, end=Between(0.5, 20))
    burnt = phase.integral(fuel)
    # what bounds nothing leaves the fastest motion as it is
    for most, fastest, expected in ((1.0, 0.5 + 1 / 0.5, 1.0), (5.0, 2.0, 2.0)):
        found = certified(least(phase.end_time, phase, bounds=[burnt <= most]), fastest)
        assert found.value(burnt) == pytest.approx(expected, rel=1e-6)


def test_sides_lie_below_their_control_all_along():
    found = solve(least(MOVE.integral(ca.fmax(0, u * v))))
    times = np.linspace(0, 3, 3001)
    power = found.sample(u, times) * found.sample(v, times)
    above = found.kept_iterate.trajectory.phases[0].polynomial("max(0, u*v)").at(times)[:, 0]
    assert np.all(above >= np.maximum(power, 0) - 1e-6)
    assert np.trapezoid(above - np.maximum(power, 0), times) < 1e-6


def test_coarse_controls_of_the_plant_are_paid_for_what_they_do():
    """A control that is held in each interval burns what it does, and not its largest power."""
    cost = MOVE.integral(ca.fmax(0, u * v) + 0.1 * u**2)
    settings = Settings(controls="constant", refinement=FixedMesh(), verify=False)
    found = solve(least(cost), settings=settings)
    assert found.value(cost) == pytest.approx(found.objective, rel=1e-5)


def test_a_kink_may_be_left_as_it_is(tmp_path):
    stated = pushed(0, 3 * ca.fabs(v.symbol))
    kept = solve(stated, settings=Settings(reformulations=()))
    assert kept.form.problem is stated

    save(kept, tmp_path / "kept.ocp")
    found = load(tmp_path / "kept.ocp")
    assert found.form.problem is found.problem
    assert [control.name for control in found.problem.controls["push"]] == ["u"]
    assert found.value("objective") == pytest.approx(10.276459747, rel=1e-6)
    assert certify(found).passed


def test_a_bound_that_leaves_room_has_the_value_that_was_stated(tmp_path):
    burnt = Bound("burnt", BURNT, "m/s", upper=5.0)
    found = solve(least(EFFORT, bounds=[burnt]))
    # u = 2/3 - 4/9 t burns twice the largest speed, which is 1/2
    assert found.value("burnt") == pytest.approx(1.0, rel=1e-6)
    save(found, tmp_path / "least.ocp")
    assert load(tmp_path / "least.ocp").value("burnt") == pytest.approx(1.0, rel=1e-6)
    again = solve(dataclasses.replace(found.problem, scale=2.0))
    assert again.value("burnt") == pytest.approx(1.0, rel=1e-6)


def test_a_sum_over_many_levels_keeps_its_kinks():
    many = sum(ca.fabs(x - k / 20) for k in range(21))
    assert controls(least(MOVE.integral(many + fuel))) == ["u", "abs(u)"]


def test_another_objective_is_stated_of_what_was_stated():
    problem = least(BURNT)
    smooth = with_objective(problem, EFFORT)
    assert controls(smooth) == ["u"]
    assert controls(with_objective(problem, EFFORT, [BURNT <= 1.0])) == ["u", "abs(u)"]
    assert controls(with_objective(problem, problem.objective + EFFORT)) == ["u", "abs(u)"]
    assert controls(with_objective(smooth, BURNT)) == ["u", "abs(u)"]


def test_a_state_that_sums_up_a_kink_is_told_to_be_an_integral():
    energy = State("energy", "J")
    rates = {x: v, v: u, energy: ca.fmax(0, u * v)}
    ends = {x: 0, v: 0, energy: 0}, {x: 1, v: 0}
    phase = Phase("move", rates, *ends, end=3.0)
    short = Settings(solver=Ipopt(max_iterations=20))
    with pytest.raises(SolveFailed, match="write it as an integral of phase 'move'"):
        solve(least(phase.at_end(energy), phase), settings=short)


def test_a_cost_that_is_too_small_between_the_points_is_refused():
    """A control above |x - r| is a polynomial, and passes below the kink where x crosses r."""
    problem = least(MOVE.integral(ca.fabs(x - 0.3) + 0.01 * u**2))
    found = solve(problem)
    # the objective is that of the kink itself, along the replayed motion
    stated = dense_integral(found.evaluator, found.replayed, MOVE.integral(ca.fabs(x - 0.3)))
    effort = dense_integral(found.evaluator, found.replayed, EFFORT)
    assert found.objective == pytest.approx(stated + 0.01 * effort, rel=1e-6)
    assert certify(found).passed

    # on a coarse mesh the cost is too small between the points, and that is refused
    coarse = solve(problem, settings=Settings(intervals=3, refinement=FixedMesh(), verify=True))
    assert not coarse.verification.passed
    reasons = coarse.verification.reasons
    assert any(
        "the costs between the points of the mesh are too small" in reason for reason in reasons
    )
    assert not certify(coarse).passed


rate = Control("rate", "m/s")
p = Unknown("p", "m", lower=-5, upper=5)
drift = Phase("drift", {x: rate}, {x: 0}, end=1.0)
effort, reached = drift.integral(rate**2), drift.at_end(x)

# From 0 to y in 1 s the least effort is y^2, and the derivative of the rest is that of one side, or
# the optimum is on the kink
STATEMENTS = {
    "missed point": (3 * ca.fabs(reached - 1) + effort, 1.0),
    "larger of two": (ca.fmax(reached, 1 - reached) + 0.1 * effort, 0.525),
    "off the kink": (ca.fabs(reached - 1) + effort, 0.75),
    "lesser one, negative": (effort - ca.fmin(reached, 2 - reached), -0.25),
    # on the kink of the inner term: 2 max(|y - 1|, 0.2) + y^2 at y = 0.8
    "kink in a side": (2 * ca.fmax(ca.fabs(reached - 1), 0.2) + effort, 1.04),
    "of an unknown": (4 * ca.fabs(p - 2) + (p - reached) ** 2 + effort, 2.0),
}


@pytest.mark.parametrize(("cost", "least"), STATEMENTS.values(), ids=STATEMENTS)
def test_kinks_of_what_is_minimised(cost, least):
    found = solve(Problem("ends", drift, minimise=cost))
    assert found.objective == pytest.approx(least, rel=1e-6)
    assert found.value(cost) == pytest.approx(found.objective, abs=1e-6)


def test_an_end_that_is_maximised_has_the_other_sign():
    found = solve(Problem("ends", drift, maximise=-3 * ca.fabs(reached - 1) - effort))
    assert found.objective == pytest.approx(-1.0, rel=1e-6)


def test_a_kink_that_gains_stays():
    problem = Problem("ends", drift, minimise=effort - ca.fabs(reached - 1), bounds=[reached <= 5])
    found = solve(problem)
    assert found.form.problem is problem
    # y^2 - (1 - y) for y < 1
    assert found.objective == pytest.approx(-1.25, rel=1e-6)


def test_an_answer_at_a_kink_is_stored(tmp_path):
    found = solve(Problem("ends", drift, minimise=STATEMENTS["missed point"][0]))
    save(found, tmp_path / "ends")
    assert load(tmp_path / "ends").objective == found.objective


def pushed_by_parts():
    """The same motion into a soft stop, in phases before, at and behind it."""
    came, went = Between(0.3, 1.6, guess=0.9), Between(0.5, 1.9, guess=1.3)
    before = Phase("before", {x: v, v: free}, {x: 0, v: 1}, {x: 1}, end=came)
    at = Phase("at", {x: v, v: free - 10 * (x - 1)}, final={x: 1}, start=came, end=went)
    behind = Phase("behind", {x: v, v: free}, final={x: 0, v: -2}, start=went, end=2.0)
    phases = before, at, behind
    effort = sum(phase.integral(free**2) for phase in phases)
    return Problem(
        "parts", phases, minimise=effort, links=(*joined(before, at), *joined(at, behind))
    )


# a parabola (t - 1/2)^2 + height, whose kinks are those of |x|
def parabola(height, kinked=None):
    phase = Phase("fall", {x: v, v: 2.0}, {x: 0.25 + height, v: -1}, end=1.0)
    cost = ca.fabs(x) if kinked is None else kinked
    # of a square it is not known that the integral only costs, so that its kinks stay
    return Problem("fall", phase, minimise=phase.integral(cost) ** 2 + phase.at_end(v))


def crossings_of(problem):
    solution = solve(problem)
    return kink_crossings(solution.trajectory, Evaluator(problem), problem.phases[0].name)


@pytest.mark.parametrize(
    ("expression", "above", "below"),
    [
        (lambda a: ca.fabs(a), lambda a: a, lambda a: -a),
        (lambda a: ca.sign(a) * a, lambda a: a, lambda a: -a),
        (lambda a: ca.fmax(3 * a, a), lambda a: 3 * a, lambda a: a),
        (lambda a: ca.fmin(3 * a, a), lambda a: a, lambda a: 3 * a),
        (lambda a: ca.if_else(a > 0, 2 * a, a), lambda a: 2 * a, lambda a: a),
        (lambda a: ca.if_else(a >= 0, 2 * a, a), lambda a: 2 * a, lambda a: a),
    ],
    ids=["fabs", "sign", "fmax", "fmin", "lt", "le"],
)
def test_an_expression_goes_on_as_on_a_given_side(expression, above, below):
    a, side = ca.SX.sym("a"), ca.SX.sym("side")
    kinks = KinkSurfaces.of([expression(a)])
    (held,) = kinks.with_sides([expression(a)], side)
    function = ca.Function("held", [a, side], [held])
    surface = ca.Function("surface", [a], list(kinks.values))

    for value in (-0.7, 0.3):
        # which side is called 1 is the surface's business
        up = float(np.sign(float(surface(value)) * value))
        assert float(function(value, up)) == pytest.approx(float(above(value)))
        assert float(function(value, -up)) == pytest.approx(float(below(value)))
        assert float(function(value, 0)) == pytest.approx(float(expression(ca.DM(value))))


def test_a_kink_is_known_again_in_another_expression():
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    kinks = KinkSurfaces.of([ca.fabs(a - b), ca.fmax(a, 1), ca.fabs(a - b) * b])
    assert len(kinks.keys) == 2
    side = ca.SX.sym("side", 2)
    held = kinks.with_sides([7 * ca.fabs(a - b), ca.fabs(a)], side)
    function = ca.Function("held", [a, b, side], held)
    # the second one is no kink of the first three
    assert [float(value) for value in function(1, 3, ca.DM([1, 0]))] == [-14.0, 1.0]


def test_kinks_of_controls_are_not_crossed_by_a_motion():
    problem = pushed(ca.fmax(x - 1, 0) + ca.fabs(free) + ca.fmax(x, free))
    (surface,) = crossable_kinks(problem, "push").values
    assert not ca.depends_on(surface, free.symbol)


@pytest.mark.parametrize(
    ("limits", "sign", "count"),
    [({"lower": 0}, 1, 0), ({"lower": 0}, -1, 0), ({"upper": -1}, 1, 0), ({"lower": -1}, 1, 1)],
)
def test_a_signal_that_keeps_its_sign_makes_no_kink(limits, sign, count):
    speed, force = State("speed", "m/s", **limits), Control("force", "N")
    drag = speed * ca.fabs(sign * speed)
    push = Phase("push", {speed: force - drag}, end=1)
    problem = Problem("push", push, minimise=push.integral(force**2))
    assert len(crossable_kinks(problem, "push").values) == count


def test_crossings_are_found_where_they_are():
    crossings = crossings_of(parabola(-0.0625))
    assert crossings.places == pytest.approx([0.25, 0.75], abs=1e-9)
    assert crossings.behind.tolist() == [-1, 1]
    moving = crossings_of(parabola(-0.0625, ca.fabs(x + 0.0625 - TIME**2)))
    assert moving.places == pytest.approx([0.25], abs=1e-9)

    # a motion that touches a kink does not cross it
    assert crossings_of(parabola(0.0)).count == 0
    assert crossings_of(parabola(1e-3)).count == 0


def test_a_step_is_no_kink():
    with pytest.warns(UserWarning, match="jumps"):
        problem = parabola(-0.0625, ca.if_else(x > 0, 2 + x, 1))
    assert crossings_of(problem).count == 0


def test_a_soft_stop_costs_what_it_costs_in_phases():
    solution = solve(pushed(10 * ca.fmax(x - 1, 0)))
    parts = solve(pushed_by_parts())
    assert certify(parts).passed
    assert certify(solution).passed
    assert solution.objective == pytest.approx(parts.objective, rel=1e-7)

    # a breakpoint at each crossing, and hardly any other one
    (motion,), places = solution.trajectory.phases, [p.end for p in parts.trajectory.phases[:2]]
    assert [np.abs(motion.breakpoints - t).min() for t in places] == pytest.approx([0, 0], abs=1e-6)
    assert motion.intervals <= 24


@pytest.mark.parametrize(
    "problem",
    [
        pushed(10 * ca.if_else(x > 1, x - 1, 0)),
        pushed(100 * ca.fmax(x - 1, 0) ** 2),
        pushed(2 * v * ca.fabs(v)),
        pushed(10 * ca.fmax(x - 0.5 - 0.1 * TIME, 0)),
    ],
    ids=["if", "square", "drag", "moving"],
)
def test_what_crosses_a_kink_is_certified(problem):
    solution = solve(problem)
    certificate = certify(solution)
    assert certificate.passed, certificate
    assert solution.trajectory.phases[0].intervals <= 30
    assert all(entry.iterations <= 5 for entry in solution.mesh_iterations[1:])


def test_a_saved_solution_keeps_its_sides(tmp_path):
    solution = solve(pushed(10 * ca.fmax(x - 1, 0)))
    save(solution, tmp_path / "stop.ocp")
    again = load(tmp_path / "stop.ocp")
    sides = again.mesh.phases[0].sides
    assert sides is not None
    assert np.array_equal(sides, solution.mesh.phases[0].sides)
    assert certify(again).passed


def test_a_problem_without_kinks_gives_no_sides():
    solution = solve(pushed(ca.sin(x)))
    assert solution.mesh.phases[0].sides is None


def crossed(breakpoints, places, behind=(1, -1)):
    """A mesh with two breakpoints for crossings of one kink, and where these are."""
    mesh = uniform(10, 4)
    sides = np.zeros((10, 1), dtype=np.int64)
    fractions = mesh.breakpoints.copy()
    for number, (at, side) in enumerate(zip((3, 7), behind, strict=True)):
        fractions[at] = breakpoints[number]
        sides[at - 1], sides[at] = -side, side
    mesh = PhaseMesh(fractions, mesh.degrees, sides=sides)
    off = np.abs(np.asarray(places) - np.asarray(breakpoints))
    zeros = np.zeros(2, dtype=np.int64)
    found = KinkCrossings(
        np.array(places), zeros, np.array(behind), off, 1, np.zeros(10, dtype=bool)
    )
    return mesh, found


def test_breakpoints_that_come_no_nearer_are_given_up():
    nearing = [crossed([0.3, 0.7], [0.3 + 0.01 * 0.5**k, 0.7])[1] for k in range(8)]
    staying = [crossed([0.3, 0.7], [0.31, 0.7])[1] for _ in range(5)]
    assert are_met(nearing, 10)
    assert are_met(staying[:4], 10)
    assert not are_met(staying, 10)


def test_a_breakpoint_follows_its_crossing_and_leaves_known_times_alone():
    solved, crossings = crossed([0.3, 0.7], [0.305, 0.7])
    moved = with_crossings(solved, crossings, np.empty(0), 1e-8)
    assert moved.moved.tolist() == [True, False]
    expected = np.sort(np.append(np.delete(uniform(10, 4).breakpoints, 3), 0.305))
    assert moved.mesh.breakpoints == pytest.approx(expected)
    held = with_crossings(solved, crossings, np.array([0.3]), 1e-8)
    assert {0.3, 0.305} <= set(np.round(held.mesh.breakpoints, 12).tolist())

    sides = with_sides(moved.mesh, moved.crossings, 1e-8).sides
    assert sides is not None
    assert sides.ravel().tolist() == [0, 0, -1, 1, 0, 0, 1, -1, 0, 0]


def test_sides_reach_as_far_as_a_crossing_may_move():
    # the first one was 0.009 from its breakpoint, the second one on it
    _, near = crossed([0.309, 0.7], [0.3, 0.7])
    mesh = uniform(40, 4)
    sides = with_sides(mesh, near, 1e-8).sides
    assert sides is not None
    assert np.flatnonzero(sides[:, 0] == 1).tolist() == [12, 13, 14, 15, 27]
    assert np.flatnonzero(sides[:, 0] == -1).tolist() == [8, 9, 10, 11, 28]
    # and no farther than half-way to the next one, of which each keeps its own
    far = with_sides(mesh, near, 1e-8, np.ones(2)).sides
    assert far is not None
    assert far.ravel().tolist() == [-1] * 12 + [1] * 16 + [-1] * 12


HOURS = 24
energy = State("energy", "MWh", lower=0, upper=4)
power = Control("power", "MW", lower=-1, upper=1)


def lossy(rate, level):
    """A store at a price per hour around a level [EUR/MWh], its cost and its problem."""
    phase = Phase("day", {energy: rate}, {energy: 2}, {energy: 2}, end=HOURS)
    cost = phase.integral((level + 20 * ca.sin(2 * ca.pi * ca.floor(TIME) / HOURS)) * power)
    return cost, Problem("store", phase, minimise=cost)


def least_cost(level):
    """The least cost by a linear program, with charge and discharge constant in each hour."""
    price = level + 20 * np.sin(2 * np.pi * np.arange(HOURS) / HOURS)
    into = np.tril(np.ones((HOURS, HOURS)))
    stored = np.hstack([0.95 * into, -into / 0.95])
    limits = {"A_ub": np.vstack([stored, -stored]), "b_ub": np.full(2 * HOURS, 2.0)}
    back = {"A_eq": stored[-1:], "b_eq": [0.0]}
    found = linprog(np.concatenate([price, -price]), **limits, **back, bounds=(0, 1))
    assert np.minimum(found.x[:HOURS], found.x[HOURS:]).max() < 1e-9
    return found.fun


# what is charged, however it is written
eta = Constant("efficiency", value=0.95)
RATES = {
    "largest values": 0.95 * ca.fmax(power, 0) - ca.fmax(-power, 0) / 0.95,
    "least value": ca.fmin(0.95 * power, power / 0.95),
    "constant": eta * ca.fmax(power, 0) + ca.fmin(power, 0) / eta,
}


@pytest.mark.parametrize("rate", RATES.values(), ids=RATES)
def test_a_store_with_losses_costs_what_a_linear_program_says(rate):
    cost, problem = lossy(rate, 50)
    found = solve(problem)
    assert least_cost(50) == pytest.approx(-100.902536, abs=1e-6)
    assert found.objective == pytest.approx(least_cost(50), rel=1e-6)
    assert found.value(cost) == pytest.approx(found.objective, rel=1e-9)


def test_the_control_of_the_statement_is_sampled_and_stored(tmp_path):
    rate = RATES["largest values"]
    found = solve(lossy(rate, 50)[1])
    times = np.arange(HOURS) + 0.5
    drawn = found.sample(power, times)
    assert np.abs(drawn).max() <= 1.0
    stated = 0.95 * np.maximum(drawn, 0.0) - np.maximum(-drawn, 0.0) / 0.95
    assert found.sample(rate, times) == pytest.approx(stated, abs=1e-12)
    save(found, tmp_path / "store")
    assert load(tmp_path / "store").objective == found.objective


def test_the_statement_of_the_user_stays_and_can_be_used_again():
    phase = Phase("day", {energy: RATES["largest values"]}, {energy: 2}, {energy: 2}, end=HOURS)
    bought = phase.integral(power)
    for limit in (1.0, 2.0):
        problem = least(bought, phase, bounds=[phase.integral(power**2) <= limit])
        assert controls(problem) == ["power", "|power|"]
    assert [symbol.name for symbol in phase.symbols] == ["energy", "power"]


@pytest.mark.parametrize("level", [-50, 10])
def test_a_price_that_pays_for_losses_is_told(level):
    with pytest.raises(
        SolveFailed,
        match=r"a positive and a negative part at the same time .* two non-negative controls",
    ):
        solve(lossy(RATES["largest values"], level)[1])


@pytest.mark.parametrize("intervals", [10, pytest.param(24, marks=pytest.mark.slow)])
def test_a_drive_that_feeds_nothing_back_is_crossed_at_rest(intervals: int) -> None:
    """A cart turns back at full thrust, and the cost of its power bends where its speed is none."""
    place = State("x", "m", lower=-1.2, upper=1.2)
    rates = {place: v, v: u - 0.3 * v}
    phase = Phase("go", rates, {place: 0, v: 1}, {place: -1, v: 0}, end=4.0)
    problem = Problem("turn", phase, minimise=phase.integral(ca.fmax(0, u * v)))
    certified(problem, 0.2954279, settings=Settings(intervals=intervals))
