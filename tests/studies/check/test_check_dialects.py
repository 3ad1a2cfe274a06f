"""Files in foreign dialects: read right, or refused with the reason."""

import gzip
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from models.truss import TrussParameters, evaluate_motion
from studies.check.reading.profile import read_profile
from studies.cli import main
from studies.common.exit_codes import ExitCode, StudyError
from studies.truss.motions.laws import paper_laws

WITH_FRICTION = TrussParameters(pulley_friction=0.01)
PINNED = paper_laws(WITH_FRICTION, 140.0)[0].law
TIME = np.linspace(0.0, 140.0, 201)
MOTION = PINNED.motion(TIME)
ANGLE, DEGREES = MOTION.angle, np.degrees(MOTION.angle)
ROPE = evaluate_motion(
    WITH_FRICTION, MOTION.angle, np.maximum(MOTION.speed, 0), MOTION.acceleration
).rope_length

Write = Callable[[Path], None]


def text(
    header: str,
    *columns: np.ndarray,
    separator: str = ",",
    decimal: str = ".",
    encoding: str = "utf-8",
    digits: str = ".12g",
    above: str = "",
    end: str = "\n",
) -> Write:
    rows = (separator.join(f"{x:{digits}}" for x in row) for row in zip(*columns, strict=True))
    body = end.join(row.replace(".", decimal) for row in rows)
    content = f"{above}{header}{end}{body}{end}"
    return lambda path: path.write_bytes(content.encode(encoding))


def excel(path: Path) -> None:
    from openpyxl import Workbook

    book = Workbook()
    sheet = book.active
    sheet.append(["Deployment test", None])
    sheet.append(["Time [s]", "Angle [deg]"])
    for row in zip(TIME.tolist(), DEGREES.tolist(), strict=True):
        sheet.append(list(row))
    book.save(path)


def records(path: Path) -> None:
    rows = [{"t": t, "angle_rad": a} for t, a in zip(TIME.tolist(), ANGLE.tolist(), strict=True)]
    path.write_text(json.dumps(rows))


READ: dict[str, tuple[str, Write]] = {
    "plain": ("a.csv", text("time [s],angle [rad]", TIME, ANGLE)),
    "no units": ("a.csv", text("time,angle", TIME, ANGLE)),
    "degrees in brackets": ("a.csv", text("time [s],angle [deg]", TIME, DEGREES)),
    "milliseconds": ("a.csv", text("Time [ms], Angle (deg)", 1e3 * TIME, DEGREES)),
    "suffixes": ("a.csv", text("time_ms;angle_deg", 1e3 * TIME, DEGREES, separator=";")),
    "German": (
        "a.csv",
        text("Zeit (s);Winkel (°)", TIME, DEGREES, separator=";", decimal=",", encoding="cp1252"),
    ),
    "byte-order mark": (
        "a.csv",
        text("t;alpha / °", TIME, DEGREES, separator=";", encoding="utf-8-sig", end="\r\n"),
    ),
    "UTF-16 with tabs": (
        "a.txt",
        text("Time (s)\tAngle (rad)", TIME, ANGLE, separator="\t", encoding="utf-16"),
    ),
    "row of units": ("a.csv", text("time;angle\ns;deg", TIME, DEGREES, separator=";")),
    "header as comment": ("a.dat", text("# time angle", TIME, ANGLE, separator="  ")),
    "lines above": (
        "a.csv",
        text("time,angle", TIME, ANGLE, above="Operator: N.N.\nDate: 2026-01-01\n\n"),
    ),
    "quotation marks": ("a.csv", text('"Time [s]","Angle [rad]"', TIME, ANGLE)),
    "further columns": (
        "a.csv",
        text("state,angle [mrad],time [min]", 0 * TIME, 1e3 * ANGLE, TIME / 60),
    ),
    "rope in mm": ("a.csv", text("time_s,rope_length_mm", TIME, 1e3 * ROPE)),
    "camel case": ("a.csv", text("Time,RopeLength", TIME, ROPE, digits=".17g")),
    "records of JSON": ("a.json", records),
    "MATLAB": ("a.mat", lambda path: savemat(path, {"run": {"time": TIME, "angle_deg": DEGREES}})),
    "Excel": ("a.xlsx", excel),
}


@pytest.mark.parametrize("name", READ)
def test_dialects_are_read_right(name: str, tmp_path: Path) -> None:
    file, write = READ[name]
    write(tmp_path / file)
    profile = read_profile(tmp_path / file)
    assert profile.time == pytest.approx(TIME, abs=1e-8)  # ten digits of minutes
    (quantity,) = profile.values
    expected = ROPE if quantity == "rope_length" else ANGLE
    assert profile.values[quantity] == pytest.approx(expected, abs=1e-8)  # nine digits


def with_value(row: int, value: float) -> np.ndarray:
    changed = ANGLE.copy()
    changed[row] = value
    return changed


def moved(row: int, to: float) -> np.ndarray:
    changed = TIME.copy()
    changed[row] = to
    return changed


