"""Rest at the ends: it fails only if no motion that keeps the jerk's cap is at rest there."""

from pathlib import Path

import numpy as np
import pytest
from scipy.special import comb

from models.laws import JerkLimited, Step5, UnderWay
from models.truss import TrussParameters
from studies.check.ends import Most, at_rest, end_rate
from studies.check.reading.profile import read_profile
from studies.check.truss import check_truss
from studies.common.result import Result
from studies.truss.config import DEPLOYED, TrussStudy
from studies.truss.limits.caps import Caps
from tests.studies.check.least_jerk import least_jerk

T = 10.0
TRUSS = TrussParameters()
PEAK = 0.0839  # rad/s^2, acceleration of the paper's Bezier law
NAME = "acceleration at the start"
JERK = Most("jerk", "rad/s^3", 3, 1.0)


def bezier(rows: int, start: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Times and angles of the paper's Bezier law, with an acceleration at its start [rad/s^2]."""
    time = np.linspace(0.0, T, rows)
    stowed = TRUSS.stowed_angle
    points = [stowed, stowed, stowed + start * T**2 / 56, 0.4465, 0.8152, 1.2169, *3 * [DEPLOYED]]
    s = time / T
    return time, sum(comb(8, k) * s**k * (1 - s) ** (8 - k) * p for k, p in enumerate(points))


def check(
    path: Path, time: np.ndarray, angle: np.ndarray, jerk: float = 1.0, digits: str = "%.10g"
) -> Result:
    header = "time [s],angle [rad]"
    np.savetxt(path, np.column_stack([time, angle]), digits, ",", header=header, comments="")
    study = TrussStudy(minimise="peak-acceleration", duration=T, truss=TRUSS, caps=Caps(jerk=jerk))
    return check_truss(read_profile(path), study, optimum=False)


@pytest.mark.parametrize("rows", [21, 31, 41, 61, 81, 121])
def test_coarse_rows_of_a_resting_profile_do_not_fail(rows: int, tmp_path: Path) -> None:
    result = check(tmp_path / "a.csv", *bezier(rows))
    assert result.passed, [c.sentence for c in result.checks]
    (end,) = [c for c in result.checks if c.name.startswith("acceleration at")]
    # where the curve alone moves at its start, that is said
    assert (end.value > end.limit) == (not end.decided)
    assert rows == 121 or end.sentence.startswith("not decided: ")


@pytest.mark.parametrize(
    ("rows", "part", "digits"),
    [(101, 0.25, "%.10g"), (1001, 0.02, "%.16g"), (401, 0.25, "%.6f")],
)
def test_a_start_with_acceleration_fails(
    rows: int, part: float, digits: str, tmp_path: Path
) -> None:
    """If the cap on the jerk leaves less room between rows than that: finer rows tell more."""
    result = check(tmp_path / "a.csv", *bezier(rows, start=part * PEAK), jerk=0.15, digits=digits)
    (failed,) = [c for c in result.checks if not c.passed]
    assert failed.name == NAME
    assert "if the jerk is at most 0.15 rad/s^3" in failed.sentence


@pytest.mark.parametrize(("rows", "part"), [(41, 0.05), (101, 0.01)])
def test_an_acceleration_that_a_motion_at_rest_explains_is_not_decided(
    rows: int, part: float, tmp_path: Path
) -> None:
    """The rows lie on a smooth curve that starts with acceleration, and on one from rest as well.

    The other one keeps the cap on the jerk: its first rows are made, with the state that the smooth
    curve has at the last of them.
    """
    time, angle = bezier(rows, start=part * PEAK)
    result = check(tmp_path / "a.csv", time, angle)
    (start,) = [c for c in result.checks if c.name == NAME]
    assert start.passed
    assert not start.decided

    curve = np.polynomial.Polynomial.fit(time, angle, 8)
    end = tuple(float(curve.deriv(order)(time[24])) for order in (1, 2))
    assert least_jerk(time[:25], angle[:25], (0.0, 0.0), end) < 0.2


@pytest.mark.parametrize(
    ("rows", "jerk", "digits"),
    [(81, 0.2, "%.17g"), (401, 1.0, "%.17g"), (101, 3.0, "%.6f")],
)
def test_a_jerk_limited_start_from_rest_never_fails(
    rows: int, jerk: float, digits: str, tmp_path: Path
) -> None:
    """Its jerk switches among the first rows, or its digits hide the start."""
    law, time = JerkLimited(T, TRUSS.stowed_angle, DEPLOYED, jerk), np.linspace(0.0, T, rows)
    result = check(tmp_path / "a.csv", time, law.motion(time).angle, jerk, digits)
    ends = [c for c in result.checks if " at the " in c.name]
    assert len(ends) == 2
    assert all(c.passed for c in ends), [c.sentence for c in ends]


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


def test_no_rounding_and_no_jerk_lead_beyond_the_bound_of_an_end() -> None:
    """Motions of piecewise constant jerk, at random, their rows wrong by all that is allowed."""
    rng = np.random.default_rng(3)
    for _ in range(300):
        time = np.cumsum(rng.uniform(0.3, 1.0, 24))
        time -= time[0]
        wrong = rng.uniform(0.0, 10.0 ** rng.uniform(-6, 0), time.size)
        speed, turn = rng.normal(size=2)
        switches = np.append(0.0, np.sort(rng.uniform(0.0, time[-1], 4)))
        steps = np.diff(rng.choice([-1.0, 0.0, 1.0], 5), prepend=0.0)
        values = speed * time + turn * time**2 / 2
        values += (np.maximum(time[:, None] - switches, 0.0) ** 3 / 6) @ steps
        values += wrong * rng.choice([-1.0, 1.0], time.size)
        for order, truth in ((1, speed), (2, turn)):
            rate = end_rate(time, values, wrong, order, (JERK,))
            assert abs(rate.value - truth) <= rate.wrong * (1 + 1e-9)


@pytest.mark.parametrize(("order", "of_rows"), [(1, [-1.5, 2.0, -0.5]), (2, [1.0, -2.0, 1.0])])
def test_the_bound_of_an_end_is_attained(order: int, of_rows: list[float]) -> None:
    """By the greatest jerk and rows that are wrong each in its worst direction."""
    time, wrong = np.arange(3.0), np.array([3e-3, 1e-3, 2e-3])
    slope = np.sign(of_rows) * wrong
    for side in (1.0, -1.0):
        # the truth is 0, and of both bounds the same sign counts
        rate = end_rate(time, side * time**3 / 6 + slope, wrong, order, (JERK,))
        by_jerk = np.dot(of_rows, time**3) / 6
        assert rate.wrong == pytest.approx(abs(by_jerk) + np.abs(of_rows) @ wrong)
        if side * by_jerk > 0:
            assert rate.value == pytest.approx(rate.wrong)


def test_a_limit_on_the_acceleration_bounds_a_speed() -> None:
    """And of two limits the one that leaves less open counts."""
    time, wrong = np.linspace(0.0, 1.0, 11), np.full(11, 1e-12)
    turn = Most("acceleration", "rad/s^2", 2, 4.0)
    rate = end_rate(time, 2.0 * time**2, wrong, 1, (turn,))
    assert rate.value == pytest.approx(rate.wrong) == pytest.approx(0.2)
    assert end_rate(time, 2.0 * time**2, wrong, 1, (turn, JERK)).given is JERK


def test_rest_that_only_the_curve_has_fails_by_the_rows() -> None:
    rate = end_rate(np.arange(20.0), np.arange(20.0) ** 2, np.full(20, 1e-9), 2, (JERK,))
    criterion = at_rest(NAME, "rad/s^2", 0.0, rate, 1e-8)
    assert not criterion.passed
    assert "although the smoothed curve is at rest" in criterion.sentence


@pytest.mark.parametrize(("rates", "noise"), [(False, 0.0), (True, 0.0), (False, 1e-5)])
def test_a_profile_that_is_under_way_is_held_against_the_rate_of_its_start(
    rates: bool, noise: float, tmp_path: Path
) -> None:
    degrees, path = 2.0, tmp_path / "a.csv"
    start = TRUSS.stowed_angle + np.radians(degrees) * 4.0 / 3
    law = UnderWay(Step5(T, start, DEPLOYED), np.radians(degrees), 4.0)
    motion = law.motion(np.linspace(0.0, T, 401))
    angle = motion.angle + noise * np.random.default_rng(59).standard_normal(401)
    columns = {"time [s]": motion.time, "angle [rad]": angle}
    if rates:
        columns |= {
            "angular_speed [rad/s]": motion.speed,
            "angular_acceleration [rad/s^2]": motion.acceleration,
        }
    rows = np.column_stack([*columns.values()])
    np.savetxt(path, rows, "%.12g", ",", header=",".join(columns), comments="")

    def told(rate: float) -> Result:
        study = TrussStudy(
            minimise="peak-acceleration",
            duration=T,
            start_rate_deg_per_s=rate,
            caps=Caps(jerk=1.0),
        )
        return check_truss(read_profile(path), study, optimum=False)

    assert told(degrees).passed
    # at rest or slower the same rows fail, and nothing else of them does
    for rate in (0.0, 0.9 * degrees):
        failed = [one.name for one in told(rate).checks if not one.passed]
        assert "speed at the start" in failed
        assert set(failed) <= {"speed at the start", NAME}
