"""Laws whose acceleration is a polynomial on each piece, integrated exactly."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from models.arrays import Array
from models.errors import require
from models.laws.motion import AngularMotion, increasing, law_times

Pair = tuple[float, float]


@dataclass(frozen=True)
class Piecewise:
    """Acceleration of at most second degree on each piece, with jumps where it is told to.

    At a breakpoint acceleration and jerk are those of the piece to its right.

    Attributes
    ----------
    edges : times 0 = t_0 < ... < t_m [s].
    rates : m triples, the acceleration, the jerk and the slope of the jerk at the left edge of each
        piece [rad/s^2, rad/s^3, rad/s^4].
    start_angle, start_speed : [rad, rad/s].

    Raises
    ------
    ModelError
        If the edges do not start at 0 and increase, or the rates do not match them.
    """

    edges: tuple[float, ...]
    rates: tuple[tuple[float, float, float], ...]
    start_angle: float
    start_speed: float = 0.0

    def __post_init__(self) -> None:
        check_edges(self.edges, len(self.rates))
        require(bool(np.isfinite(self.rates).all()), "a piece is not finite; give finite values.")

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

    def motion(self, time: ArrayLike) -> AngularMotion:
        """Motion at times (m,) in [0, T]."""
        t = law_times(time, self.duration)

        # at a breakpoint the piece to its right counts
        piece = np.searchsorted(self.edges[1:-1], t, side="right")
        dt = t - np.asarray(self.edges)[piece]
        angle, speed, acceleration, jerk = _advance(self._states[piece].T, dt)
        return AngularMotion(time=t, angle=angle, speed=speed, acceleration=acceleration, jerk=jerk)

    @functools.cached_property
    def _states(self) -> Array:
        """Angle, speed and rates at the left edge of each piece, (m, 5)."""
        angle, speed, states = self.start_angle, self.start_speed, []

        for rates, dt in zip(self.rates, np.diff(self.edges).tolist(), strict=True):
            states.append((angle, speed, *rates))
            angle, speed = _advance(states[-1], dt)[:2]

        return np.array(states)


def check_edges(edges: Sequence[float], pieces: int) -> None:
    """Refuse edges that do not increase from 0 or do not match the number of pieces."""
    require(
        len(edges) >= 2 and edges[0] == 0 and increasing(edges),
        f"{len(edges)} edges do not increase from 0 s; give at least two increasing times from 0.",
    )
    require(
        pieces == len(edges) - 1,
        f"{pieces} values for {len(edges) - 1} pieces; give one for each piece.",
    )


def constant_acceleration(
    edges: Sequence[float], accelerations: Sequence[float], start_angle: float = 0.0
) -> Piecewise:
    """From rest, with a constant acceleration on each piece [rad/s^2]."""
    rates = tuple((float(a), 0.0, 0.0) for a in accelerations)
    return Piecewise(tuple(map(float, edges)), rates, start_angle)


def constant_jerk(
    edges: Sequence[float],
    jerks: Sequence[float],
    start_angle: float,
    start_speed: float = 0.0,
    start_acceleration: float = 0.0,
) -> Piecewise:
    """Continuous acceleration with a constant jerk on each piece [rad/s^3]; see `Piecewise`."""
    ramps = [(jerk, jerk) for jerk in jerks]
    return linear_jerk(edges, ramps, start_angle, start_speed, start_acceleration)


def linear_jerk(
    edges: Sequence[float],
    ramps: Sequence[Pair],
    start_angle: float,
    start_speed: float = 0.0,
    start_acceleration: float = 0.0,
) -> Piecewise:
    """Continuous acceleration with a jerk that is linear on each piece and may jump between them.

    Parameters
    ----------
    edges : times 0 = t_0 < ... < t_m [s].
    ramps : m pairs, the jerk at the start and at the end of each piece [rad/s^3].
    start_angle, start_speed, start_acceleration : [rad, rad/s, rad/s^2].

    Raises
    ------
    ModelError
        If the edges do not start at 0 and increase, or the ramps do not match them.
    """
    edges = tuple(map(float, edges))
    check_edges(edges, len(ramps))

    # Only the acceleration is carried from piece to piece here; `Piecewise` does the rest.
    acceleration, rates = float(start_acceleration), []
    for dt, (first, last) in zip(np.diff(edges).tolist(), ramps, strict=True):
        slope = (float(last) - float(first)) / dt
        rates.append((acceleration, float(first), slope))
        acceleration += dt * (float(first) + dt * slope / 2)
    return Piecewise(edges, tuple(rates), start_angle, start_speed)


def _advance(state: Any, dt: Any) -> Any:
    """Angle, speed, acceleration and jerk dt after a row of `Piecewise._states`, or many."""
    angle, speed, acceleration, jerk, slope = state

    # Taylor's polynomial, which is exact here, in Horner's form
    return (
        angle + dt * (speed + dt * (acceleration / 2 + dt * (jerk / 6 + dt * slope / 24))),
        speed + dt * (acceleration + dt * (jerk / 2 + dt * slope / 6)),
        acceleration + dt * (jerk + dt * slope / 2),
        jerk + dt * slope,
    )
