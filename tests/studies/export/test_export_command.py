"""`antenna-ocp export` end to end, and its answers to misuse."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from studies.cli import main
from studies.common import columns as text
from studies.common.columns import Dialect
from studies.common.result import Result
from studies.export import binary

Write = Callable[[str], Path]


def export(*words: object) -> int:
    return main(["export", *map(str, words)])


def complaint(capsys: pytest.CaptureFixture[str]) -> str:
    return capsys.readouterr().err


@pytest.mark.parametrize(
    "dialect", [Dialect(), Dialect(";", ","), Dialect("tab"), Dialect(";", ".", header=False)]
)
def test_csv_comes_back_in_each_dialect(short: Result, dialect: Dialect) -> None:
    columns = {name: short.arrays[name].values for name in ("time", "angle", "angular_jerk")}
    again = text.read_csv(text.write_csv(short, columns, dialect), dialect)
    for found, exact in zip(again.values(), columns.values(), strict=True):
        assert np.array_equal(found, exact)


def test_matlab_and_json_come_back(short: Result) -> None:
    columns = {name: short.arrays[name].values for name in ("time", "rope_length")}
    for again in (
        binary.read_mat(binary.write_mat(short, columns)),
        text.read_json(text.write_json(short, columns)),
    ):
        assert all(np.array_equal(again[name], columns[name]) for name in columns)


def test_parquet_comes_back(short: Result) -> None:
    pytest.importorskip("pyarrow", reason="pyarrow is an extra")
    columns = {name: short.arrays[name].values for name in ("time", "rope_length")}
    again = binary.read_parquet(binary.write_parquet(short, columns))
    assert all(np.array_equal(again[name], columns[name]) for name in columns)


def meets(value: object, schema: dict[str, object]) -> bool:
    """Whether JSON keeps to a schema, as far as ours goes: types, keys, items."""
    kinds = {
        "object": dict,
        "array": list,
        "string": str,
        "number": (int, float),
        "null": type(None),
    }
    stated = schema.get("type", list(kinds))
    allowed = stated if isinstance(stated, list) else [stated]
    if not any(isinstance(value, kinds[str(name)]) for name in allowed):
        return False

    if isinstance(value, list):
        items = schema.get("items", {})
        assert isinstance(items, dict)
        return len(value) >= int(str(schema.get("minItems", 0))) and all(
            meets(item, items) for item in value
        )
    if not isinstance(value, dict):
        return True

    known, further = schema.get("properties", {}), schema.get("additionalProperties", True)
    required = schema.get("required", [])
    assert isinstance(known, dict)
    assert isinstance(required, list)
    if not set(required) <= set(value):
        return False
    for name, item in value.items():
        inner = known.get(name, further)
        if inner is False or (isinstance(inner, dict) and not meets(item, inner)):
            return False
    return True


def test_json_keeps_to_the_published_schema(short: Result) -> None:
    schema = json.loads((Path(text.__file__).parent / text.SCHEMA_FILE).read_text("utf-8"))
    profile = json.loads(text.write_json(short, {"time": short.arrays["time"].values}))
    assert meets(profile, schema)
    assert not meets(profile | {"columns": {}}, schema)
    profile["columns"]["time"]["values"] = ["0"]
    assert not meets(profile, schema)


def test_a_fixed_step_gives_even_rows(folder: Path, tmp_path: Path) -> None:
    file = tmp_path / "even.csv"
    assert export(folder, "--to", "csv", "--step", 0.5, "--output", file) == 0
    time = text.read_csv(file.read_text("utf-8"), Dialect())["time"]
    assert np.array_equal(time, 0.5 * np.arange(9))


def test_points_lie_on_the_switches(folder: Path, short: Result, tmp_path: Path) -> None:
    file = tmp_path / "switches.csv"
    assert export(folder, "--to", "csv", "--points", 12, "--output", file) == 0
    time = text.read_csv(file.read_text("utf-8"), Dialect())["time"]
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
    assert record["peak acceleration behind the loop [m/s^2]"] <= 4.0 * (1 + 1e-6)
    assert 0 < record["peak angular acceleration above the optimum [1]"] < 0.2


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


@pytest.mark.parametrize(
    ("words", "answer"),
    [
        (("--to", "galil"), "state drive.counts"),
        (("--to", "pvt", "--step", "0"), "--step is 0; give a finite positive number"),
        (("--to", "pvt", "--step", "1", "--points", "9"), "both stated"),
        (("--to", "pvt", "--signal", "elbow"), "this result has rope, angle"),
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
