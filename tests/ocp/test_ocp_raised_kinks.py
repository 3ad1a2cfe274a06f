"""Costs with a kink at which the optimum rests: fuel, energy that is not fed back, dead bands."""

import dataclasses
import math

import casadi as ca
import numpy as np
import pytest

from ocp import (
    TIME,
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
    certify,
    joined,
    load,
    save,
    solve,
    with_objective,
)
from ocp.mesh.dense_integral import dense_integral
from ocp.reformulate.form import reformulated
from ocp.reformulate.standard import STANDARD

x, v = State("x", "m"), State("v", "m/s")
u = Control("u", "m/s^2", lower=-1, upper=1)
price = Constant("price", value=2.0)

# 1 m from rest to rest in 3 s with |u| <= 1: thrust up to this speed, coast, brake
COASTING = (3.0 - math.sqrt(5.0)) / 2.0


def move(**options):
    return Phase("move", {x: v, v: u}, {x: 0, v: 0}, {x: 1, v: 0}, end=3.0, **options)


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


def least(cost, **options):
    phase = move(**options)
    return Problem("least", phase, minimise=cost(phase))


def solved(problem):
    """What is solved in place of a problem."""
    return reformulated(problem, STANDARD).problem


def controls(problem):
    """Names of the controls that are solved for, in the first phase."""
    return [control.name for control in solved(problem).controls[problem.phases[0].name]]


@pytest.mark.parametrize(
    ("cost", "expected"),
    [
        (lambda p: p.integral(ca.fabs(u)), 2 * COASTING),
        (lambda p: p.integral(ca.fmax(0, u * v)), COASTING**2 / 2),
        (lambda p: p.integral(ca.fabs(u * v)), COASTING**2),
        (lambda p: p.integral(ca.fmax(u * v, 0.6 * u * v)), 0.4 * COASTING**2 / 2),
        (lambda p: p.integral(-ca.fmin(u, -u.symbol)), 2 * COASTING),
        (lambda p: price * p.integral(ca.fabs(u) / 2), 2 * COASTING),
        (lambda p: p.integral((1 + TIME) * ca.fabs(u)), 5 * COASTING),
        (lambda p: p.integral(ca.if_else(TIME < 1, 2, 1) * ca.fabs(u)), dear_then_cheap()),
        (lambda p: p.integral(3 - 2 * (1 - ca.fmax(ca.fmax(u, -u.symbol), -5))), 3 + 4 * COASTING),
    ],
    ids=[
        "fuel",
        "no recovery",
        "both ways",
        "recovery of 0.6",
        "lesser",
        "price",
        "rising",
        "tariff",
        "nested",
    ],
)
def test_an_optimum_on_a_kink_is_found_and_certified(cost, expected):
    found = solve(least(cost))
    assert found.objective == pytest.approx(expected, rel=3e-6)
    assert certify(found).passed


@pytest.mark.parametrize(
    "factor",
    [
        TIME - 1,
        ca.if_else(TIME < 1, 0, 1),
        1 - 2 * ca.if_else(TIME < 1.0, TIME > 0.9999, 0),
        price * (1 + TIME),
    ],
    ids=["of both signs", "zero for a while", "negative for a moment", "of a constant and time"],
)
def test_a_factor_of_time_without_a_sign_keeps_the_kink(factor):
    problem = least(lambda p: p.integral(factor * ca.fabs(u)))
    assert controls(problem) == ["u"]


def test_a_factor_of_time_that_is_zero_at_one_instant_has_a_sign():
    problem = least(lambda p: p.integral((TIME - 1.5) ** 2 * ca.fabs(u)))
    assert len(controls(problem)) == 2


def test_a_factor_of_time_needs_an_end_of_it():
    free = Phase("move", {x: v, v: u}, {x: 0, v: 0}, {x: 1, v: 0}, end=Between(1, math.inf, 3))
    cost = free.integral(TIME * ca.fabs(u))
    assert controls(Problem("least", free, minimise=cost)) == ["u"]


def test_what_is_maximised():
    phase = move()
    found = solve(Problem("most", phase, maximise=4 - phase.integral(ca.fabs(u))))
    assert found.objective == pytest.approx(4 - 2 * COASTING, rel=1e-6)
    assert found.value("objective") == pytest.approx(found.objective, rel=1e-9)


def test_the_statement_stays_and_its_form_shows_what_is_solved():
    stated = least(lambda p: p.integral(ca.fmax(0, u * v)))
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
    phase = move(bounds=[Bound("other", other + u, lower=-5)])
    problem = Problem("least", phase, minimise=phase.integral(ca.fabs(u)))
    assert controls(problem) == ["u", "abs(u)", "abs(u) (2)"]


