"""The laws give the paper's figures and those derived again from its equations."""

import math

import numpy as np
import pytest
from scipy.optimize import linprog

from models import laws
from models.errors import ModelError
from models.laws.bezier import bernstein_curve, derivative_points

DURATION = 140.0  # [s]
STOWED, OPEN = math.radians(4.4), math.pi / 2
STROKE = OPEN - STOWED
STEP5 = laws.Step5(DURATION, STOWED, OPEN)
BEZIER = laws.Bezier(DURATION)


def digits(value, places):
    """Agreement to half a unit of the last printed place."""
    return pytest.approx(value, rel=0, abs=0.5 * 10.0**-places)


def test_step5():
    peaks = laws.peaks(STEP5)
    assert peaks.acceleration == pytest.approx(3.75 * 2 * STROKE / DURATION**2, rel=1e-12)
    assert peaks.acceleration == digits(5.717e-4, 7)
    assert peaks.acceleration == pytest.approx(5.7e-4, rel=0.01)  # as printed
    assert peaks.speed == pytest.approx(2 * STROKE / DURATION, rel=1e-12)  # below (40)
    assert peaks.jerk * DURATION**3 == digits(69.0, 1)


def test_printed_bezier():
    peaks = laws.peaks(BEZIER)
    assert peaks.acceleration == digits(4.284e-4, 7)
    assert peaks.acceleration == digits(4.28e-4, 6)  # as printed
    assert peaks.jerk * DURATION**3 == digits(124.22, 2)
    assert 1 - peaks.acceleration / laws.peaks(STEP5).acceleration == digits(0.251, 3)


def test_printed_points_miss_the_ends():
    motion = BEZIER.motion([0.0, DURATION])
    assert motion.angle - [STOWED, OPEN] == pytest.approx([5.5e-6, 3.7e-6], abs=5e-8)
    ends = laws.paper_points(STOWED, OPEN)
    assert list(laws.Bezier(DURATION, ends).motion([0.0, DURATION]).angle) == [STOWED, OPEN]
    # between the ends the paper's own points, for the paper's range
    assert ends[3:-3] == pytest.approx(laws.PAPER_POINTS[3:-3], rel=1e-15)


@pytest.mark.parametrize("start", [4.4, 10, 20, 26, 30, 45, 66, 89])
def test_the_paper_s_law_has_one_shape_for_every_range(start):
    start = math.radians(start)
    law = laws.Bezier(DURATION, laws.paper_points(start, OPEN))
    found = laws.peaks(law)
    stroke = OPEN - start
    assert found.acceleration * DURATION**2 / stroke == pytest.approx(5.62, rel=1e-3)
    assert found.jerk * DURATION**3 / stroke == pytest.approx(83.15, rel=1e-3)
    # it never runs backwards
    assert law.motion(np.linspace(0, DURATION, 501)).speed.min() >= -1e-12 * found.speed


def test_best_bezier_of_degree_8_is_a_little_better_than_the_printed_one():
    s = np.linspace(0, 1, 2001)

    def acceleration(points):
        return bernstein_curve(derivative_points(points, 2), s)

    fixed = acceleration([STOWED] * 3 + [0] * 3 + [OPEN] * 3)
    free = np.stack([acceleration(np.eye(9)[k]) for k in (3, 4, 5)], axis=1)
    bound = np.ones((s.size, 1))
    best = linprog(
        [0, 0, 0, 1],
        A_ub=np.block([[free, -bound], [-free, -bound]]),
        b_ub=np.concatenate([-fixed, fixed]),
        bounds=(None, None),
    )
    inner = tuple(best.x[:3])
    law = laws.Bezier(DURATION, (STOWED,) * 3 + inner + (OPEN,) * 3)
    assert laws.peaks(law).acceleration == digits(4.277e-4, 7)


def test_least_peak_acceleration():
    assert laws.least_peak_acceleration(STROKE, DURATION) == digits(3.049e-4, 7)
    # The jerks are those of the rivals to the digits given: a last digit of 69.0 moves the figure.
    for rival, cubed, figure in ((BEZIER, 124.22, 3.418e-4), (STEP5, 69.0, 3.924e-4)):
        jerk = cubed / DURATION**3
        law = laws.JerkLimited(DURATION, STOWED, OPEN, jerk)
        own = laws.peaks(law)
        assert law.peak_acceleration == digits(figure, 7)
        assert own.acceleration == pytest.approx(law.peak_acceleration, rel=1e-12)
        assert own.jerk == pytest.approx(jerk, rel=1e-12)
        assert own.acceleration < laws.peaks(rival).acceleration


