"""The shows of fronts: their cases come in turn, and a cold start that fails is no crash."""

import math

import pytest

from benchmarks.shows.scale import pareto, pareto_arm
from benchmarks.shows.scale.fronts import found_cold, times_faster


@pytest.mark.parametrize("show", [pareto, pareto_arm])
def test_cases_come_in_turn_whatever_the_seed(show):
    cases = len(show.CASES)
    assert [show.question(3, k)["study"] for k in range(cases + 1)] == [*show.CASES, show.CASES[0]]


def test_a_cold_start_is_a_value_and_its_seconds_or_nan():
    value, seconds = found_cold(lambda: float(sum(range(100_000))), ValueError)
    assert value == 4999950000.0
    assert seconds > 0
    assert math.isnan(found_cold(lambda: float("none"), ValueError)[0])
    with pytest.raises(ValueError, match="none"):  # another error is one of the show
        found_cold(lambda: float("none"), KeyError)


def test_as_many_cold_starts_as_points_stand_beside_the_front():
    assert times_faster([2.0, 4.0], 10, 15.0) == 2.0
