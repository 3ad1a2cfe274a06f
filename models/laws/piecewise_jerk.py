"""Laws of piecewise constant jerk, integrated exactly; among them the least peak acceleration."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from models.errors import require
from models.laws.bounds import least_peak_acceleration
from models.laws.motion import Array, Motion, check_duration, check_stroke, increasing, law_times


@dataclass(frozen=True)
class PiecewiseJerk:
    """Constant jerk on each piece, from rest unless told otherwise.

    At a breakpoint the jerk is that of the piece to its right.

    Attributes
    ----------
    edges : times 0 = t_0 < ... < t_m [s].
    jerks : m values [rad/s^3].
    start_angle : [rad].
    start_speed, start_acceleration : [rad/s, rad/s^2].

    Raises
    ------
    ModelError
        If the edges do not start at 0 and increase, or the jerks do not match them.
    """

    edges: tuple[float, ...]
    jerks: tuple[float, ...]
    start_angle: float
    start_speed: float = 0.0
    start_acceleration: float = 0.0

    def __post_init__(self) -> None:
        for name in ("edges", "jerks"):
            object.__setattr__(self, name, tuple(float(value) for value in getattr(self, name)))
        require(
            len(self.edges) >= 2 and self.edges[0] == 0 and increasing(self.edges),
            f"edges are {self.edges} s; give at least two increasing times from 0.",
        )
        require(
            len(self.jerks) == len(self.edges) - 1 and all(map(math.isfinite, self.jerks)),
            f"{len(self.jerks)} jerks for {len(self.edges) - 1} pieces; give one finite jerk each.",
        )

    @property
    def duration(self) -> float:
        """T [s]."""
        return self.edges[-1]

    @property
    def end_angle(self) -> float:
        """Angle reached at T [rad]."""
        return float(self.motion(self.duration).angle[0])

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """The inner edges."""
        return self.edges[1:-1]

    def motion(self, time: ArrayLike) -> Motion:
        """Motion at times (m,) in [0, T]."""
        t = law_times(time, self.duration)
        piece = np.searchsorted(self.edges[1:-1], t, side="right")
        angle, speed, acceleration = self._states[piece].T
        jerk, dt = np.asarray(self.jerks)[piece], t - np.asarray(self.edges)[piece]
        angle, speed, acceleration = _advance(angle, speed, acceleration, jerk, dt)
        return Motion(time=t, angle=angle, speed=speed, acceleration=acceleration, jerk=jerk)

    @functools.cached_property
    def _states(self) -> Array:
        """Angle, speed and acceleration at the left edge of each piece, shape (m, 3)."""
        state = (self.start_angle, self.start_speed, self.start_acceleration)
        states = []
        for jerk, dt in zip(self.jerks, np.diff(self.edges), strict=True):
            states.append(state)
            state = _advance(*state, jerk, dt)
        return np.array(states)


def _advance(angle: Any, speed: Any, acceleration: Any, jerk: Any, dt: Any) -> tuple[Any, Any, Any]:
    """State after dt under constant jerk; numbers or arrays alike."""
    return (
        angle + dt * (speed + dt * (acceleration / 2 + dt * jerk / 6)),
        speed + dt * (acceleration + dt * jerk / 2),
        acceleration + dt * jerk,
    )


@dataclass(frozen=True)
class JerkLimited:
    """The law of least peak acceleration under a jerk cap, from rest to rest.

    The acceleration is a trapezoid up and its mirror image down, with ramps of slope `jerk`; its
    peak is (j T/4) (1 - sqrt(1 - 32 D/(j T^3))), D the stroke.

    Attributes
    ----------
    duration : T [s].
    start_angle, end_angle : [rad].
    jerk : cap j [rad/s^3].

    Raises
    ------
    ModelError
        If j T^3 < 32 D (the message names the least feasible cap), the duration is not positive
        or the angles do not increase.
    """

    duration: float
    start_angle: float
    end_angle: float
    jerk: float

    def __post_init__(self) -> None:
        check_duration(self.duration)
        check_stroke(self.start_angle, self.end_angle)
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
    def profile(self) -> PiecewiseJerk:
        """The law as pieces of constant jerk."""
        total, ramp = self.duration, self.peak_acceleration / self.jerk
        times = [0.0, ramp, total / 2 - ramp, total / 2 + ramp, total - ramp, total]
        signs = [1, 0, -1, 0, 1]
        held = times[2] - times[1] > 1e-12 * total  # else the trapezoids are triangles
        if not held:
            times, signs = [0.0, total / 4, 3 * total / 4, total], [1, -1, 1]
        jerks = tuple(sign * self.jerk for sign in signs)
        return PiecewiseJerk(edges=tuple(times), jerks=jerks, start_angle=self.start_angle)

    def motion(self, time: ArrayLike) -> Motion:
        """Motion at times (m,) in [0, T]."""
        return self.profile.motion(time)
