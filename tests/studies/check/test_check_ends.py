"""Rest at the ends: coarse rows at rest do not fail, a start with acceleration does."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.special import comb

from models.laws import JerkLimited
from models.truss import TrussParameters
from studies.check.ends import at_rest, end_rate
from studies.check.reading.profile import read_profile
from studies.check.truss import check_truss
from studies.common.result import Result
from studies.truss.config import DEPLOYED, TrussStudy
from studies.truss.limits.caps import Caps

T = 10.0
TRUSS = TrussParameters()
PEAK = 0.0839  # rad/s^2, acceleration of the paper's Bezier law
NAME = "acceleration at the start"


def bezier(rows: int, start: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Times and angles of the paper's Bezier law, with an acceleration at its start [rad/s^2]."""
    time = np.linspace(0.0, T, rows)
    stowed = TRUSS.stowed_angle
    points = [stowed, stowed, stowed + start * T**2 / 56, 0.4465, 0.8152, 1.2169, *3 * [DEPLOYED]]
    s = time / T
    return time, sum(comb(8, k) * s**k * (1 - s) ** (8 - k) * p for k, p in enumerate(points))


def check(path: Path, time: np.ndarray, angle: np.ndarray) -> Result:
    header = "time [s],angle [rad]"
    np.savetxt(path, np.column_stack([time, angle]), "%.10g", ",", header=header, comments="")
    study = TrussStudy(
        minimise="peak-acceleration", duration=T, truss=TRUSS, caps=Caps(jerk=1000 / T**3)
    )
    return check_truss(read_profile(path), study, optimum=False)


@pytest.mark.parametrize("rows", [21, 31, 41, 61, 81, 121])
def test_coarse_rows_of_a_resting_profile_do_not_fail(rows: int, tmp_path: Path) -> None:
    result = check(tmp_path / "a.csv", *bezier(rows))
    assert result.passed, [c.sentence for c in result.checks]
    (end,) = [c for c in result.checks if c.name.startswith("acceleration at")]
    # where the curve alone moves at its start, that is said
    assert (end.value > end.limit) == (not end.decided)
    assert rows == 121 or end.sentence.startswith("not decided: ")


@pytest.mark.parametrize(("rows", "part"), [(41, 0.05), (101, 0.01), (1001, 0.001)])
def test_a_start_with_acceleration_fails(rows: int, part: float, tmp_path: Path) -> None:
    """However small the part of the peak acceleration: the finer rows tell it."""
    result = check(tmp_path / "a.csv", *bezier(rows, start=part * PEAK))
    (failed,) = [c for c in result.checks if not c.passed]
    assert failed.name == NAME
    assert failed.value == pytest.approx(part * PEAK, rel=0.1)


@pytest.mark.parametrize("jerk", [0.125, 0.2])
@pytest.mark.parametrize("rows", [21, 41, 101])
def test_a_start_from_rest_between_two_rows_is_not_decided(
    rows: int, jerk: float, tmp_path: Path
) -> None:
    """The acceleration rises within one to six rows, and is constant over the next ones."""
    law, time = JerkLimited(T, TRUSS.stowed_angle, DEPLOYED, jerk), np.linspace(0.0, T, rows)
    result = check(tmp_path / "a.csv", time, law.motion(time).angle)
    ends = [c for c in result.checks if " at the " in c.name]
    assert all(c.passed for c in ends), [c.sentence for c in ends]


def test_rates_at_an_end_hold_the_truth_within_digits_and_interpolation() -> None:
    time = np.sort(np.append(np.linspace(0.0, 1.0, 41), 0.0123))  # rows need not be even
    values = np.sin(2.0 * time) + 3.0
    wrong = np.full(time.size, 1e-10)
    for order, truth in ((1, 2.0), (2, 0.0)):
        rate = end_rate(time, values, wrong, order)
        assert abs(rate.value - truth) <= rate.wrong <= 1e-2
    backwards = end_rate(time[::-1], values[::-1], wrong, 2)
    assert backwards.value == pytest.approx(-4.0 * math.sin(2.0), abs=backwards.wrong)

    # the digits of close rows tell less than rows further apart
    fine = np.linspace(0.0, 1.0, 4001)
    rate = end_rate(fine, np.sin(2.0 * fine), np.full(fine.size, 1e-9), 2)
    assert abs(rate.value) <= rate.wrong < 1e-3


def test_rest_that_only_the_curve_has_fails_by_the_rows() -> None:
    rate = end_rate(np.arange(20.0), np.arange(20.0) ** 2, np.full(20, 1e-9), 2)
    criterion = at_rest(NAME, "rad/s^2", 0.0, rate, 1e-8)
    assert not criterion.passed
    assert "though the curve is drawn at rest" in criterion.sentence
