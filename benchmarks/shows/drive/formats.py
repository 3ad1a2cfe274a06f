"""The show "drive-formats": every table and curve of the main study's optimum, written and read.

Each table is read back from its own text, interpolated as its device does it, and played without a
position loop and with one. Each curve of C is compiled with strict flags and held against the
motion at 10,000 times. Nothing is solved: the optimum is in closed form.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.shows.drive.table import DRUM_RADIUS, optimum
from benchmarks.shows.show import Question, Row
from ocp.arrays import Array
from studies.common.console import Table, number
from studies.common.exit_codes import StudyError
from studies.drive import Drive
from studies.drive.course import Course, rope_course
from studies.export import c99, polynomials
from studies.export.formats import TABLES, Spacing, tabulated
from studies.export.round_trip import round_trip

LINE = "every export of the optimum read back and played; C compiled and compared: 26 cases"
LIMIT = 300.0  # [s]; a case takes a few

BITS, PERIOD = 20, 0.1  # of the encoder a drum turn, between two set-points [s]
BANDWIDTHS = (None, 5.0)  # [Hz]
CURVES = tuple((signal, real) for signal in ("rope", "angle") for real in c99.REALS)
SEGMENTS = ("rope", "angle")  # as JSON, which keeps all digits
FLAGS = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-Wconversion", "-pedantic")
SAMPLES = 10_000
ABOUT = {"signal": "rope [m]", "unit": "m", "question": "the main study"}
CASES: tuple[dict[str, Any], ...] = (
    *({"name": name, "bandwidth": f} for name in TABLES for f in BANDWIDTHS),
    *({"name": f"segments of the {signal}", "signal": signal} for signal in SEGMENTS),
    *({"name": f"c99, {real}, {what}", "signal": what, "real": real} for what, real in CURVES),
)


def question(seed: int, index: int) -> Question:
    """The format of a case; nothing is drawn, whatever the seed."""
    return CASES[index % len(CASES)]


def answer(question: Question, folder: Path) -> Row:
    """What comes back, the largest difference, and the peak beside its bound."""
    law, truss = optimum()
    course = rope_course(law.profile, truss)
    if "signal" not in question:
        return _of_a_table(question, course)

    if question["signal"] == "angle":
        segments = polynomials.exact_segments(law.profile)
        course = _angle(law.profile)
    else:
        segments = polynomials.fitted_segments(course)
    time = np.linspace(0.0, course.duration, SAMPLES)
    if "real" in question:
        found = _compiled(c99.write_source(segments, ABOUT, question["real"]), folder)
        values = _called(found, question["real"], time)
    else:
        again = polynomials.read_segments(polynomials.write_segments(segments, ABOUT)).curve()
        values = np.stack([again(time, nu=order) for order in range(3)])
    exact = course.derivatives(time)[:3]
    miss, speed, acceleration = np.abs(values - exact).max(axis=1).tolist()
    return {"unit": course.unit, "miss": miss, "speed": speed, "acceleration": acceleration}


def _of_a_table(question: Question, course: Course) -> Row:
    form = TABLES[question["name"]]
    drive = Drive(
        drum_radius=DRUM_RADIUS,
        counts=2**BITS,
        period=PERIOD,
        interpolation="spline",
        bandwidth=question["bandwidth"],
    )
    points = tabulated(course, question["name"], drive, Spacing())
    again = form.read(form.write(points, ABOUT, 1), points.count)
    record = round_trip(course, again, drive, form.interpolation, optimum()[1])

    # what is written has fifteen digits, or counts
    written = np.abs(again.positions - points.positions).max()
    peak, most = record.playback.peak(2)[0], record.playback.most
    assert record.truss is not None
    return {
        "unit": "m",
        "points": int(points.times.size),
        "miss": float(written),
        "peak": peak,
        "bound": most,
        "within": most is not None and peak <= most * (1 + 1e-12),
        "terminal_angle_deg": float(np.degrees(record.truss.angle[-1])),
    }


def _angle(law: Any) -> Course:
    """The angle of a law as a course."""

    def derivatives(time: Array) -> Array:
        motion = law.motion(time)
        return np.stack([motion.angle, motion.speed, motion.acceleration, motion.jerk])

    return Course("angle", "rad", law.duration, (0.0, law.duration), derivatives)


def _compiled(source: str, folder: Path) -> Path:
    """A shared library of the code, without a warning."""
    compiler = next((name for name in ("cc", "gcc", "clang") if shutil.which(name)), None)
    if compiler is None:
        raise StudyError("there is no C compiler; install gcc or clang to run this case")
    code, library = folder / "deployment.c", folder / "deployment.so"
    code.write_text(source, "utf-8")
    command = [compiler, *FLAGS, "-shared", "-fPIC", str(code), "-o", str(library)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    if done.returncode:
        raise StudyError(f"{compiler} does not take the code: {done.stderr.splitlines()[0]}")
    return library


def _called(library: Path, real: str, times: Array) -> Array:
    """Position, velocity and acceleration of the compiled function, (3, m)."""
    kind = ctypes.c_double if real == "double" else ctypes.c_float
    function = ctypes.CDLL(str(library.resolve())).deployment_at
    function.argtypes = [kind, *[ctypes.POINTER(kind)] * 3]
    outputs = [kind() for _ in range(3)]
    rows = []
    for time in times.tolist():
        function(kind(time), *map(ctypes.byref, outputs))
        rows.append([output.value for output in outputs])
    return np.array(rows).T


def tables(rows: Sequence[Row]) -> list[Table]:
    """Tables for drives, then curves."""
    answered = [row for row in rows if not row["failure"]]
    made = [_of_tables([row for row in answered if "peak" in row])]
    made.append(_of_curves([row for row in answered if "speed" in row]))
    failed = [(row["name"], row["failure"]) for row in rows if row["failure"]]
    return made if not failed else [*made, Table("failed", ("case", "why"), failed)]


def _of_tables(rows: Sequence[Row]) -> Table:
    head = ("format", "loop [Hz]", "points", "written and read [m]", "peak [m/s^2]")
    cells = [
        (
            row["name"],
            "-" if row["bandwidth"] is None else f"{row['bandwidth']:g}",
            str(row["points"]),
            number(row["miss"], 2),
            number(row["peak"], 6),
            number(row["bound"], 6),
            "yes" if row["within"] else "NO",
            f"{row['terminal_angle_deg']:.7f}",
        )
        for row in rows
    ]
    notes = [f"{BITS} bits a turn of a drum of {1e3 * DRUM_RADIUS:g} mm, {PERIOD:g} s"]
    columns = (*head, "bound [m/s^2]", "within", "terminal angle [deg]")
    return Table("tables: peak acceleration as the drive plays them", columns, cells, notes)


def _of_curves(rows: Sequence[Row]) -> Table:
    head = ("curve", "unit", "position off by", "velocity off by", "acceleration off by")
    keys = ("miss", "speed", "acceleration")
    cells = [(row["name"], row["unit"], *(number(row[key], 2) for key in keys)) for row in rows]
    notes = [f"against the motion at {SAMPLES} times; compiled with {' '.join(FLAGS)}"]
    return Table("polynomial segments and C", head, cells, notes)
