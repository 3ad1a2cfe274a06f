"""What a motion law is: a deployment angle over time with exact derivatives."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from models.arrays import Array
from models.errors import require
from models.numerics import dense_peak


@dataclass(frozen=True, eq=False)
class AngularMotion:
    """Histories of a law, all of shape (m,).

    Attributes
    ----------
    time : [s].
    angle, speed, acceleration, jerk : [rad, rad/s, rad/s^2, rad/s^3].
    """

    time: Array
    angle: Array
    speed: Array
    acceleration: Array
    jerk: Array


class Law(Protocol):
    """A motion law on [0, duration].

    `breakpoints` are the times strictly inside at which its pieces meet, where the jerk or a
    derivative of it may jump: meshes and quadratures should split there.
    """

    @property
    def duration(self) -> float:
        """T [s]."""
        ...

    @property
    def start_angle(self) -> float:
        """Angle at time 0 [rad]."""
        ...

    @property
    def end_angle(self) -> float:
        """Angle at T [rad]."""
        ...

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Inner times at which pieces meet [s]."""
        ...

    def motion(self, time: ArrayLike) -> AngularMotion:
        """Motion at times (m,) in [0, T]."""
        ...


@dataclass(frozen=True)
class DerivedLaw:
    """What is made from another law; times and ends are its own, unless a subclass says otherwise.

    Attributes
    ----------
    law : the other law.
    """

    law: Law

    @property
    def duration(self) -> float:
        """T [s]."""
        return self.law.duration

    @property
    def start_angle(self) -> float:
        """Angle at time 0 [rad]."""
        return self.law.start_angle

    @property
    def end_angle(self) -> float:
        """Angle at T [rad]."""
        return self.law.end_angle

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Inner times at which pieces meet [s]."""
        return self.law.breakpoints


@dataclass(frozen=True)
class Peaks:
    """Greatest absolute speed [rad/s], acceleration [rad/s^2] and jerk [rad/s^3] of a law."""

    speed: float
    acceleration: float
    jerk: float


def peaks(law: Law) -> Peaks:
    """Peaks of a law, located between samples as well as on them."""

    # Laws are smooth between breakpoints: a quarter of the usual samples shows every maximum.
    def peak(name: str) -> float:
        return dense_peak(
            lambda t: np.abs(getattr(law.motion(t), name)),
            0.0,
            law.duration,
            breakpoints=law.breakpoints,
            samples=501,
        ).value

    return Peaks(speed=peak("speed"), acceleration=peak("acceleration"), jerk=peak("jerk"))


def check_duration(duration: float) -> None:
    """Raise ModelError unless `duration` is positive and finite."""
    require(0 < duration < math.inf, f"duration is {duration!r} s; give a positive finite time.")


def check_stroke(start_angle: float, end_angle: float) -> None:
    """Raise ModelError unless the angles are finite and increase."""
    finite = math.isfinite(start_angle) and math.isfinite(end_angle)
    require(
        finite and start_angle < end_angle,
        f"the law runs from {start_angle!r} to {end_angle!r} rad; give start_angle < end_angle.",
    )


@dataclass(frozen=True)
class Stroke:
    """A turn between two angles in a given time: what several laws are stated by.

    Attributes
    ----------
    duration : T [s].
    start_angle, end_angle : [rad].

    Raises
    ------
    ModelError
        If the duration is not positive or the angles do not increase.
    """

    duration: float
    start_angle: float
    end_angle: float

    def __post_init__(self) -> None:
        check_duration(self.duration)
        check_stroke(self.start_angle, self.end_angle)


def law_times(time: ArrayLike, duration: float) -> Array:
    """Return times as an array (m,), refused outside [0, duration] but for rounding."""
    times = np.atleast_1d(np.asarray(time, dtype=float))
    slack = 1e-12 * duration  # rounding of times that were computed, as by linspace
    require(
        times.ndim == 1 and bool(np.all((times >= -slack) & (times <= duration + slack))),
        f"times must be one array within [0, {duration:g}] s; the law is not defined elsewhere.",
    )

    inside: Array = np.clip(times, 0.0, duration)
    return inside


def increasing(values: Sequence[float]) -> bool:
    """Whether all values are finite and each exceeds the one before."""
    array = np.asarray(values, dtype=float)
    return bool(np.isfinite(array).all() and (np.diff(array) > 0).all())
