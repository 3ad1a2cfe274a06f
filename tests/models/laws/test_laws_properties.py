"""Every law keeps its end conditions and its derivatives are those of its angle."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from models import laws

durations = st.floats(0.5, 500.0)
starts = st.floats(0.01, 0.7)
ends = st.floats(0.8, math.pi / 2)


@st.composite
def resting_laws(draw):
    """Laws from rest to rest with zero acceleration at both ends, (45)."""
    duration, start, end = draw(durations), draw(starts), draw(ends)
    kind = draw(st.sampled_from(["step5", "bezier", "jerk", "table", "dwell"]))
    if kind == "step5":
        return laws.Step5(duration, start, end)
    if kind == "bezier":
        inner = draw(st.lists(st.floats(0.0, 1.6), min_size=0, max_size=6))
        return laws.Bezier(duration, (start,) * 3 + tuple(inner) + (end,) * 3)
    if kind == "jerk":
        factor = draw(st.floats(1.0, 50.0))
        jerk = factor * laws.least_jerk_cap(end - start, duration)
        return laws.JerkLimited(duration, start, end, jerk)
    if kind == "table":
        times = np.linspace(0, duration, draw(st.integers(2, 12)))
        return laws.Tabulated(times, start + (end - start) * (times / duration) ** 2)
    return laws.BetweenRests(laws.Step5(duration, start, end), draw(st.floats(0.1, 50.0)))


@st.composite
def any_laws(draw):
    duration, start, end = draw(durations), draw(starts), draw(ends)
    kind = draw(st.sampled_from(["rest", "line", "jerks", "free table"]))
    if kind == "line":
        return laws.StraightLine(duration, start, end)
    if kind == "jerks":
        jerks = draw(st.lists(st.floats(-5.0, 5.0), min_size=1, max_size=8))
        edges = np.linspace(0, duration, len(jerks) + 1)
        scaled = tuple(jerk / duration**3 for jerk in jerks)
        return laws.constant_jerk(edges, scaled, start, 0.3 / duration, -0.2 / duration**2)
    if kind == "free table":
        times = np.linspace(0, duration, draw(st.integers(6, 12)))
        angles = start + (end - start) * np.sin(times / duration * math.pi / 2)
        return laws.Tabulated(times, angles, ends="free")
    return draw(resting_laws())


@given(resting_laws())
def test_ends(law):
    span = law.duration
    motion = law.motion([0.0, span])
    assert motion.angle == pytest.approx([law.start_angle, law.end_angle], abs=1e-12)
    # In units of the duration; splines solve a linear system, hence more than rounding.
    assert motion.speed * span == pytest.approx([0, 0], abs=1e-9)
    assert motion.acceleration * span**2 == pytest.approx([0, 0], abs=1e-7)


@given(any_laws())
def test_derivatives(law):
    """On each smooth piece, integrals of a derivative are differences of what it derives."""
    x, w = np.polynomial.legendre.leggauss(12)  # exact for polynomials up to degree 23
    edges = [0.0, *law.breakpoints, law.duration]
    for low, high in itertools.pairwise(edges):
        # Just inside, so that a jump of the jerk does not enter.
        a, b = low + 1e-9 * (high - low), high - 1e-9 * (high - low)
        ends, inner = law.motion([a, b]), law.motion((a + b) / 2 + (b - a) / 2 * x)
        chain = ("angle", "speed", "acceleration", "jerk")
        for order in range(3):
            change = np.diff(getattr(ends, chain[order]))[0]
            integral = (b - a) / 2 * w @ getattr(inner, chain[order + 1])
            scale = np.abs(getattr(inner, chain[order])).max() + np.abs(change) + 1e-3
            assert integral == pytest.approx(change, abs=1e-9 * scale)


@given(any_laws())
def test_breakpoints_lie_inside_and_increase(law):
    edges = [0.0, *law.breakpoints, law.duration]
    assert all(low < high for low, high in itertools.pairwise(edges))


@given(any_laws(), st.floats(0.0, 1.0))
def test_angle_and_speed_are_continuous(law, where):
    span = law.duration
    step = 1e-7 * span
    t = min(max(where * span, step), span - step)
    for at in (t, *law.breakpoints):
        motion = law.motion([at - step, at + step])
        gap = np.diff([motion.angle, motion.speed * span], axis=1)
        # Two steps of 1e-7 of the duration, at rates that these laws keep well below 1e3.
        assert np.abs(gap).max() <= 2e-4


@given(resting_laws())
def test_no_law_beats_the_bound_on_acceleration(law):
    stroke = law.end_angle - law.start_angle
    bound = laws.least_peak_acceleration(stroke, law.duration)
    assert laws.peaks(law).acceleration >= bound * (1 - 1e-9)


@given(durations, starts, ends, st.floats(1.0, 100.0))
def test_jerk_limited_meets_its_own_bound(duration, start, end, factor):
    jerk = factor * laws.least_jerk_cap(end - start, duration)
    law = laws.JerkLimited(duration, start, end, jerk)
    expected = laws.least_peak_acceleration(end - start, duration, jerk=jerk)
    peaks = laws.peaks(law)
    # At factor 1 the root vanishes, and rounding of 1 - 1/factor enters under the root.
    assert peaks.acceleration == pytest.approx(expected, rel=1e-7)
    assert peaks.jerk == pytest.approx(jerk, rel=1e-12)


@given(st.lists(st.floats(0.0, 1.5), min_size=2, max_size=10), durations)
def test_bezier_stays_in_the_hull_of_its_points(points, duration):
    points = [min(points) - 0.1, *points, max(points) + 0.1]
    angle = laws.Bezier(duration, points).motion(np.linspace(0, duration, 50)).angle
    assert angle.min() >= min(points) - 1e-12
    assert angle.max() <= max(points) + 1e-12


def test_a_table_of_a_smooth_law_gives_it_back_at_sixth_order():
    law = laws.Bezier(10.0)
    dense = np.linspace(0, 10, 777)
    errors = []
    for count in (21, 41):
        times = np.linspace(0, 10, count)
        table = laws.Tabulated(times, law.motion(times).angle)
        errors.append(np.abs(table.motion(dense).angle - law.motion(dense).angle).max())
    order = np.log2(errors[0] / errors[1])
    assert order == pytest.approx(6, abs=0.5)  # of quintic splines, before its limit


def test_a_rest_before_a_law_waits_then_plays():
    law = laws.Step5(10.0, 0.1, 1.5)
    dwell = laws.BetweenRests(law, before=4.0)
    times = np.array([0.0, 3.9, 4.0, 6.0, 14.0])
    motion = dwell.motion(times)
    assert list(motion.angle[:3]) == [0.1, 0.1, 0.1]
    assert motion.angle[3] == law.motion(2.0).angle[0]
    assert dwell.breakpoints == (4.0, 9.0)
    assert dwell.end_angle == law.end_angle
