"""What is at a limit, and what presses: by distance and by multiplier."""

import numpy as np
import pytest

from ocp import Control, Phase, Problem, Settings, State, solve
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
from ocp.optimality.multipliers import all_multipliers
from tests.ocp.problems import bryson_denham, rest_to_rest, solved_on


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
