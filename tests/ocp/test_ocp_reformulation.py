"""Reformulations: one of one's own, and sizes of vectors as controls."""

import math
from dataclasses import dataclass

import casadi as ca
import numpy as np
import pytest

from ocp import (
    Between,
    Bound,
    Constant,
    Control,
    InvalidNumber,
    Ipopt,
    Phase,
    Problem,
    Restated,
    Settings,
    SolveFailed,
    State,
    StatementError,
    Trajectory,
    Unverified,
    certify,
    family,
    load,
    prepare,
    save,
    solve,
)
from ocp.reformulate.form import reformulated
from ocp.reformulate.standard import STANDARD_REFORMULATIONS
from tests.ocp.problems import certified

# From 1 to e in 1 s at the rate u x, with the least integral of u^2: u = 1, so that x = exp(t)
x, u = State("x", "kg", lower=0.1), Control("u", "1/s", lower=-5, upper=5)
goal = Constant("goal", "kg", value=np.e)
grow = Phase("grow", {x: u * x}, {x: 1}, {x: goal}, end=1.0)
effort = grow.integral(u**2)
growth = Problem("growth", grow, minimise=ca.exp(effort), bounds=[grow.at_end(u) <= 4])

z = State("log x", "1")


@dataclass(frozen=True)
class Logarithm:
    """The logarithm of x, whose rate is u, and of the objective."""

    backwards: bool = True

    def apply(self, problem):
        """The growth on a straight line."""
        if x not in problem.phases[0].states:
            return None
        line = Phase("grow", {z: u}, {z: 0}, {z: ca.log(goal)}, end=1.0)
        solved = Problem("line", line, minimise=line.integral(u**2), bounds=[line.at_end(u) <= 4])
        back = {x: ca.exp(z)} if self.backwards else {}
        return Restated(solved, back=back, forth={z: ca.log(x)})


OWN = Settings(reformulations=(*Settings().reformulations, Logarithm()))
TIMES = np.linspace(0.0, 1.0, 11)


@pytest.fixture(scope="module")
def found():
    return solve(growth, settings=OWN)


def test_the_answer_is_told_in_terms_of_the_statement(found):
    assert found.problem is growth
    assert found.form.problem.name == "line"
    assert found.objective == pytest.approx(np.e, rel=1e-7)
    assert found.value(effort) == pytest.approx(1.0, rel=1e-7)
    for replayed in (False, True):
        values = found.sample(x, TIMES, replayed=replayed)
        assert values == pytest.approx(np.exp(TIMES), rel=1e-7)
    assert set(found.table()) == {"time", "x", "u"}
    with pytest.raises(StatementError, match="'log x' is not a symbol"):
        found.sample(z, TIMES)


def test_the_statement_is_replayed_and_certified(found):
    assert found.replay.phases[0].state_names == ("x",)
    assert found.verification.replayed_objective == pytest.approx(np.e, rel=1e-6)
    assert found.verification.objective == found.objective
    assert certify(found).passed


def test_a_way_back_that_is_wrong_does_not_pass():
    class Wrong(Logarithm):
        def apply(self, problem):
            made = super().apply(problem)
            return made and Restated(made.problem, back={x: ca.exp(1.01 * z)})

    settings = Settings(reformulations=(Wrong(),))
    with pytest.raises(SolveFailed, match="the replay misses the end state"):
        solve(growth, settings=settings)


def test_sensitivities_are_those_that_the_statement_has(found):
    slopes = found.sensitivities()
    # the effort is log(goal)^2
    assert slopes["goal"] == pytest.approx(2.0 / np.e, rel=1e-6)
    assert not any("log x" in name for name in slopes)


def test_it_starts_again_from_its_answer_from_a_motion_and_from_a_file(found, tmp_path):
    assert solve(growth, settings=OWN, guess=found).iterations <= 2
    motion = solve(growth, settings=OWN, guess=found.trajectory)
    assert motion.objective == pytest.approx(np.e, rel=1e-7)
    save(found, tmp_path / "growth.ocp")
    read = load(tmp_path / "growth.ocp")
    assert read.sample("x", TIMES) == pytest.approx(np.exp(TIMES), rel=1e-7)
    assert solve(read.problem, settings=OWN, guess=read).iterations <= 2
    # without the reformulation it is another program
    other = solve(read.problem, guess=read)
    assert other.form.problem is read.problem
    assert other.objective == pytest.approx(np.e, rel=1e-6)


def test_other_verbs_solve_it_too(found):
    prepared = prepare(growth, settings=OWN, guess=found)
    again = prepared.solve(constants={goal: 2.0}, guess=found)
    assert again.objective == pytest.approx(np.exp(np.log(2.0) ** 2), rel=1e-7)
    (_, last) = family(growth, goal, [np.e, 2.0], settings=OWN).solutions()
    assert last.sample(x, [1.0])[0] == pytest.approx(2.0, rel=1e-7)


def test_errors_hold_motions_of_the_statement():
    with pytest.raises(SolveFailed) as failed:
        solve(
            growth, settings=Settings(reformulations=[Logarithm()], solver=Ipopt(max_iterations=0))
        )
    assert isinstance(failed.value.iterate, Trajectory)
    assert failed.value.iterate.phases[0].states == ("x",)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (
            [Logarithm(backwards=False)],
            "does not convert 'x' back; give it as an expression of the new symbols",
        ),
        (["epigraph"], "give objects with a method apply"),
        (None, "give objects with a method apply"),
        ([Logarithm], "give objects with a method apply"),
    ],
)
def test_what_is_no_reformulation_is_refused(given, words):
    with pytest.raises(StatementError, match=words):
        solve(growth, settings=Settings(reformulations=given))


def test_a_reformulation_without_a_hash_is_told_how_to_get_one():
    @dataclass
    class Plain:
        def apply(self, problem):
            return None

    with pytest.raises(StatementError, match=r"write @dataclass\(frozen=True\)"):
        Settings(reformulations=[Plain()])


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


def test_what_a_switch_of_all_thrusts_costs_is_known():
    """One thrust alone has no room below the size: all together they have."""
    found = solve(least(size), settings=Settings(accuracy=1e-4))
    assert abs(found.objective - line(2)) / line(2) <= found.accuracy <= 1e-4


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

    with pytest.raises(Unverified, match="for a vector set the scale= of its controls"):
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
