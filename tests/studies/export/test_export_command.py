"""`antenna-ocp export` end to end, and its answers to misuse."""

import dataclasses
import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from studies.common.columns import Dialect
from studies.common.result import Result
from studies.drive.drum import Drum
from studies.export import work
from tests.studies.export.command_line import complaint, export, read_mat, rubbed
from tests.studies.written_columns import read_csv, read_json

Write = Callable[[str], Path]


def test_a_fixed_step_gives_even_rows(folder: Path, tmp_path: Path) -> None:
    file = tmp_path / "even.csv"
    assert export(folder, "--to", "csv", "--step", 0.5, "--output", file) == 0
    time = read_csv(file.read_text("utf-8"), Dialect())["time"]
    assert np.array_equal(time, 0.5 * np.arange(9))


@pytest.mark.parametrize("form", ["csv", "pvt"])
def test_times_of_a_step_have_the_digits_of_the_step(
    form: str, folder: Path, tmp_path: Path
) -> None:
    file = tmp_path / "even"
    assert export(folder, "--to", form, "--step", 0.3, "--output", file) == 0
    rows = [
        line.split(",")[0] for line in file.read_text("utf-8").splitlines() if line[0].isdigit()
    ]
    # 3 times 0.3 is 0.8999999999999999 in binary numbers
    assert rows[:4] == ["0.0" if form == "csv" else "0", "0.3", "0.6", "0.9"]
    assert max(map(len, rows)) <= 3


