"""A law between two rests: what a drive that waits before and after does."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from models.laws.motion import AngularMotion, Law


@dataclass(frozen=True)
class BetweenRests:
    """Another law, at rest for a while before and after it.

    Attributes
    ----------
    law : Law
    before, after : rests, not negative [s].
    """

    law: Law
    before: float
    after: float

    @property
    def duration(self) -> float:
        """Rests included [s]."""
        return self.before + self.law.duration + self.after

    @property
    def start_angle(self) -> float:
        """Angle at time 0 [rad]."""
        return self.law.start_angle

    @property
    def end_angle(self) -> float:
        """Angle at the end [rad]."""
        return self.law.end_angle

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Inner times at which pieces meet [s], where the rests end and begin among them."""
        ends = [self.before] if self.before > 0.0 else []
        last = [self.before + self.law.duration] if self.after > 0.0 else []
        return (*ends, *(self.before + t for t in self.law.breakpoints), *last)

    def motion(self, time: ArrayLike) -> AngularMotion:
        """Motion at times (m,) in [0, T]; where a derivative jumps, that behind the jump."""
        times = np.asarray(time, dtype=float)
        own = times - self.before
        moving = (own >= 0.0) & ((own < self.law.duration) | (self.after == 0.0))

        found = self.law.motion(np.clip(own, 0.0, self.law.duration))
        rates = (
            np.where(moving, row, 0.0) for row in (found.speed, found.acceleration, found.jerk)
        )
        return AngularMotion(times, found.angle, *rates)
