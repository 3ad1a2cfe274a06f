"""The motion behind a profile: through its rows where they are exact, smoothed where they scatter.

Either way there is a law with its derivatives, and for each of its peaks how low and how high that
of the true motion may be.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import PPoly, make_interp_spline

from models.laws import AngularMotion
from models.laws.motion import law_times
from ocp.arrays import Array
from studies.check.smoothing.noise import (
    NoiseEstimate,
    differences,
    estimate_noise,
    scale_with_times,
)
from studies.check.smoothing.spline import SHARE, SmoothingSpline, simultaneous, smooth

MOST_KNOTS = 4001  # rows of an exact profile that are interpolated
ROWS_AN_INTERVAL = 4  # between the knots of a smoothing spline, at first
DENSEST = 1.5  # the same where the curve has more detail
INTERVALS = (6, 120, 480)  # between its knots: least, at first, and most
JUMP = 0.2  # of the peak acceleration: what counts as a jump of it
BESIDE = 3  # rows to either side, where nothing of a jump shows
ALONE = 8.0  # times the change there, from which it is a jump
SEGMENT = 10  # rows that a piece between two jumps has at least
OVERSHOOT = 1.05  # of the jerk, from which the cubic spline is taken instead
COARSE = 1.3  # the residual over the noise from which the knots are too few
SLOW, GENTLE = 1e-3, 2e-2  # of the peak: speed and acceleration at an end that count as none
# of a speed at an end that counts as none, and of a miss there, in standard deviations; four are
# tested a profile, and at 3 one of 52 noisy ones at rest was called moving
CERTAIN = 4.0
DRAWN = 100  # motions by which the scatter of forces is worked out
INSTANTS = 401  # at which they are compared
ABOUT = 9  # further ones about each peak, as far as the next even one

Histories = Callable[[Any, Array], dict[str, Array]]


@dataclass(frozen=True, eq=False)
class SplineLaw:
    """A law of the deployment angle that is a spline.

    Attributes
    ----------
    spline : a SciPy PPoly of the angle [rad] over time [s], from 0 on.
    """

    spline: Any

    @property
    def duration(self) -> float:
        """T [s]."""
        return float(self.spline.x[-1])

    @property
    def start_angle(self) -> float:
        """At time 0 [rad]."""
        return float(self.spline(0.0))

    @property
    def end_angle(self) -> float:
        """At T [rad]."""
        return float(self.spline(self.duration))

    @cached_property
    def breakpoints(self) -> tuple[float, ...]:
        """The knots between start and end [s]."""
        return tuple(self.spline.x[1:-1].tolist())

    def motion(self, time: ArrayLike) -> AngularMotion:
        """Motion at times (m,) in [0, T]."""
        t = law_times(time, self.duration)
        return AngularMotion(t, *(self.spline(t, nu=order) for order in range(4)))


@dataclass(frozen=True, eq=False)
class Recovered:
    """A motion recovered from rows.

    Attributes
    ----------
    law : any law; a spline, or what the rows state exactly.
    noise : of the rows.
    rest : derivatives taken as zero at start and end: 0 none, 1 speed, 2 acceleration, too.
    fit : the smoothing spline; None where the law goes through all rows.
    scatter : (m,) standard deviation of each row, as the differences between rows tell it; None
        where the law goes through all rows.
    """

    law: Any
    noise: NoiseEstimate
    rest: tuple[int, int]
    fit: SmoothingSpline | None
    scatter: Array | None = None

    def deviation(self, time: float, order: int) -> float:
        """By how much a derivative at a time may differ from the truth, nearly certainly."""
        if self.fit is None:
            return 0.0
        return CERTAIN * float(self.fit.deviation(np.array([time]), order)[0])

    def band(self, order: int) -> tuple[Array, Array]:
        """Instants, and half-widths of the band that holds a derivative of smoothed rows."""
        assert self.fit is not None
        return self.fit.grid, self.fit.band(order)

    def ranges(self, histories: Histories, peaks: Array) -> dict[str, tuple[float, float]]:
        """Least and greatest that the peak of each history may be; none where rows are exact.

        Parameters
        ----------
        histories : callable
            Maps a law to histories (m,) by name at times (m,); their greatest values are meant.
        peaks : (n,)
            Times at which the law itself has them: even instants alone pass by a sharp one [s].
        """
        if self.fit is None:
            return {}
        even, step = np.linspace(0.0, self.law.duration, INSTANTS, retstep=True)
        near = (peaks[:, None] + step * np.linspace(-1.0, 1.0, ABOUT)).ravel()
        grid = np.unique(np.clip(np.concatenate([even, near]), 0.0, self.law.duration))
        centre = histories(self.law, grid)
        curves = self.fit.draws(DRAWN)
        drawn = [histories(SplineLaw(_pieces(curve)), grid) for curve in curves]

        found = {}
        for name, values in centre.items():
            width = simultaneous(np.stack([d[name] - values for d in drawn], axis=1))
            found[name] = float((values - width).max()), float((values + width).max())
        return found

    @property
    def bias(self) -> float:
        """By how much smoothing changed the peak acceleration, estimated, relative."""
        if self.fit is None:
            return 0.0
        once, twice = (
            float(np.abs(curve(self.fit.grid, nu=2)).max())
            for curve in (self.fit.curve, self.fit.again)
        )
        return twice / once - 1


def recover(
    time: Array, values: Array, scale: Array, half_of_times: Array | None = None
) -> Recovered:
    """The motion behind values (m,) at times (m,) whose relative scatter is `scale` (m,).

    `half_of_times` (m,) is by how much the times may be rounded.
    """
    noise = estimate_noise(time, values, scale)
    if noise.matters:
        if half_of_times is not None:
            scale = scale_with_times(time, values, scale, half_of_times)
        return _smoothed(time, values, scale, noise)
    return _through(time, values, noise)


def kept_rows(count: int) -> NDArray[np.intp]:
    """Places of those of so many exact rows that are looked at: as many as digits allow."""
    return np.unique(np.append(np.arange(0, count, -(-count // MOST_KNOTS)), count - 1))


def _through(time: Array, values: Array, noise: NoiseEstimate) -> Recovered:
    """A spline through all rows that are looked at."""
    kept = kept_rows(time.size)
    time, values = time[kept], values[kept]
    rest = _rest_of(make_interp_spline(time, values, k=5), time)

    # no smooth curve follows a jump of the acceleration: each side is interpolated on its own
    edges = [0, *_jumps(time, values), time.size - 1]
    pieces = []
    for begin, end in pairwise(edges):
        part = slice(begin, end + 1)
        given = (rest[0] if begin == 0 else 0, rest[1] if end == time.size - 1 else 0)
        pieces.append(_pieces(_best_through(time[part], values[part], given)))
    return Recovered(SplineLaw(_joined(pieces)), noise, rest, None)


def _best_through(time: Array, values: Array, rest: tuple[int, int]) -> Any:
    """The quintic spline, or the cubic one where jumps of the jerk make the other overshoot."""
    quintic, cubic = (_interpolated(time, values, degree, rest) for degree in (5, 3))
    overshoots = _peak(quintic, time, 3) > OVERSHOOT * _peak(cubic, time, 3)
    return cubic if overshoots else quintic


def _jumps(time: Array, values: Array) -> list[int]:
    """Rows at which the acceleration jumps: its means before and behind differ there alone."""
    places, weights = differences(time, 2)
    if len(places) < time.size - 2 or time.size < 4 * SEGMENT:
        return []
    mean = 2 * (weights * values[places]).sum(axis=1)
    change = np.zeros(time.size)
    change[2:-2] = np.abs(mean[2:] - mean[:-2])

    found: list[int] = []
    for row in np.flatnonzero(change > JUMP * np.abs(mean).max()).tolist():
        around = change[max(row - BESIDE, 0) : row + BESIDE + 1]
        quiet = max(change[max(row - BESIDE, 0)], change[min(row + BESIDE, time.size - 1)])
        inside = SEGMENT <= row < time.size - SEGMENT and row - (found or [0])[-1] >= SEGMENT
        if inside and change[row] == around.max() and change[row] > ALONE * quiet:
            found.append(row)
    return found


def _pieces(spline: Any) -> Any:
    """A BSpline as polynomials between its knots, which are evaluated faster and can be joined."""
    k = spline.k
    whole = PPoly.from_spline(spline)
    return PPoly(whole.c[:, k : whole.c.shape[1] - k], whole.x[k : len(whole.x) - k])


def _joined(pieces: list[Any]) -> Any:
    """Polynomials one after the other."""
    rows = max(len(piece.c) for piece in pieces)
    padded = [np.pad(piece.c, ((rows - len(piece.c), 0), (0, 0))) for piece in pieces]
    edges = [pieces[0].x[:1], *(piece.x[1:] for piece in pieces)]
    return PPoly(np.concatenate(padded, axis=1), np.concatenate(edges))


def _peak(spline: Any, time: Array, order: int) -> float:
    middle = (time[:-1] + time[1:]) / 2
    return float(np.abs(spline(np.concatenate([time, middle]), nu=order)).max())


def _rest_of(spline: Any, time: Array) -> tuple[int, int]:
    """Which derivatives of an exact profile vanish at its ends."""
    grid = np.concatenate([time, (time[:-1] + time[1:]) / 2])
    speed, turn = (float(np.abs(spline(grid, nu=order)).max()) for order in (1, 2))

    def at(end: float) -> int:
        if abs(float(spline(end, nu=1))) > SLOW * speed:
            return 0
        return 2 if abs(float(spline(end, nu=2))) <= GENTLE * turn else 1

    return at(time[0]), at(time[-1])


def _interpolated(time: Array, values: Array, degree: int, rest: tuple[int, int]) -> Any:
    """A spline through all rows with as many conditions at each end as its degree has room for."""
    room = (degree - 1) // 2
    given = [min(room, count) for count in rest]
    left, right = ([(order, 0.0) for order in range(1, count + 1)] for count in given)

    # a condition that is not given makes a row no knot
    inner = time[1 + room - given[0] : time.size - 1 - room + given[1]]
    knots = np.concatenate([[time[0]] * (degree + 1), inner, [time[-1]] * (degree + 1)])
    ends = (left or None, right or None)
    return make_interp_spline(time, values, k=degree, t=knots, bc_type=ends)


def _smoothed(time: Array, values: Array, scale: Array, noise: NoiseEstimate) -> Recovered:
    """The smoothing spline, with ends at rest if the rows allow it."""
    least, count, most = INTERVALS
    count = int(np.clip(time.size // ROWS_AN_INTERVAL, least, count))
    fit = smooth(time, values, scale, count, (0, 0))
    most = int(min(most, time.size / DENSEST))
    while fit.noise > COARSE * noise.deviation and 2 * count <= most:
        count *= 2
        fit = smooth(time, values, scale, count, (0, 0))

    start, end = (_rest_within(fit, instant) for instant in (time[0], time[-1]))
    if (start, end) != (0, 0):
        fit = smooth(time, values, scale, count, (start, end))
    scatter = noise.deviation * np.abs(scale)
    return Recovered(SplineLaw(_pieces(fit.curve)), noise, (start, end), fit, scatter)


def _rest_within(fit: SmoothingSpline, instant: float) -> int:
    """How many derivatives at an end are zero within what the rows tell."""
    for order in (1, 2):
        at = np.array([instant])
        value, scatter = float(fit.curve(at, nu=order)[0]), float(fit.deviation(at, order)[0])
        if abs(value) > CERTAIN * scatter:
            return order - 1
    return 2


def sure(recovered: Recovered) -> str:
    """How sure the recovered motion is, in one sentence for the reader."""
    if recovered.fit is None:
        return "the rows are taken as exact: a spline goes through them"
    return f"bounds hold the true motion with {100 * SHARE:.0f} % probability, everywhere at once"


def how_smoothed(fit: SmoothingSpline) -> str:
    """How noise was taken away, in words for the reader."""
    return (
        "smoothed by a quintic spline whose roughness follows from restricted maximum likelihood, "
        f"{fit.freedom:.0f} effective parameters"
    )
