"""`antenna-ocp export` of a stop out of a motion, and of the way on."""

import dataclasses
import json
import math
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from scipy.optimize import brentq

from models.truss import rope_length
from studies.common.result import Result
from studies.truss.motions.laws import law_of_result, study_of
from tests.studies.export.command_line import complaint, export, rubbed

Write = Callable[[str], Path]


def test_a_stop_and_the_way_on_are_profiles(
    folder: Path, drive_file: Write, tmp_path: Path
) -> None:
    drive = drive_file("bandwidth = 20\nperiod = 0.05")
    ends = {}
    for flag in ("--stop-at", "--resume-at"):
        file = tmp_path / flag
        words = ("--to", "pvt", "--drive", drive, flag, 2, "--stop-within", 1, "--output", file)
        assert export(folder, *words) == 0
        rows = [
            [float(cell) for cell in line.split(",")]
            for line in file.read_text("utf-8").splitlines()
            if line[0].isdigit()
        ]
        assert rows[-1][2] == 0.0
        ends[flag] = rows[0][1], rows[-1][1]
    # it goes on from where it stopped, to the end, to a count of 2 micrometres
    assert ends["--resume-at"][0] == pytest.approx(ends["--stop-at"][1], abs=2e-6)
    assert ends["--resume-at"][1] == pytest.approx(6.6099, abs=1e-4)


@pytest.mark.parametrize("friction", [0.0, 0.01])
def test_a_stop_and_the_way_on_of_a_yielding_rope_join(
    friction: float, short: Result, tmp_path: Path, drive_file: Write
) -> None:
    path = rubbed(short, friction, tmp_path)
    drive = drive_file("period = 0.05\nrope_stiffness = 500")

    ends = {}
    for words in ((), ("--stop-at", 2, "--stop-within", 1), ("--resume-at", 2, "--stop-within", 1)):
        file = tmp_path / f"table{len(ends)}"
        assert export(path, "--to", "ethercat", "--drive", drive, *words, "--output", file) == 0
        lines = file.read_text("utf-8").splitlines()
        counts = [int(line) for line in lines if line.isdigit()]
        ends[words[:1]] = counts[0], counts[-1]
    # all three are positions of one drum, to the rounding of a count
    assert ends["--resume-at",][0] == pytest.approx(ends["--stop-at",][1], abs=1)
    assert ends["--resume-at",][1] == pytest.approx(ends[()][1], abs=1)
    assert ends[()][0] == ends["--stop-at",][0] == 0


@pytest.mark.parametrize("form", ["newport-xps", "galil"])
def test_displacements_behind_a_stop_are_played_from_where_it_ended(
    form: str, folder: Path, drive_file: Write, tmp_path: Path
) -> None:
    drive = drive_file("period = 0.05\nrope_stiffness = 5000\nbandwidth = 20")
    records = []
    for to in (form, "pvt"):
        file = tmp_path / to
        words = ("--resume-at", 2, "--stop-within", 1, "--output", file)
        assert export(folder, "--to", to, "--drive", drive, *words) == 0
        records.append(json.loads(Path(f"{file}.record.json").read_text("utf-8")))
    # half a count of rope, 1 micrometre
    assert abs(records[0]["miss of the last position [m]"]) < 2e-6
    assert records[0]["terminal angle [deg]"] == pytest.approx(90, abs=2e-5)
    force = "peak rope force [N]"
    assert records[0][force] == pytest.approx(records[1][force], rel=2e-2)


