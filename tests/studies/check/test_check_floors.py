"""A cap is called broken only where the rows prove it, and not where the drawn curve swings.

The motion has a jerk of exactly its cap, which switches between the rows; the least motion of that
kind gives the peaks that it is held against.
"""

from pathlib import Path

import numpy as np
import pytest

from models.laws import JerkLimited
from models.truss import TrussParameters
from studies.check.reading.digits import half_a_digit, half_a_digit_of_times
from studies.check.reading.profile import read_profile
from studies.check.truss import check_truss
from studies.common.result import Result
from studies.drive.schema import Drive
from studies.truss.checks import broken_caps
from studies.truss.config import DEPLOYED, TrussStudy
from studies.truss.limits.caps import Caps
from studies.truss.motions.deployment import COLUMNS, Deployment, columns_at
from studies.truss.motions.laws import paper_laws
from tests.studies.check.least_jerk import least_jerk

T = 10.0
JERK = 200 / T**3
TRUSS = TrussParameters(pulley_friction=0.01)
DRIVE = Drive(drum_radius=0.05)
LAW = JerkLimited(T, TRUSS.stowed_angle, DEPLOYED, JERK)
EXACT = Deployment("law", LAW, TRUSS, DRIVE)
STATED = ("time", "angle", "angular_speed", "angular_acceleration", "angular_acceleration_before")
CAPS = {
    "speed": "peak-speed",
    "acceleration": "peak-acceleration",
    "jerk": "peak-jerk",
    "rope_speed": "peak-rope-speed",
    "rope_acceleration": "peak-rope-acceleration",
    "rope_jerk": "peak-rope-jerk",
    "motor_speed": "peak-motor-speed",
    "force": "peak-force",
    "power": "peak-power",
    "reaction": "peak-reaction",
}


def rows(path: Path, step: float, digits: int, names: tuple[str, ...]) -> Path:
    time = np.linspace(0.0, T, round(T / step) + 1)
    columns = columns_at(EXACT, time)
    header = ",".join(f"{name} [{COLUMNS[name][0]}]" for name in names)
    table = np.column_stack([columns[name] for name in names])
    np.savetxt(path, table, f"%.{digits}g", ",", header=header, comments="")
    return path


def check(path: Path, factor: float) -> Result:
    caps = Caps(**{cap: factor * EXACT.values[key] for cap, key in CAPS.items()})
    study = TrussStudy(minimise="energy", duration=T, truss=TRUSS, drive=DRIVE, caps=caps)
    return check_truss(read_profile(path), study, optimum=False)


@pytest.mark.parametrize(
    ("step", "digits", "names"),
    [(0.05, 17, STATED), (0.01, 12, STATED[:2]), (0.01, 12, ("time", "rope_length"))],
    ids=["with rates", "angles alone", "rope alone"],
)
def test_no_cap_that_the_motion_keeps_is_called_broken(
    step: float, digits: int, names: tuple[str, ...], tmp_path: Path
) -> None:
    path = rows(tmp_path / "a.csv", step, digits, names)
    result = check(path, factor=1.0)
    assert result.passed, [c.sentence for c in result.checks]
    for key in CAPS.values():
        peak = result.details["peaks"][key]
        assert peak["low"] <= EXACT.values[key] * (1 + 1e-6), key
    # the drawn curve swings about the switches, and that decides nothing
    (jerk,) = (c.sentence for c in result.checks if c.name == "peak angular jerk")
    assert result.value("peak-jerk") > 1.05 * JERK
    assert "not decided" in jerk

    # what is broken by 5 % is found all the same, in each quantity
    broken = [c for c in check(path, factor=1 / 1.05).checks if not c.passed]
    assert len(broken) >= len(CAPS), [c.sentence for c in broken]


def test_a_force_is_proven_by_rates_and_estimated_from_angles(tmp_path: Path) -> None:
    for names, words in ((STATED, "broken by at least"), (STATED[:2], "exceeded by an estimated")):
        result = check(rows(tmp_path / "a.csv", 0.05, 17, names), factor=1 / 1.05)
        (force,) = (c.sentence for c in result.checks if c.name == "peak rope force")
        assert words in force


