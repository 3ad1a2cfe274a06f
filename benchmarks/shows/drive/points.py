"""The show "drive-points": the main study's optimum in few points, on its switches or evenly.

Galil's 255 segments, and 64 and 1,024 cam points, each on the switches and at even steps: 12 cases,
since the cams are joined by a spline and by quintics. What is compared is the interpolated motion
itself, without a position loop, beside the optimum.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.shows.drive.table import DRUM_RADIUS, optimum
from benchmarks.shows.show import Question, Row
from studies.common.console import Table, number
from studies.drive import Drive
from studies.drive.course import rope_course
from studies.drive.playback import extremes_on_the_truss, on_the_truss, played
from studies.drive.setpoints import sampled, switch_point_times
from studies.export.pvt import GALIL_SAMPLE, rounded_velocities

LINE = "the optimum in 255 segments, 64 and 1024 points: on the switches, or evenly"
LIMIT = 300.0  # [s]; a case takes a few

TABLES = (  # name, points, interpolation, bits of the encoder (none: not rounded), sample [s]
    ("Galil PVT, 255 segments, 12 bits", 256, "hermite", 12, GALIL_SAMPLE),
    ("Galil PVT, 255 segments, 20 bits", 256, "hermite", 20, GALIL_SAMPLE),
    ("cam spline, 64 points", 64, "spline", None, None),
    ("cam quintic, 64 points", 64, "quintic", None, None),
    ("cam spline, 1024 points", 1024, "spline", None, None),
    ("cam quintic, 1024 points", 1024, "quintic", None, None),
)


def question(seed: int, index: int) -> Question:
    """The table of a case; nothing is drawn, whatever the seed."""
    place, evenly = divmod(index % (2 * len(TABLES)), 2)
    name, points, kind, bits, sample = TABLES[place]
    return {
        "name": name,
        "points": points,
        "interpolation": kind,
        "bits": bits,
        "sample": sample,
        "knots": "even" if evenly else "on the switches",
    }


def answer(question: Question, folder: Path) -> Row:
    """The motion's peaks beside those of the optimum, and its largest distance from it."""
    law, truss = optimum()
    course = rope_course(law.profile, truss)
    bits, sample, kind = question["bits"], question["sample"], question["interpolation"]
    drive = Drive(drum_radius=DRUM_RADIUS, counts=None if bits is None else 2**bits)

    if question["knots"] == "even":
        times = np.linspace(0.0, course.duration, question["points"])
        if sample is not None:
            times = sample * np.rint(times / sample)
    else:
        times = switch_point_times(course, question["points"] - 1, sample)
    points = sampled(course, times, drive.count("m"))
    if sample is not None:
        points = rounded_velocities(points)

    output = played(course, points, drive, kind)
    moved = on_the_truss(output.motion, truss)
    inside = np.minimum(output.time, course.duration)
    exact = course.derivatives(inside)
    return {
        "rope": output.peak(2)[0] / course.peaks[1] - 1,
        "bound": None if output.most is None else output.most / course.peaks[1] - 1,
        "angle": extremes_on_the_truss(output, moved, drive)["peak-acceleration"][0]
        / law.peak_acceleration
        - 1,
        "distance": float(np.abs(output.motion[0] - exact[0]).max()),
        "acceleration": float(np.abs(output.motion[2] - exact[2]).max()) / course.peaks[1],
        "terminal_angle_deg": math.degrees(float(moved.angle[-1])),
    }


def tables(rows: Sequence[Row]) -> list[Table]:
    """A line a case."""
    head = ["table", "knots", "peak of rope [%]", "bound [%]", "peak of angle [%]"]
    head += ["largest miss of rope's acceleration [%]", "of its length [m]", "terminal angle [deg]"]
    cells = [
        [
            row["name"],
            row["knots"],
            _percent(row.get("rope")),
            _percent(row.get("bound")),
            _percent(row.get("angle")),
            _percent(row.get("acceleration")),
            number(row.get("distance"), 3),
            f"{row['terminal_angle_deg']:.7f}" if not row["failure"] else row["failure"],
        ]
        for row in rows
    ]
    title = "peak acceleration above the optimum's, 140 s, without a position loop"
    return [Table(title=title, head=head, rows=cells)]


def _percent(value: float | None) -> str:
    return "-" if value is None else f"{100 * value:+.4f}"
