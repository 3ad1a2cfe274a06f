"""Costs that hold the size of a vector, such as the fuel of a thruster that turns."""

import math

import casadi as ca
import numpy as np
import pytest

from ocp import (
    Between,
    Bound,
    Constant,
    Control,
    InvalidNumber,
    Phase,
    Problem,
    Settings,
    State,
    Unverified,
    certify,
    solve,
)
from ocp.reformulate.form import reformulated
from ocp.reformulate.standard import STANDARD_REFORMULATIONS
from tests.ocp.problems import certified

places = [State(name, "m") for name in "xyz"]
speeds = [State(f"v{name}", "m/s") for name in "xyz"]
thrusts = [Control(f"a{name}", "m/s^2", lower=-1, upper=1) for name in "xyz"]
GOAL = (1.0, 0.5, 0.25)

COARSE = Settings(intervals=8)  # a first mesh that takes half the time

ax, ay = thrusts[:2]


def vector(thrust=thrusts[:2]):
    return ca.vertcat(*[a.symbol for a in thrust])


def move(thrust=thrusts[:2], speed=(0.0, 0.0, 0.0), end=3.0, most=1.0):
    """To the goal, and to rest there, by a thrust of limited size."""
    n = len(thrust)
    own, rates = places[:n], speeds[:n]
    bounds = [] if most is None else [Bound("thrust", ca.sumsqr(vector(thrust)), upper=most**2)]
    return Phase(
        "move",
        {**dict(zip(own, rates, strict=True)), **dict(zip(rates, thrust, strict=True))},
        {**dict.fromkeys(own, 0.0), **dict(zip(rates, speed[:n], strict=True))},
        {**dict(zip(own, GOAL[:n], strict=True)), **dict.fromkeys(rates, 0.0)},
        end=end,
        bounds=bounds,
    )


def least(cost, **options):
    phase = move(**options)
    return Problem("least", phase, minimise=phase.integral(cost))


def line(n, end=3.0, most=1.0):
    """Fuel from rest to rest along a line: thrust up to a speed, coast, brake."""
    way = math.hypot(*GOAL[:n])
    return most * end - math.sqrt((most * end) ** 2 - 4.0 * most * way)


def raised(problem):
    """Controls that are solved for in place of sizes."""
    form = reformulated(problem, STANDARD_REFORMULATIONS).problem
    return [c for c in form.controls["move"] if c not in set(problem.controls["move"])]


@pytest.mark.parametrize(
    "size",
    [
        ca.sqrt(ax**2 + ay**2),
        ca.sqrt(ax * ax + ay * ay),
        ca.hypot(ax, ay),
        ca.norm_2(vector()),
        ca.sqrt(ca.dot(vector(), vector())),
        ca.sqrt(2 * (ax**2 + ay**2) / 2),
    ],
    ids=["squares", "products", "hypot", "norm_2", "dot", "factors"],
)
def test_all_ways_to_write_a_size_are_seen(size):
    (control,) = raised(least(size))
    assert control.scale == pytest.approx(1.0)  # by the bound on the thrust


def test_a_thruster_coasts_on_its_way_along_a_line():
    found = certified(least(size), line(2), settings=COARSE)
    assert found.sample(ax, [1.5])[0] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.slow
def test_three_components():
    certified(least(ca.norm_2(vector(thrusts)), thrust=thrusts), line(3), settings=COARSE)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("speed", "expected"),
    # as stated by its size and its direction, and above 64 half-planes less than 0.12 % below
    [((-0.25, 0.5), 1.2914545190), ((0.3, -0.8), 1.9416982355)],
)
def test_a_thrust_that_turns(speed, expected):
    found = certified(least(ca.norm_2(vector()), speed=speed), expected, 2e-6, settings=COARSE)
    times = np.linspace(0, 3, 3001)
    (control,) = raised(found.problem)
    above = found.kept_iterate.trajectory.phases[0].polynomial(control.name).at(times)[:, 0]
    sizes = np.hypot(found.sample(ax, times), found.sample(ay, times))
    assert np.all(above >= sizes - 1e-6)


@pytest.mark.slow
def test_units_and_scales_do_not_matter():
    """Millinewtons per kilogramme, and an hour."""
    most, far = 1e-3, Constant("most", "m/s^2", value=1e-3)
    thrust = [Control(name, "m/s^2", lower=-far, upper=far) for name in ("a", "b")]
    phase = move(thrust=thrust, end=120.0, most=most)
    cost = 1e3 * phase.integral(ca.norm_2(vector(thrust)))
    problem = Problem("least", phase, minimise=cost)

    # what a certificate allows: where the thrust switches inside an interval, 4e-6 are left
    certified(problem, 1e3 * line(2, 120.0, most), 1e-5, settings=Settings(intervals=12))


