"""Pareto fronts of a problem beside their closed form."""

import itertools
import math

import numpy as np
import pytest

from ocp import Control, Phase, Problem, State, StatementError, front


def load() -> tuple[Problem, object, object]:
    """1 kg moved by 1 m in 2 s, from rest to rest: its peak force and its heat."""
    x, v, force = State("x", "m"), State("v", "m/s"), Control("force", "N")
    move = Phase("move", {x: v, v: force}, {x: 0, v: 0}, {x: 1, v: 0}, end=2.0)
    heat = move.integral(force**2)
    return Problem("load", move, minimise=heat), move.peak(force, absolute=True), heat


def least_heat(peak: float) -> float:
    """The force is a straight line in time that is cut off at the peak."""
    straight = math.sqrt(3 * (1 - 1 / peak))
    return 2 * peak**2 * (1 - 2 * straight / 3)


def test_a_front_lies_on_its_closed_form_and_has_its_slopes() -> None:
    problem, peak, heat = load()
    found = front(problem, limited=peak, minimised=heat, points=5)
    assert len(found.points) >= 4
    assert not found.gaps
    # the minimum of the heat has a peak of 1.5 N, and no motion has a peak below 1 N
    assert found.points[0].x == pytest.approx(1.0, rel=3e-3)
    # the front is flat there: points nearer than a hundredth are alike to six digits
    assert found.points[-1].x == pytest.approx(1.5, rel=1e-2)
    for point in found.points:
        assert point.y == pytest.approx(least_heat(point.x), rel=1e-4)
        assert point.motion.verification.passed
    for point in found.points[1:-1]:
        step = 1e-5
        slope = (least_heat(point.limit + step) - least_heat(point.limit - step)) / (2 * step)
        # it vanishes at the flat end
        assert point.slope == pytest.approx(slope, rel=1e-2, abs=1e-3)
    assert all(a.x < b.x and a.y > b.y for a, b in itertools.pairwise(found.points))
    assert found.knee in found.points[1:-1]


@pytest.mark.slow
def test_a_front_between_stated_limits() -> None:
    problem, peak, heat = load()
    found = front(problem, limited=peak, minimised=heat, limits=(1.1, 1.3), points=2)
    np.testing.assert_allclose([found.points[0].x, found.points[-1].x], [1.1, 1.3], rtol=1e-5)


def test_an_end_that_no_motion_attains_is_left_open() -> None:
    problem, peak, heat = load()
    found = front(problem, limited=peak, minimised=heat, limits=(0.5, 1.3), points=4)
    assert [point.x for point in found.points] == pytest.approx([1.3], rel=1e-5)
    assert "no motion was found at the limit 0.5" in found.remarks[0]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"points": 1}, "a front of 1 points cannot be drawn; give 2 or more"),
        ({"limits": (2, 1)}, r"the limits \(2, 1\) of the front cross; give \(lowest, highest\)"),
    ],
)
def test_a_front_refuses_in_a_sentence(options, words) -> None:
    problem, peak, heat = load()
    with pytest.raises(StatementError, match=words):
        front(problem, limited=peak, minimised=heat, **options)
