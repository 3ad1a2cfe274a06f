"""The family of jerk caps: what is timed, and how its answers are held against each other."""

import io
import math
from pathlib import Path

import pytest

from benchmarks.parts import Setup
from benchmarks.race.rows.problems import JERK_CAP
from benchmarks.speed import family
from studies.common.console import Console


@pytest.mark.slow
def test_three_members_are_timed_and_agree(tmp_path: Path) -> None:
    said = io.StringIO()
    setup = Setup(Console(said, said), repeats=1, limit=60.0, peers=False, environments=tmp_path)
    first, *_, record = family.measure(setup, members=3)
    assert family.faster(first | {"verified": [], "cold": []}) is None

    assert len(record["verified"]) == len(record["cold"]) == 3
    assert 0 < record["inside"] < record["family"]
    assert family.overhead(record) > 1
    assert family.faster(record) > 0
    assert max(family.differences(record).values()) < family.AGREEMENT
    assert "3 of 3 members" in said.getvalue()
    (table,) = family.tables(record)
    assert "times faster" in str(table)


def test_the_closed_form_is_the_motion_between_its_limits() -> None:
    # 0.341756 mrad/s^2 is what the race's contestants are held against
    assert family.optimum(JERK_CAP["A"]) == pytest.approx(3.417562e-4, rel=1e-6)
    # with no limit of the jerk, 4 D / T^2
    bang_bang = 4 * (family.END - family.START) / family.DURATION["A"] ** 2
    assert family.optimum(1e6 * JERK_CAP["A"]) == pytest.approx(bang_bang, rel=1e-5)
    # under the least jerk that does, the plateaus have gone: a = J T / 4
    least = 32 * (family.END - family.START) / family.DURATION["A"] ** 3
    peak = least * family.DURATION["A"] / 4
    assert family.optimum(least * (1 + 1e-12)) == pytest.approx(peak, rel=1e-5)


def test_caps_have_equal_ratios() -> None:
    low, middle, high = family.caps(3)
    assert middle == pytest.approx(math.sqrt(low * high))
    assert (low, high) == pytest.approx((0.5 * JERK_CAP["A"], 2 * JERK_CAP["A"]))
