"""The estimated gain of finer controls, where it counts, and where they share limits."""

from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, linprog

from ocp import Between, Bound, Control, Phase, Problem, Radau, State
from ocp.estimates.estimated_gain import PhaseGains, estimated_gain
from ocp.optimality.active_set import strongest_multipliers
from ocp.optimality.control_gains import SharedLimit, _shares, limits_by_group, traded_gain
from tests.ocp.problems import certified, rest_to_rest, solved_on


def moved(minimise, end):
    """A distance of 1 m from rest to rest."""
    *_, u, phase = rest_to_rest(end=end, lower=-10, upper=20)
    return solved_on(7, Problem("move", [phase], minimise=minimise(phase, u)))


def telling(solution, *, acting):
    iterate = solution.kept_iterate
    strongest = np.full(iterate.trajectory.phases[0].intervals, float(acting))
    return PhaseGains.of(iterate, solution.evaluator, 0, strongest).informative


def test_a_coarse_switch_is_estimated_to_gain_about_what_its_place_gains():
    fastest = moved(lambda phase, u: phase.end_time, end=Between(0.1, 5.0))
    # from 20 to -10 m/s^2 at one third: the square root of 2 s (1/20 + 1/10)
    gained = fastest.objective / np.sqrt(0.3) - 1.0
    assert gained > 1e-3
    iterate = fastest.kept_iterate
    estimated = estimated_gain(iterate, fastest.evaluator, strongest_multipliers(iterate))
    assert estimated == pytest.approx(gained, rel=0.1)
    # a control on its bound is one that it may have to leave: there the estimate counts
    assert telling(fastest, acting=True).all()


def test_an_estimated_gain_is_noise_where_a_control_is_smooth_and_a_constraint_acts():
    easiest = moved(lambda phase, u: phase.integral(u**2), end=1.0)
    assert telling(easiest, acting=False).all()
    assert not telling(easiest, acting=True).any()


def slow_move(*, with_pump):
    """A distance of 1 m below a speed limit, beside a tank that a pump fills all the time."""
    x, v, u = State("x", "m"), State("v", "m/s", upper=1.2), Control("u", "m/s^2")
    level, pump = State("level"), Control("pump", lower=0.0, upper=1.0)
    dynamics, start = {x: v, v: u}, {x: 0, v: 0}
    if with_pump:
        dynamics, start = dynamics | {level: pump}, start | {level: 0}
    phase = Phase("move", dynamics, start, {x: 1, v: 0}, end=1.0)
    effort = phase.integral(u**2)
    problem = Problem(
        "slow move", [phase], minimise=effort - phase.at_end(level) if with_pump else effort
    )
    # odd, so that the arc begins inside an interval
    return solved_on(11, problem, scheme=Radau(4), verify=False)


def test_a_control_on_its_bound_makes_no_noise_of_another_one_tell():
    alone, beside = slow_move(with_pump=False), slow_move(with_pump=True)
    assert beside.objective == pytest.approx(alone.objective - 1.0, rel=1e-7)
    estimated = []
    for solution in (alone, beside):
        iterate = solution.kept_iterate
        strongest = strongest_multipliers(iterate)
        gains = PhaseGains.of(iterate, solution.evaluator, 0, strongest[0])
        estimated.append(gains.counted.sum() * iterate.objective_size)
        # what the speed limit leaves between its points is there in both
        assert gains.anywhere.sum() > 2.0 * gains.counted.sum()
    assert estimated[1] == pytest.approx(estimated[0], rel=1e-2, abs=1e-9)


def test_a_limit_that_the_start_lies_on_does_not_hide_the_peak():
    """A panel that a spring opens and a rope holds back, from rest at its stop."""

    def rate_of(q, w, tension):
        return (6 * (2.2 - q) + 1.5 - 0.4 * w - 0.3 * tension * ca.cos(q / 2)) / 8

    def farthest(tension):
        """Where it comes to rest under a constant tension, by SciPy."""

        def moving(t, y):
            return [y[1], rate_of(*y, tension)]

        def stops(t, y):
            return y[1] + (t < 0.2)

        stops.terminal = True
        tolerances = {"rtol": 1e-11, "atol": 1e-12}
        return solve_ivp(moving, (0, 60), [0, 0], events=stops, **tolerances).y[0, -1]

    least = brentq(lambda tension: farthest(tension) - np.pi / 2, 30, 44)
    q, w = State("angle", "rad", lower=0), State("rate", "rad/s", lower=0)
    rope = Control("rope", "N", lower=0, upper=40)
    rates, ends = {q: w, w: rate_of(q, w, rope)}, ({q: 0, w: 0}, {q: np.pi / 2, w: (0, 0.05)})
    panel = Phase("open", rates, *ends, end=30.0)
    found = certified(Problem("panel", panel, minimise=panel.peak(rope)), least, 1e-7)
    assert found.mesh_iterations[-1].intervals < 100


