"""The motion of a stored study once more, inside the limits of a drive.

Each limit is lowered by what interpolation and rounding may add to it, so that the export of the
new motion keeps the limit itself. The new motion is a local optimum, found from the paper's Bezier
law.
"""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from models.laws import Law
from models.truss import TrussParameters, force_coefficients, rope_speed
from ocp import OcpError, Settings, solve
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.result import Result
from studies.drive.course import Course
from studies.drive.interpolation import ERROR_CONSTANTS, acceleration_bound
from studies.drive.motor import rope_force_of
from studies.drive.playback import loop_of
from studies.drive.schema import Drive
from studies.drive.setpoints import SetPoints

if TYPE_CHECKING:
    from studies.truss.config import TrussStudy

ANGLES = 400  # at which the force that an acceleration of the rope takes is looked at
KEPT = 1e-5  # of a limit: what the solver may leave beyond it, and the replay of it


@dataclasses.dataclass(frozen=True)
class RopeLimits:
    """Limits of a rope, infinite where there are none.

    Attributes
    ----------
    speed, acceleration : [m/s, m/s^2].
    force, power : on one rope [N], of both motors [W].
    """

    speed: float = math.inf
    acceleration: float = math.inf
    force: float = math.inf
    power: float = math.inf


def lowered_limits(
    course: Course, points: SetPoints, drive: Drive, kind: str, truss: TrussParameters
) -> RopeLimits:
    """The drive's limits less the bounds of interpolation and rounding.

    Raises
    ------
    StudyError
        If a bound leaves nothing of a limit, or has no finite value.
    """
    if drive.jerk is not None:
        raise StudyError(
            "--within-limits cannot bound the rope's jerk yet; remove drive.jerk and lower "
            "caps.jerk of the study instead"
        )
    speed_limit, force_limit = _limits_with_the_motor(drive)
    gain, added = _added_acceleration(course, points, drive, kind)
    speed = added * points.longest if points.count is None else _added_speed(points, drive, added)
    force = _force_per_acceleration(truss) * (added + (gain - 1.0) * course.peaks[1])
    top = course.peaks[0]

    def left(name: str, limit: float | None, less: float, divided: float = 1.0) -> float:
        if limit is None:
            return math.inf
        kept = (limit - less) / divided * (1 - KEPT)
        if kept <= 0:
            raise StudyError(
                f"interpolation and rounding may add {less:.4g} to the {name}, but its limit is "
                f"{limit:g}; take more counts, another step or another interpolation",
                ExitCode.INFEASIBLE,
            )
        return kept

    pull = left("rope force", force_limit, force)
    most_pull = pull if math.isfinite(pull) else (drive.power or 0.0) / max(2 * top, 1e-12)
    return RopeLimits(
        speed=left("speed", speed_limit, speed),
        acceleration=left("acceleration", drive.acceleration, added, gain),
        force=pull,
        power=left("motor power", drive.power, 2 * (top * force + most_pull * speed)),
    )


def _limits_with_the_motor(drive: Drive) -> tuple[float | None, float | None]:
    """Speed and force of a rope within the limits of rope and shaft; None where there are none.

    A drum of one layer is meant: counts of any other are refused.
    """
    speeds, forces = [drive.speed], [drive.force]
    if drive.motor_speed is not None:
        speeds.append(drive.motor_speed * drive.radius / drive.gear_ratio)
    if drive.motor_torque is not None:
        forces.append(rope_force_of(drive, drive.motor_torque))
    return (
        min((limit for limit in speeds if limit is not None), default=None),
        min((limit for limit in forces if limit is not None), default=None),
    )


def _added_acceleration(
    course: Course, points: SetPoints, drive: Drive, kind: str
) -> tuple[float, float]:
    """By what the course's acceleration is multiplied at most, and what is added to it."""
    loop = loop_of(drive)
    bound = acceleration_bound(course, points, kind)
    if bound is None or (kind == "linear" and loop is None):
        raise StudyError(
            f"the interpolation {kind} has no bounded acceleration by itself; state "
            "drive.bandwidth, or an interpolation that is hermite, spline or quintic",
        )
    if loop is None:
        return 1.0, bound.interpolation + bound.rounding
    rounded = loop.curvature * ERROR_CONSTANTS[kind].position * (points.count or 0.0)
    if kind == "linear":
        even = points.longest / points.shortest
        return max(1.0, loop.impulses(points.shortest) * even), rounded
    return 1.0, bound.interpolation + min(rounded, loop.overshoot * bound.rounding)


def _added_speed(points: SetPoints, drive: Drive, added: float) -> float:
    """What rounding adds to the speed: a count a step, or less behind a slow loop."""
    count = points.count or 0.0
    by_step = 2 * count / points.shortest
    loop = loop_of(drive)
    if loop is None:
        return by_step + added * points.longest
    return min(by_step, 2 * loop.frequency * loop.overshoot * count)


def _force_per_acceleration(truss: TrussParameters) -> float:
    """Force for each unit of the rope's acceleration, the most along the travel [N s^2/m]."""
    alpha = ca.SX.sym("alpha")
    ratio = force_coefficients(truss, alpha).inertial / rope_speed(truss, alpha, 1.0)
    angles = np.linspace(truss.stowed_angle, math.pi / 2, ANGLES)
    values = ca.Function("ratio", [alpha], [ratio])(angles[None]).full()
    return float(np.abs(values).max())


def law_within(result: Result, limits: RopeLimits) -> Law:
    """The best motion of a stored study under further limits of the rope.

    Raises
    ------
    StudyError
        If none was found.
    """
    from studies.truss.config import study_from
    from studies.truss.motions.laws import law_of
    from studies.truss.motions.starts import bezier_start
    from studies.truss.problem import needs_forces, state

    study = _within(study_from(result.configuration), limits)
    references = {row.key: abs(next(iter(row.values.values()))) for row in result.table}
    single = all(len(stage) == 1 for stage in study.minimise)
    weights = dict.fromkeys(references, 1.0) if single else references

    statement = state(study, bezier_start(study), weights, needs_forces(study))
    try:
        solution = solve(statement.problem(), settings=Settings(intervals=study.solver.intervals))
    except OcpError as error:
        stated = ", ".join(
            f"{name} {value:.4g}"
            for name, value in dataclasses.asdict(limits).items()
            if math.isfinite(value)
        )
        raise StudyError(
            f"no motion was found inside the limits less what the drive may add ({stated}): "
            f"{error}",
            ExitCode.INFEASIBLE,
        ) from error
    return law_of(study, statement, solution)


def _within(study: TrussStudy, limits: RopeLimits) -> TrussStudy:
    """The study with its caps lowered to the limits."""
    lowered = {}
    for cap, limit in (
        ("rope_speed", limits.speed),
        ("rope_acceleration", limits.acceleration),
        ("force", limits.force),
        ("power", limits.power),
    ):
        stated = getattr(study.caps, cap)
        if math.isfinite(limit):
            lowered[cap] = limit if stated is None else min(stated, limit)
    return dataclasses.replace(study, caps=dataclasses.replace(study.caps, **lowered))
