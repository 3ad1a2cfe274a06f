"""What is at a limit, what presses, and where the arcs on a limit are best begun and cut."""

import dataclasses

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from ocp import (
    TIME,
    Accuracy,
    Bound,
    Control,
    FixedMesh,
    Ipopt,
    Phase,
    Problem,
    Settings,
    State,
    certify,
    solve,
)
from ocp.estimates.constrained_arcs import (
    active_set_changes,
    arc_gains,
    collocation_points,
    junction_gains,
    shift_gains,
    stretches_of,
    with_ends,
)
from ocp.mesh.mesh import Mesh, PhaseMesh
from ocp.mesh.trajectory import Evaluator
from ocp.numerics.piecewise_polynomial import Bernstein, Lagrange, Piece, PiecewisePolynomial
from ocp.optimality.active_set import (
    ACTING,
    ACTIVE,
    AT,
    STRONGLY_ACTIVE,
    acting_on_states,
    at_limit,
    limit_distances,
    path_multiplier_sums,
    share_at_limit,
    strongly_active,
)
from ocp.optimality.hamiltonian import hamiltonian_of
from ocp.optimality.multipliers import all_multipliers, phase_costates
from tests.ocp.iterates import iterate_on
from tests.ocp.problems import (
    bryson_denham,
    certified,
    check_of,
    failed,
    rest_to_rest,
    solved_on,
    with_costates,
)


def test_at_a_limit_from_either_side():
    values = np.array([0.9, 1.0 - 1e-6, 1.0, 1.0 + 1e-6, 1.1])
    np.testing.assert_array_equal(at_limit(values, 1.0, 1e-5), [False, True, True, True, False])
    assert not at_limit(values, np.inf, 1e-5).any()
    assert not at_limit(values, -np.inf, 1e-5).any()


def test_share_of_an_interval_at_its_limit():
    # a constant, a line that leaves the limit, a parabola that stays on it, a quartic that touches
    pieces = (
        Piece(np.array([0]), Bernstein(1), np.array([[[2.0]]])),
        Piece(np.array([1]), Bernstein(2), np.array([[[2.0], [1.0]]])),
        Piece(np.array([3]), Bernstein(3), np.array([[[2.0], [2.0], [2.0]]])),
        Piece(
            np.array([2]), Lagrange((0.0, 0.5, 0.8, 1.0)), np.array([[[0.0], [1.0], [2.0], [1.0]]])
        ),
    )
    polynomial = PiecewisePolynomial(np.arange(5.0), pieces)
    np.testing.assert_array_equal(share_at_limit(polynomial, 2.0, AT), [1.0, 0.5, 0.25, 1.0])
    np.testing.assert_array_equal(share_at_limit(polynomial, np.inf, AT), np.zeros(4))


def test_strongly_active_is_relative_to_the_largest():
    multipliers = np.array([-1.0, 1e-3, -2e-6, 1e-7, 0.0])
    np.testing.assert_array_equal(
        strongly_active(multipliers, STRONGLY_ACTIVE), [True, True, True, False, False]
    )
    np.testing.assert_array_equal(
        strongly_active(multipliers, ACTING, 100.0), [True, False, False, False, False]
    )
    assert not strongly_active(np.zeros(3), STRONGLY_ACTIVE).any()
    assert strongly_active(np.empty(0), STRONGLY_ACTIVE).size == 0


@pytest.fixture(scope="module")
def hop():
    return solved_on(30, bryson_denham()).kept_iterate


def test_a_bound_of_a_state_acts_where_the_path_meets_and_leaves_it(hop):
    (acting,) = acting_on_states(hop)
    # masses sit where the roof is met and left, at the breakpoints 10 and 20 of 30
    assert {9, 10, 19, 20} & set(np.flatnonzero(acting))
    assert not acting[:8].any()
    assert not acting[22:].any()


