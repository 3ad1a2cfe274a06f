"""What the flags of `antenna-ocp export` ask for: a course, its points, and what a drive plays."""

from __future__ import annotations

import argparse
import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from models.truss import angle_from_rope_length, rope_length
from ocp.arrays import Array
from studies.common.configuration import as_number, finite, positive, whole
from studies.common.exit_codes import StudyError
from studies.drive.course import DRUM, Course, drum_course, with_dwells
from studies.drive.schema import Drive
from studies.drive.setpoints import SetPoints, sampled, switch_point_times, uniform_times
from studies.drive.stopping import resume_course, resume_from, stop_course
from studies.drive.stretch import stretched
from studies.export.formats import Spacing, tabulated
from studies.export.round_trip import Breach, RoundTrip, round_trip
from studies.export.source import Source
from studies.export.templates import TableTemplate

PLANS = 8  # of a stop, which take a moment each
ASIDE = 1e-3  # of a lower limit: what a table adds changes with its motion
NEAR_END = 1e-6  # of a motion: nothing is left of it there
PLANNED = ("speed", "acceleration", "jerk")  # limits of a drive that a plan keeps


@dataclass(frozen=True, eq=False)
class Asked:
    """A motion, and the flags that say what is made of it.

    Attributes
    ----------
    source : the motion.
    options : the flags.
    form : the table that they ask for; None of columns and curves.
    """

    source: Source
    options: argparse.Namespace
    form: TableTemplate | None

    @property
    def partial(self) -> bool:
        """Whether only a stop or the way on from it is asked for."""
        parts = (self.options.stop_at, self.options.resume_at, self.options.resume_from)
        return any(part is not None for part in parts)

    @property
    def spacing(self) -> Spacing:
        """Where the points of a table lie."""
        points = None
        if self.options.points is not None:
            points = whole(2)("--points", as_number(self.options.points))
        return Spacing(self.positive("step"), points)

    def kind(self, drive: Drive) -> str:
        """The interpolation between the points of a table."""
        return self._fixed_kind or drive.interpolation

    @property
    def _fixed_kind(self) -> str | None:
        """The interpolation that the table's device does whatever the drive states."""
        return None if self.form is None else self.form.layout.interpolation

    def changed(self, flags: Mapping[str, str]) -> Asked:
        """The same with other flags; of a step and a number of points the new one holds."""
        spaced = {"step": None, "points": None} if {"step", "points"} & set(flags) else {}
        options = argparse.Namespace(**{**vars(self.options), **spaced, **flags})
        return dataclasses.replace(self, options=options)

    def positive(self, flag: str) -> float | None:
        """The number of a flag, which has to be positive; None if it is not stated."""
        text = getattr(self.options, flag)
        return None if text is None else positive(_typed(flag), as_number(text))

    def course(self, drive: Drive) -> Course:
        """The whole motion, or its stop, or what follows the stop; between the drive's dwells.

        Rope on a drum of several layers is no multiple of the drum's turn. What is exported is the
        turn then, unless the user names a signal.
        """
        source, options = self.source, self.options
        layered = drive.rope_diameter is not None and source.truss is not None
        signal = options.signal or (DRUM if layered else None)
        winding = signal == DRUM and source.truss is not None
        course = source.course("rope" if winding else signal)
        within = self.positive("stop_within")
        if options.stop_at is not None:
            course = stop_course(course, self._time("stop_at"), drive, within)
        elif options.resume_at is not None:
            lasting = self.positive("resume_within")
            course = resume_course(course, self._time("resume_at"), drive, within, lasting)
        elif options.resume_from is not None:
            stands = self._standing(course)
            course = resume_from(course, stands, drive, self.positive("resume_within"))
        if source.truss is not None and course.signal == "rope":
            course = stretched(course, source.truss, drive)
        if winding:
            course = drum_course(course, drive.drum)
        return with_dwells(course, drive.start_dwell, drive.end_dwell)

    def points(self, course: Course, drive: Drive) -> SetPoints:
        """The points of a table, or of columns that a drive has to follow."""
        if self.form is not None:
            return tabulated(course, self.form, drive, self.spacing)
        return sampled(course, self.row_times(course, drive), drive.count(course.unit))

    def row_times(self, course: Course, drive: Drive) -> Array:
        """Times (m,) of rows of the whole profile [s]."""
        if self.spacing.points is not None:
            return switch_point_times(course, self.spacing.points - 1)
        times = uniform_times(course, self.spacing.step or drive.period)
        inside: Array = np.minimum(times, course.duration)
        return inside

    def played(self, points: SetPoints, course: Course, drive: Drive) -> RoundTrip:
        """What a drive makes of points of a course."""
        source, kind = self.source, self._fixed_kind
        return round_trip(course, points, drive, kind, source.truss, source.result, self.partial)

    def written(
        self, points: SetPoints, drive: Drive, about: Mapping[str, str]
    ) -> tuple[str, SetPoints]:
        """The text of a table, and its points as the drive reads them, their digits included."""
        assert self.form is not None  # of columns and curves nobody asks
        return self.form.write(points, about, drive.ropes)

    def tried(self, drive: Drive, *, digits: bool = True) -> RoundTrip:
        """The record of what is asked for; of a stop, planned so that its table keeps limits.

        Parameters
        ----------
        digits : whether points count as they are written.
        """
        record = self._record(self.course(drive), drive, digits)
        if not self.partial or self.form is None:
            return record
        return self.planned_inside(drive, record, digits=digits)[1]

    def planned_inside(
        self, drive: Drive, record: RoundTrip, *, digits: bool = True
    ) -> tuple[Drive, RoundTrip]:
        """Lower limits for the plan of a stop, and the record of its table.

        Such a course rides its limit. What interpolation, rounding and the loop add comes on top,
        so that it is planned again inside a limit that is lower by as much as the table was above.
        """
        inside = drive
        for _ in range(PLANS):
            lower = {
                breach.name: getattr(inside, breach.name) / (1 + breach.excess) * (1 - ASIDE)
                for breach in record.breaches
                if isinstance(breach, Breach)
                and breach.name in PLANNED
                and breach.value > breach.limit
            }
            if not lower:
                break
            inside = dataclasses.replace(inside, **lower)
            try:
                course = self.course(inside)
            except StudyError:  # the lower limits leave no such course
                break
            record = self._record(course, drive, digits)
        return inside, record

    def _record(self, course: Course, drive: Drive, digits: bool) -> RoundTrip:
        points = self.points(course, drive)
        if digits and self.form is not None:
            _, points = self.written(points, drive, {"unit": course.unit})
        return self.played(points, course, drive)

    def _standing(self, course: Course) -> float:
        """Where the axis stands, by the angle or the length of rope that was measured there."""
        law, truss, text = self.source.law, self.source.truss, self.options.resume_from
        if law is None or truss is None:
            raise StudyError("--resume-from is for a truss; of an arm, use --resume-at")
        value = finite("--resume-from", as_number(text.removesuffix("m").removesuffix("deg")))
        first, last = (
            float(rope_length(truss, angle)) for angle in (law.start_angle, law.end_angle)
        )
        by_length = text.endswith("m")
        begin, end = (
            (first, last) if by_length else np.degrees([law.start_angle, law.end_angle]).tolist()
        )
        # from 0 at the start of the motion to 1 at its end, where nothing is left of it
        if not 0.0 <= (value - begin) / (end - begin) < 1.0 - NEAR_END:
            unit = "m of rope" if by_length else "deg"
            raise StudyError(
                f"--resume-from is {value:g} {unit}, but the motion runs from {begin:.6g} to "
                f"{end:.6g} {unit}; give a place before its end"
            )
        if course.signal == "rope":
            length = value if by_length else float(rope_length(truss, math.radians(value)))
            return float(rope_length(truss, truss.stowed_angle)) - length
        return float(angle_from_rope_length(truss, value)) if by_length else math.radians(value)

    def _time(self, flag: str) -> float:
        return finite(_typed(flag), as_number(getattr(self.options, flag)))


def _typed(flag: str) -> str:
    return "--" + flag.replace("_", "-")
