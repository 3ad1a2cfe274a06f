"""A message of the export names the cause, and another table that was played and helps."""

import dataclasses
import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from studies.common.result import Result
from tests.studies.export.command_line import complaint, export

Write = Callable[[str], Path]
ROUNDED = "counts = 4096\nbandwidth = 20\nperiod = 0.005\ninterpolation = 'spline'\n"


def test_rounding_is_named_and_the_step_that_was_played_passes(
    brisk: Result, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, drive, file = tmp_path / "stored", tmp_path / "drive.toml", tmp_path / "table"
    folder.mkdir()
    free = {**brisk.configuration, "caps": {}}  # no table keeps a cap on the jerk that it rides
    dataclasses.replace(brisk, configuration=free).save(folder)
    peak = float(np.abs(brisk.arrays["rope_acceleration"].values).max())
    drive.write_text(f"drum_radius = 0.02\n{ROUNDED}acceleration = {1.2 * peak}\n", "utf-8")

    words = ("--to", "ethercat", "--drive", drive, "--output", file)
    assert export(folder, *words) == 5
    said = complaint(capsys)
    assert re.search(r"the acceleration is [\d.]+ m/s\^2 at [\d.]+ s, .* its limit", said)
    count = 2 * np.pi * 0.02 / 4096
    assert f"counts of {count:.2g} m; that divided by the square of the step of 0.005 s" in said
    assert f"{count / 0.005**2:.2g} m/s^2" in said

    found = re.search(r"remedy, played and found to pass: --step ([\d.]+)\n", said)
    assert found is not None
    assert float(found[1]) > 0.005  # a shorter one would make it worse
    assert "--within-limits" not in said  # no other motion is needed
    assert export(folder, *words, "--step", found[1]) == 0


def test_what_no_table_keeps_is_said_with_what_the_best_one_leaves(
    brisk: Result, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, drive, file = tmp_path / "stored", tmp_path / "drive.toml", tmp_path / "table"
    folder.mkdir()
    brisk.save(folder)
    drive.write_text("bandwidth = 5\nperiod = 0.1\n", "utf-8")
    words = ("--to", "codesys-xyva", "--drive", drive, "--output", file)
    assert export(folder, *words) == 0
    said = complaint(capsys)
    # the loop overshoots each step of the jerk by 4.6 %, by whichever table
    assert re.search(r"peak angular jerk [\d.]+ rad/s\^3 \(\d\.\d % above the cap of", said)
    assert "cause: not the rounding" in said
    assert "the position loop, which overshoots" in said
    lower = re.search(r"more room has a motion of the study with caps.jerk = ([\d.]+)", said)
    assert lower is not None
    record = json.loads(Path(f"{file}.record.json").read_text("utf-8"))
    excess = record["peak angular jerk beyond the cap of the study [1]"]
    cap = brisk.configuration["caps"]["jerk"]
    assert float(lower[1]) == pytest.approx(cap * (1 - 2 * excess / (1 + excess)), rel=1e-2)


def test_a_limit_of_what_straight_lines_lack_names_an_interpolation_that_passes(
    brisk: Result, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, drive, file = tmp_path / "stored", tmp_path / "drive.toml", tmp_path / "table"
    folder.mkdir()
    free = {**brisk.configuration, "caps": {}}
    dataclasses.replace(brisk, configuration=free).save(folder)
    peak = float(np.abs(brisk.arrays["rope_acceleration"].values).max())
    stated = f"period = 0.1\nacceleration = {1.2 * peak}\n"
    drive.write_text(stated, "utf-8")

    words = ("--to", "beckhoff", "--drive", drive, "--output", file)
    assert export(folder, *words) == 5
    said = complaint(capsys)
    assert "the acceleration has no bound between the points, but its limit is" in said
    found = re.search(
        r"remedy, played and found to pass: (interpolation = .*) in the drive\n", said
    )
    assert found is not None
    drive.write_text(f"{stated}{found[1]}\n", "utf-8")
    assert export(folder, *words) == 0


@pytest.mark.parametrize("to", ["c99", "segments"])
def test_a_curve_that_its_drive_samples_too_finely_names_a_period_that_passes(
    to: str, brisk: Result, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, drive, file = tmp_path / "stored", tmp_path / "drive.toml", tmp_path / "curve"
    folder.mkdir()
    free = {**brisk.configuration, "caps": {}}
    dataclasses.replace(brisk, configuration=free).save(folder)
    peak = float(np.abs(brisk.arrays["rope_acceleration"].values).max())
    stated = f"drum_radius = 0.02\n{ROUNDED}acceleration = {1.2 * peak}\n"
    drive.write_text(stated, "utf-8")

    words = ("--to", to, "--drive", drive, "--output", file)
    assert export(folder, *words) == 5
    found = re.search(r"found to pass: period = ([\d.]+) in the drive\n", complaint(capsys))
    assert found is not None
    assert float(found[1]) > 0.005
    drive.write_text(stated.replace("period = 0.005", f"period = {found[1]}"), "utf-8")
    assert export(folder, *words) == 0


@pytest.mark.parametrize("form", ["c99", "codesys-xy"])
def test_a_file_says_what_its_positions_are_and_its_record_what_it_lacks(
    form: str, brisk: Result, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, file = tmp_path / "stored", tmp_path / "table"
    folder.mkdir()
    brisk.save(folder)
    assert export(folder, "--to", form, "--output", file) == 0
    meaning = "position = rope wound in since the stowed truss was at rest, positive; the column "
    assert meaning + "rope_length of a CSV export falls by as much\n" in file.read_text("utf-8")
    said = capsys.readouterr().out
    if form == "c99":  # the motion itself, which the polynomials are
        assert "no value between the points" not in said
        assert "peak rope force [N]: " in said
    else:
        (reason,) = [line for line in said.splitlines() if "why values are missing" in line]
        assert "straight lines between points have no acceleration" in reason
        assert "no value between the points of peak acceleration after the loop" in said
