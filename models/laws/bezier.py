"""The paper's second law: a Bezier curve of the angle over time, (41)-(45)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from models.arrays import Array
from models.errors import require
from models.laws.motion import AngularMotion, check_duration, check_stroke, law_times

# Control points [rad] as printed below (45); they miss 4.4 deg by 5.5e-6 and 90 deg by 3.7e-6 rad.
PAPER_POINTS = (0.0768, 0.0768, 0.0768, 0.4465, 0.8152, 1.2169, 1.5708, 1.5708, 1.5708)
PAPER_RANGE = (math.radians(4.4), math.pi / 2)  # [rad], the angles that they stand for


@dataclass(frozen=True)
class Bezier:
    """Angle sum P_i B_i,N(t/T) of any degree N, (41)-(42).

    Three equal points at an end give zero speed and acceleration there, (45).

    Attributes
    ----------
    duration : T [s].
    points : P_0..P_N [rad].

    Raises
    ------
    ModelError
        If the duration is not positive, or the points are fewer than two, not finite or do not
        lead to a greater angle.
    """

    duration: float
    points: tuple[float, ...] = PAPER_POINTS

    def __post_init__(self) -> None:
        check_duration(self.duration)

        points = tuple(float(point) for point in self.points)
        object.__setattr__(self, "points", points)
        require(len(points) >= 2, f"a Bezier law has {len(points)} points; give at least 2.")
        require(all(map(math.isfinite, points)), f"points are {points}; give finite angles.")
        check_stroke(points[0], points[-1])

    @property
    def start_angle(self) -> float:
        """P_0 [rad]."""
        return self.points[0]

    @property
    def end_angle(self) -> float:
        """P_N [rad]."""
        return self.points[-1]

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """None: the law is one polynomial."""
        return ()

    def motion(self, time: ArrayLike) -> AngularMotion:
        """Motion at times (m,) in [0, T]; derivatives are curves of the points' differences."""
        t = law_times(time, self.duration)

        # each derivative by t = T s brings a factor 1/T
        angle, speed, acceleration, jerk = (
            bernstein_curve(derivative_points(self.points, order), t / self.duration)
            / self.duration**order
            for order in range(4)
        )

        return AngularMotion(time=t, angle=angle, speed=speed, acceleration=acceleration, jerk=jerk)


def pinned(points: Sequence[float], start_angle: float, end_angle: float) -> tuple[float, ...]:
    """Set the first and last three points to the angles, so that (45) holds exactly.

    Raises
    ------
    ModelError
        If there are fewer than six points.
    """
    require(len(points) >= 6, f"{len(points)} points cannot be pinned; give at least 6.")
    return (start_angle,) * 3 + tuple(points[3:-3]) + (end_angle,) * 3


def paper_points(start_angle: float, end_angle: float) -> tuple[float, ...]:
    """The paper's points for a motion between two angles [rad], pinned to them.

    The middle points move with the range, so that the law has the same shape in any range; in
    the paper's own range they are the printed ones, to the last digit.
    """
    start, end = PAPER_RANGE
    points = [
        point
        + (start_angle - start) * (end - point) / (end - start)
        + (end_angle - end) * (point - start) / (end - start)
        for point in PAPER_POINTS
    ]
    return pinned(points, start_angle, end_angle)


def derivative_points(points: Sequence[float], order: int) -> Array:
    """Control points of the derivative of given order by s, shape (N + 1 - order,) or (1,) zero."""
    degree = len(points) - 1
    if order > degree:
        return np.zeros(1)
    return math.perm(degree, order) * np.diff(np.asarray(points, dtype=float), n=order)


def bernstein_curve(points: ArrayLike, s: Array) -> Array:
    """Value (m,) of the Bezier curve with `points` at s (m,) in [0, 1], (41)-(42)."""
    control = np.asarray(points, dtype=float)
    degree = control.size - 1

    i = np.arange(degree + 1)
    choose = np.array([math.comb(degree, k) for k in i], dtype=float)
    basis = choose * s[:, None] ** i * (1 - s[:, None]) ** (degree - i)
    return np.asarray(basis @ control)