def test_what_is_active_and_what_is_not(hop):
    distances = limit_distances(hop)
    assert distances.violation < 1e-9  # the solver's constraint violation of 1e-10, and rounding
    _, upper = distances.active(ACTIVE)

    # the position, at all breakpoints of the arc, and where it is given at both ends
    columns = hop.transcription.columns.phases[0]
    rows = hop.transcription.program.rows
    at_roof = upper[rows + columns.nodes[:, 0]]
    np.testing.assert_array_equal(np.flatnonzero(at_roof), [0, *range(10, 21), 30])

    # every equation is active from both sides
    equations = np.concatenate([ids.ravel() for ids in hop.transcription.rows.phases[0].defects])
    for active in distances.active(ACTIVE):
        assert active[equations].all()


def test_multipliers_belong_to_active_limits(hop):
    multipliers, distances = all_multipliers(hop), limit_distances(hop)
    lower, upper = distances.active(ACTIVE)
    # what the barrier leaves of 1e-10 at a distance of more than 1e-4 is less than 1e-6
    assert np.abs(multipliers[~(lower | upper)]).max() < 1e-6
    assert (multipliers[lower & ~upper] < 1e-6).all()
    assert (multipliers[upper & ~lower] > -1e-6).all()


def test_forces_of_a_path_constraint_are_summed_in_each_interval():
    # least peak of |u| to go from rest to rest: u is at the peak all along, first up, then down
    _, _, u, phase = rest_to_rest(piecewise="constant")
    problem = Problem("softly", [phase], minimise=phase.peak(u, absolute=True))
    forces = path_multiplier_sums(solved_on(10, problem).kept_iterate, 0)
    above, below = forces.values()
    np.testing.assert_array_equal(strongly_active(above, STRONGLY_ACTIVE), [True] * 5 + [False] * 5)
    np.testing.assert_array_equal(strongly_active(below, STRONGLY_ACTIVE), [False] * 5 + [True] * 5)


def test_bounds_that_nothing_touches_do_not_act():
    # without any limit that acts, the largest multiplier is what the barrier leaves everywhere
    x, v, u = State("x", lower=-9, upper=9), State("v"), Control("u", lower=-5, upper=5)
    phase = Phase("move", {x: v, v: u}, {x: 0, v: 0}, {x: 1, v: 0}, end=1.0)
    problem = Problem("far from walls", [phase], minimise=phase.integral(u**2))
    iterate = solve(problem, settings=Settings(intervals=10)).kept_iterate
    assert not acting_on_states(iterate)[0].any()


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


def test_the_estimated_gain_by_breakpoints_is_what_is_lost():
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


def below_a_speed(limit):
    """One metre in one second from rest to rest with least effort, below a speed [m/s]."""
    x, v, u = State("x", "m"), State("v", "m/s", upper=limit), Control("u", "m/s^2")
    phase = Phase("move", {x: v, v: u}, initial={x: 0, v: 0}, final={x: 1, v: 0}, end=1)
    return Problem("below a speed", phase, minimise=phase.integral(u**2))


def least_effort(limit):
    """Parabolas of ``t_a = 3 (V - 1) / (2 V)`` at both ends, which cost ``8 V^2 / (3 t_a)``."""
    return 8.0 * limit**2 / (3.0 * (1.5 * (limit - 1.0) / limit))


def over_a_hill(steepness, top):
    """From 0 to 0 in one second over a parabola of height 1, with least integral of u^2."""
    x, u = State("x"), Control("u")
    hill = Bound("hill", x - 1 + steepness * (TIME - top) ** 2, lower=0)
    phase = Phase("over", {x: u}, initial={x: 0}, final={x: 0}, end=1, bounds=[hill])
    return Problem("over a hill", phase, minimise=phase.integral(u**2))