number = st.floats(-2.0, 2.0).filter(lambda value: abs(value) > 1e-2)
# no room within the 1e-7 to which the linear program keeps its limits, but for none
size = st.integers(0, 2000).map(lambda thousandths: thousandths / 1000)


def gains(count, numbers, sizes):
    """What controls gain at most that share limits, as it is bounded and by SciPy."""
    slope, rows = np.array(numbers[:count]), np.array(numbers[count:]).reshape(count, count)
    down, up, slack = np.array(sizes).reshape(3, count)
    limits = [
        SharedLimit(row[None], np.array([np.inf]), np.array([limit]))
        for row, limit in zip(rows, slack, strict=True)
    ]
    bound = traded_gain(slope[None], (down[None], up[None]), limits)[0]
    # where a limit does not act, the controls' own room is what bounds the gain
    alone = float(np.abs(slope) @ np.where(slope > 0, down, up))

    # the most of -slope . step with rows . step <= slack
    found = linprog(slope, A_ub=rows, b_ub=slack, bounds=list(zip(-down, up, strict=True)))
    assert found.success
    return min(bound, alone), -found.fun


@settings(max_examples=150, deadline=None)
@given(st.tuples(*[number] * 6), st.tuples(*[size] * 6))
def test_two_controls_of_two_limits_gain_what_a_linear_program_gives(numbers, sizes):
    bound, exact = gains(2, numbers, sizes)
    assert bound == pytest.approx(exact, rel=1e-8, abs=1e-8)


@settings(max_examples=100, deadline=None)
@given(st.tuples(*[number] * 12), st.tuples(*[size] * 9))
def test_three_limits_of_three_controls_gain_no_more(numbers, sizes):
    bound, exact = gains(3, numbers, sizes)
    assert bound >= exact - 1e-8


def test_controls_are_grouped_by_the_limits_that_they_share():
    def limit(*held):
        slopes = np.zeros((3, 5))
        slopes[:, held] = 1.0
        return SharedLimit(slopes, np.ones(3), np.ones(3))

    limits = [limit(0, 3), limit(1, 4), limit(3, 4)]
    groups = {tuple(own): len(shared) for own, shared in limits_by_group(limits, 5)}
    assert groups == {(2,): 0, (0, 1, 3, 4): 3}
    apart = {tuple(own): shared for own, shared in limits_by_group(limits[:2], 5)}
    assert sorted(apart) == [(0, 3), (1, 4), (2,)]
    assert apart[0, 3][0].slopes.tolist() == [[1.0, 1.0]] * 3


def test_a_limit_is_shared_wherever_the_first_of_its_times_is():
    # s >= F v, from rest: the force makes no power at first
    speeds = np.array([0.0, 0.5, 1.0])
    limit = SimpleNamespace(is_equation=False, of_controls=True)
    assert _shares(limit, np.stack([np.ones(3), -speeds], axis=1))
    assert not _shares(limit, np.stack([np.ones(3), np.zeros(3)], axis=1))


def test_two_costs_with_kinks_are_held_apart():
    # two masses, each as in the test below: what one pays is no matter of the other
    states = [(State(f"x{k}", "m"), State(f"v{k}", "m/s")) for k in range(2)]
    thrusts = [Control(f"u{k}", "m/s^2", lower=-1, upper=1) for k in range(2)]
    rates, start, end = {}, {}, {}
    for (x, v), u in zip(states, thrusts, strict=True):
        rates |= {x: v, v: u}
        start |= {x: 0, v: 0}
        end |= {x: 1, v: 0}
    move = Phase("move", rates, start, end, end=3.0)
    fuel = sum(move.integral(ca.fabs(u)) for u in thrusts)
    found = certified(Problem("two masses", move, minimise=fuel), 2 * (3.0 - np.sqrt(5.0)))
    assert found.mesh_iterations[-1].intervals < 60


def test_a_modulus_as_a_control_above_two_sides():
    # 1 m from rest to rest in 3 s by the least integral of |u|, |u| <= 1: thrust for t1, coast,
    # brake for t1, and t1 (3 - t1) = 1
    x, v = State("x", "m"), State("v", "m/s")
    u, size = Control("u", "m/s^2", lower=-1, upper=1), Control("size", "m/s^2")
    sides = [Bound("above u", size - u, lower=0), Bound("above -u", size + u, lower=0)]
    move = Phase("move", {x: v, v: u}, {x: 0, v: 0}, {x: 1, v: 0}, end=3.0, bounds=sides)
    found = certified(Problem("least fuel", move, minimise=move.integral(size)), 3.0 - np.sqrt(5.0))
    # on the coasting arc neither control alone has room, and both together gain nothing
    assert found.mesh_iterations[-1].intervals < 60
