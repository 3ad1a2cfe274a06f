"""The motion of a stored study once more, inside the limits of a drive.

Each limit holds with what interpolation, rounding and the position loop may add, so that the export
of the new motion keeps the limit itself. The new motion is a local optimum, found from the paper's
Bezier law.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

from models.laws import Law
from ocp import OcpError, solve
from studies.common.console import silent
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.result import Result
from studies.drive.additions import additions, on_the_rope, wound_peaks
from studies.drive.course import DRUM, Course
from studies.drive.schema import Drive
from studies.drive.setpoints import SetPoints
from studies.export.round_trip import Breach, Slack
from studies.truss.expressions import Reserve

ITERATIONS = 1000  # for one motion: what has a solution takes up to 200
KEPT = 1e-5  # of a limit: what the solver may leave beyond it, and the replay of it
MORE = 1.5  # times what a played motion is above a limit: the next one is another motion
_OF_A_BREACH = {  # key of the drive, by the name of the limit in a record
    "speed": "speed",
    "acceleration": "acceleration",
    "jerk": "jerk",
    "rope force": "force",
    "motor power": "power",
    "motor speed": "motor_speed",
    "motor torque": "motor_torque",
    "torque-speed curve": "torque_speed",
}
_SMOOTHER = (
    "take the interpolation hermite on a drum of one layer, or remove drive.jerk and lower "
    "caps.rope_jerk of the study instead"
)


def nearer(inside: Drive, breaches: Sequence[Breach | Slack]) -> Drive:
    """Lower limits for the next motion, after one that was found inside of `inside` broke limits.

    What the bounds of `lowered` do not know adds to that motion: the stretch of a rope is wound in
    with a speed and an acceleration of its own.
    """
    changes: dict[str, Any] = {}
    for breach in breaches:
        if not isinstance(breach, Breach) or not breach.value > breach.limit:
            continue
        key, share = _OF_A_BREACH[breach.name], 1 - MORE * (1 - breach.limit / breach.value)
        limit = getattr(inside, key)
        if key == "torque_speed":  # with both of a corner each share of the curve is larger
            changes[key] = tuple((share * speed, share * torque) for speed, torque in limit)
        else:
            changes[key] = share * limit
    return dataclasses.replace(inside, **changes)


def lowered(course: Course, points: SetPoints, drive: Drive, kind: str) -> tuple[Drive, Reserve]:
    """The drive with lower limits of the rope's motion, and what its other limits have to bear.

    What is added to a speed, an acceleration or a jerk is the same everywhere. What an acceleration
    adds to a force depends on the angle.

    Raises
    ------
    StudyError
        If a bound leaves nothing of a limit, or has no finite value.
    """
    found, acceleration = additions(course, points, drive, kind), course.peaks[1]
    if course.signal == DRUM:
        found = on_the_rope(found, course, drive.drum)
        _, _, acceleration = wound_peaks(course, drive.drum)
    gain, more = found.acceleration_gain, found.acceleration

    lower: dict[str, Any] = {
        name: limit * (1 - KEPT)
        for name in ("force", "power", "motor_speed", "motor_torque")
        if (limit := getattr(drive, name)) is not None
    }
    lower["speed"] = _less("speed", drive.speed, found.speed)
    lower["acceleration"] = _less("acceleration", drive.acceleration, more, gain)
    lower["jerk"] = _less("jerk", drive.jerk, found.jerk, found.jerk_gain)
    within = dataclasses.replace(drive, **lower)
    return within, Reserve(found.speed, more + (gain - 1.0) * acceleration)


def _less(name: str, limit: float | None, less: float, divided: float = 1.0) -> float | None:
    """A limit, less what is added to what it limits; None where there is none."""
    if limit is None:
        return None
    if not math.isfinite(less):  # of a jerk
        raise StudyError(
            f"the {name} has no bound between the points of this table, so that --within-limits "
            f"cannot keep its limit; {_SMOOTHER}"
        )
    kept = (limit - less) / divided * (1 - KEPT)
    if kept <= 0:
        raise StudyError(
            f"interpolation and rounding may add {less:.4g} to the {name}, but its limit is "
            f"{limit:g}",
            ExitCode.NOT_SOLVED,
        )
    return kept


def law_within(
    result: Result, drive: Drive, limits: tuple[Drive, Reserve], tension: float = 0.0
) -> Law:
    """The best motion of a stored study that keeps the limits of a drive, too.

    Parameters
    ----------
    limits : as `lowered` gives them.
    tension : by which the least tension that the study allows is raised [N].

    Raises
    ------
    StudyError
        If none was found.
    """
    from studies.truss.motions.laws import law_of, study_of
    from studies.truss.motions.starts import starting_motion
    from studies.truss.problem import needs_forces, settings_of, state
    from studies.truss.search.proofs import check_some_optimum

    stored = study_of(result)
    # what is impossible by proof is said with the limits as the user states them
    check_some_optimum(dataclasses.replace(stored, drive=drive), silent())

    within, reserve = limits
    caps = dataclasses.replace(stored.caps, least_tension=stored.caps.least_tension + tension)
    study = dataclasses.replace(stored, drive=within, caps=caps)
    references = {row.key: abs(next(iter(row.values.values()))) for row in result.table}
    single = all(len(stage) == 1 for stage in study.minimise)
    weights = dict.fromkeys(references, 1.0) if single else references

    start, forces = starting_motion("bezier", study), needs_forces(study)
    statement = state(study, start, weights, forces, reserve=reserve)
    settings = dataclasses.replace(settings_of(study, forces), iterations=ITERATIONS)
    try:
        solution = solve(statement.problem(), settings=settings, partial=False)
    except OcpError as error:
        taut = f", with {tension:.3g} N more in every rope" if tension else ""
        raise StudyError(
            "no motion was found that keeps the limits and leaves room for what interpolation, "
            f"rounding and loop may add to the rope: {reserve.speed:.3g} m/s and "
            f"{reserve.acceleration:.3g} m/s^2{taut}; this is no proof that there is none",
            ExitCode.NOT_SOLVED,
        ) from error
    return law_of(study, statement, solution)
