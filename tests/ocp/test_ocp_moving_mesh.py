"""Few intervals whose breakpoints move: what a mesh is merged to, and how it follows a switch."""

import dataclasses

import numpy as np
import pytest

from ocp import (
    Accuracy,
    AdaptiveMesh,
    Between,
    Bound,
    FixedMesh,
    Mesh,
    MovingMesh,
    Problem,
    Settings,
    Solution,
    coarsened,
    solve,
)
from ocp.refinement.policies.moving_mesh import merged_mesh, moving_mesh
from tests.ocp.problems import STRONGEST, least_time, race, rest_to_rest

ACCURACY = Accuracy(objective=1e-5, path=1e-5)
STILL = Settings(intervals=40, accuracy=ACCURACY, refinement=AdaptiveMesh(move_breakpoints=False))
MOVING = dataclasses.replace(STILL, refinement=MovingMesh())
FIXED = dataclasses.replace(STILL, refinement=FixedMesh())


def switch(solution: Solution) -> float:
    """The fraction of the time at which the control changes its sign."""
    motion = solution.trajectory.phases[0]
    middle = np.full(motion.intervals, 0.5)
    levels = motion.polynomial("u").value(np.arange(motion.intervals), middle)[:, 0]
    return float(motion.fractions[np.flatnonzero(np.diff(np.sign(levels)))[0] + 1])


def neighbour(solution, strongest, mesh, settings=MOVING) -> Solution:
    """The solution with another cap on the drive, from a given one and on a mesh."""
    constants = {STRONGEST: strongest}
    return solve(
        solution.problem, settings=settings, guess=solution, mesh=mesh, constants=constants
    )


def following(solution: Solution) -> Mesh:
    """The mesh on which a neighbour of a solution starts."""
    return moving_mesh(solution.kept_iterate, solution.evaluator, 1e-3)


@pytest.fixture(scope="module")
def first() -> Solution:
    """On a mesh that bisection has closed in on the switch, which is at a third."""
    return solve(race(), settings=STILL)


def test_a_refined_mesh_is_merged_to_the_intervals_that_its_signals_need(first: Solution) -> None:
    merged = coarsened(first.trajectory, 1e-3).phases[0]
    assert merged.intervals < first.mesh.intervals / 2
    # no longer than a fifth of the phase, and the narrow ones at the switch stay
    assert np.diff(merged.breakpoints).max() <= 0.2 + 1e-12
    assert np.abs(merged.breakpoints - 1 / 3).min() < 2e-3
    assert np.isin(merged.breakpoints, first.trajectory.phases[0].fractions).all()

    mesh = coarsened(first.trajectory, 1e-3)
    again = solve(first.problem, settings=STILL, guess=first, mesh=mesh)
    assert again.objective == pytest.approx(least_time(2.0), rel=1e-5)


def test_breakpoints_follow_a_switch_without_a_finer_mesh(first: Solution) -> None:
    found, counts = first, []
    for strongest in (2.1, 2.2, 2.4, 2.6, 2.8, 3.0):
        found = neighbour(found, strongest, following(found))
        assert found.objective == pytest.approx(least_time(strongest), rel=1e-6)
        # the time feels a shift of the switch by its square alone
        assert switch(found) == pytest.approx(1 / (1 + strongest), abs=1e-4)
        counts.append(len(found.mesh_iterations))
    assert counts[1:] == [1] * 5
    assert found.mesh.intervals < first.mesh.intervals / 2

    # the same intervals without motion know the old switch alone
    held = neighbour(first, 3.0, coarsened(first.trajectory, 1e-3), FIXED)
    assert held.objective > least_time(3.0) * (1 + 1e-4)


def test_a_program_serves_neighbours_and_a_mesh_that_went_far_begins_anew(first: Solution) -> None:
    moved = solve(first.problem, settings=MOVING, guess=first, mesh=following(first))
    near = neighbour(moved, 2.01, moved.mesh)
    assert near.kept_iterate.transcription is moved.kept_iterate.transcription

    # what has gone far begins anew from where it is, with the same intervals
    far = neighbour(moved, 3.0, moved.mesh)
    new = following(far)
    assert new is not far.mesh
    np.testing.assert_array_equal(new.phases[0].breakpoints, far.trajectory.phases[0].fractions)


def test_an_interval_grows_no_longer_than_it_may(first: Solution) -> None:
    mesh = coarsened(first.trajectory, 1e-3).freed(longest=1.05)
    found = neighbour(first, 8.0, mesh, FIXED)
    widths = np.diff(found.trajectory.phases[0].fractions) / np.diff(mesh.phases[0].breakpoints)
    assert widths.max() <= 1.05 + 1e-8
    # so the switch, which wants to a ninth, is not there yet
    assert found.objective > least_time(8.0) * (1 + 1e-4)


def test_a_first_mesh_is_kept_within_looser_tolerances(first: Solution) -> None:
    mesh = coarsened(first.trajectory, 1e-3)
    assert len(neighbour(first, 4.0, mesh, STILL).mesh_iterations) > 1

    loose = MovingMesh(kept=Accuracy(objective=1.0, path=1.0))
    kept = neighbour(first, 4.0, mesh, dataclasses.replace(STILL, refinement=loose))
    assert len(kept.mesh_iterations) == 1


def test_constraints_are_imposed_between_the_points_of_what_was_merged() -> None:
    end = Between(0.1, 20, guess=2)
    _, v, u, phase = rest_to_rest(end=end, lower=-4.0, upper=4.0, piecewise="linear")
    phase = dataclasses.replace(phase, bounds=[Bound("power", u * v, "W/kg", upper=1.0)])
    found = solve(Problem("race", phase, minimise=phase.end_time), settings=STILL)
    merged = merged_mesh(found.kept_iterate, found.evaluator, 1e-3)
    (points,) = merged.extra[0]
    # five to an interval: in the gaps of four collocation points and both ends but the last
    counts = np.bincount(points.intervals, minlength=merged.phases[0].intervals)
    assert set(counts) <= {0, points.tau.size // np.count_nonzero(counts)}
    assert np.count_nonzero(counts) > 0
    # while it brakes its power is far below the limit
    assert counts[-1] == 0
