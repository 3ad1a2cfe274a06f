"""The paper's first law: a quintic step of the angular velocity, (39)-(40)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from models.laws.motion import AngularMotion, Stroke, law_times


@dataclass(frozen=True)
class Step5(Stroke):
    """Velocity up by a quintic step on [0, T/2] and down on [T/2, T], (39)-(40).

    The peak velocity is 2 (end_angle - start_angle)/T. It is not a quintic in the angle.
    """

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Half time, where the two steps meet."""
        return (self.duration / 2,)

    def motion(self, time: ArrayLike) -> AngularMotion:
        """Motion at times (m,) in [0, T]; the second half mirrors the first."""
        t = law_times(time, self.duration)
        half = self.duration / 2
        late = t > half

        # x runs from 0 to 1 up to half time and back again
        x = np.where(late, self.duration - t, t) / half
        peak = (self.end_angle - self.start_angle) / half
        gain = peak * half * x**4 * (2.5 + x * (x - 3))  # angle from the nearer end

        return AngularMotion(
            time=t,
            angle=np.where(late, self.end_angle - gain, self.start_angle + gain),
            speed=peak * x**3 * (10 + x * (6 * x - 15)),
            acceleration=np.where(late, -1, 1) * peak / half * 30 * x**2 * (1 - x) ** 2,
            jerk=peak / half**2 * 60 * x * (1 - x) * (1 - 2 * x),
        )
