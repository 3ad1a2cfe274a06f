"""Laws refuse what they cannot do, in one sentence that names the remedy."""

import math

import numpy as np
import pytest

from models import laws
from models.errors import ModelError

STEP5 = laws.Step5(10.0, 0.1, 1.5)


@pytest.mark.parametrize("law", [laws.Step5, laws.StraightLine])
@pytest.mark.parametrize("duration", [0.0, -1.0, math.inf, math.nan])
def test_bad_durations(law, duration):
    with pytest.raises(ModelError, match="give a positive finite time"):
        law(duration, 0.1, 1.5)


@pytest.mark.parametrize("angles", [(1.5, 0.1), (0.1, 0.1), (math.nan, 1.0), (0.0, math.inf)])
def test_bad_angles(angles):
    for make in (laws.Step5, laws.StraightLine):
        with pytest.raises(ModelError, match="start_angle < end_angle"):
            make(10.0, *angles)
    with pytest.raises(ModelError, match="start_angle < end_angle"):
        laws.JerkLimited(10.0, *angles, 1.0)


def test_infeasible_jerk_cap_names_the_least_feasible_one():
    least = 32 * 1.4 / 10.0**3
    with pytest.raises(ModelError, match=r"raise it to at least 0\.0448"):
        laws.JerkLimited(10.0, 0.1, 1.5, 0.99 * least)
    for jerk in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(ModelError, match="jerk cap"):
            laws.JerkLimited(10.0, 0.1, 1.5, jerk)


def test_bad_bounds():
    with pytest.raises(ModelError, match="stroke"):
        laws.least_peak_acceleration(0.0, 1.0)
    with pytest.raises(ModelError, match="duration"):
        laws.least_peak_acceleration(1.0, 0.0)


@pytest.mark.parametrize("points", [(), (0.1,), (0.1, math.nan, 1.0), (1.0, 0.5)])
def test_bad_bezier_points(points):
    with pytest.raises(ModelError):
        laws.Bezier(10.0, points)


@pytest.mark.parametrize(
    ("edges", "jerks"),
    [
        ((0.0,), ()),
        ((1.0, 2.0), (1.0,)),
        ((0.0, 2.0, 1.0), (1.0, 1.0)),
        ((0.0, 1.0), (1.0, 2.0)),
        ((0.0, 1.0), (math.nan,)),
        ((0.0, math.inf), (1.0,)),
    ],
)
def test_bad_pieces(edges, jerks):
    with pytest.raises(ModelError, match="give"):
        laws.constant_jerk(edges, jerks, 0.1)


@pytest.mark.parametrize(
    ("times", "angles", "ends"),
    [
        ([0.0], [0.1], "at rest"),
        ([0.0, 1.0], [0.1, 0.2, 0.3], "at rest"),
        ([1.0, 2.0], [0.1, 0.2], "at rest"),
        ([0.0, 2.0, 1.0], [0.1, 0.2, 0.3], "at rest"),
        ([0.0, 1.0, 2.0], [0.1, math.nan, 0.3], "at rest"),
        ([0.0, 1.0], [0.2, 0.1], "at rest"),
        ([0.0, 1.0, 2.0], [0.1, 0.2, 0.3], "free"),
        ([0.0, 1.0], [0.1, 0.2], "clamped"),
    ],
)
def test_bad_tables(times, angles, ends):
    with pytest.raises(ModelError):
        laws.Tabulated(times, angles, ends)


@pytest.mark.parametrize("rest", [-1.0, math.inf, math.nan])
def test_bad_rests(rest):
    with pytest.raises(ModelError, match="a rest is"):
        laws.BetweenRests(STEP5, rest)
    with pytest.raises(ModelError, match="a rest is"):
        laws.BetweenRests(STEP5, after=rest)


@pytest.mark.parametrize("time", [-0.1, 10.1, math.nan, np.zeros((2, 2))])
def test_times_outside_the_law(time):
    with pytest.raises(ModelError, match="not defined elsewhere"):
        STEP5.motion(time)


def test_laws_are_values():
    assert laws.Bezier(1.0, list(laws.PAPER_POINTS)) == laws.Bezier(1.0)
    assert hash(laws.Tabulated([0.0, 1.0], [0.1, 0.2])) == hash(
        laws.Tabulated((0.0, 1.0), (0.1, 0.2))
    )
