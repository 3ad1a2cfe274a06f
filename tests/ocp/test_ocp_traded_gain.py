"""What controls gain that share limits, against a linear program of another library."""

from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from ocp import Bound, Control, Phase, Problem, State, certify, solve
from ocp.optimality.control_gains import SharedLimit, _shares, limits_by_group, traded_gain

number = st.floats(-2.0, 2.0).filter(lambda value: abs(value) > 1e-2)
# no room within the 1e-7 to which the linear program keeps its limits, but for none
size = st.integers(0, 2000).map(lambda thousandths: thousandths / 1000)


def most(slope, down, up, rows, slack):
    """The most of -slope . step with rows . step <= slack, by SciPy."""
    found = linprog(slope, A_ub=rows, b_ub=slack, bounds=list(zip(-down, up, strict=True)))
    assert found.success
    return -found.fun


@settings(max_examples=150, deadline=None)
@given(st.tuples(*[number] * 6), st.tuples(*[size] * 6))
def test_two_controls_of_two_limits_gain_what_a_linear_program_gives(numbers, sizes):
    slope, rows = np.array(numbers[:2]), np.array(numbers[2:]).reshape(2, 2)
    down, up, slack = np.array(sizes[:2]), np.array(sizes[2:4]), np.array(sizes[4:])
    limits = [
        SharedLimit(row[None], np.array([np.inf]), np.array([limit]))
        for row, limit in zip(rows, slack, strict=True)
    ]
    bound = traded_gain(slope[None], (down[None], up[None]), limits)[0]
    # where a limit does not act, the controls' own room is what bounds the gain
    alone = float(np.abs(slope) @ np.where(slope > 0, down, up))
    exact = most(slope, down, up, rows, slack)
    assert min(bound, alone) == pytest.approx(exact, rel=1e-8, abs=1e-8)


@settings(max_examples=100, deadline=None)
@given(st.tuples(*[number] * 15), st.tuples(*[size] * 9))
def test_three_limits_of_three_controls_gain_no_more(numbers, sizes):
    slope, rows = np.array(numbers[:3]), np.array(numbers[3:12]).reshape(3, 3)
    down, up, slack = (np.array(sizes[k : k + 3]) for k in (0, 3, 6))
    limits = [
        SharedLimit(row[None], np.array([np.inf]), np.array([limit]))
        for row, limit in zip(rows, slack, strict=True)
    ]
    bound = traded_gain(slope[None], (down[None], up[None]), limits)[0]
    alone = float(np.abs(slope) @ np.where(slope > 0, down, up))
    assert min(bound, alone) >= most(slope, down, up, rows, slack) - 1e-8


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
    found = solve(Problem("two masses", move, minimise=fuel))
    assert found.objective == pytest.approx(2 * (3.0 - np.sqrt(5.0)), rel=1e-6)
    assert certify(found).passed
    assert found.mesh_iterations[-1].intervals < 60


def test_a_modulus_as_a_control_above_two_sides():
    # 1 m from rest to rest in 3 s by the least integral of |u|, |u| <= 1: thrust for t1, coast,
    # brake for t1, and t1 (3 - t1) = 1
    x, v = State("x", "m"), State("v", "m/s")
    u, size = Control("u", "m/s^2", lower=-1, upper=1), Control("size", "m/s^2")
    sides = [Bound("above u", size - u, lower=0), Bound("above -u", size + u, lower=0)]
    move = Phase("move", {x: v, v: u}, {x: 0, v: 0}, {x: 1, v: 0}, end=3.0, bounds=sides)
    found = solve(Problem("least fuel", move, minimise=move.integral(size)))
    assert found.objective == pytest.approx(3.0 - np.sqrt(5.0), rel=1e-6)
    assert certify(found).passed
    # on the coasting arc neither control alone has room, and both together gain nothing
    assert found.mesh_iterations[-1].intervals < 60
