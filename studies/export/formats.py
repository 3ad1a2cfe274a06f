"""The formats of `antenna-ocp export`, and what each of them asks of a table."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from ocp.arrays import Array
from studies.common.exit_codes import StudyError
from studies.drive.course import Course
from studies.drive.schema import Drive
from studies.drive.setpoints import SetPoints, sampled, switch_point_times, uniform_times
from studies.export import cams, fieldbus, pvt

COLUMNS = ("csv", "json", "mat", "parquet")  # the whole profile
CURVES = ("segments", "c99")  # polynomials, without points


@dataclass(frozen=True)
class TableFormat:
    """A table that a drive takes.

    Attributes
    ----------
    write, read : make its text, and the set-points again.
    interpolation : that the device does between its points; None is that of the drive.
    even : whether all steps have to be equal.
    counts : whether positions are rounded to counts where the drive states them.
    most : points that the device holds where the drive states no buffer; None is any number.
    sample : of which all times are multiples [s]; None is any time.
    segments : whether its limit is of segments, which are one fewer than the points.
    holds : derivatives in it, the position among them: 1 is positions alone.
    relative : whether it says how far the axis moves, and not where it is.
    """

    write: Callable[[SetPoints, Mapping[str, str], int], str]
    read: Callable[[str, float | None], SetPoints]
    interpolation: str | None
    even: bool = False
    counts: bool = False
    most: int | None = None
    sample: float | None = None
    segments: bool = False
    holds: int = 2
    relative: bool = False


TABLES: Mapping[str, TableFormat] = {
    "pvt": TableFormat(pvt.write_plain, pvt.read_plain, "hermite", counts=True),
    "newport-xps": TableFormat(
        pvt.write_newport, pvt.read_newport, "hermite", counts=True, relative=True
    ),
    "galil": TableFormat(
        pvt.write_galil,
        pvt.read_galil,
        "hermite",
        counts=True,
        most=pvt.GALIL_SEGMENTS,
        sample=pvt.GALIL_SAMPLE,
        segments=True,
        relative=True,
    ),
    "codesys-x": TableFormat(cams.write_codesys_x, cams.read_codesys_x, None, even=True, holds=1),
    "codesys-xy": TableFormat(cams.write_codesys_xy, cams.read_codesys_xy, None, holds=1),
    "codesys-xyva": TableFormat(
        cams.write_codesys_xyva, cams.read_codesys_xyva, "quintic", holds=3
    ),
    "beckhoff": TableFormat(cams.write_beckhoff, cams.read_beckhoff, None, holds=1),
    "sew": TableFormat(cams.write_sew, cams.read_sew, None, most=cams.SEW_POINTS, holds=1),
    "sew-spline": TableFormat(
        cams.write_sew, cams.read_sew, "spline", most=cams.SEW_SPLINE_POINTS, holds=1
    ),
    "ethercat": TableFormat(
        fieldbus.write_ethercat, fieldbus.read_ethercat, None, even=True, counts=True, holds=1
    ),
}
NEEDED = {"hermite": 2, "quintic": 3}  # derivatives at each point; of the others positions do
FORMATS = (*COLUMNS, *TABLES, *CURVES)


@dataclass(frozen=True)
class Spacing:
    """Where the user wants the points of a table.

    Attributes
    ----------
    step : a fixed one [s], or None.
    points : as many, on the switches; or None.
    """

    step: float | None = None
    points: int | None = None

    def __post_init__(self) -> None:
        if self.step is not None and self.points is not None:
            raise StudyError("--step and --points are both stated; keep one of them")
        if self.step is not None and not self.step > 0:
            raise StudyError(f"--step is {self.step:g} s; give a positive time")
        if self.points is not None and self.points < 2:
            raise StudyError(f"--points is {self.points}; give at least 2")


def tabulated(course: Course, name: str, drive: Drive, spacing: Spacing) -> SetPoints:
    """The table of a course for a format.

    Points lie on the course's switches where the format allows it.

    Raises
    ------
    StudyError
        If the device cannot hold the motion, or the encoder cannot resolve it.
    """
    form = TABLES[name]
    kind = form.interpolation or drive.interpolation
    if NEEDED.get(kind, 1) > form.holds:
        raise StudyError(
            f"drive.interpolation is {kind!r}, which needs velocities, but a table of {name} holds "
            "positions alone; state spline, linear or hold, or export as pvt or codesys-xyva"
        )
    count = drive.count(course.unit) if form.counts else None
    if count is not None:
        drive.check_travel(course.travel, course.unit)

    most = drive.buffer if drive.buffer is not None else form.most
    points = sampled(course, _times(course, form, drive, spacing, most), count)
    held = points.times.size - (1 if form.segments else 0)
    if most is not None and held > most:
        what = "segments" if form.segments else "points"
        step = course.duration / (most - (0 if form.segments else 1))
        remedy = f"a step of {step:.4g} s would do, or a buffer of {held}"
        raise StudyError(f"the table has {held} {what}, but the device holds {most}; {remedy}")
    if drive.longest_segment is not None and points.longest > drive.longest_segment * (1 + 1e-9):
        raise StudyError(
            f"the longest step is {points.longest:.4g} s, but drive.longest_segment is "
            f"{drive.longest_segment:g} s; take more points, or a shorter step"
        )
    return pvt.rounded_velocities(points) if name == "galil" else points


def _times(
    course: Course, form: TableFormat, drive: Drive, spacing: Spacing, most: int | None
) -> Array:
    limit = spacing.points if spacing.points is not None else most
    segments = None if limit is None else limit - (0 if form.segments else 1)

    if form.even:
        if spacing.points is not None and form.sample is None and not form.counts:
            return np.linspace(0.0, course.duration, spacing.points)
        return uniform_times(course, spacing.step or drive.period)
    if spacing.step is not None:
        step = spacing.step
        if form.sample is not None:
            step = form.sample * max(1, round(step / form.sample))
        return uniform_times(course, step)
    if segments is None:
        segments = max(1, round(course.duration / drive.period))
        # nobody limits the table: as many again where the motion has more pieces than that
        pieces = len(course.switches) - 1
        segments += pieces if pieces > segments else 0
    rounded = form.counts and drive.counts is not None
    return switch_point_times(course, segments, form.sample, drive.longest_segment, rounded)