def test_jerk_limited_closed_form_and_limits():
    jerk = 1e-4
    term = 1 - 32 * STROKE / (jerk * DURATION**3)
    expected = jerk * DURATION / 4 * (1 - math.sqrt(term))
    capped = laws.least_peak_acceleration(STROKE, DURATION, jerk=jerk)
    assert capped == pytest.approx(expected, rel=1e-12)
    huge = laws.least_peak_acceleration(STROKE, DURATION, jerk=1e9)
    assert huge == pytest.approx(laws.least_peak_acceleration(STROKE, DURATION), rel=1e-12)
    least = laws.least_jerk_cap(STROKE, DURATION)
    law = laws.JerkLimited(DURATION, STOWED, OPEN, least)
    assert law.breakpoints == (DURATION / 4, 3 * DURATION / 4)  # triangles, nothing held
    assert law.motion(DURATION).angle[0] == pytest.approx(OPEN, abs=1e-14)


def least_by_linear_program(speed: float, jerk: float, pieces: int = 240) -> float:
    """Least peak acceleration of a stroke of 1 in a time of 1 with constant jerk in each piece.

    The signals at the ends of the pieces are linear in the jerks; the last variable is the peak.
    """
    step = 1.0 / pieces
    place = np.arange(1, pieces + 1)[:, None] - np.arange(pieces)  # of each end after each piece
    after = np.maximum(place, 0)
    acceleration = step * (after > 0)
    rate = step**2 * np.where(after > 0, after - 0.5, 0.0)
    way = step**3 * np.where(after > 0, (after**2 - after) / 2 + 1 / 6, 0.0)

    peak, none = -np.ones((pieces, 1)), np.zeros((pieces, 1))
    found = linprog(
        np.eye(pieces + 1)[-1],
        A_ub=np.vstack(
            [np.hstack([sign * acceleration, peak]) for sign in (1, -1)] + [np.hstack([rate, none])]
        ),
        b_ub=np.concatenate([np.zeros(2 * pieces), np.full(pieces, speed)]),
        A_eq=np.hstack([[acceleration[-1], rate[-1], way[-1]], np.zeros((3, 1))]),
        b_eq=[0.0, 0.0, 1.0],
        bounds=[(-jerk, jerk)] * pieces + [(0, None)],
    )
    assert found.success
    return float(found.fun)


@pytest.mark.parametrize("jerk", [40.0, 80.0, 400.0])
def test_least_peak_acceleration_under_a_speed_cap_is_that_of_a_linear_program(jerk):
    least = laws.least_speed_cap(1.0, 1.0, jerk)
    assert 1.0 < least < 2.0
    for speed in [*np.linspace(1.01 * least, 2.0, 6), 2.5]:
        found = laws.least_peak_acceleration(1.0, 1.0, jerk=jerk, speed=speed)
        # the program can switch only between its pieces
        assert least_by_linear_program(speed, jerk) == pytest.approx(found, rel=5e-3)


def test_caps_on_speed_that_act_not_at_all_or_leave_no_motion():
    free = laws.least_peak_acceleration(3.0, 2.0, jerk=50.0)
    assert laws.least_peak_acceleration(3.0, 2.0, jerk=50.0, speed=3.0) == free  # 2 D/T
    assert laws.least_peak_acceleration(3.0, 2.0, speed=3.0) == laws.least_peak_acceleration(
        3.0, 2.0
    )
    # as both ramps take W = T - D/v without a jerk cap
    assert laws.least_peak_acceleration(3.0, 2.0, speed=2.0) == pytest.approx(2.0 / 0.5)
    least = laws.least_speed_cap(3.0, 2.0, 50.0)
    attained = laws.least_peak_acceleration(3.0, 2.0, jerk=50.0, speed=least)
    assert attained == pytest.approx(math.sqrt(least * 50.0), rel=1e-6)  # triangles
    with pytest.raises(ModelError, match=f"raise it to at least {least}"):
        laws.least_peak_acceleration(3.0, 2.0, jerk=50.0, speed=0.99 * least)
    with pytest.raises(ModelError, match=r"raise it to more than 1\.5"):
        laws.least_peak_acceleration(3.0, 2.0, speed=1.5)
