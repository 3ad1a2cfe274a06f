"""Columns of a profile with what its drive has to follow: the same points that its record plays."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from ocp.arrays import Array
from studies.common.result import Result, Series
from studies.drive.course import DRUM, Course
from studies.drive.schema import Drive
from studies.drive.setpoints import SetPoints
from studies.export.source import Source

SET_POINT = "{signal}_set_point"  # the column of positions; those of its rates begin with it


def with_set_points(
    source: Source, columns: Mapping[str, Array], course: Course, points: SetPoints, drive: Drive
) -> tuple[Result, dict[str, Array]]:
    """The columns with those of the set-points beside them, and a result that knows their units.

    The position holds the stretch of a rope that yields, and is rounded to counts where the drive
    has any. Of a drum, the rope that its turn winds in is a column, too.

    Parameters
    ----------
    columns : (m,) each, by names of the series of the source's result.
    points : of the course, at the times of the columns.
    """
    name, unit = SET_POINT.format(signal=course.signal), course.unit
    stretch = "" if course.stretch is None else ", with the stretch"
    what = f"rope wound in since the start{stretch}"
    # a signal of another mechanism may have any name
    is_rope = source.truss is not None and course.signal == "rope"
    added = {
        name: Series(
            unit,
            "time",
            points.positions,
            what if is_rope else f"{course.signal} since the start{stretch}",
        ),
        f"{name}_speed": Series(f"{unit}/s", "time", points.velocities, "its rate"),
        f"{name}_acceleration": Series(
            f"{unit}/s^2", "time", points.accelerations, "rate of that speed"
        ),
    }
    if course.signal == DRUM:
        rope = SET_POINT.format(signal="rope")
        added[rope] = Series("m", "time", drive.drum.rope_at(points.positions), what)

    result = source.result
    arrays = {
        key: dataclasses.replace(result.arrays[key], values=values)
        for key, values in columns.items()
    }
    extended = dataclasses.replace(result, arrays={**arrays, **added})
    return extended, {**columns, **{key: series.values for key, series in added.items()}}
