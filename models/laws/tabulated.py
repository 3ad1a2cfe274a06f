"""A law through given points, for profiles that come from elsewhere."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Any, Literal

from numpy.typing import ArrayLike

from models.errors import require
from models.laws.motion import AngularMotion, check_stroke, increasing, law_times

_DEGREE = 5


@dataclass(frozen=True)
class Tabulated:
    """Quintic spline through (time, angle): four times continuously differentiable.

    Attributes
    ----------
    times : 0 = t_0 < ... < t_m [s].
    angles : [rad], as many.
    ends : "at rest" adds zero speed and acceleration at both ends, (45); "free" lets the spline
        find them and needs at least 6 points.

    Raises
    ------
    ModelError
        If the table is too short, its times do not start at 0 and increase, or an angle is
        not finite.
    """

    times: tuple[float, ...]
    angles: tuple[float, ...]
    ends: Literal["at rest", "free"] = "at rest"

    def __post_init__(self) -> None:
        for name in ("times", "angles"):
            object.__setattr__(self, name, tuple(float(value) for value in getattr(self, name)))

        require(
            self.ends in ("at rest", "free"),
            f'ends is {self.ends!r}; choose "at rest" or "free".',
        )

        # a free spline of degree 5 has six unknowns; ends at rest give four of them
        least = 2 if self.ends == "at rest" else _DEGREE + 1
        require(
            len(self.times) == len(self.angles) >= least,
            f"{len(self.times)} times, {len(self.angles)} angles; give at least {least} of each.",
        )
        require(
            self.times[0] == 0 and increasing(self.times),
            "the times of the table do not increase from 0; sort and shift them.",
        )
        require(
            all(map(math.isfinite, self.angles)),
            "an angle of the table is not finite; remove it.",
        )
        check_stroke(self.angles[0], self.angles[-1])

    @property
    def duration(self) -> float:
        """T [s]."""
        return self.times[-1]

    @property
    def start_angle(self) -> float:
        """First angle [rad]."""
        return self.angles[0]

    @property
    def end_angle(self) -> float:
        """Last angle [rad]."""
        return self.angles[-1]

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """The inner times, at which the fifth derivative may jump."""
        return self.times[1:-1]

    def motion(self, time: ArrayLike) -> AngularMotion:
        """Motion at times (m,) in [0, T]."""
        t = law_times(time, self.duration)
        return AngularMotion(t, *(self._spline(t, nu=order) for order in range(4)))

    @functools.cached_property
    def _spline(self) -> Any:
        from scipy.interpolate import make_interp_spline

        rest = [(1, 0.0), (2, 0.0)]
        ends = (rest, rest) if self.ends == "at rest" else None
        return make_interp_spline(self.times, self.angles, k=_DEGREE, bc_type=ends)
