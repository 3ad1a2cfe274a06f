"""What other breakpoints gain where a control rides a limit that it cannot follow exactly."""

import dataclasses

import numpy as np
import pytest

from ocp import Accuracy, Control, Ipopt, Phase, Problem, Settings, State, solve
from ocp.estimates.constrained_arcs import (
    active_set_changes,
    arc_gains,
    collocation_points,
    shift_gains,
    stretches_of,
    with_ends,
)
from ocp.mesh.mesh import Mesh, PhaseMesh
from ocp.mesh.trajectory import Evaluator
from ocp.optimality.active_set import acting_on_states
from ocp.optimality.hamiltonian import hamiltonian_of
from ocp.optimality.multipliers import phase_costates
from tests.ocp.iterates import iterate_on
from tests.ocp.problems import certified, check_of, failed, solved_on, with_costates

# of the ride below, with all intervals of the found mesh a quarter as wide: 4.0380750 by halves
LEAST_FORCE = 4.0380749
ARCS = "where path constraints act in 'ride': Hamiltonian"


def ride():
    """Least peak of a + 4 x [m/s^2]: on the peak x'' + 4 x is constant, and no jerk is linear."""
    x, v, a = State("x", "m"), State("v", "m/s"), State("a", "m/s^2")
    jerk = Control("jerk", "m/s^3", lower=-60.0, upper=60.0)
    rest = {v: 0, a: 0}
    phase = Phase("ride", {x: v, v: a, a: jerk}, {x: 0, **rest}, {x: 1, **rest}, end=1.0)
    top = phase.peak(a + 4.0 * x, name="force", unit="m/s^2")
    return Problem("ride", [phase], minimise=top)


def ride_on(breakpoints):
    """The iterate of one run of the solver on a mesh of given breakpoints."""
    mesh = Mesh((PhaseMesh(np.array(breakpoints), np.array(4)),))
    return iterate_on(mesh, ride(), solver=Ipopt(tolerance=1e-13))


def hamiltonian_means(iterate):
    evaluator = Evaluator(iterate.problem)
    points = collocation_points(iterate.transcription.columns.phases[0])
    costates = phase_costates(iterate, 0)
    values = hamiltonian_of(evaluator, iterate.transcription, 0).along(
        evaluator, iterate.trajectory, costates, points.intervals, points.tau
    )
    return points.means(values.value)


def test_interval_means_are_the_slope_of_the_optimum_by_a_breakpoint():
    # moving a breakpoint makes one interval wider and the next one narrower
    points, step = np.array([0.0, 0.15, 0.4, 0.55, 0.8, 1.0]), 1e-5
    means = hamiltonian_means(ride_on(points))
    for k in (2, 3):
        lower, upper = (
            ride_on(np.where(np.arange(6) == k, points + by, points)).objective
            for by in (-step, step)
        )
        slope = (upper - lower) / (2.0 * step)
        assert abs(slope) > 1e-3
        # central differences of a smooth optimum, which is known to 1e-13 of 4
        assert slope == pytest.approx(means[k - 1] - means[k], rel=1e-4, abs=1e-6)


def test_gains_by_the_difference_of_means_and_the_shorter_interval():
    means, steps = np.array([1.0, 3.0, 2.0, 2.0]), np.array([0.5, 0.25, 1.0, 1.0])
    found = shift_gains(means, steps, np.zeros(4, dtype=int), np.ones(4, dtype=bool))
    np.testing.assert_allclose(found, [0.25, 0.25 + 0.125, 0.125, 0.0])
    # not across a known instant, and not beside an interval that does not count
    found = shift_gains(means, steps, np.array([0, 1, 1, 1]), np.array([True, True, False, True]))
    np.testing.assert_array_equal(found, np.zeros(4))


def test_gains_at_the_ends_of_an_arc_are_those_inside_by_the_cube_of_the_width():
    inside, steps = np.array([0.0, 0.0, 2.0, 1.0, 0.0, 0.0]), np.array([1.0, 2.0, 1.0, 1.0, 3.0, 1])
    arcs = np.array([False, False, True, True, False, False])
    acting = np.array([False, True, True, True, True, False])
    found = with_ends(inside, steps, acting, arcs)
    np.testing.assert_allclose(found, [0.0, 2.0 * 8, 2.0, 1.0, 1.0 * 27, 0.0])


def test_nothing_is_told_where_nothing_acts():
    iterate = ride_on(np.linspace(0.0, 1.0, 6))
    nothing = arc_gains(iterate, Evaluator(iterate.problem), 0, np.zeros(5, dtype=bool))
    np.testing.assert_array_equal(nothing, np.zeros(5))
    np.testing.assert_array_equal(stretches_of(iterate, iterate.trajectory.phases[0]), np.zeros(5))


def test_a_peak_that_is_ridden_is_as_low_as_asked_for():
    # pointwise gains say nothing on the peak: without the widths 1.9e-6 more than the least force
    assert check_of(certified(ride(), LEAST_FORCE), ARCS).value < 2e-6


def test_what_breakpoints_promise_is_what_is_lost():
    found = solve(ride(), settings=Settings(accuracy=Accuracy(objective=1e-4)))
    lost = found.objective / LEAST_FORCE - 1.0
    assert lost > 1e-6
    assert lost / 5.0 < found.mesh_iterations[-1].gain < 5.0 * lost


def test_a_mesh_that_is_too_coarse_for_its_peak_fails():
    coarse = solve(ride(), settings=Settings(accuracy=Accuracy(objective=1e-2)))
    assert coarse.objective > LEAST_FORCE * (1.0 + 4e-5)
    assert "finer controls" in failed(coarse)


def test_negated_multipliers_of_a_ridden_peak_fail():
    found = solve(ride())
    iterate = found.kept_iterate
    rows = iterate.row_multipliers.copy()
    for path in iterate.transcription.rows.path:
        rows[path.rows] *= -1.0
    spoilt = dataclasses.replace(iterate, row_multipliers=rows)
    assert {"stationarity", "complementarity"} <= failed(dataclasses.replace(found, iterate=spoilt))


def test_costates_that_are_off_along_a_ridden_peak_fail():
    # in one interval in the middle of what rides the peak
    found = solve(ride())
    changed = active_set_changes(found.kept_iterate, 0)
    riding = np.flatnonzero(acting_on_states(found.kept_iterate)[0] & ~changed)
    interval = riding[riding.size // 2]
    off = np.where(np.arange(changed.size) == interval, 1.0 + 1e-3, 1.0)
    assert ARCS in failed(with_costates(found, off))


def test_a_peak_that_leaks_between_the_points_fails():
    leak = check_of(solved_on(40, ride()), "path constraints")
    assert leak.value > 1e-4
    assert not leak.passed
