"""A straight line, which serves as a guess."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from models.laws.motion import AngularMotion, Stroke, law_times


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