def least_over_a_hill(k, c):
    """Tangents from both ends and the parabola between: slope s at a, ``s a = 1 - k (a - c)^2``."""
    a = np.sqrt(c**2 - 1.0 / k)
    b = 1.0 - np.sqrt((1.0 - c) ** 2 - 1.0 / k)
    slopes = -2.0 * k * (np.array([a, b]) - c)
    arc = 4.0 * k**2 * ((b - c) ** 3 - (a - c) ** 3) / 3.0
    return slopes[0] ** 2 * a + slopes[1] ** 2 * (1.0 - b) + arc


@pytest.mark.parametrize("limit", [1.04, 1.08, 1.12, 1.35, 1.48])
def test_a_speed_is_held_from_where_it_is_best(limit):
    certified(below_a_speed(limit), least_effort(limit))


@pytest.mark.parametrize(("k", "c"), [(10, 0.4), (100, 0.5), (400, 0.51237), (1000, 0.51237)])
def test_a_hill_that_is_narrower_than_an_interval_is_touched_where_it_is_best(k, c):
    # time enters, so that the Hamiltonian is not constant
    certified(over_a_hill(k, c), least_over_a_hill(k, c))


def over_a_bell(width):
    """From 0 to 0 over a bell of height 1; it vanishes at both ends, where the motion begins."""
    x, u = State("x"), Control("u")
    bell = Bound("bell", x - ca.exp(-(((TIME - 0.5) / width) ** 2) / 2), lower=0)
    phase = Phase("over", {x: u}, initial={x: 0}, final={x: 0}, end=1, bounds=[bell])
    return Problem("over a bell", phase, minimise=phase.integral(u**2))


def least_over_a_bell(width):
    """Twice a tangent from the start to the bell, and the bell up to its top."""

    def bell(t):
        return np.exp(-(((t - 0.5) / width) ** 2) / 2)

    def slope(t):
        return -(t - 0.5) / width**2 * bell(t)

    at = brentq(lambda t: slope(t) * t - bell(t), 0.5 - width, 0.5 - 1e-9, xtol=1e-15)
    return 2 * (slope(at) ** 2 * at + quad(lambda t: slope(t) ** 2, at, 0.5)[0])


@pytest.mark.parametrize("width", [0.01, 0.02])
def test_a_limit_that_fixed_values_meet_hides_no_other_arc(width):
    # the start lies on the limit, whose multiplier there is any number, often a huge one
    found = certified(over_a_bell(width), least_over_a_bell(width))

    # those of the bell at the start and the end, and no others
    iterate = found.kept_iterate
    determined = iterate.determined_row_multipliers
    undetermined = np.flatnonzero(iterate.row_multipliers != determined)
    bell = np.concatenate([path.rows for path in iterate.transcription.rows.phases[0].path])
    assert undetermined.size == 2
    assert np.isin(undetermined, bell).all()


@pytest.mark.parametrize("limit", [1.04, 1.08, 1.12])
def test_a_mesh_whose_arcs_begin_too_early_is_not_certified(limit):
    coarse = solve(below_a_speed(limit), settings=Settings(refinement=FixedMesh()))
    assert coarse.objective > least_effort(limit) * (1 + 3e-4)
    failed = {c.name for c in certify(coarse).checks if not c.passed}
    assert any("where path constraints act" in name for name in failed)


def test_a_quarter_of_the_hamiltonians_difference_beside_the_end_of_an_arc_counts():
    ends = np.array([False, True, False, False])
    steps, stretches = np.array([0.5, 0.25, 1.0, 1.0]), np.zeros(4, dtype=int)
    found = junction_gains(np.array([2.0, -4.0, 8.0]), steps, stretches, ends)
    np.testing.assert_allclose(found, [0.0625, 0.0625 + 0.125, 0.125, 0.0])
    # at a known instant it may jump
    found = junction_gains(np.array([2.0, -4.0, 8.0]), steps, np.array([0, 1, 1, 1]), ends)
    np.testing.assert_allclose(found, [0.0, 0.125, 0.125, 0.0])
