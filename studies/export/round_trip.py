"""What a table does on the drive that it was written for, and whether that keeps the limits."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from models.errors import ModelError
from models.truss import TrussParameters
from studies.common.console import above
from studies.common.exit_codes import StudyError
from studies.common.result import Result
from studies.drive.course import DRUM, SAMPLES, Course, Stretch
from studies.drive.playback import (
    Playback,
    TrussPlayback,
    at_common_times,
    extremes_on_the_truss,
    motor_peaks,
    on_the_truss,
    played,
    relieved,
    wound,
)
from studies.drive.schema import Drive
from studies.drive.setpoints import SetPoints, sampled
from studies.drive.yielding import felt
from studies.export.beyond_caps import BeyondCap, beyond_caps
from studies.truss.motions.laws import study_of

TOLERANCE = 1e-6  # of a limit: what an optimiser that rides it leaves
SLACK = 1e-3  # of the peak force: what spline and interpolation leave of a tension of zero
UNDEFINED = (
    "straight lines between points have no acceleration; state drive.bandwidth, or "
    "drive.interpolation = 'spline' (and drive.drum_radius for speed and torque of a motor)"
)
DIGITS = 1e-12  # [m or rad]: a table that is closer to its course is not rounded
OPEN = math.pi / 2  # [rad]


@dataclass(frozen=True)
class Breach:
    """A limit that is broken.

    Attributes
    ----------
    name, unit : of the limit.
    value, limit : found and allowed.
    time : when it is worst [s].
    """

    name: str
    unit: str
    value: float
    limit: float
    time: float

    @property
    def sentence(self) -> str:
        """Place and amount."""
        if math.isnan(self.value):
            return (
                f"the {self.name} has no bound between the points, but its limit is "
                f"{self.limit:g} {self.unit}"
            )
        return (
            f"the {self.name} is {self.value:.6g} {self.unit} at {self.time:.6g} s, "
            f"{above(self.excess)} its limit of {self.limit:g} {self.unit}"
        )

    @property
    def excess(self) -> float:
        """Relative to the limit; infinite where there is no value."""
        return math.inf if math.isnan(self.value) else self.value / self.limit - 1.0


@dataclass(frozen=True)
class Slack:
    """A rope that would have to push.

    Attributes
    ----------
    push : of the segment with the least tension [N].
    time : when it is least [s].
    """

    push: float
    time: float

    @property
    def sentence(self) -> str:
        """Place and amount."""
        return (
            f"the rope would have to push with {self.push:.4g} N at {self.time:.6g} s and is "
            "slack there"
        )

    @property
    def excess(self) -> float:
        """No table with a slack rope is better than another."""
        return math.inf


@dataclass(frozen=True, eq=False)
class RoundTrip:
    """The record of a round trip.

    Attributes
    ----------
    playback : of the table.
    truss : that it moves, or None.
    values : numbers for the record, by name with the unit in brackets.
    breaches : limits that are broken, and ropes that would push.
    beyond : caps of the study that the played table exceeds.
    """

    playback: Playback
    truss: TrussPlayback | None
    values: Mapping[str, Any]
    breaches: tuple[Breach | Slack, ...] = ()
    beyond: tuple[BeyondCap, ...] = ()

    @property
    def push(self) -> float:
        """What a rope would have to push with [N]; zero where all stay taut."""
        return max((b.push for b in self.breaches if isinstance(b, Slack)), default=0.0)

    def lines(self) -> list[str]:
        """The record for a reader."""
        known, unknown = [], []
        for name, value in self.values.items():
            if isinstance(value, float) and math.isnan(value):
                unknown.append(name.split(" [")[0])
            else:
                shown = f"{value:.6g}" if isinstance(value, float) else str(value)
                known.append(f"{name}: {shown}")
        if unknown:
            known.append(f"no value between the points of {', '.join(unknown)}")
        return [*known, *(f"BROKEN: {breach.sentence}" for breach in self.breaches)]


def round_trip(
    course: Course,
    points: SetPoints,
    drive: Drive,
    kind: str | None = None,
    truss: TrussParameters | None = None,
    result: Result | None = None,
    partial: bool = False,
) -> RoundTrip:
    """Play a table that was read back, and hold it against the course and the drive's limits.

    Parameters
    ----------
    kind : of interpolation; that of the drive by default.
    truss : that the rope moves.
    result : whose optimum the peaks are held against.
    partial : whether the course ends before the motion does, as a stop.

    Raises
    ------
    StudyError
        If the motion leaves the reach of the mechanism.
    """
    drum = drive.drum if course.signal == DRUM else None

    def axis(table: SetPoints) -> Playback:
        return played(course, table, drive, kind)

    def rope(table: SetPoints) -> Playback:
        return axis(table) if drum is None else wound(axis(table), drum)

    output = axis(points)
    values, unit, replayed = _of_the_axis(course, points, output), course.unit, None
    if drum is not None:
        output, unit = wound(output, drum), "m"
        values |= _of_the_rope(output)
    breaches = _against_limits(output, drive, unit)
    beyond: tuple[BeyondCap, ...] = ()

    if truss is not None and course.signal in ("rope", DRUM):
        # the mechanism feels what is rounded off through a rope that yields
        smooth = sampled(course, points.times)
        rounded = bool(np.abs(points.positions - smooth.positions).max() > DIGITS)
        exact = moved = rope(smooth) if rounded else output
        if course.stretch is not None:
            moved = rope(relieved(course, smooth, drum))
            values |= _of_the_stretch(course, course.stretch)
        output, moved = at_common_times(output, moved)
        try:
            off = felt(output, exact, points.times, truss, drive) if rounded else 0.0
            replayed = on_the_truss(moved.motion + off, truss, output.motion[1])
        except ModelError as error:
            raise StudyError(f"the played rope leaves the mechanism: {error}") from error
        on_truss, broken = _of_the_truss(output, replayed, drive)
        values |= on_truss
        breaches += broken
        if result is not None:
            values |= _beside_the_optimum(output, replayed, drive, result, partial)
            beyond = beyond_caps(output, replayed, drive, study_of(result))
            values |= dict(one.line for one in beyond)
    if any(isinstance(value, float) and math.isnan(value) for value in values.values()):
        values["why values are missing"] = UNDEFINED
    return RoundTrip(output, replayed, values, tuple(breaches), beyond)


def itself(
    course: Course, drive: Drive, truss: TrussParameters | None, result: Result
) -> RoundTrip:
    """The record of a course by itself, without a table and a loop."""
    time = course.grid(SAMPLES)
    rows, unit = course.derivatives(time), course.unit
    if course.signal == DRUM:
        rows, unit = drive.drum.wound(rows), "m"
    output = Playback(time, rows, math.nan, None, None, course.duration, course.derivatives)
    breaches = _against_limits(output, drive, unit)
    if truss is None or course.signal not in ("rope", DRUM):
        return RoundTrip(output, None, {}, tuple(breaches))

    moved = rows if course.stretch is None else rows - course.stretch.derivatives(time)
    replayed = on_the_truss(moved, truss, rows[1])
    values, broken = _of_the_truss(output, replayed, drive)
    beyond = beyond_caps(output, replayed, drive, study_of(result))
    values |= dict(one.line for one in beyond)
    return RoundTrip(output, replayed, values, (*breaches, *broken), beyond)


def _of_the_axis(course: Course, points: SetPoints, output: Playback) -> dict[str, Any]:
    """What the table and the loop make of the axis that is driven: rope, drum or joint."""
    unit, (_, exact, _) = course.unit, course.peaks
    end = float(course.derivatives(np.array([course.duration]))[0, 0])
    values: dict[str, Any] = {
        "points": int(points.times.size),
        "last time [s]": output.end,
        f"peak acceleration of the course [{unit}/s^2]": exact,
        f"peak second difference of the table [{unit}/s^2]": output.raw,
    }
    if output.bound is not None:
        values[f"bound of that by interpolation and rounding [{unit}/s^2]"] = output.bound.total
    values |= {
        f"peak speed after the loop [{unit}/s]": output.peak(1)[0],
        f"peak acceleration after the loop [{unit}/s^2]": output.peak(2)[0],
        f"bound of that [{unit}/s^2]": math.nan if output.most is None else output.most,
        f"peak jerk after the loop [{unit}/s^3]": output.peak(3)[0],
        f"miss of the last position [{unit}]": float(points.positions[-1]) - end,
    }
    return values


def _of_the_rope(output: Playback) -> dict[str, Any]:
    """What the rope does that a drum winds in."""
    return {
        "peak rope speed [m/s]": output.peak(1)[0],
        "peak rope acceleration [m/s^2]": output.peak(2)[0],
        "peak rope jerk [m/s^3]": output.peak(3)[0],
    }


def _of_the_stretch(course: Course, stretch: Stretch) -> dict[str, Any]:
    """What a yielding rope is wound in more, and the swing on it that this does not prevent."""
    return {
        "largest stretch wound in beforehand [m]": float(
            np.abs(stretch.derivatives(course.grid(SAMPLES))[0]).max()
        ),
        "most of the tension that it misses at a step [N]": stretch.missed,
        "stretch of the rope on the drum, left out, about [m]": stretch.on_the_drum,
    }


def _of_the_truss(
    output: Playback, replayed: TrussPlayback, drive: Drive
) -> tuple[dict[str, Any], list[Breach | Slack]]:
    extremes = extremes_on_the_truss(output, replayed, drive)
    last = int(np.searchsorted(output.time, output.end))
    last = min(last, output.time.size - 1)
    values: dict[str, Any] = {
        "peak angular acceleration after the loop [rad/s^2]": extremes["peak-acceleration"][0],
        "peak rope force [N]": extremes["peak-force"][0],
        "least tension of all segments [N]": extremes["least-tension"][0],
        "peak motor power [W]": extremes["peak-power"][0],
        "peak reaction on the arm [N]": extremes["peak-reaction"][0],
        "terminal angle [deg]": math.degrees(float(replayed.angle[-1])),
        "speed left at the last point [rad/s]": float(replayed.speed[last]),
        "energy of that at the end stop [J]": float(replayed.energy[last]),
        "largest angle [deg]": math.degrees(float(replayed.angle.max())),
    }

    warning, breaches = _slack(extremes, drive)
    values |= warning
    limited = [
        (extremes["peak-force"], "rope force", "N", drive.force),
        (extremes["peak-power"], "motor power", "W", drive.power),
    ]
    if drive.drum_radius is not None:
        of_the_motor = motor_peaks(output, replayed, drive)
        values["peak motor speed [1/min]"] = 60 * of_the_motor["speed"][0] / (2 * math.pi)
        values["peak motor torque [N m]"] = of_the_motor["torque"][0]
        if drive.motor_inertia > 0.0:
            values["peak motor force, rotor included [N]"] = of_the_motor["force"][0]
        limited += [
            (of_the_motor["speed"], "motor speed", "rad/s", drive.motor_speed),
            (of_the_motor["torque"], "motor torque", "N m", drive.motor_torque),
        ]
        if drive.torque_speed is not None:
            share = of_the_motor["load"]
            values["largest share of the torque-speed curve [1]"] = share[0]
            limited.append((share, "torque-speed curve", "of it", 1.0))
    for peak, name, unit, limit in limited:
        if limit is not None:
            breaches += _breach(name, unit, peak, limit)
            values[f"margin of the {name} [1]"] = limit / peak[0] - 1.0
    return values, breaches


def _slack(
    extremes: Mapping[str, tuple[float, float]], drive: Drive
) -> tuple[dict[str, Any], list[Breach | Slack]]:
    """A rope pulls: where its tension comes out below zero the mechanism moves otherwise.

    Without a position loop the rope follows the table exactly, its rounding included. No rope does,
    so that this is said and refused only behind a loop.
    """
    tension, time = extremes["least-tension"]
    if not tension < -SLACK * extremes["peak-force"][0]:
        return {}, []
    if drive.bandwidth is not None:
        return {}, [Slack(-tension, time)]
    return {
        "warning": f"a rope that follows the table exactly would push with {-tension:.4g} N at "
        f"{time:.6g} s; state drive.bandwidth to see what the position loop leaves of that"
    }, []


def _against_limits(output: Playback, drive: Drive, unit: str) -> list[Breach | Slack]:
    names = ("speed", "acceleration", "jerk")
    limits = (drive.speed, drive.acceleration, drive.jerk)
    breaches: list[Breach | Slack] = []
    for order, (name, limit) in enumerate(zip(names, limits, strict=True), start=1):
        if limit is not None:
            per = f"{unit}/s" + (f"^{order}" if order > 1 else "")
            breaches += _breach(name, per, output.peak(order), limit)
    return breaches


def _breach(name: str, unit: str, peak: tuple[float, float], limit: float) -> list[Breach]:
    """The breach of a limit by a peak and its time; none where it is kept."""
    value, time = peak
    if value <= limit * (1 + TOLERANCE):
        return []
    return [Breach(name, unit, value, limit, time)]


def _beside_the_optimum(
    output: Playback, replayed: TrussPlayback, drive: Drive, result: Result, partial: bool
) -> dict[str, Any]:
    if partial:
        return {}
    extremes = extremes_on_the_truss(output, replayed, drive)
    values: dict[str, Any] = {
        "miss of the deployed angle [deg]": math.degrees(float(replayed.angle[-1]) - OPEN)
    }
    for row in result.table:
        if row.minimised and row.key in extremes:
            own = next(iter(row.values.values()))
            values[f"{row.title} above the optimum [1]"] = extremes[row.key][0] / own - 1.0
    return values
