"""Jumps of controls of any order: where they are, and meshes that close in on them."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ocp import Accuracy, Control, Phase, PhaseTrajectory, Problem, Radau, Settings, State, solve
from ocp.estimates.error_estimate import MeshErrors
from ocp.estimates.promised_gain import (
    control_errors,
    parts_to_resolve,
    saturated,
)
from ocp.estimates.switch_detection import (
    Jump,
    control_jumps,
    control_samples,
    jumps,
    switches_at_breakpoints,
)
from ocp.mesh.mesh import Mesh, PhaseMesh, uniform
from ocp.mesh.trajectory import SignalGroup
from ocp.numerics.piecewise_polynomial import (
    Bernstein,
    Lagrange,
    Piece,
    PiecewisePolynomial,
    bernstein,
)
from ocp.refinement.policies.brackets import hindered, most_iterations, settled, with_brackets
from ocp.refinement.solved_mesh import SolvedMesh


def motion(coefficients, breakpoints=None, degree=4) -> PhaseTrajectory:
    """A phase from 1 s to 3 s with one control of given Bernstein coefficients, (N, count)."""
    table = np.atleast_2d(np.asarray(coefficients, dtype=float))
    count = len(table)
    if breakpoints is None:
        breakpoints = np.linspace(0.0, 1.0, count + 1)
    times = 1.0 + 2.0 * np.asarray(breakpoints)
    every = np.arange(count)
    support = Lagrange(tuple(Radau().at(degree).support.tolist()))
    nothing = Piece(every, support, np.zeros((count, degree + 1, 1)))
    control = Piece(every, Bernstein(table.shape[1]), table[:, :, None])
    groups = (
        SignalGroup("state", ("x",), PiecewisePolynomial(times, (nothing,))),
        SignalGroup("control", ("u",), PiecewisePolynomial(times, (control,))),
    )
    return PhaseTrajectory("phase", Radau(), times, np.full(count, degree), groups)


def fitted(function, intervals, count, degree=4) -> PhaseTrajectory:
    """A phase whose control interpolates a function of the fraction in every interval."""
    points = np.linspace(0.0, 1.0, count) if count > 1 else np.array([0.5])
    fractions = (np.arange(intervals)[:, None] + points) / intervals
    change = np.linalg.inv(bernstein(count, points))
    return motion(function(fractions) @ change.T, degree=degree)


SAMPLED = {
    "constant": ([[3.0], [5.0]], [0.25, 0.75], [3, 5]),
    "linear": ([[3.0, 4.0], [5.0, 7.0]], [0, 0.5, 0.5, 1], [3, 4, 5, 7]),
}


@pytest.mark.parametrize("case", SAMPLED)
def test_samples_of_a_control(case) -> None:
    coefficients, fractions, values = SAMPLED[case]
    found = control_samples(motion(coefficients), "u")
    np.testing.assert_allclose(found[0], fractions, atol=1e-15)
    np.testing.assert_allclose(found[1], values, rtol=1e-15)


def test_a_control_of_a_higher_order_is_sampled_at_the_collocation_points() -> None:
    fractions, values = control_samples(fitted(lambda s: s**3, 5, 4), "u")
    points = (np.arange(5)[:, None] + Radau().at(4).points) / 5
    np.testing.assert_allclose(fractions, points.ravel(), rtol=1e-14)
    np.testing.assert_allclose(values, fractions**3, atol=1e-14)


@given(
    interval=st.integers(1, 3),
    part=st.floats(0.16, 0.84),
    low=st.floats(-3, -0.5),
    high=st.floats(0.5, 3),
)
def test_a_switch_inside_an_interval_is_located_by_the_area(interval, part, low, high) -> None:
    # five levels that keep the area of a switch from `low` to `high`; its level is 0.15 of their
    # difference away from both, or it counts as one of them
    breaks, switch = np.linspace(0.0, 1.0, 6), 0.2 * (interval + part)
    share = np.clip((switch - breaks[:-1]) / 0.2, 0.0, 1.0)
    found = control_jumps(motion((share * low + (1 - share) * high)[:, None]))
    assert len(found) == 1
    assert found[0].at == pytest.approx(switch, abs=1e-12)
    assert found[0].size == pytest.approx(1.0)


def test_beside_a_switch_that_swings_the_levels_are_those_of_whole_intervals() -> None:
    # from 1 to 0.2 a third behind the second breakpoint: areas are kept, samples swing to 0
    swinging = [[1.0, 1.0, 1.0], [1.0, 0.9, 0.5], [0.0, -0.0, 0.2 - 1 / 15], [0.2, 0.2, 0.2]]
    table = np.array([*swinging, [0.2, 0.2, 0.2]])
    switch = 0.2 + (table[1:3].mean(axis=1).sum() * 0.2 - 0.2 * 0.4) / 0.8
    (jump,) = control_jumps(motion(table))
    assert jump.at == pytest.approx(switch, abs=1e-12)

    # there and back in neighbouring intervals: the level behind the first switch is between them
    there_and_back = [[1.0, 1.0, 1.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]]
    down, up = control_jumps(motion(there_and_back))
    assert down.first < down.at < down.last
    assert up.first < up.at < up.last
    assert down.at + up.at == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("count", [1, 2, 4])
def test_a_jump_at_a_breakpoint_is_located_there(count) -> None:
    levels = np.repeat([[1.0], [1.0], [-2.0], [-2.0]], count, axis=1)
    (jump,) = control_jumps(motion(levels))
    assert jump.at == pytest.approx(0.5, abs=1e-15)


@pytest.mark.parametrize("count", [1, 2, 4])
def test_a_slope_is_no_jump(count) -> None:
    assert control_jumps(fitted(lambda s: np.sin(3 * s), 20, count)) == []


def test_a_jump_in_a_line_is_located_by_the_levels_beside_it() -> None:
    # the line swings over both levels, its mean is a tenth below their middle
    (jump,) = control_jumps(motion([[1.0, 1.0], [1.1, -1.3], [-1.0, -1.0], [-1.0, -1.0]]))
    assert (jump.first, jump.last) == (0.25, 0.5)
    assert jump.at == pytest.approx(0.25 + 0.25 * 0.45, abs=1e-15)

    # at the begin of the phase its range stands for the level before
    (jump,) = control_jumps(motion([[1.4, -0.9], [-0.6, -0.6], [-0.6, -0.6]]))
    assert jump.at == pytest.approx((0.25 + 0.6) / 2.0 / 3.0, abs=1e-15)


def test_a_line_between_like_levels_holds_no_jump() -> None:
    levels = [[0.0, 0.0], [0.14, -0.02], [0.0, 0.0], [0.0, 0.0], [1.0, 1.0]]
    assert [jump.at for jump in control_jumps(motion(levels))] == pytest.approx([0.8])


def test_the_error_of_a_line_is_that_of_its_interpolation() -> None:
    # between the ends of an interval of length h the line is h^2 / 8 u'' off at most
    found = control_errors(fitted(lambda s: s**2, 10, 2), uniform(10, 4))
    np.testing.assert_allclose(found, 0.1**2 / 4, rtol=1e-12)


@pytest.mark.parametrize(("count", "power"), [(1, 1), (2, 2)])
def test_parts_that_resolve_a_control(count, power) -> None:
    # thirds err by a third where the shape is a level, and by a ninth where it is a line
    slope = fitted(lambda s: s**power, 10, count)
    error = control_errors(slope, uniform(10, 4))[5, 0]
    parts = parts_to_resolve(slope, uniform(10, 4), error / 3**power)
    np.testing.assert_allclose(parts, 3.0, rtol=1e-12)


def test_a_movable_breakpoint_without_a_jump_hides_no_error() -> None:
    control = fitted(lambda s: s**2, 10, 2)
    moved = PhaseMesh(np.linspace(0, 1, 11), 4, (5,))
    np.testing.assert_array_equal(
        control_errors(control, moved), control_errors(control, uniform(10, 4))
    )


def test_the_error_of_a_level_is_its_mean_error() -> None:
    # a ramp is off by h / 4 of its slope on average; the samples span 0.9 of the range
    found = control_errors(fitted(lambda s: s, 10, 1), uniform(10, 4))
    np.testing.assert_allclose(found, 0.1 / 4 / 0.9, rtol=1e-12)


def test_the_error_of_a_polynomial_is_its_last_legendre_coefficient() -> None:
    # 2 + P_3 on one interval; its range is taken at the collocation points
    legendre = np.polynomial.legendre.Legendre([2.0, 0.0, 0.0, 1.0], domain=[0, 1])
    control = fitted(legendre, 1, 4)
    size = np.ptp(control_samples(control, "u")[1])
    np.testing.assert_allclose(control_errors(control, uniform(1, 4)), 1.0 / size, rtol=1e-12)


def test_a_level_beside_a_jump_is_no_error_but_one_between_two_levels_is() -> None:
    levels = np.array([1.0, 1.0, 0.2, -1.0, -1.0])[:, None]
    found = control_errors(motion(levels), uniform(5, 4))
    np.testing.assert_allclose(found[:, 0], [0, 0, 0.8 / 4 / 2, 0, 0], atol=1e-15)


@pytest.mark.parametrize("count", [1, 2, 4])
def test_intervals_on_a_bound(count) -> None:
    levels = np.repeat([[1.0], [0.5], [-2.0]], count, axis=1)
    levels[2, -1] += 1e-4  # of a range of 3: close enough
    found = saturated(motion(levels), {"u": (-2.0, 1.0)})
    assert found.tolist() == [[True], [False], [True]]


def test_a_jump_gets_a_bracket_with_a_breakpoint_that_moves() -> None:
    mesh = uniform(5, 4)
    jump = Jump(0.3, 0.7, 0.52, 1.0)
    moved = with_brackets(mesh, [jump], move=True)
    assert moved is not None
    (index,) = moved.movable
    assert moved.breakpoints[index] == 0.52
    # it stands in a bracket of 0.15 of where the jump may be, 0.4, on either side
    np.testing.assert_allclose(moved.breakpoints[index + np.array([-1, 1])], [0.46, 0.58])
    assert with_brackets(moved, [jump], move=True) is None


def test_an_interval_in_which_a_jump_may_lie_anywhere_is_its_bracket() -> None:
    moved = with_brackets(uniform(5, 4), [Jump(0.4, 0.6, 0.45, 1.0)], move=True)
    assert moved is not None
    np.testing.assert_allclose(moved.breakpoints, [0, 0.2, 0.4, 0.45, 0.6, 0.8, 1.0])
    assert moved.movable == (3,)


def test_a_bracket_without_a_moving_breakpoint_is_not_replaced_by_one_of_its_width() -> None:
    jump = Jump(0.3, 0.7, 0.52, 1.0)
    fixed = with_brackets(uniform(5, 4), [jump], move=False)
    assert fixed is not None
    assert fixed.movable == ()
    assert with_brackets(fixed, [jump], move=False) is None


def test_a_breakpoint_that_ran_into_its_neighbour_takes_its_place() -> None:
    # the breakpoint at 0.5 may move; it went to 0.6 - 1e-3, where its control jumps
    mesh = PhaseMesh(np.array([0, 0.4, 0.5, 0.6, 1.0]), 4, (2,))
    solved = motion([[1.0], [1.0], [-1.0], [-1.0]], [0, 0.4, 0.599, 0.6, 1.0])
    after, blocked = settled(mesh, solved)
    assert blocked
    np.testing.assert_allclose(after.breakpoints, [0, 0.4, 0.599, 1.0])
    assert after.movable == (2,)


def test_a_breakpoint_passes_narrow_intervals_as_far_as_it_has_room_behind() -> None:
    # one at a time it would pass them forever; the last one but one is in reach, at 0.599 + 0.199
    points = np.array([0, 0.4, 0.5, 0.6, 0.61, 0.62, 0.79, 0.9, 1.0])
    mesh = PhaseMesh(points, 4, (2,))
    at = points.copy()
    at[2] = 0.599
    after, blocked = settled(mesh, motion([[1.0]] * 2 + [[-1.0]] * 6, at))
    assert blocked
    np.testing.assert_allclose(after.breakpoints, [0, 0.4, 0.599, 0.9, 1.0])
    # but not a known time
    after, blocked = settled(mesh, motion([[1.0]] * 2 + [[-1.0]] * 6, at), np.array([0.62]))
    np.testing.assert_allclose(after.breakpoints, [0, 0.4, 0.599, 0.62, 0.79, 0.9, 1.0])
    # nor another one that moves
    mesh = PhaseMesh(points, 4, (2, 5))
    after, blocked = settled(mesh, motion([[1.0]] * 2 + [[-1.0]] * 3 + [[1.0]] * 3, at))
    np.testing.assert_allclose(after.breakpoints, [0, 0.4, 0.599, 0.62, 0.79, 0.9, 1.0])


def test_a_control_that_the_barrier_holds_off_its_bound_does_not_jump() -> None:
    times, breakpoints = np.linspace(0.05, 0.95, 10), np.linspace(0.0, 1.0, 11)
    values = np.where(times < 0.5, 1.0 - 2e-8, 1.0)
    assert not jumps(times, values, breakpoints)
    (jump,) = jumps(times, np.where(times < 0.5, 0.0, 1.0), breakpoints)
    assert jump.at == pytest.approx(0.5)


def test_a_breakpoint_without_a_jump_stays_put() -> None:
    mesh = PhaseMesh(np.array([0, 0.4, 0.5, 0.6, 1.0]), 4, (2,))
    solved = motion([[1.0], [1.0], [1.0], [-1.0]], [0, 0.4, 0.55, 0.6, 1.0])
    after, blocked = settled(mesh, solved)
    assert not blocked
    assert after.movable == ()
    np.testing.assert_allclose(after.breakpoints, [0, 0.4, 0.55, 0.6, 1.0])


def solved_mesh(movable, iterations=10, leak=0.0, intervals=5):
    """A mesh with movable breakpoints, the iterations that it took and what it left open."""
    mesh = Mesh((replace(uniform(intervals, 3), movable=movable),))
    errors = MeshErrors(phases=(), dynamics=0.0, excess=leak, gain=0.0)
    return SolvedMesh(
        iterate=SimpleNamespace(mesh=mesh),
        errors=errors,
        violation=0.0,
        tight=True,
        finer=True,
        iterations=iterations,
    )


def test_breakpoints_that_cost_far_more_iterations_are_held_still():
    def held(first, still, *moving):
        meshes = [solved_mesh((), first), solved_mesh((), still)]
        meshes += [solved_mesh((3,), count) for count in moving]
        return hindered(meshes, Accuracy())

    assert not held(30, 30)
    assert not held(30, 30, 100)  # a hundred is not too many
    assert held(30, 30, 101)
    # a hard problem without them, too
    assert not held(30, 60, 101)
    # the first mesh starts from afar
    assert held(400, 30, 101)


def test_breakpoints_that_lead_nowhere_are_held_still():
    def held(*leaks, movable=(3,)):
        return hindered([solved_mesh(movable, leak=leak) for leak in leaks], Accuracy(path=1e-7))

    assert held(4e-5, 4e-5, 3e-5)
    assert held(4e-5, 4e-5, 3e-5, 5e-8)  # once and for all
    assert not held(4e-5, 4e-5)
    assert not held(4e-5, 4e-5, 1e-5)
    assert not held(9e-8, 9e-8, 9e-8)  # nothing is open
    assert not held(4e-5, 4e-5, 3e-5, movable=())


@pytest.mark.parametrize("intervals", [5, 8, 11, 14])
def test_an_arc_is_entered_where_it_begins_whatever_the_first_mesh_is(intervals):
    """Bryson, Denham and Dreyfus 1963: the entry moved to where the roof leaks, for 40 meshes."""
    x, v, u = State("x", "m", upper=1 / 9), State("v", "m/s"), Control("u", "m/s^2")
    phase = Phase("move", {x: v, v: u}, {x: 0, v: 1}, {x: 0, v: -1}, end=1.0)
    problem = Problem("roof", phase, minimise=phase.integral(0.5 * u**2))
    found = solve(problem, settings=Settings(intervals=intervals))
    assert found.objective == pytest.approx(4.0, rel=1e-6)
    assert len(found.mesh_iterations) <= 8


def test_a_mesh_whose_breakpoints_move_is_given_up_where_the_next_ones_would_be_held_still():
    moving = solved_mesh((3,), 0).iterate.mesh
    still = solved_mesh((), 0, intervals=6).iterate.mesh
    assert most_iterations([solved_mesh((), 30)], moving) == 100
    assert most_iterations([solved_mesh((), 400)], moving) == 100
    later = [solved_mesh((), 30), solved_mesh((), 60), solved_mesh((3,), 90)]
    assert most_iterations(later, moving) == 120
    assert most_iterations([solved_mesh((), 30)], still) == np.inf
    # one with the same intervals has only more points, and there is a mesh to go back to
    assert most_iterations([solved_mesh((), 30)], solved_mesh((), 0).iterate.mesh) == 100
    assert most_iterations([], moving) == np.inf  # there is nothing to go back to


def test_rounding_about_zero_is_no_jump() -> None:
    levels = motion(1e-14 * np.array([[1.0, 1.0], [1.0, 1.0], [-1.0, -1.0], [-1.0, -1.0]]))
    assert len(control_jumps(levels)) == 1
    assert control_jumps(levels, {"u": 1.0}) == []
    assert switches_at_breakpoints(levels, {}).any()
    assert not switches_at_breakpoints(levels, {"u": 1.0}).any()