@pytest.mark.parametrize("form", ["csv", "pvt"])
@pytest.mark.parametrize(
    ("flag", "value", "said"),
    [
        # the table would last as long as its step, and the motion with it
        ("--step", 100, "the step of the table is 100 s, but the motion lasts 4 s; give a shorter"),
        ("--step", 1e-7, "steps of 1e-07 s make 4e+07 points of a motion of 4 s, but a table may"),
        (
            "--points",
            10**8,
            "100000000 points are too many for a table, which may have up to 2e+06; give fewer",
        ),
    ],
)
def test_a_step_fits_the_motion(
    form: str,
    flag: str,
    value: float,
    said: str,
    folder: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    file = tmp_path / "table"
    assert export(folder, "--to", form, flag, value, "--output", file) == 2
    assert said in complaint(capsys)
    assert not file.exists()


@pytest.mark.parametrize("form", ["csv", "pvt"])
def test_many_points_are_told(
    form: str,
    folder: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(work, "MANY", 8)
    export(folder, "--to", form, "--step", 0.5, "--output", tmp_path / "many")
    assert "writing" in (told := capsys.readouterr().err)
    assert "9 points" in told


def test_points_lie_on_the_switches(folder: Path, short: Result, tmp_path: Path) -> None:
    file = tmp_path / "switches.csv"
    assert export(folder, "--to", "csv", "--points", 12, "--output", file) == 0
    time = read_csv(file.read_text("utf-8"), Dialect())["time"]
    assert time.size == 12
    assert set(short.arrays["knot"].values) <= set(time)


def test_a_record_lies_beside_the_table(
    folder: Path, drive_file: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "table.pvt"
    drive = drive_file("bandwidth = 20\ngear_ratio = 50\nforce = 80\nropes = 2")
    assert export(folder, "--to", "pvt", "--drive", drive, "--output", file) == 0
    record = json.loads((tmp_path / "table.pvt.record.json").read_text("utf-8"))
    # half a count of rope, 1 micrometre, turns the angle at its end by less than 3e-7 rad
    assert abs(record["miss of the deployed angle [deg]"]) < 2e-5
    assert record["margin of the rope force [1]"] > 0
    assert record["energy of that at the end stop [J]"] < 1e-6
    assert "terminal angle [deg]: 90" in capsys.readouterr().out
    assert file.read_text("utf-8").splitlines()[-1].count(",") == 4  # two ropes


@pytest.mark.parametrize(
    ("limit", "said"),
    [
        ("motor_speed = 100.0", "the motor speed is "),
        ("motor_torque = 0.1", "the motor torque is "),
        ("torque_speed = [[0, 2.0], [100, 0]]", "the torque-speed curve is "),
    ],
)
def test_limits_of_the_motor_are_held_against_the_played_table(
    limit: str,
    said: str,
    folder: Path,
    drive_file: Write,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    drive = drive_file(f"bandwidth = 20\ngear_ratio = 2.0\nefficiency = 0.8\n{limit}")
    assert export(folder, "--to", "pvt", "--drive", drive, "--output", tmp_path / "a.pvt") == 5
    assert said in complaint(capsys)


def test_a_broken_limit_is_refused_with_place_and_amount(
    folder: Path, drive_file: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    drive = drive_file("bandwidth = 20\nspeed = 3.0")
    file = tmp_path / "table.pvt"
    assert export(folder, "--to", "pvt", "--drive", drive, "--output", file) == 5
    said = complaint(capsys)
    assert "the speed is 4." in said
    assert "above its limit of 3 m/s" in said
    assert "--within-limits" in said
    assert not file.exists()


@pytest.mark.slow
def test_within_limits_the_motion_is_optimised_again(
    folder: Path, drive_file: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    # the optimum's rope takes 4.44 m/s^2; least of all motions is 4 L/T^2 = 1.65
    drive = drive_file("bandwidth = 50\nacceleration = 4.0\nperiod = 0.02")
    file = tmp_path / "table.pvt"
    words = ("--to", "pvt", "--drive", drive, "--output", file)
    assert export(folder, *words) == 5
    assert export(folder, *words, "--within-limits") == 0
    record = json.loads((tmp_path / "table.pvt.record.json").read_text("utf-8"))
    assert record["peak acceleration after the loop [m/s^2]"] <= 4.0 * (1 + 1e-6)
    assert 0 < record["peak angular acceleration above the optimum [1]"] < 0.2


@pytest.mark.slow
def test_the_stretch_of_the_rope_is_kept_within_limits(
    brisk: Result, drive_file: Write, tmp_path: Path
) -> None:
    folder = rubbed(brisk, 0.01, tmp_path)
    # along the limit of power the motion found may switch more often than a table has segments
    pvt = ("--to", "pvt", "--step", "0.05")
    yielding, line = "period = 0.05\nrope_stiffness = 500\n", "peak motor power [W]"
    peaks = []
    for lines in ("period = 0.05\n", yielding):
        file = tmp_path / f"free{len(peaks)}"
        assert export(folder, *pvt, "--drive", drive_file(lines), "--output", file) == 0
        peaks.append(json.loads(Path(f"{file}.record.json").read_text("utf-8"))[line])

    # the motion keeps this limit, but for the stretch
    limit = (peaks[0] + peaks[1]) / 2
    assert peaks[0] < 0.999 * limit
    words = (*pvt, "--drive", drive_file(f"{yielding}power = {limit}"))
    assert export(folder, *words, "--output", tmp_path / "t") == 5
    assert export(folder, *words, "--output", tmp_path / "t", "--within-limits") == 0
    record = json.loads((tmp_path / "t.record.json").read_text("utf-8"))
    assert 0.9 * limit < record[line] <= limit * (1 + 1e-6)


def test_rests_and_a_yielding_rope_are_part_of_what_is_written(
    folder: Path, drive_file: Write, tmp_path: Path
) -> None:
    drive = drive_file("start_dwell = 1.0\nend_dwell = 2.0\nrope_stiffness = 5e4\nperiod = 0.1")
    for form in ("pvt", "csv"):
        file = tmp_path / form
        assert export(folder, "--to", form, "--drive", drive, "--output", file) == 0
        record = json.loads((tmp_path / f"{form}.record.json").read_text("utf-8"))
        # the stretch of 0.2 mm is wound in and yields again: a count is left, 2e-5 deg
        assert abs(record["miss of the deployed angle [deg]"]) < 3e-5

    lines = [line for line in (tmp_path / "pvt").read_text("utf-8").splitlines() if line[0] != "#"]
    rows = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    resting = (rows[:, 0] <= 1.0) | (rows[:, 0] > 5.0)
    assert (rows[resting, 2] == 0.0).all()
    assert rows[-1, 0] == pytest.approx(7.0)

    columns = read_csv((tmp_path / "csv").read_text("utf-8"), Dialect())
    time = columns["time"]
    assert time[-1] == 7.0
    assert (columns["angular_acceleration"][(time < 1.0) | (time > 5.0)] == 0.0).all()
    assert columns["angle"][time < 1.0] == pytest.approx(columns["angle"][0], abs=0)
    assert columns["angle"][time > 5.0] == pytest.approx(math.pi / 2, abs=1e-9)
    assert columns["angular_speed"].max() > 0.5


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lines", "form", "said", "line", "limit"),
    [
        # least of all motions is 32 L/T^3 = 3.3 m/s^3, the optimum's rope has 24
        (
            "interpolation = 'hermite'\njerk = 15.0\nperiod = 0.05",
            "newport-xps",
            "the jerk is 2",
            "peak jerk after the loop [m/s^3]",
            15.0,
        ),
        # the optimum takes 1.1 times what this motor has
        (
            "bandwidth = 50\nperiod = 0.01\ngear_ratio = 20\n"
            "torque_speed = [[0, 0.22], [2000, 0.2], [3800, 0.0]]",
            "pvt",
            "the torque-speed curve is 1.",
            "largest share of the torque-speed curve [1]",
            1.0,
        ),
    ],
)
def test_jerk_and_curve_of_the_motor_are_kept_within_limits(
    folder: Path,
    lines: str,
    form: str,
    said: str,
    line: str,
    limit: float,
    drive_file: Write,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    drive, file = drive_file(lines), tmp_path / "table"
    words = ("--to", form, "--drive", drive, "--output", file)
    assert export(folder, *words) == 5
    assert said in complaint(capsys)
    assert export(folder, *words, "--within-limits") == 0
    record = json.loads((tmp_path / "table.record.json").read_text("utf-8"))
    assert 0.5 * limit < record[line] <= limit * (1 + 1e-6)


def test_what_is_impossible_by_proof_is_said_with_the_limit_as_stated(
    folder: Path, drive_file: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    drive = drive_file("interpolation = 'hermite'\nspeed = 1.6")
    words = ("--to", "pvt", "--drive", drive, "--output", tmp_path / "t", "--within-limits")
    assert export(folder, *words) == 3
    said = " ".join(complaint(capsys).split())
    assert "at most 1.6 m/s; its minimum is 1.65247 m/s" in said


@pytest.mark.slow
@pytest.mark.parametrize("form", ["csv", "json", "mat"])
def test_columns_hold_the_set_points_that_their_record_is_about(
    form: str, folder: Path, drive_file: Write, tmp_path: Path
) -> None:
    drum, yielding = "rope_diameter = 0.003\nlayer_turns = 10\n", "rope_stiffness = 500\n"
    read: dict[str, Callable[[Path], dict[str, np.ndarray]]] = {
        "csv": lambda file: read_csv(file.read_text("utf-8"), Dialect()),
        "json": lambda file: read_json(file.read_text("utf-8")),
        "mat": lambda file: read_mat(file.read_bytes()),
    }
    wound = []
    for lines in ("", yielding, drum + yielding):
        file, table = tmp_path / f"{form}{len(wound)}", tmp_path / f"pvt{len(wound)}"
        drive = drive_file(f"{lines}period = 0.1")
        assert export(folder, "--to", form, "--drive", drive, "--output", file) == 0
        words = ("--to", "pvt", "--step", 0.1, "--drive", drive, "--output", table)
        assert export(folder, *words) == 0

        record = json.loads(Path(f"{file}.record.json").read_text("utf-8"))
        name = "drum_set_point" if drum in lines else "rope_set_point"
        assert record["column that is played"] == name
        columns = read[form](file)
        beside = read_csv(table.read_text("utf-8"), Dialect())
        # the digits of the table of positions
        assert columns[name] == pytest.approx(beside["position"], abs=1e-12)
        assert columns[f"{name}_speed"] == pytest.approx(beside["velocity"], abs=1e-12)
        wound.append(columns["rope_set_point"][-1])

    # the rope's own length has no stretch; what is wound in has, by whichever drum
    travel = columns["rope_length"][0] - columns["rope_length"][-1]
    assert wound[0] == pytest.approx(travel, abs=2e-6)
    assert wound[1] > travel + 0.01
    assert wound[2] == pytest.approx(wound[1], abs=4e-6)


def test_positions_alone_are_not_played_with_velocities(
    folder: Path, drive_file: Write, capsys: pytest.CaptureFixture[str]
) -> None:
    drive = drive_file("interpolation = 'hermite'")
    assert export(folder, "--to", "ethercat", "--drive", drive) == 2
    assert "a table of ethercat holds positions alone; state spline" in complaint(capsys)


def test_a_drum_of_several_layers_gets_its_turn(
    folder: Path, drive_file: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    layered = "rope_diameter = 0.003\nlayer_turns = 10\ninterpolation = 'spline'"
    drive, file = drive_file(layered), tmp_path / "table"
    words = ("--to", "ethercat", "--drive", drive)
    assert export(folder, *words, "--output", file) == 0
    record = json.loads((tmp_path / "table.record.json").read_text("utf-8"))
    # half a count on the outermost layer, and 3.3 m of rope turn the angle by one rad there
    assert abs(record["miss of the deployed angle [deg]"]) < 1e-4
    assert record["peak rope speed [m/s]"] == pytest.approx(4.12, rel=0.05)

    counts = [int(line) for line in file.read_text("utf-8").splitlines() if line.isdigit()]
    turn = 2 * math.pi * counts[-1] / 65536
    assert Drum(0.02, 0.003, 10).rope_at(np.array([turn]))[0] == pytest.approx(6.60987, abs=1e-5)
    # lengths of rope are no counts of it
    assert export(folder, *words, "--signal", "rope") == 2
    assert "export the turn of the drum with --signal drum" in complaint(capsys)


@pytest.mark.slow
def test_a_rope_that_would_push_is_refused_behind_a_loop(
    folder: Path, drive_file: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    # where rope climbs to the next layer the drum's acceleration steps, and the loop overshoots
    layered = "rope_diameter = 0.003\nlayer_turns = 10\ninterpolation = 'spline'\n"
    file = tmp_path / "table"
    words = ("--to", "ethercat", "--output", file, "--drive")
    assert export(folder, *words, drive_file(layered + "bandwidth = 20")) == 5
    said = complaint(capsys)
    assert "the rope would have to push with" in said
    assert ("found to pass" in said) != ("or try --within-limits" in said)
    assert "--least-tension" not in said  # no table was played with it
    assert not file.exists()

    # no rope follows a table exactly, so that this is said and not refused
    assert export(folder, *words, drive_file(layered)) == 0
    record = json.loads((tmp_path / "table.record.json").read_text("utf-8"))
    assert record["least tension of all segments [N]"] < 0.0
    assert "state drive.bandwidth" in record["warning"]


def test_caps_of_the_study_that_a_table_exceeds_are_said_first(
    short: Result, tmp_path: Path, drive_file: Write, capsys: pytest.CaptureFixture[str]
) -> None:
    peak = float(np.abs(short.arrays["rope_speed"].values).max())
    path, line = tmp_path / "capped", "peak rope speed beyond the cap of the study [1]"
    path.mkdir()
    records = []
    for cap, beyond in ((0.9 * peak, True), (1.1 * peak, False)):
        capped = {**short.configuration, "caps": {"rope_speed": cap}}
        dataclasses.replace(short, configuration=capped).save(path)
        file = tmp_path / f"table {cap}"
        assert export(path, "--to", "pvt", "--drive", drive_file(), "--output", file) == 0
        records.append(json.loads(Path(f"{file}.record.json").read_text("utf-8")))
        # in the first line of the table as well, and with the cause on the terminal
        words = "BEYOND CAPS OF THE STUDY = peak rope speed 4.084 m/s (11 % above the cap of 3.676)"
        assert file.read_text("utf-8").startswith(f"# {words}") == beyond
        said = capsys.readouterr().err
        assert (words.replace(" =", ":") in said and "cause: the motion itself" in said) == beyond
    assert records[0][line] == pytest.approx(1 / 0.9 - 1, rel=1e-2)
    assert line not in records[1]


@pytest.mark.parametrize(
    ("words", "answer"),
    [
        (("--to", "galil"), "give drive.counts"),
        (("--to", "pvt", "--step", "0"), "--step is 0; give a finite positive number"),
        (("--to", "pvt", "--step", "1", "--points", "9"), "both given"),
        (("--to", "pvt", "--signal", "elbow"), "this result has rope, angle, drum"),
        (("--to", "csv", "--decimal", ","), "another --separator"),
        (("--to", "csv", "--separator", "ab"), "give one sign"),
        (("--to", "mat"), "name a file with --output"),
        (("--to", "pvt", "--stop-at", "7"), "lasts from 0 to 4 s"),
        (("--to", "pvt", "--stop-within", "1"), "belongs to --stop-at"),
        (("--to", "json", "--stop-at", "1"), "export it as pvt"),
        (("--to", "csv", "--within-limits"), "needs a table of a drive"),
        (("--to", "pvt", "--drive", "nowhere.toml"), "cannot be read"),
    ],
)
def test_misuse_is_answered_in_a_sentence(
    folder: Path, words: tuple[str, ...], answer: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert export(folder, *words) == 2
    said = complaint(capsys)
    assert answer in said
    assert said.count("\n") == 1


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        ("drum_radius = -1", "drive.drum_radius is -1; give a finite positive number"),
        ("interpolation = 'cubic'", "drive.interpolation is 'cubic'"),
        ("bandwith = 5", "did you mean drive.bandwidth?"),
        ("counts = 1.5", "drive.counts is 1.5"),
    ],
)
def test_a_wrong_drive_is_answered_in_a_sentence(
    folder: Path, line: str, answer: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    drive = tmp_path / "wrong.toml"
    drive.write_text(f"[drive]\n{line}\n", "utf-8")
    assert export(folder, "--to", "pvt", "--drive", drive) == 2
    assert answer in complaint(capsys)