REFUSED: dict[str, tuple[str, Write, str]] = {
    "degrees as radians": ("a.csv", text("time,angle", TIME, DEGREES), "look like degrees"),
    "milliradians as radians": (
        "a.csv",
        text("t,angle [rad]", TIME, 1e3 * ANGLE),
        "look like milliradians; give the unit",
    ),
    "length hauled in": (
        "a.csv",
        text("t,rope_length [m]", TIME, ROPE[0] - ROPE),
        "look like lengths wound in, from 0 on: give the remaining rope length",
    ),
    "radians as degrees": ("a.csv", text("t,angle [deg]", TIME, ANGLE), "look like radians"),
    "two angles": ("a.csv", text("t,angle,angle_deg", TIME, ANGLE, 1.1 * DEGREES), "contradicts"),
    "angle and another rope": (
        "a.csv",
        text("time,angle,rope_length", TIME, ANGLE, np.linspace(ROPE[0], ROPE[-1], 201)),
        "contradicts itself",
    ),
    "millimetres as metres": ("a.csv", text("t,rope_length", TIME, 1e3 * ROPE), "look like mm"),
    "another rope": ("a.csv", text("t,rope_length [m]", TIME, ROPE + 1), "m long when stowed"),
    "unknown unit": ("a.csv", text("t [fortnight],angle", TIME, ANGLE), "no unit of time"),
    "no header": ("a.csv", text("0.0,0.1", TIME, ANGLE), "no header"),
    "no angle": ("a.csv", text("time,voltage", TIME, ANGLE), "no column of an angle"),
    "nan": ("a.csv", text("time,angle", TIME, with_value(16, np.nan)), "row 17"),
    "an hour backwards": ("a.csv", text("time,angle", moved(50, 3.0), ANGLE), "sort the rows"),
    "a time twice": ("a.csv", text("time,angle", moved(50, TIME[49]), ANGLE), "repeats"),
    "closing": ("a.csv", text("time,angle", TIME, ANGLE[::-1]), "give an opening"),
    "commas of both kinds": (
        "a.csv",
        text("time,angle", TIME, ANGLE, decimal=",", digits=".3f"),
        "no header above its numbers",
    ),
    "exponents of Fortran": (
        "a.csv",
        lambda path: path.write_text("time,angle\n" + "0.0D+00,1.0D-01\n" * 30),
        "one number a cell, such as 1.5e-3",
    ),
    "ragged": (
        "a.csv",
        lambda path: path.write_text("time,angle\n" + "0,1\n" * 30 + "3\n"),
        "row 31",
    ),
    "a cell too many": (
        "a.csv",
        lambda path: path.write_text("time,angle\n" + "0,1\n" * 30 + "3,1,4\n"),
        "row 31 below the header has 3 cells",
    ),
    "empty": ("a.csv", lambda path: path.write_bytes(b""), "is empty"),
    "header only": (
        "a.csv",
        lambda path: path.write_text("time,angle\n"),
        "no consistent rows of numbers",
    ),
    "binary": ("a.bin", lambda path: path.write_bytes(bytes(range(256)) * 9), "is not text"),
    "HDF5": ("a.mat", lambda path: path.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(9)), "-v7"),
    "old Excel": ("a.xls", lambda path: path.write_bytes(b"\xd0\xcf\x11\xe0" + bytes(9)), ".xlsx"),
    "damaged Excel": ("a.xlsx", lambda path: path.write_bytes(b"PK\x03\x04" + bytes(99)), "as CSV"),
    "damaged MATLAB": ("a.mat", lambda path: path.write_bytes(b"MATLAB 5.0 MAT-file" * 3), "-v7"),
    "packed": ("a.gz", lambda path: path.write_bytes(gzip.compress(b"time,angle")), "unpack"),
    "broken JSON": ("a.json", lambda path: path.write_text('{"time": [0, 1'), "as JSON"),
    "uneven JSON": (
        "a.json",
        lambda path: path.write_text(json.dumps({"time": [1, 2], "angle": [1]})),
        "different lengths",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_read_is_refused_with_the_reason(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, write, words = REFUSED[name]
    write(tmp_path / file)
    assert main(["check", str(tmp_path / file), "--no-optimum"]) == ExitCode.BAD_INPUT
    said, *command = capsys.readouterr().err.split("\n  antenna-ocp check ")
    assert words in " ".join(said.split())
    assert len(command) <= 1


def test_a_column_can_be_named(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    text("stamp,encoder 3", 1e3 * TIME, DEGREES)(path)
    for named in (
        ["time=stamp [ms]", "angle=2 [deg]"],
        ["time=stamp:ms", "angle=encoder 3:deg"],
        ["time=stamp:0.001 s", "angle=2:60 deg"],
    ):
        profile = read_profile(path, named)
        per_unit = 60.0 if "60" in named[1] else 1.0
        assert profile.values["angle"] == pytest.approx(per_unit * ANGLE, abs=1e-9 * per_unit)
    profile = read_profile(path, ["time=row:0.7 s", "angle=2 [deg]"])
    assert profile.time == pytest.approx(TIME, abs=1e-9)
    assert profile.values["angle"] == pytest.approx(ANGLE, abs=1e-10)
    with pytest.raises(StudyError, match="did you mean 'encoder 3'"):
        read_profile(path, ["time=stamp [ms]", "angle=encoder 4"])
    with pytest.raises(StudyError, match="write QUANTITY=HEADER:UNIT"):
        read_profile(path, ["speed=stamp"])


def test_without_openpyxl_an_excel_file_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    excel(tmp_path / "a.xlsx")
    monkeypatch.setitem(__import__("sys").modules, "openpyxl", None)
    with pytest.raises(StudyError, match=r"install antenna-ocp\[excel\]"):
        read_profile(tmp_path / "a.xlsx")


@pytest.mark.slow
def test_a_million_rows_are_read(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    time = np.linspace(0.0, 140.0, 1_000_001)
    angle = PINNED.motion(time).angle
    np.savetxt(path, np.column_stack([time, angle]), "%.6f", ",", header="time,angle", comments="")
    profile = read_profile(path)
    assert profile.time.size == time.size
    assert profile.values["angle"][500_000] == pytest.approx(angle[500_000], abs=5e-7)