def test_the_form_shows_what_is_solved():
    problem = least(ca.norm_2(vector()))
    (control,) = raised(problem)
    assert (control.name, control.unit, control.lower) == ("sqrt(ax^2 + ay^2)", "m/s^2", 0.0)
    form = reformulated(problem, STANDARD_REFORMULATIONS).problem
    assert form.phases[0].bounds[-1].name == "sqrt(ax^2 + ay^2), size"


@pytest.mark.parametrize(
    ("limits", "bound", "typical"),
    [
        ({"lower": -3, "upper": 2}, None, 3 * math.sqrt(2)),
        ({"lower": -3, "upper": 3}, lambda q: q <= 4, 2),
        ({}, lambda q: Bound("b", ca.sqrt(q), upper=Constant("c", value=3)), 3),
        ({"scale": 0.5}, None, 0.5 * math.sqrt(2)),
        ({"lower": 0}, None, None),
        ({}, lambda q: q >= 1, None),
        ({}, lambda q: q + 0.1 * ca.sqrt(q) <= 1, None),
    ],
)
def test_its_typical_value_is_told_by_limits(limits, bound, typical):
    thrust = [Control(name, **limits) for name in ("a", "b")]
    square = ca.sumsqr(vector(thrust))
    phase = move(thrust=thrust, most=None)
    bounds = [] if bound is None else [bound(square)]
    phase = Phase("move", phase.dynamics, phase.initial, phase.final, end=3.0, bounds=bounds)
    found = raised(Problem("least", phase, minimise=phase.integral(ca.sqrt(square))))
    assert [control.scale for control in found] == (
        [] if typical is None else [pytest.approx(typical)]
    )


size = ca.norm_2(vector())
vx, vy = speeds[:2]
MOVE = move()


@pytest.mark.parametrize(
    "cost",
    [
        -MOVE.integral(size),
        MOVE.integral(size * vx),
        MOVE.integral(size) ** 2,
        MOVE.integral(ca.sqrt(1 + ax**2 + ay**2)),
        MOVE.integral(ca.sqrt(ax**2 - ay**2 / 2)),
        MOVE.integral(ca.sqrt(ax * ay)),
        MOVE.integral(ca.sqrt(ax**4 + ay**2)),
        MOVE.integral(ca.sqrt((ax - 1) ** 2 + ay**2)),
        # smooth where they are not zero, and nothing makes them zero with the controls
        MOVE.integral(ca.sqrt((ax + vx) ** 2 + (ay - vy) ** 2)),
        MOVE.integral(ca.hypot(vx, vy)),
        MOVE.integral(ca.sqrt(ax)),
    ],
)
def test_what_is_no_size_of_controls_that_costs_is_left_as_it_is(cost):
    problem = Problem("kept", MOVE, minimise=cost)
    assert reformulated(problem, STANDARD_REFORMULATIONS).problem is problem


@pytest.mark.slow
def test_a_budget_of_fuel():
    # along the line in the least time: t1 = F/2, and t1 (T - t1) is the way
    phase = move(end=Between(0.5, 20))
    burnt = phase.integral(size)
    fast = Problem("fast", phase, minimise=phase.end_time, bounds=[burnt <= 1.0])
    found = certified(fast, 0.5 + 2 * math.hypot(1, 0.5), settings=COARSE)
    assert found.value(burnt) == pytest.approx(1.0, rel=1e-5)


@pytest.mark.slow
def test_no_fuel_at_all():
    phase = move()
    rest = Phase("rest", phase.dynamics, phase.initial, phase.initial, end=3.0, bounds=phase.bounds)
    found = solve(Problem("nothing", rest, minimise=rest.integral(size)), settings=COARSE)
    assert found.objective == pytest.approx(0.0, abs=1e-7)


@pytest.mark.slow
def test_limits_far_above_what_is_used_are_refused_and_a_scale_is_not():
    """What is rounded is a part of the limits, and must be a small part of the motion."""

    def problem(**options):
        thrust = [Control(name, "m/s^2", **options) for name in ("a", "b")]
        phase = move(thrust=thrust, most=None)
        cost = ca.norm_2(vector(thrust)) + ca.sumsqr(vector(thrust)) / 2
        return Problem("least", phase, minimise=phase.integral(cost))

    with pytest.raises(Unverified, match="for a vector state the scale= of its controls"):
        solve(problem(lower=-1e4, upper=1e4))
    # on 20 intervals a second solve finds that 7e-6 are left
    stated, limited = (
        solve(problem(**options), settings=Settings(intervals=40))
        for options in ({"lower": -1e4, "upper": 1e4, "scale": 1.0}, {"lower": -2, "upper": 2})
    )
    assert stated.objective == pytest.approx(limited.objective, rel=2e-6)
    assert certify(stated).passed


def test_without_limits_the_message_asks_for_them():
    thrust = [Control(name, "m/s^2") for name in ("a", "b")]
    with pytest.raises(InvalidNumber, match=r"where a = 0.*give the controls limits"):
        solve(least(ca.norm_2(vector(thrust)), thrust=thrust, most=None))
