"""A law through rows that give angle, speed and acceleration."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from models.arrays import Array
from models.errors import require
from models.laws.motion import AngularMotion, increasing, law_times

_JUMP = 1e-6  # of the greatest acceleration: less is rounding
_SHORTEST = 1e-6  # of the duration: across shorter pieces, differences of angles are rounding
_ROUNDING = 8 * float(
    np.finfo(float).eps
)  # of the largest angle: what a step of the angle may be off


@dataclass(frozen=True, eq=False)
class Hermite:
    """Quintic pieces between rows; angle and speed are continuous, the acceleration may jump.

    Where it jumps anywhere the jerk is given as NaN: it has no bound.

    Each piece takes angle, speed and acceleration of the rows at its two ends (quintic Hermite
    interpolation), so that it is as accurate as a Taylor series of the fifth degree.

    Attributes
    ----------
    times : 0 = t_0 < ... < t_m [s].
    angles, speeds : [rad, rad/s], shape (m + 1,).
    accelerations : behind each row [rad/s^2], shape (m + 1,).
    before : accelerations before each row [rad/s^2], shape (m + 1,).
    gains, turns : what the speed gains from row to row [rad/s], and by how much more the angle
        turns than at the first row's speed [rad], shape (m,) each; from the rows themselves by
        default. Between close rows those differences are rounding, so whoever integrates an
        acceleration states them.
    forwards : whether a speed below zero between rows counts as none. Noise makes such speeds where
        none of the rows has one.
    highest : angle beyond which no row is, and the law counts as there [rad].

    Raises
    ------
    ModelError
        If the columns differ in length, the times do not start at 0 and increase, or a value is
        not finite.
    """

    times: Array
    angles: Array
    speeds: Array
    accelerations: Array
    before: Array
    gains: Array | None = None
    turns: Array | None = None
    forwards: bool = False
    highest: float = math.inf

    def __post_init__(self) -> None:
        columns = (self.times, self.angles, self.speeds, self.accelerations, self.before)
        sizes = {np.shape(column) for column in columns}
        require(
            len(sizes) == 1 and np.size(self.times) >= 2,
            f"the columns of the rows have the shapes {sorted(sizes)}; give columns of one length.",
        )
        require(
            self.times[0] == 0 and increasing(self.times.tolist()),
            "the times of the rows do not increase from 0; sort and shift them.",
        )
        require(bool(np.isfinite(columns).all()), "a row is not finite; give finite values.")

    @property
    def duration(self) -> float:
        """T [s]."""
        return float(self.times[-1])

    @property
    def start_angle(self) -> float:
        """First angle [rad]."""
        return float(self.angles[0])

    @property
    def end_angle(self) -> float:
        """Last angle [rad]."""
        return float(self.angles[-1])

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """The inner times: the third derivative may jump there, the acceleration too."""
        return tuple(self.times[1:-1].tolist())

    def motion(self, time: ArrayLike) -> AngularMotion:
        """Motion at times (m,) in [0, T]."""
        t = law_times(time, self.duration)

        # at a row the piece to its right counts
        piece = np.searchsorted(self.times[1:-1], t, side="right")
        h = np.diff(self.times)[piece]
        s = (t - self.times[piece]) / h
        c = self._coefficients[:, piece]
        values = []
        for order in range(4):
            value = np.zeros_like(t)
            for k in range(5, order - 1, -1):  # Horner's rule on the derivative
                factor = float(np.prod(np.arange(k - order + 1, k + 1)))
                value = value * s + factor * c[k]
            values.append(value / h**order)
        values[0] = np.minimum(values[0], self.highest)
        if self.forwards:
            values[1] = np.maximum(values[1], 0.0)
        if self._jumps:  # the jerk has no bound then, and that of the pieces would say little
            values[3] = np.full_like(t, np.nan)
        return AngularMotion(t, *values)

    @functools.cached_property
    def _jumps(self) -> bool:
        """Whether the acceleration jumps at an inner row."""
        gaps = np.abs(self.accelerations - self.before)[1:-1]
        return bool((gaps > _JUMP * np.abs(self.before).max()).any())

    @functools.cached_property
    def _coefficients(self) -> Array:
        """Of the powers of local time from 0 to 1, (6, m)."""
        h = np.diff(self.times)
        angle, speed = self.angles[:-1], h * self.speeds[:-1]
        first, last = h**2 * self.accelerations[:-1], h**2 * self.before[1:]

        # what the quadratic from the left end misses at the right end
        turns = self.angles[1:] - angle - speed if self.turns is None else self.turns
        gains = np.diff(self.speeds) if self.gains is None else self.gains
        miss = turns - first / 2
        rate = h * gains - first
        bend = last - first
        cubic = 10 * miss - 4 * rate + bend / 2
        quartic = -15 * miss + 7 * rate - bend
        quintic = 6 * miss - 3 * rate + bend / 2

        # Across a short piece the speed alone is interpolated, and the angle is its integral: a
        # speed that jumped between pieces would be kinetic energy from nowhere. So it is wherever
        # what the angles add to the speeds is rounding, which 1/h^2 makes an acceleration.
        rounding = _ROUNDING * np.abs(self.angles).max()
        added = np.abs(miss - (rate / 2 - bend / 12))
        short = (h < _SHORTEST * self.duration) | (added < rounding)
        short &= self.turns is None
        cubic = np.where(short, rate - bend / 3, cubic)
        quartic = np.where(short, bend / 4 - rate / 2, quartic)
        quintic = np.where(short, 0.0, quintic)
        return np.stack([angle, speed, first / 2, cubic, quartic, quintic])
