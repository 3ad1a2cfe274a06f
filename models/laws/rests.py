"""A law between two rests: what a drive that waits before and after does."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from models.errors import require
from models.laws.motion import AngularMotion, DerivedLaw, law_times


@dataclass(frozen=True)
class BetweenRests(DerivedLaw):
    """Another law, at rest for a while before and after it.

    Attributes
    ----------
    law : Law
    before, after : rests [s].

    Raises
    ------
    ModelError
        If a rest is negative or not finite.
    """

    before: float = 0.0
    after: float = 0.0

    def __post_init__(self) -> None:
        for rest in (self.before, self.after):
            require(0 <= rest < math.inf, f"a rest is {rest!r} s; give a finite time from 0 on.")

    @property
    def duration(self) -> float:
        """Rests included [s]."""
        return self.before + self.law.duration + self.after

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Inner times at which pieces meet [s], where the rests end and begin among them."""
        ends = [self.before] if self.before > 0.0 else []
        last = [self.before + self.law.duration] if self.after > 0.0 else []
        return (*ends, *(self.before + t for t in self.law.breakpoints), *last)

    def motion(self, time: ArrayLike) -> AngularMotion:
        """Motion at times (m,) in [0, T]; where a derivative jumps, that behind the jump."""
        times = law_times(time, self.duration)
        own = times - self.before
        moving = (own >= 0.0) & ((own < self.law.duration) | (self.after == 0.0))

        # the law is defined on its own interval only: at rest its ends are looked up
        found = self.law.motion(np.clip(own, 0.0, self.law.duration))
        rates = (
            np.where(moving, row, 0.0) for row in (found.speed, found.acceleration, found.jerk)
        )
        return AngularMotion(times, found.angle, *rates)
