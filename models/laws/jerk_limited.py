"""The law of least peak acceleration under a jerk cap, in closed form."""

from __future__ import annotations

import functools
from dataclasses import dataclass

from numpy.typing import ArrayLike

from models.laws.bounds import least_peak_acceleration
from models.laws.motion import AngularMotion, Stroke
from models.laws.piecewise import Piecewise, constant_jerk


@dataclass(frozen=True)
class JerkLimited(Stroke):
    """The law of least peak acceleration under a jerk cap, from rest to rest.

    The acceleration is a trapezoid up and its mirror image down, with ramps of slope `jerk`; its
    peak is (j T/4) (1 - sqrt(1 - 32 D/(j T^3))), D the stroke.

    Attributes
    ----------
    jerk : cap j [rad/s^3].

    Raises
    ------
    ModelError
        If j T^3 < 32 D (the message names the least feasible cap); see `Stroke`.
    """

    jerk: float

    def __post_init__(self) -> None:
        super().__post_init__()
        _ = self.peak_acceleration  # refuses an infeasible cap

    @functools.cached_property
    def peak_acceleration(self) -> float:
        """A [rad/s^2]."""
        stroke = self.end_angle - self.start_angle
        return least_peak_acceleration(stroke, self.duration, jerk=self.jerk)

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Ends of the ramps."""
        return self.profile.breakpoints

    @functools.cached_property
    def profile(self) -> Piecewise:
        """The law as pieces of constant jerk."""
        total, ramp = self.duration, self.peak_acceleration / self.jerk
        times = [0.0, ramp, total / 2 - ramp, total / 2 + ramp, total - ramp, total]
        signs = [1, 0, -1, 0, 1]

        # At the least feasible cap the trapezoids are triangles, and pieces of no length go.
        held = times[2] - times[1] > 1e-12 * total
        if not held:
            times, signs = [0.0, total / 4, 3 * total / 4, total], [1, -1, 1]

        jerks = tuple(sign * self.jerk for sign in signs)
        return constant_jerk(times, jerks, self.start_angle)

    def motion(self, time: ArrayLike) -> AngularMotion:
        """Motion at times (m,) in [0, T]."""
        return self.profile.motion(time)
