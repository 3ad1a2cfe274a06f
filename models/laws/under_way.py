"""A law that is under way at its start: another one, from rest, and a speed that fades."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from models.errors import require_not_negative, require_positive
from models.laws.motion import AngularMotion, DerivedLaw


@dataclass(frozen=True)
class UnderWay(DerivedLaw):
    """Another law plus the motion of a speed v0 (1 - t/tau)^2, which ends with the law's end.

    Where neither runs backwards, the sum does not.

    Attributes
    ----------
    law : Law
    start_speed : v0 [rad/s].
    fading : tau [s], within the law's duration.

    Raises
    ------
    ModelError
        If the speed is negative, or the time is not positive and finite.
    """

    start_speed: float
    fading: float

    def __post_init__(self) -> None:
        require_not_negative("UnderWay", start_speed=self.start_speed)
        require_positive("UnderWay", fading=self.fading)

    @property
    def start_angle(self) -> float:
        """That of the other law, less what the speed adds."""
        return self.law.start_angle - self.start_speed * self.fading / 3

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Those of the other law, and where the speed has faded [s]."""
        inside = [self.fading] if self.fading < self.duration else []
        return tuple(sorted({*self.law.breakpoints, *inside}))

    def motion(self, time: ArrayLike) -> AngularMotion:
        """Motion at times (m,) in [0, T]."""
        other = self.law.motion(time)
        left = np.maximum(1 - other.time / self.fading, 0.0)
        v0, tau = self.start_speed, self.fading
        return AngularMotion(
            other.time,
            other.angle - v0 * tau / 3 * left**3,
            other.speed + v0 * left**2,
            other.acceleration - 2 * v0 / tau * left,
            other.jerk + 2 * v0 / tau**2 * (left > 0),
        )
