"""What a drive does between the points of its table, and how far that may be from the course.

A bound holds for the acceleration between the points. It has two parts, which are proven in
docs/explanation/drive.md: what the rounding of positions adds, and what the interpolation adds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ocp.arrays import Array
from studies.drive.course import Course
from studies.drive.setpoints import SetPoints


@dataclass(frozen=True)
class ErrorConstants:
    """How far an interpolation carries an error; the proofs are in docs/explanation/drive.md.

    Attributes
    ----------
    jerk : of the longest step times the peak jerk, that it adds to the acceleration.
    jump : of a jump of the acceleration, that it adds to the acceleration.
    rounding : of a count over the step squared, that rounded positions add to the acceleration.
    position : of a count, that rounded positions add to the position.
    rounded_speed : of a count over the step, that they add to the speed.
    rounded_jerk : of a count over the step cubed, that they add to the jerk.
    """

    jerk: float
    jump: float
    rounding: float
    position: float
    rounded_speed: float
    rounded_jerk: float


ERROR_CONSTANTS = {
    # of the second difference, not between the points
    "linear": ErrorConstants(0.0, 0.0, 2.0, 0.5, 1.0, math.inf),
    "hermite": ErrorConstants(8 / 27, 1.0, 6.0, 1.39, 3.0, 12.0),
    "spline": ErrorConstants(4 / math.sqrt(27), 2.0, 6.0, 1.39, 3.0, 12.0),
    "quintic": ErrorConstants(5 / 24, 1.0, 23.1, 1.44, 4.5, 240.0),
}
# of a rounded velocity's step: over the step in time, in a cubic Hermite segment, that it adds to
VELOCITY = 3.0  # the acceleration,
VELOCITY_JERK = 6.0  # and, over the step squared, the jerk
PROJECTION = 2.18  # norm of the projection on quadratics: what a quintic makes of a jerk


def jerk_gain(points: SetPoints, kind: str) -> float:
    """How many times the peak jerk of a course an interpolation of exact points may have."""
    if kind == "spline":  # two ends of a segment, whose accelerations are off by a step's worth
        return 1.0 + 2 * ERROR_CONSTANTS[kind].jerk * points.longest / points.shortest
    return {"hermite": 1.0, "quintic": PROJECTION}.get(kind, math.inf)


def interpolated(points: SetPoints, kind: str) -> Any:
    """The piecewise polynomial of a table, as a SciPy `PPoly` from its first time to its last."""
    from scipy.interpolate import BPoly, CubicHermiteSpline, CubicSpline, PPoly

    t, x = points.times, points.positions
    if kind == "hold":
        return PPoly(x[None, :-1], t)
    if kind == "linear":
        return PPoly(np.stack([np.diff(x) / np.diff(t), x[:-1]]), t)
    if kind == "hermite":
        return CubicHermiteSpline(t, x, points.velocities)
    if kind == "spline":
        return CubicSpline(t, x, bc_type=((1, float(points.velocities[0])), (1, 0.0)))

    ends = np.stack([x, points.velocities, points.accelerations], axis=1)
    return PPoly.from_bernstein_basis(BPoly.from_derivatives(t, ends))


def second_differences(points: SetPoints) -> Array:
    """Mean acceleration about each inner point: the step of the slope over the mean step."""
    steps = np.diff(points.times)
    return np.diff(np.diff(points.positions) / steps) / ((steps[1:] + steps[:-1]) / 2)


@dataclass(frozen=True)
class AccelerationBound:
    """The most that the acceleration can be; see `acceleration_bound`.

    Attributes
    ----------
    course : peak of the course itself.
    interpolation, rounding : what these two add.
    """

    course: float
    interpolation: float
    rounding: float

    @property
    def total(self) -> float:
        """All together."""
        return self.course + self.interpolation + self.rounding


def acceleration_bound(course: Course, points: SetPoints, kind: str) -> AccelerationBound | None:
    """The most that the acceleration between the points can be; None where it has no bound.

    Of a linear interpolation it is the bound of the second differences.
    """
    if kind == "hold":
        return None
    _, peak, jerk = course.peaks
    constants = ERROR_CONSTANTS[kind]

    step = np.diff(points.times)
    neighbours = step[1:] * step[:-1] if step.size > 1 else step**2
    # a quintic's error stays within a segment; a spline's reaches its neighbour
    spacing = float((step**2).min() if kind == "quintic" else neighbours.min())

    rounding = constants.rounding * (points.count or 0.0) / spacing
    if kind == "hermite":
        rounding += VELOCITY * points.velocity_step / points.shortest
    interpolation = constants.jerk * points.longest * jerk + constants.jump * course.jump
    return AccelerationBound(peak, interpolation, rounding)