def test_digits_are_told_from_a_column() -> None:
    assert half_a_digit(np.array([0.0768, 1.5001, 0.25])) == pytest.approx([5e-5] * 3)
    # of numbers with as many significant digits the largest one is the least exact
    # a rate that is not known at a row tells nothing
    assert half_a_digit(np.array([1.25, np.nan, 3.5]))[[0, 2]] == pytest.approx([5e-3] * 2)
    assert half_a_digit(np.array([0.07681, 1.234, 12.34])) == pytest.approx([5e-6, 5e-4, 5e-3])
    assert half_a_digit_of_times((np.arange(30) / 3).round(3)) == pytest.approx([5e-4] * 30)
    # times that are far from even are rounded, too
    uneven = np.array([0.0, 0.15, 0.3, 0.312, 0.45])
    assert half_a_digit_of_times(uneven) == pytest.approx([5e-4] * 5)
    # even ones are exact, to the precision of a number in memory
    assert half_a_digit_of_times(np.linspace(0.0, 10.0, 101)).max() < 1e-14
    assert half_a_digit_of_times(1.7e9 + np.arange(30) / 100).max() > 1e-7
    single = np.sin(np.arange(30.0)).astype(np.float32).astype(float)
    assert 2e-8 < half_a_digit(single).max() < 4e-8


@pytest.mark.parametrize(("of_time", "of_angle"), [("%.10g", "%.14g"), ("%.6f", "%.9f")])
def test_rounded_times_break_no_cap(of_time: str, of_angle: str, tmp_path: Path) -> None:
    """Rows of a stored optimum are uneven, and close where its jerk switches."""
    switches = np.array([[2.4371284123], [4.912835712345], [7.512784634567]])
    near = switches + 0.00212345678 * np.arange(-2, 3)  # none of them has ten digits
    time = np.unique(np.concatenate([np.linspace(0.0, T, 401), near.ravel()]))
    path = tmp_path / "a.csv"
    pairs = zip(time, LAW.motion(time).angle, strict=True)
    lines = [f"{of_time % t},{of_angle % angle}" for t, angle in pairs]
    path.write_text("\n".join(["time [s],angle [rad]", *lines]) + "\n")
    result = check(path, factor=1.0)
    assert result.passed, [c.sentence for c in result.checks if not c.passed]
    for key in CAPS.values():
        peak = result.details["peaks"][key]
        assert peak["low"] <= EXACT.values[key] * (1 + 1e-6), key
        # noise is smoothed within a band of 95 %; of exact rows only what is least is known
        if result.details["noise"]["matters"]:
            assert EXACT.values[key] <= peak["high"], key


def test_a_tension_below_its_least_is_short_of_that(tmp_path: Path) -> None:
    """Not of the rope's force, beside which it is nothing."""
    least = EXACT.values["least-tension"]
    study = TrussStudy(
        minimise="energy", duration=T, truss=TRUSS, caps=Caps(least_tension=4 * least)
    )
    path = rows(tmp_path / "a.csv", 0.05, 17, STATED)
    result = check_truss(read_profile(path), study, optimum=False)
    (tension,) = [c.sentence for c in result.checks if c.name.startswith("minimum tension")]
    assert tension.startswith("FAILED")
    assert "short by" in tension
    assert "75 %" in tension
    assert broken_caps(study, EXACT.values)["least-tension"] == pytest.approx(0.75)


def test_the_verdict_speaks_of_the_studys_objective(tmp_path: Path) -> None:
    path = rows(tmp_path / "a.csv", 0.05, 17, STATED)
    study = TrussStudy(minimise="peak-force", duration=T, truss=TRUSS)
    sentence = check_truss(read_profile(path), study, optimum=False).verdict.sentence
    assert sentence.startswith("yes, it passes all")
    assert "peak rope force" in sentence
    assert "acceleration" not in sentence


@pytest.mark.parametrize("rows_of_file", [429, 2001])
def test_a_jerk_that_falls_fast_breaks_its_cap_only_if_close_rows_tell_it(
    rows_of_file: int, tmp_path: Path
) -> None:
    """A cap 1 % below the peak, which a Bezier law has at its start alone.

    Through fewer rows there is another motion, which keeps the cap and goes on as the law does.
    """
    bezier = next(one for one in paper_laws(TRUSS, T) if one.name == "Bezier")
    time = np.linspace(0.0, T, rows_of_file)
    angle = bezier.law.motion(time).angle
    path, table = tmp_path / "a.csv", np.column_stack([time, angle])
    np.savetxt(path, table, "%.17g", ",", header="time [s],angle [rad]", comments="")
    cap = bezier.values["peak-jerk"] / 1.01
    study = TrussStudy(minimise="energy", duration=T, truss=TRUSS, caps=Caps(jerk=cap))
    result = check_truss(read_profile(path), study, optimum=False)
    (jerk,) = [c for c in result.checks if c.name == "peak angular jerk"]

    last = bezier.law.motion(time[[40]])
    state = float(last.speed[0]), float(last.acceleration[0])
    least = least_jerk(time[:41], angle[:41], end=state)
    assert (least > cap) == (not jerk.passed) == (rows_of_file > 2000)
    assert jerk.decided == (not jerk.passed)
    # the proven floor is all that the rows tell
    assert result.details["peaks"]["peak-jerk"]["low"] == pytest.approx(least, rel=1e-4)
    assert all(c.passed for c in result.checks if " at the " in c.name)
