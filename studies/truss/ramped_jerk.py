"""A law of piecewise linear jerk, integrated exactly: what a profile's rows define."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from models.errors import require
from models.laws import Motion
from models.laws.motion import increasing, law_times

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RampedJerk:
    """Jerk that is linear on each piece and may jump between pieces, from rest.

    Attributes
    ----------
    edges : times 0 = t_0 < ... < t_m [s].
    ramps : m pairs, the jerk at the start and at the end of each piece [rad/s^3].
    start_angle : [rad].

    Raises
    ------
    ModelError
        If the edges do not start at 0 and increase, or the ramps do not match them.
    """

    edges: tuple[float, ...]
    ramps: tuple[tuple[float, float], ...]
    start_angle: float

    def __post_init__(self) -> None:
        require(
            len(self.edges) >= 2 and self.edges[0] == 0 and increasing(self.edges),
            f"{len(self.edges)} edges do not increase from 0 s; sort and shift them.",
        )
        require(
            len(self.ramps) == len(self.edges) - 1 and bool(np.isfinite(self.ramps).all()),
            f"{len(self.ramps)} ramps for {len(self.edges) - 1} pieces; give a finite one each.",
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
        """Motion at times (m,) in [0, T]; at an edge the jerk is that of the piece to its right."""
        t = law_times(time, self.duration)
        piece = np.searchsorted(self.edges[1:-1], t, side="right")
        dt = t - np.asarray(self.edges)[piece]
        angle, speed, acceleration, jerk, slope = self._pieces[piece].T
        angle, speed, acceleration, jerk = _advance(angle, speed, acceleration, jerk, slope, dt)
        return Motion(time=t, angle=angle, speed=speed, acceleration=acceleration, jerk=jerk)

    @cached_property
    def _pieces(self) -> Array:
        """Angle, speed, acceleration, jerk and its slope at the left of each piece, (m, 5)."""
        angle, speed, acceleration, rows = self.start_angle, 0.0, 0.0, []
        for dt, (first, last) in zip(np.diff(self.edges).tolist(), self.ramps, strict=True):
            row = (angle, speed, acceleration, first, (last - first) / dt)
            rows.append(row)
            angle, speed, acceleration, _ = _advance(*row, dt)
        return np.array(rows)


def _advance(angle: Any, speed: Any, acceleration: Any, jerk: Any, slope: Any, dt: Any) -> Any:
    """State and jerk after dt under a linear jerk; numbers or arrays alike."""
    return (
        angle + dt * (speed + dt * (acceleration / 2 + dt * (jerk / 6 + dt * slope / 24))),
        speed + dt * (acceleration + dt * (jerk / 2 + dt * slope / 6)),
        acceleration + dt * (jerk + dt * slope / 2),
        jerk + dt * slope,
    )
