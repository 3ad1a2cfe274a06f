"""Rest that was recorded with a motion is no part of it; rows that would be lost are told."""

import math
from pathlib import Path

import numpy as np
import pytest

from models.laws import JerkLimited
from models.truss import TrussParameters
from studies.check.reading.profile import MeasuredProfile, read_profile
from studies.check.reading.rest import moving_part
from studies.cli import main
from studies.common.exit_codes import ExitCode, StudyError
from studies.truss.config import DEPLOYED
from studies.truss.motions.laws import paper_laws

T = 60.0
TRUSS = TrussParameters()
LIMITED = JerkLimited(T, TRUSS.stowed_angle, DEPLOYED, 200 / T**3)
BEZIER = paper_laws(TRUSS, T)[0].law


def recorded(
    path: Path,
    law: object = LIMITED,
    rest: float = 3.0,
    step: float = 0.1,
    sigma: float = 0.0,
    late: float = 0.0,
) -> Path:
    time = np.arange(round((T + 2 * rest) / step) + 1) * step
    angle = law.motion(np.clip(time - rest - late, 0.0, T)).angle  # type: ignore[attr-defined]
    angle = angle + sigma * np.random.default_rng(1).standard_normal(time.size)
    rows = np.column_stack([time, angle])
    np.savetxt(path, rows, "%.17g", ",", header="time [s],angle [rad]", comments="")
    return path


def moving(path: Path) -> MeasuredProfile:
    return moving_part(read_profile(path))


@pytest.mark.parametrize("law", [LIMITED, BEZIER], ids=["limited", "Bezier"])
@pytest.mark.parametrize("late", [0.0, 0.037], ids=["on a row", "between rows"])
def test_rest_of_exact_rows_is_left_out(law: object, late: float, tmp_path: Path) -> None:
    found = moving(recorded(tmp_path / "a.csv", law, late=late))
    # a row is 0.1 s from the next one
    assert found.origin == pytest.approx(3.0 + late, abs=0.02)
    assert found.duration == pytest.approx(T, abs=0.02)


@pytest.mark.parametrize("sigma", [1e-5, 3.5e-4])
def test_rest_of_noisy_rows_is_left_out_but_for_what_noise_hides(
    sigma: float, tmp_path: Path
) -> None:
    found = moving(recorded(tmp_path / "a.csv", sigma=sigma))
    # six standard deviations hide so much of a start under this jerk
    hidden = (6 * 6 * sigma * T**3 / 200) ** (1 / 3)
    assert found.origin == pytest.approx(3.0, abs=hidden)
    assert found.duration == pytest.approx(T, abs=2 * hidden)


@pytest.mark.parametrize("sigma", [0.0, 1e-5, 3.5e-4, 2e-3])
@pytest.mark.parametrize("law", [LIMITED, BEZIER], ids=["limited", "Bezier"])
def test_no_start_is_taken_for_rest(law: object, sigma: float, tmp_path: Path) -> None:
    measured = read_profile(recorded(tmp_path / "a.csv", law, rest=0.0, sigma=sigma))
    assert moving_part(measured) is measured


@pytest.mark.slow
def test_a_cap_in_the_duration_is_that_of_the_motion(tmp_path: Path, capsys) -> None:
    path = recorded(tmp_path / "a.csv")
    words = ["check", str(path), "--jerk-cap", "200/T^3", "--no-optimum"]
    assert main(words) == ExitCode.OK
    said = capsys.readouterr().out
    assert "moves from 3.00 to 63.00 s by the time of the file" in said
    assert f"cap {200 / T**3:.6g}" in said
    # whoever wants all of it says so
    assert main([*words, "--motion-from", "0", "--motion-to", "66"]) == ExitCode.NOT_VERIFIED
    assert f"cap {200 / 66.0**3:.6g}" in capsys.readouterr().out
    # and a study that states the length of the file means it
    assert main([*words, "--duration", "66"]) == ExitCode.NOT_VERIFIED
    assert "moves from" not in capsys.readouterr().out


def test_too_few_rows_between_two_times_are_refused(tmp_path: Path) -> None:
    measured = read_profile(recorded(tmp_path / "a.csv"))
    with pytest.raises(StudyError, match="give at least 20, by --motion-from and --motion-to"):
        moving_part(measured, begin=10.0, end=11.0)
    assert moving_part(measured, begin=10.0).duration == pytest.approx(53.0)
    assert math.isclose(moving_part(measured, end=40.04).origin, 3.0, abs_tol=0.02)


@pytest.mark.parametrize("mark", ["\x0c", "\x85", "\u2028"], ids=["form feed", "NEL", "LS"])
@pytest.mark.parametrize("where", ["first", "last", "all"])
def test_rows_with_strange_ends_of_lines_are_not_lost(
    mark: str, where: str, tmp_path: Path, capsys
) -> None:
    path = recorded(tmp_path / "a.csv", rest=0.0)
    lines = path.read_text().splitlines()
    if where == "all":
        text = mark.join(lines)
    else:
        at = 1 if where == "first" else len(lines) - 1
        text = "\n".join([*lines[:at], f"{lines[at]}{mark}{lines[at]}", *lines[at + 1 :]])
    path.write_text(text, "utf-8")
    assert main(["check", str(path), "--no-optimum"]) == ExitCode.BAD_INPUT
    said = capsys.readouterr().err
    assert where == "all" or ("line 2" if where == "first" else "row 601") in said
