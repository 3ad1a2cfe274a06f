"""Simple laws that serve as guesses: a straight line, and a wait before another law."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from models.errors import require
from models.laws.motion import AngularMotion, Law, Stroke, law_times


@dataclass(frozen=True)
class StraightLine(Stroke):
    """Constant speed from start to end; it starts and stops abruptly, so it breaks (45)."""

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """None."""
        return ()

    def motion(self, time: ArrayLike) -> AngularMotion:
        """Motion at times (m,) in [0, T]."""
        t = law_times(time, self.duration)
        speed = (self.end_angle - self.start_angle) / self.duration

        # the jumps of the speed at both ends do not show in the derivatives inside
        rest = np.zeros_like(t)
        return AngularMotion(t, self.start_angle + speed * t, rest + speed, rest, rest)


@dataclass(frozen=True)
class Dwell:
    """Wait at the start angle, then play another law: it dawdles, then swings.

    Attributes
    ----------
    law : the law to play.
    wait : time at rest before it [s].

    Raises
    ------
    ModelError
        If the wait is not positive and finite.
    """

    law: Law
    wait: float

    def __post_init__(self) -> None:
        require(0 < self.wait < math.inf, f"wait is {self.wait!r} s; give a positive finite time.")

    @property
    def duration(self) -> float:
        """Wait and law together [s]."""
        return self.wait + self.law.duration

    @property
    def start_angle(self) -> float:
        """Of the law [rad]."""
        return self.law.start_angle

    @property
    def end_angle(self) -> float:
        """Of the law [rad]."""
        return self.law.end_angle

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """End of the wait, then those of the law."""
        return (self.wait, *(self.wait + time for time in self.law.breakpoints))

    def motion(self, time: ArrayLike) -> AngularMotion:
        """Motion at times (m,) in [0, T]."""
        t = law_times(time, self.duration)
        waiting = t < self.wait

        # The law is defined on its own interval only: while waiting its start is looked up.
        played = self.law.motion(np.clip(t - self.wait, 0.0, self.law.duration))

        return AngularMotion(
            time=t,
            angle=np.where(waiting, self.law.start_angle, played.angle),
            speed=np.where(waiting, 0.0, played.speed),
            acceleration=np.where(waiting, 0.0, played.acceleration),
            jerk=np.where(waiting, 0.0, played.jerk),
        )