@pytest.mark.slow
def test_a_stop_leaves_room_for_what_its_table_adds(
    folder: Path, drive_file: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, peak = tmp_path / "stop", "peak acceleration after the loop [m/s^2]"
    axis = "bandwidth = 20\nperiod = 0.05\n"

    def stopped(limit: str, within: float) -> int:
        words = ("--to", "pvt", "--stop-at", 2, "--stop-within", within, "--output", file)
        return export(folder, *words, "--drive", drive_file(axis + limit))

    def found() -> float:
        record = tmp_path / "stop.record.json"
        value = json.loads(record.read_text("utf-8"))[peak]
        file.unlink()
        record.unlink()
        return float(value)

    assert stopped("", 1.0) == 0
    limit = 0.97 * found()
    assert stopped(f"acceleration = {limit}", 1.0) == 0
    assert found() <= limit * (1 + 1e-9)

    # the remedy is one that a stop has
    capsys.readouterr()
    assert stopped(f"acceleration = {0.5 * limit}", 1.0) == 5
    assert "cause: the stop itself" in complaint(capsys)


def test_a_stop_and_the_way_on_say_which_caps_they_exceed(
    short: Result, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    power, line = 60.0, "peak motor power beyond the cap of the study [1]"
    caps = {**short.configuration["caps"], "power": power}
    path = tmp_path / "capped"
    path.mkdir()
    dataclasses.replace(short, configuration={**short.configuration, "caps": caps}).save(path)

    flags = ("--to", "pvt", "--resume-at", 2, "--stop-within", 1, "--step", 0.05, "--output")
    file = tmp_path / "beyond"
    assert export(path, *flags, file) == 0
    record = json.loads(Path(f"{file}.record.json").read_text("utf-8"))
    assert record[line] == pytest.approx(record["peak motor power [W]"] / power - 1)
    said = complaint(capsys)
    words = f"peak motor power {record['peak motor power [W]']:.4g} W"
    assert f"BEYOND CAPS OF THE STUDY: {words}" in said
    assert file.read_text("utf-8").startswith(f"# BEYOND CAPS OF THE STUDY = {words}")

    # the drive that the message names makes a table that exceeds nothing
    found = re.search(r"remedy, played and found to pass: (speed = [\d.e-]+) in the drive", said)
    assert found is not None
    slow = tmp_path / "slow.toml"
    slow.write_text(found[1], "utf-8")
    assert export(path, *flags, tmp_path / "within", "--drive", slow) == 0
    assert "BEYOND" not in complaint(capsys)


def test_a_half_open_truss_is_opened_from_its_angle_or_its_length_of_rope(
    folder: Path, short: Result, drive_file: Write, tmp_path: Path
) -> None:
    drive = drive_file("bandwidth = 20\nperiod = 0.02")
    truss = study_of(short).truss
    length = float(rope_length(truss, math.radians(45)))
    whole = float(rope_length(truss, truss.stowed_angle))
    tables = []
    for place in ("45", "45deg", f"{length!r}m"):
        file = tmp_path / f"table{len(tables)}"
        words = ("--resume-from", place, "--resume-within", 4, "--output", file)
        assert export(folder, "--to", "pvt", "--drive", drive, *words) == 0
        lines = file.read_text("utf-8").splitlines()
        tables.append([[float(c) for c in line.split(",")] for line in lines if line[0].isdigit()])

        # it is played: from rest to the open truss, in the time that is stated
        record = json.loads(Path(f"{file}.record.json").read_text("utf-8"))
        assert record["terminal angle [deg]"] == pytest.approx(90, abs=2e-5)
        assert record["last time [s]"] == pytest.approx(4.0)
        # of the jerk 32 D/T^3 the peak speed is 2 D/T; a loop follows it to a thousandth
        way = length - float(rope_length(truss, math.pi / 2))
        assert record["peak speed after the loop [m/s]"] == pytest.approx(2 * way / 4, rel=1e-3)
    assert tables[0] == tables[1]
    for one, other in zip(tables[0], tables[2], strict=True):
        assert one == pytest.approx(other, abs=1e-9)
    # positions count from the stowed truss, as those of the whole motion, in counts of 2 um
    assert tables[0][0][1] == pytest.approx(whole - length, abs=2e-6)
    assert tables[0][0][2] == tables[0][-1][2] == 0.0


def test_a_resumed_motion_takes_the_time_that_the_whole_one_takes_from_there(
    folder: Path, short: Result, tmp_path: Path
) -> None:
    law = law_of_result(short)
    file = tmp_path / "table"
    assert export(folder, "--to", "pvt", "--resume-from", 60, "--output", file) == 0
    passed = brentq(lambda t: law.motion(t).angle[0] - math.radians(60), 0.0, law.duration)
    record = json.loads(Path(f"{file}.record.json").read_text("utf-8"))
    assert record["last time [s]"] == pytest.approx(law.duration - passed, abs=1e-6)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--resume-from", 95), "95 deg, but the motion runs from 4.4 to 90 deg; give a place"),
        (("--resume-from", 90), "90 deg, but the motion runs from 4.4 to 90 deg"),
        (("--resume-from", "3m"), "3 m of rope, but the motion runs from 33.5"),
        (("--resume-from", "half"), "--resume-from is 'half'"),
        (("--resume-from", 45, "--resume-at", 2), "--resume-at and --resume-from are profiles"),
        (("--stop-at", 2, "--resume-within", 3), "--resume-within belongs to --resume-at or"),
        (("--resume-from", 45, "--resume-within", 0), "--resume-within is 0"),
    ],
)
def test_a_place_to_resume_from_that_there_is_not_is_refused(
    words: tuple[object, ...], said: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert export(folder, "--to", "pvt", *words) == 2
    assert said in complaint(capsys)


def test_a_time_below_that_of_the_limits_is_refused_with_theirs(
    folder: Path, drive_file: Write, capsys: pytest.CaptureFixture[str]
) -> None:
    drive = drive_file("speed = 1.0")
    words = ("--to", "pvt", "--drive", drive, "--resume-from", 45, "--resume-within")
    assert export(folder, *words, 2) == 3
    least = re.search(r"2 s are too short .* need at least ([0-9.]+) s", complaint(capsys))
    assert least is not None
    assert export(folder, *words, 1.01 * float(least[1])) == 0
