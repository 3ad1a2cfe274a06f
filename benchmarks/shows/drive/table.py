"""The show "drive-table": what a drive makes of the main study's optimum, by its settings.

Four set-point periods, three encoders, two interpolations and two position loops make 48 cases, in
this order; further cases begin again. The optimum is in closed form, so that nothing is solved.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from benchmarks.shows.show import Question, Row
from models.laws import JerkLimited
from models.truss import TrussParameters
from studies.common.console import Table, number
from studies.drive import Drive
from studies.drive.course import rope_course
from studies.drive.playback import extremes_on_the_truss, on_the_truss, played
from studies.drive.setpoints import sampled, uniform_times

LINE = "what a drive makes of the optimum: 48 cases of period, encoder, interpolation, loop"
LIMIT = 300.0  # [s]; a case takes a few

PERIODS = (0.001, 0.01, 0.1, 1.0)  # [s]
BITS = (12, 16, 20)  # a drum turn
INTERPOLATIONS = ("linear", "spline")
BANDWIDTHS = (5.0, 50.0)  # [Hz]
DRUM_RADIUS = 0.02  # [m]
DURATION, JERK_MULTIPLE = 140.0, 124.22  # [s], of 1/T^3: the Bezier law's own peak jerk
FRICTION = 0.01  # mu [-], as in the main study


def question(seed: int, index: int) -> Question:
    """The settings of a case; nothing is drawn, whatever the seed."""
    sizes = (len(PERIODS), len(BITS), len(INTERPOLATIONS), len(BANDWIDTHS))
    places = []
    for size in reversed(sizes):
        index, place = divmod(index, size)
        places.append(place)
    bandwidth, kind, bits, period = places
    return {
        "period": PERIODS[period],
        "bits": BITS[bits],
        "interpolation": INTERPOLATIONS[kind],
        "bandwidth": BANDWIDTHS[bandwidth],
    }


def optimum() -> tuple[JerkLimited, TrussParameters]:
    """The main study's optimum and its truss."""
    truss = TrussParameters(pulley_friction=FRICTION)
    jerk = JERK_MULTIPLE / DURATION**3
    return JerkLimited(DURATION, truss.stowed_angle, math.pi / 2, jerk=jerk), truss


def answer(question: Question, folder: Path) -> Row:
    """Raw and filtered peaks, their bound, and the terminal angle."""
    law, truss = optimum()
    course = rope_course(law.profile, truss)
    drive = Drive(
        drum_radius=DRUM_RADIUS,
        counts=2 ** question["bits"],
        period=question["period"],
        interpolation=question["interpolation"],
        bandwidth=question["bandwidth"],
    )
    points = sampled(course, uniform_times(course, drive.period), drive.count("m"))
    output = played(course, points, drive)
    moved = on_the_truss(output.motion, truss)
    return {
        "course": course.peaks[1],
        "raw": output.raw,
        "raw_bound": None if output.bound is None else output.bound.total,
        "filtered": output.peak(2)[0],
        "filtered_bound": output.most,
        "angular": extremes_on_the_truss(output, moved, drive)["peak-acceleration"][0],
        "optimum": law.peak_acceleration,
        "terminal_angle_deg": math.degrees(float(moved.angle[-1])),
    }


def tables(rows: Sequence[Row]) -> list[Table]:
    """A line a case."""
    head = ["period [s]", "bits", "interpolation", "loop [Hz]", "table [m/s^2]"]
    head += ["rope after the loop", "bound", "angle [rad/s^2]", "terminal angle [deg]"]
    cells = [
        [
            f"{row['period']:g}",
            str(row["bits"]),
            row["interpolation"],
            f"{row['bandwidth']:g}",
            number(row.get("raw"), 4),
            number(row.get("filtered"), 4),
            number(row.get("filtered_bound"), 4),
            number(row.get("angular"), 4),
            f"{row['terminal_angle_deg']:.6f}" if not row["failure"] else row["failure"],
        ]
        for row in rows
    ]

    answered = [row for row in rows if not row["failure"]]
    held = sum(row["filtered"] <= row["filtered_bound"] for row in answered)
    notes = [f"{held} of {len(rows)} peaks are within their bound."]
    if answered:
        first = answered[0]
        notes.append(
            f"the course itself: rope {first['course']:.4g} m/s^2, "
            f"angle {first['optimum']:.4g} rad/s^2."
        )
    title = "peak acceleration of rope and angle, drum of 20 mm, 140 s"
    return [Table(title=title, head=head, rows=cells, notes=notes)]
