"""Meshes stay ordered and keep their points; jumps of controls are found where they are."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ocp.estimates.switch_detection import Jump, jumps
from ocp.mesh.mesh import PhaseMesh, uniform, with_points
from ocp.refinement.policies.brackets import with_brackets


@st.composite
def meshes(draw):
    inner = draw(st.lists(st.integers(1, 999), max_size=8, unique=True))
    points = np.array([0, *sorted(inner), 1000]) / 1000.0
    count = len(points) - 1
    degrees = draw(st.lists(st.integers(1, 8), min_size=count, max_size=count))
    movable = draw(st.sets(st.integers(1, count - 1))) if count > 1 else ()
    return PhaseMesh(points, np.array(degrees), tuple(sorted(movable)))


fractions = st.lists(st.floats(0.0, 1.0), max_size=6).map(np.array)


@given(intervals=st.integers(1, 300), degree=st.integers(1, 8))
def test_a_uniform_mesh(intervals, degree):
    mesh = uniform(intervals, degree)
    assert mesh.intervals == intervals
    assert not mesh.moving.any()
    np.testing.assert_array_equal(mesh.degrees, degree)
    # equal up to the rounding of points near 1
    np.testing.assert_allclose(np.diff(mesh.breakpoints), 1 / intervals, atol=1e-15)


@given(mesh=meshes(), added=fractions)
def test_added_points_are_there_and_old_ones_stay(mesh, added):
    finer = with_points(mesh, added)
    assert np.isin(mesh.breakpoints, finer.breakpoints).all()
    for point in added:  # `closest` of `with_points`: nearer ones count as the same
        assert np.abs(finer.breakpoints - point).min() <= 1e-9
    middles = 0.5 * (finer.breakpoints[:-1] + finer.breakpoints[1:])
    parents = np.searchsorted(mesh.breakpoints, middles) - 1
    np.testing.assert_array_equal(finer.degrees, mesh.degrees[parents])
    np.testing.assert_array_equal(
        finer.breakpoints[list(finer.movable)], mesh.breakpoints[list(mesh.movable)]
    )


@given(mesh=meshes())
def test_an_interval_moves_with_either_end(mesh):
    for k in range(mesh.intervals):
        assert mesh.moving[k] == (k in mesh.movable or k + 1 in mesh.movable)
    assert not mesh.frozen().moving.any()


@given(
    where=st.floats(0.15, 0.85),
    low=st.floats(-3, 1),
    size=st.floats(0.5, 4),
    rise=st.booleans(),
    samples=st.integers(12, 60),
)
def test_a_jump_is_found_where_it_keeps_the_area(where, low, size, rise, samples):
    # cell means of a step, as piecewise constant controls approximate it
    edges = np.linspace(0, 1, samples + 1)
    share = np.clip((edges[1:] - where) * samples, 0, 1)  # part of each cell after the jump
    values = low + size * (share if rise else 1 - share)
    middles = 0.5 * (edges[:-1] + edges[1:])
    (found,) = jumps(middles, values, edges)
    assert found.first <= found.at <= found.last
    assert found.last - found.first <= 2.0 / samples + 1e-12  # the cell and its neighbours
    if 0.2 < (where * samples) % 1 < 0.8:  # mixed cell: its mean says where the jump is
        before, after = values[0], values[-1]
        area = np.trapezoid(values, middles)
        step = before * (found.at - middles[0]) + after * (middles[-1] - found.at)
        # the same integral in another order
        assert step == pytest.approx(area, abs=1e-12 * (1 + abs(low) + size))
        # the trapezium through the cell means is exact for a jump inside the middle cell
        assert found.at == pytest.approx(where, abs=1e-9)


@given(slope=st.floats(-5, 5), offset=st.floats(-5, 5))
def test_a_smooth_control_has_no_jump(slope, offset):
    times = np.linspace(0, 1, 40)
    assert jumps(times, offset + slope * np.sin(3 * times), np.linspace(0, 1, 41)) == []


@given(mesh=meshes(), where=st.floats(0.05, 0.95), move=st.booleans())
def test_a_jump_is_bracketed(mesh, where, move):
    times = np.array([where - 0.04, where - 0.02, where + 0.02, where + 0.04])
    found = jumps(times, np.array([0.0, 0.0, 1.0, 1.0]), mesh.breakpoints)
    assert len(found) == 1
    finer = with_brackets(mesh.frozen(), found, move)
    assert finer is not None
    points = finer.breakpoints
    assert np.all(np.diff(points) > 0)
    at = found[0].at
    below, above = points[points < at - 1e-9].max(), points[points > at + 1e-9].min()
    assert above - below <= 0.31 * max(0.04, np.diff(mesh.breakpoints).max())
    if move:  # and the optimiser may move a breakpoint between them
        assert np.abs(points[list(finer.movable)] - at).min() <= 1e-9
        assert with_brackets(finer, found, move) is None  # it is there already
    else:
        assert finer.movable == ()


def test_a_bracket_does_not_follow_a_jump_to_and_fro():
    mesh = uniform(10, 4)
    held = with_brackets(mesh, [Jump(0.4, 0.5, 0.45, 1.0)], False)
    assert held.intervals == 12
    # the jump is seen elsewhere between the same samples: what was split beside it stays
    assert with_brackets(held, [Jump(0.4, 0.5, 0.453, 1.0)], False) is None
