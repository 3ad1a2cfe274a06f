"""The formats of `antenna-ocp export`, and where the points of a table lie."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ocp.arrays import Array
from studies.common.exit_codes import StudyError
from studies.drive.course import Course
from studies.drive.schema import Drive
from studies.drive.setpoints import SetPoints, sampled, switch_point_times, uniform_times
from studies.export import command
from studies.export.table_layout import TableLayout
from studies.export.templates import TableTemplate, shipped

TABLES: Mapping[str, TableTemplate] = {name: shipped(name) for name in command.TABLES}


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
            raise StudyError("--step and --points are both given; remove one of them")


def tabulated(course: Course, form: TableTemplate, drive: Drive, spacing: Spacing) -> SetPoints:
    """The table of a course for a format.

    Points lie on the course's switches where the format allows it.

    Raises
    ------
    StudyError
        If the device cannot hold the motion, or the encoder cannot resolve it.
    """
    layout = form.layout
    kind = layout.interpolation or drive.interpolation
    if layout.lacks(kind):
        raise StudyError(
            f"drive.interpolation is {kind!r}, which needs velocities, but a table of {form.name} "
            "holds positions alone; state spline, linear or hold, or export as pvt or codesys-xyva"
        )
    count = drive.count(course.unit) if layout.positions != "exact" else None
    if count is not None:
        drive.check_travel(course.travel, course.unit)

    most = drive.buffer if drive.buffer is not None else layout.most
    points = sampled(course, _times(course, layout, drive, spacing, most), count)
    held = points.times.size - (1 if layout.segments else 0)
    if most is not None and held > most:
        what = "segments" if layout.segments else "points"
        step = course.duration / (most - (0 if layout.segments else 1))
        remedy = f"a step of {step:.4g} s would do, or a buffer of {held}"
        raise StudyError(f"the table has {held} {what}, but the device holds {most}; {remedy}")
    if drive.longest_segment is not None and points.longest > drive.longest_segment * (1 + 1e-9):
        raise StudyError(
            f"the longest step is {points.longest:.4g} s, but drive.longest_segment is "
            f"{drive.longest_segment:g} s; take more points, or a shorter step"
        )
    return _in_whole_counts(points) if layout.whole_velocities else points


def _in_whole_counts(points: SetPoints) -> SetPoints:
    """The same with velocities in whole counts a second."""
    count = points.count or 1.0
    velocities = count * np.rint(points.velocities / count)
    return dataclasses.replace(points, velocities=velocities, velocity_step=count)


def _times(
    course: Course, layout: TableLayout, drive: Drive, spacing: Spacing, most: int | None
) -> Array:
    limit = spacing.points if spacing.points is not None else most
    segments = None if limit is None else limit - (0 if layout.segments else 1)

    rounded = layout.positions != "exact"
    if layout.even:
        if spacing.points is not None and layout.sample is None and not rounded:
            return np.linspace(0.0, course.duration, spacing.points)
        return uniform_times(course, spacing.step or drive.period)
    if spacing.step is not None:
        step = spacing.step
        if layout.sample is not None:
            step = layout.sample * max(1, round(step / layout.sample))
        return uniform_times(course, step)
    if segments is None:
        segments = max(1, round(course.duration / drive.period))
        # nobody limits the table: as many again where the motion has more pieces than that
        pieces = len(course.switches) - 1
        segments += pieces if pieces > segments else 0
    rounded = rounded and drive.counts is not None
    return switch_point_times(course, segments, layout.sample, drive.longest_segment, rounded)
