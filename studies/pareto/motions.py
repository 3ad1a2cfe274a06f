"""The motions of a front's points: kept in its result, and each as a result of the truss again.

Points are numbered from 1, the one with the least limit first, as in the rows of its profile.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from ocp import FrontPoint
from studies.common.exit_codes import StudyError, quoted
from studies.common.result import Result, Series
from studies.fronts.columns import point_name
from studies.pareto.config import limited, study_from
from studies.truss.config import as_dictionary
from studies.truss.motions.deployment import how_to_read
from studies.truss.motions.laws import BEFORE, deployment_of, stored_law
from studies.truss.study import KNOTS, series_of

# what `stored_law` makes a law of again
LAW_COLUMNS = ("time", "angle", "angular_speed", "angular_acceleration", BEFORE, *KNOTS)


def motion_series(points: Sequence[FrontPoint]) -> dict[str, Series]:
    """The laws of all points, each along axes of its own."""
    arrays = {}
    for number, point in enumerate(points, start=1):
        columns, head = series_of(point.motion.deployment), f"{point_name(number)}/"
        for name in LAW_COLUMNS:
            if name in columns:
                series = columns[name]
                kept = dataclasses.replace(series, axis=f"{head}{series.axis}")
                arrays[f"{head}{name}"] = kept
    return arrays


def motion_of(result: Result, name: str) -> Result:
    """The motion of one point of a front as a result of the truss, under the point's limits.

    Raises
    ------
    StudyError
        If no point has that name, or the front was stored without motions.
    """
    count = sum(key.endswith("/angle") for key in result.arrays)
    if count == 0:
        raise StudyError("the front was stored without its motions; run its study again")
    named = {point_name(number): number for number in range(1, count + 1)}
    if name not in named:
        raise StudyError(
            f"--motion is {quoted(name)}; this front has 'point 1' to 'point {count}', in the "
            "order of its profile, the one with the least limit first"
        )

    number = named[name]
    head = f"{name}/"
    columns = {
        key.removeprefix(head): series.values
        for key, series in result.arrays.items()
        if key.startswith(head)
    }
    asked, limit = study_from(result.configuration), result.arrays["limit"].values[number - 1]
    study = limited(asked.truss, asked.pareto.limited, float(limit))
    deployment = deployment_of(name, stored_law(columns), study)
    return dataclasses.replace(
        result,
        kind="truss",
        question=f"{result.question}, {name}",
        configuration=as_dictionary(study),
        arrays=series_of(deployment),
        details={"study": as_dictionary(study), "how_to_read": how_to_read(deployment)},
    )