def test_a_smaller_limit_is_what_it_costs_by():
    limit = Constant("limit", value=1.0)
    push = Control("u", "m/s^2", lower=-limit, upper=limit)
    phase = Phase("move", {x: v, v: push}, {x: 0, v: 0}, {x: 1, v: 0}, end=3.0)
    found = solve(Problem("least", phase, minimise=phase.integral(ca.fabs(push))))
    # the speed V satisfies V (3 - V/limit) = 1, and the fuel is 2 V
    slope = 2 * COASTING**2 / (2 * COASTING - 3)
    assert found.sensitivities()["limit"] == pytest.approx(slope, rel=1e-4)


def pushed(cost):
    """From the place and speed (0, 1) to (0, -2) in 2 s with little effort."""
    free = Control("u", "m/s^2")
    phase = Phase("push", {x: v, v: free}, {x: 0, v: 1}, {x: 0, v: -2}, end=2.0)
    return Problem("push", phase, minimise=phase.integral(free**2 + cost))


@pytest.mark.parametrize(
    ("cost", "expected"),
    [
        # with breakpoints at the crossings, and a side of the kink given beside each
        (3 * ca.fabs(v.symbol), 10.276459747),
        (3 * ca.fmax(2 * x, 1.5 - x), 13.607320163),
    ],
)
def test_a_kink_may_be_crossed_as_well(cost, expected):
    found = solve(pushed(cost))
    assert found.objective == pytest.approx(expected, rel=1e-6)
    assert certify(found).passed


@pytest.mark.parametrize("weight", [0.0, 0.01, 0.1])
def test_a_state_rests_on_the_kink_of_its_own_cost(weight):
    """From 1 m with at most 1 m/s to where nothing is paid, and there it stays."""
    speed = Control("speed", "m/s", lower=-1, upper=1)
    go = Phase("go", {x: speed}, {x: 1}, end=3.0)
    found = solve(Problem("home", go, minimise=go.integral(ca.fabs(x) + weight * speed**2)))
    # at rest the Hamiltonian is zero, so that x = weight speed^2 where the speed has no limit
    assert found.objective == pytest.approx(0.5 + weight - weight**2 / 6, rel=1e-6)
    assert found.sample(x, [2.5])[0] == pytest.approx(0.0, abs=1e-6)
    assert certify(found).passed


fuel = ca.fabs(u.symbol)


@pytest.mark.parametrize(
    "stated",
    [
        lambda p: {"maximise": p.integral(fuel)},
        lambda p: {"minimise": p.integral(-fuel)},
        lambda p: {"minimise": p.integral(ca.fmin(u, 0))},
        lambda p: {"minimise": p.integral(fuel * v)},
        lambda p: {"minimise": p.integral(fuel) ** 2},
        lambda p: {"minimise": p.integral(u**2), "bounds": [p.integral(fuel) >= 1]},
        lambda p: {
            "minimise": p.integral(u**2),
            "bounds": [Bound("b", p.integral(fuel), "1", 0, 1)],
        },
        lambda p: {"minimise": (f := p.integral(fuel)), "bounds": [f >= 1]},
        lambda p: {"minimise": -price * p.integral(fuel)},
        lambda p: {"minimise": p.integral((0.0 * price) * fuel)},
        lambda p: {"minimise": p.integral(ca.fabs(TIME - 1) * u**2)},
        lambda p: {"minimise": p.integral(ca.fabs(TIME - 1) + u**2)},
        lambda p: {"minimise": p.integral(fuel - ca.sin(fuel))},
    ],
)
def test_what_may_gain_by_more_is_left_as_it_is(stated):
    phase = move()
    problem = Problem("kept", phase, **stated(phase))
    assert solved(problem) is problem


def test_a_bound_of_another_integral_is_no_reason_to_leave_it():
    phase = move()
    bounds = [phase.integral(u) <= 1]
    problem = Problem("least", phase, minimise=phase.integral(fuel), bounds=bounds)
    assert controls(problem) == ["u", "abs(u)"]


def test_a_budget_of_fuel():
    # the least time with less fuel than the fastest motion burns: t1 = F/2, and t1 (T - t1) = 1
    phase = Phase("move", {x: v, v: u}, {x: 0, v: 0}, {x: 1, v: 0}, end=Between(0.5, 20))
    burnt = phase.integral(ca.fabs(u))
    found = solve(Problem("fast", phase, minimise=phase.end_time, bounds=[burnt <= 1.0]))
    assert found.objective == pytest.approx(0.5 + 1 / 0.5, rel=1e-6)
    assert found.value(burnt) == pytest.approx(1.0, rel=1e-6)
    assert certify(found).passed
    # what bounds nothing leaves the fastest motion as it is
    generous = solve(Problem("fast", phase, minimise=phase.end_time, bounds=[burnt <= 5.0]))
    assert generous.objective == pytest.approx(2.0, rel=1e-6)
    assert generous.value(burnt) == pytest.approx(2.0, rel=1e-6)
    assert certify(generous).passed


