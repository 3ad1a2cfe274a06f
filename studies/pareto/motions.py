"""The motions of a front's points: kept in its result, and each as a result of the truss again.

Points are numbered from 1, the one with the least limit first, as in the rows of its profile.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from ocp.analysis.front.continuation import FrontPoint
from studies.common.exit_codes import StudyError, quoted
from studies.common.result import Result, Series
from studies.pareto.config import pareto_from
from studies.pareto.truss import study_at
from studies.truss.config import as_dictionary
from studies.truss.motions.deployment import Deployment, how_to_read
from studies.truss.motions.laws import BEFORE, stored_law
from studies.truss.study import KNOTS, series_of

# what a law is made of again
COLUMNS = ("time", "angle", "angular_speed", "angular_acceleration", BEFORE, *KNOTS)


def motion_series(points: Sequence[FrontPoint]) -> dict[str, Series]:
    """The laws of all points, each along axes of its own."""
    arrays = {}
    for number, point in enumerate(points, start=1):
        columns = series_of(point.motion.deployment)
        for name in COLUMNS:
            if name in columns:
                series = columns[name]
                kept = dataclasses.replace(series, axis=f"{_head(number)}{series.axis}")
                arrays[f"{_head(number)}{name}"] = kept
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
    named = {_head(number).removesuffix("/"): number for number in range(1, count + 1)}
    if name not in named:
        raise StudyError(
            f"--motion is {quoted(name)}; this front has 'point 1' to 'point {count}', in the "
            "order of its profile, the one with the least limit first"
        )

    number = named[name]
    head = _head(number)
    columns = {
        key.removeprefix(head): series.values
        for key, series in result.arrays.items()
        if key.startswith(head)
    }
    asked = pareto_from(result.configuration)
    limit = float(result.arrays["limit"].values[number - 1])
    level = result.arrays["slice"].values[number - 1] if asked.pareto.sliced else None
    study = study_at(asked, limit, level)
    deployment = Deployment(name, stored_law(columns), study.truss, study.drive, study.margin)
    return dataclasses.replace(
        result,
        kind="truss",
        question=f"{result.question}, {name}",
        configuration=as_dictionary(study),
        arrays=series_of(deployment),
        details={"study": as_dictionary(study), "how_to_read": how_to_read(deployment)},
    )


def _head(number: int) -> str:
    return f"point {number}/"
