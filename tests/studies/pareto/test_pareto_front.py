"""Continuation and envelope on curves that are known: no solver is asked."""

import itertools
from dataclasses import dataclass, field

import pytest

from ocp import FrontPoint, PointNotFound
from ocp.analysis.front.continuation import Ranges, distance, fill, walk
from ocp.analysis.front.envelope import front_of, undominated


def point(x, y, slope=-1.0, way="up", motion=None):
    return FrontPoint(x, x, y, slope, way, False, 0.0, motion)


@dataclass
class TwoBasins:
    """y = 1/x, and from x = 1 on, for who comes from there, y = 1/x - 0.2: another basin."""

    refused: tuple[float, float] = (2.0, 2.0)
    asked: list[float] = field(default_factory=list)

    def near(self, limit, before, way):
        self.asked.append(limit)
        low, high = self.refused
        if low < limit < high:
            raise PointNotFound("refused")
        deep = before.motion == "deep" and limit >= 1.0
        return point(limit, 1 / limit - 0.2 * deep, -1 / limit**2, way, "deep" if deep else "flat")

    def afresh(self, limit, before, way):
        return self.near(limit, before, way)


RANGES = Ranges((0.2, 3.0), (0.1, 5.0))
STRIDE = 0.05


def test_points_lie_evenly_along_the_curve():
    first = point(0.2, 5.0, -25.0, motion="flat")
    found = list(walk(TwoBasins(), first, 3.0, RANGES, STRIDE, print))
    steps = [distance(a, b, RANGES) for a, b in itertools.pairwise([first, *found])]
    # the slope at the beginning of a step foretells the step; at the bend it is a third off
    assert all(0.5 * STRIDE < step < 1.5 * STRIDE for step in steps[:-1])
    assert found[-1].limit == 3.0


def test_the_way_back_finds_the_other_basin_and_the_envelope_takes_it():
    subject = TwoBasins()
    up = list(walk(subject, point(0.2, 5.0, -25.0, motion="flat"), 3.0, RANGES, STRIDE, print))
    last = point(3.0, 1 / 3 - 0.2, -1 / 9, "down", "deep")
    down = list(walk(subject, last, 0.2, RANGES, STRIDE, print))
    front = front_of([*up, last, *down], RANGES, 3 * STRIDE)

    deep = [p for p in front.points if p.x >= 1.0]
    assert deep
    assert all(p.motion == "deep" for p in deep)
    assert {p.motion for p in front.points if p.x < 1.0} == {"flat"}
    # those that are not so good are kept apart, and what the deep basin dominates is among them
    assert front.dominated
    assert all(p.motion == "flat" for p in front.dominated)
    assert [p.y for p in front.points] == sorted((p.y for p in front.points), reverse=True)


def test_a_limit_without_a_motion_is_said_and_ends_the_way():
    said = []
    first = point(0.2, 5.0, -25.0, motion="flat")
    found = list(walk(TwoBasins((1.0, 4.0)), first, 3.0, RANGES, STRIDE, said.append))
    assert max(p.limit for p in found) <= 1.0
    assert len(said) == 1
    assert "refused" in said[0]


def test_a_flat_end_is_not_walked():
    first = point(0.5, 1.0, -1e-7)
    subject = TwoBasins()
    assert list(walk(subject, first, 3.0, RANGES, STRIDE, print)) == []
    assert subject.asked == []


def test_a_gap_is_filled_or_shown():
    ends = point(0.5, 2.0, motion="flat"), point(2.0, 0.5, motion="flat")
    closed = fill(TwoBasins(), *ends, RANGES, 0.1)
    assert closed
    assert all(0.5 < p.x < 2.0 for p in closed)
    assert fill(TwoBasins((0.5, 2.0)), *ends, RANGES, 0.1) == []
    assert front_of(ends, RANGES, 0.1).gaps == ((0.5, 2.0),)


def test_dominated_points_and_the_knee():
    points = [point(1.0, 1.0), point(2.0, 1.0), point(0.0, 5.0), point(0.2, 0.5), point(3.0, 0.4)]
    best, rest = undominated(points)
    assert [(p.x, p.y) for p in best] == [(0.0, 5.0), (0.2, 0.5), (3.0, 0.4)]
    assert [(p.x, p.y) for p in rest] == [(1.0, 1.0), (2.0, 1.0)]
    front = front_of(points, Ranges((0.0, 3.0), (0.4, 5.0)), 9.0)
    assert front.knee is best[1]
    assert front.at_most(1.5) is best[1]
    assert front.at_most(-1.0) is None


@pytest.mark.parametrize(("x", "along"), [((1.0, 3.0), 2.0), ((1.0, 16.0), 4.0)])
def test_a_wide_range_counts_by_its_logarithm(x, along):
    ranges = Ranges(x, (0.0, 1.0))
    assert ranges.moved(x[0], 0.5) == pytest.approx(along, rel=1e-12)
    assert ranges.place(along, 0.0)[0] == pytest.approx(0.5, rel=1e-12)
    # the slope in parts of both ranges is that of the places
    step = 1e-6 * along
    rise = ranges.place(along + step, 0.0)[0] - ranges.place(along - step, 0.0)[0]
    assert ranges.steepness(along, 1.0) == pytest.approx(2 * step / rise, rel=1e-6)


def test_a_point_that_is_beaten_but_for_rounding_is_dropped() -> None:
    places = [(4.008, 80.0376), (4.008 + 5e-10, 80.0168), (5.0, 41.0)]
    points = [point(*place) for place in places]
    best, rest = undominated(points)
    assert [p.y for p in best] == [80.0168, 41.0]
    assert [p.y for p in rest] == [80.0376]


def test_a_better_motion_in_place_of_a_point_drops_what_it_dominates() -> None:
    points = [point(1.0, 5.0), point(2.0, 2.0), point(3.0, 1.5), point(4.0, 1.2)]
    front = front_of(points, Ranges((1.0, 4.0), (1.0, 5.0)), 1.0)
    assert front.knee is points[1]
    better = point(2.0, 1.4)

    after = front.replaced([points[0], better, *points[2:]])

    assert after.points == (points[0], better, points[3])
    assert after.dominated == (points[2],)
    assert after.knee is better
    assert front.replaced([*points[:3], point(1.5, 1.2)]).points[-1].x == 1.5