def test_sides_lie_below_their_control_all_along():
    found = solve(least(lambda p: p.integral(ca.fmax(0, u * v))))
    times = np.linspace(0, 3, 3001)
    power = found.sample(u, times) * found.sample(v, times)
    above = found.kept_iterate.trajectory.phases[0].polynomial("max(0, u*v)").at(times)[:, 0]
    assert np.all(above >= np.maximum(power, 0) - 1e-6)
    assert np.trapezoid(above - np.maximum(power, 0), times) < 1e-6


def test_coarse_controls_of_the_plant_are_paid_for_what_they_do():
    """A control that is held in each interval burns what it does, and not its largest power."""
    phase = move()
    cost = phase.integral(ca.fmax(0, u * v) + 0.1 * u**2)
    problem = Problem("least", phase, minimise=cost)
    settings = Settings(controls="constant", refinement=FixedMesh(), verify=False)
    found = solve(problem, settings=settings)
    assert found.value(cost) == pytest.approx(found.objective, rel=1e-5)


def test_a_kink_may_be_left_as_it_is(tmp_path):
    stated = pushed(3 * ca.fabs(v.symbol))
    kept = solve(stated, settings=Settings(reformulations=()))
    assert kept.form.problem is stated

    save(kept, tmp_path / "kept.ocp")
    found = load(tmp_path / "kept.ocp")
    assert found.form.problem is found.problem
    assert [control.name for control in found.problem.controls["push"]] == ["u"]
    assert found.value("objective") == pytest.approx(10.276459747, rel=1e-6)
    assert certify(found).passed


def test_a_bound_that_leaves_room_has_the_value_that_was_stated(tmp_path):
    phase = move()
    burnt = Bound("burnt", phase.integral(fuel), "m/s", upper=5.0)
    found = solve(Problem("least", phase, minimise=phase.integral(u**2), bounds=[burnt]))
    # u = 2/3 - 4/9 t burns twice the largest speed, which is 1/2
    assert found.value("burnt") == pytest.approx(1.0, rel=1e-6)
    save(found, tmp_path / "least.ocp")
    assert load(tmp_path / "least.ocp").value("burnt") == pytest.approx(1.0, rel=1e-6)
    again = solve(dataclasses.replace(found.problem, scale=2.0))
    assert again.value("burnt") == pytest.approx(1.0, rel=1e-6)


def test_a_sum_over_many_levels_keeps_its_kinks():
    phase = move()
    many = sum(ca.fabs(x - k / 20) for k in range(21))
    problem = Problem("levels", phase, minimise=phase.integral(many + ca.fabs(u)))
    assert controls(problem) == ["u", "abs(u)"]


def test_another_objective_is_stated_of_what_was_stated():
    phase = move()
    burnt, effort = phase.integral(fuel), phase.integral(u**2)
    problem = Problem("least", phase, minimise=burnt)
    smooth = with_objective(problem, effort)
    assert controls(smooth) == ["u"]
    assert controls(with_objective(problem, effort, [burnt <= 1.0])) == ["u", "abs(u)"]
    assert controls(with_objective(problem, problem.objective + effort)) == ["u", "abs(u)"]
    assert controls(with_objective(smooth, burnt)) == ["u", "abs(u)"]


def test_a_state_that_sums_up_a_kink_is_told_to_be_an_integral():
    energy = State("energy", "J")
    rates = {x: v, v: u, energy: ca.fmax(0, u * v)}
    ends = {x: 0, v: 0, energy: 0}, {x: 1, v: 0}
    phase = Phase("move", rates, *ends, end=3.0)
    problem = Problem("least", phase, minimise=phase.at_end(energy))
    with pytest.raises(SolveFailed, match="state it as an integral of phase 'move'"):
        solve(problem, settings=Settings(solver=Ipopt(max_iterations=20)))


def test_a_cost_that_is_too_small_between_the_points_is_refused():
    """A control above |x - r| is a polynomial, and passes below the kink where x crosses r."""
    phase = move()
    problem = Problem("near", phase, minimise=phase.integral(ca.fabs(x - 0.3) + 0.01 * u**2))
    found = solve(problem)
    # the objective is that of the kink itself, along the replayed motion
    stated = dense_integral(found.evaluator, found.replayed, phase.integral(ca.fabs(x - 0.3)))
    effort = dense_integral(found.evaluator, found.replayed, phase.integral(u**2))
    assert found.objective == pytest.approx(stated + 0.01 * effort, rel=1e-6)
    assert certify(found).passed

    # on a coarse mesh the cost is too small between the points, and that is refused
    coarse = solve(problem, settings=Settings(intervals=3, refinement=FixedMesh(), verify=True))
    assert not coarse.verification.passed
    reasons = coarse.verification.reasons
    assert any("the costs are too small between the points" in reason for reason in reasons)
    assert not certify(coarse).passed
