"""What follows from ropes that only pull, together with caps on the rates: times no motion beats.

With 0 <= T1 <= F on each rope, (38) bounds the acceleration at every angle and speed. U' includes
Coulomb friction, which has one sign:

    (-U' - I' omega^2 / 2 - D omega) / I <= a <= (F f - U' - I' omega^2 / 2 - D omega) / I

A cap on the acceleration bounds it, too. So does a cap j on the jerk: an acceleration a that had to
grow from zero at rest, or has to vanish at the highest speed w, needs omega >= a^2 / (2 j) and
w - omega >= a^2 / (2 j); the same holds for a deceleration.

No motion from rest is faster at any angle than the one that speeds up with all that is allowed, and
none that comes to rest than the one that brakes with it (comparison of d(omega^2/2)/d(alpha) = a).
The lower of the two bounds the time. The more the highest speed w may be, the shorter it is; but a
motion has to reach w before it has to brake from there. A motion that is under way at its start has
any acceleration there, so that its jerk is left out of the bound.

Symbols: alpha [rad], omega and w [rad/s], a [rad/s^2], T1 and F [N].
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import NamedTuple

import casadi as ca
import numpy as np

from models.laws import Step5
from models.truss import (
    Opening,
    TrussParameters,
    inertia,
    inertia_slope,
    joint_damping,
    rope_leverage,
    static_torque,
    whole_opening,
)
from ocp.arrays import Array
from studies.truss.limits.caps import Caps

STEPS = 1500  # of the way, finer near its ends
CELLS = 16  # of the highest speed
LEVELS = 4  # of cells, each a quarter of so many in width
MOST_SHARPER = 1.3  # by how much the bound of the highest speed may be above that without
NUMERICAL = 1e-4  # relative: more than the error of the steps, and taken off


class Push(NamedTuple):
    """What springs alone do, at the least, at an angle [rad]: an acceleration [rad/s^2]."""

    acceleration: float
    angle: float


def least_time_of_pull(
    truss: TrussParameters,
    caps: Caps,
    force: float | None,
    enough: float,
    opening: Opening | None = None,
) -> float:
    """Lower bound on the duration [s] under caps on the rates and a cap on the force [N].

    Parameters
    ----------
    force : float or None
        F, the cap on the force of each rope.
    enough : float
        A duration [s]; the bound is not sharpened where it stays below that anyway.
    opening : Opening, optional
        Of the motion; from stowed to open by default.

    Returns
    -------
    float
        Infinite if the motion cannot come to rest at its end.
    """
    way = _way(truss, caps, force, opening or whole_opening(truss))
    free = (math.inf if caps.speed is None else caps.speed,)
    time = float(way.times(free)[0])
    sharper = caps.jerk is not None and not way.under_way
    if not sharper or not math.isfinite(time) or MOST_SHARPER * time < enough:
        return time * (1 - NUMERICAL)

    # the highest speed that can be reached before it has to be left, to cells of cells
    high = float(way.speeds(free).max())
    width = high / CELLS
    for _ in range(LEVELS):
        edges = np.linspace(max(high - CELLS * width, 0.0), high, CELLS + 1)
        reached = np.flatnonzero(way.reach(tuple(edges[1:]), edges[:-1]))
        high = float(edges[reached[-1] + 1 if reached.size else 0])
        width /= CELLS / 4
    return float(way.times((high,))[0]) * (1 - NUMERICAL)


def greatest_start_rate(truss: TrussParameters, caps: Caps, opening: Opening) -> float:
    """The most speed at the start [rad/s] from which ropes that only pull let the truss brake."""
    way = _way(truss, caps, None, opening)
    return float(way.braking_from((math.inf if caps.speed is None else caps.speed,))[0])


def push_of_springs(truss: TrussParameters, caps: Caps, opening: Opening | None = None) -> Push:
    """The acceleration that no rope prevents, where it is highest, at the best speed there."""
    way = _way(truss, caps, None, opening or whole_opening(truss))
    top = way.speeds((math.inf if caps.speed is None else caps.speed,))[:, 0]
    least = way.least_own(top)
    highest = int(np.argmax(least))
    return Push(float(least[highest]), float(way.alpha[2 * highest]))


@functools.lru_cache(maxsize=4)
def _way(truss: TrussParameters, caps: Caps, force: float | None, opening: Opening) -> _Way:
    return _Way(truss, caps, math.inf if force is None else force, opening)


class _Way:
    """The stroke in steps, and the fastest motions from its ends, for highest speeds (m,)."""

    def __init__(self, truss: TrussParameters, caps: Caps, force: float, opening: Opening) -> None:
        law = Step5(1.0, opening.start, opening.end)
        self._start = opening.rate
        # with the middle of each step; near rest the speed grows as a cube root's square at most
        self.alpha = law.motion(np.linspace(0.0, 1.0, 2 * STEPS + 1)).angle
        terms = (static_torque, inertia_slope, joint_damping, inertia, rope_leverage)
        values = [term(truss, ca.DM(self.alpha)).full().ravel() for term in terms]
        self._slope, self._inertia_slope, self._damping, self._inertia, leverage = values
        self._pull = np.full_like(leverage, math.inf)
        if math.isfinite(force):
            self._pull = force * leverage
        self._most = math.inf if caps.acceleration is None else caps.acceleration
        self._jerk = math.inf if caps.jerk is None else caps.jerk
        self._known: dict[tuple[float, ...], tuple[Array, Array]] = {}

    @property
    def under_way(self) -> bool:
        """Whether the motion has a speed at its start, and so any acceleration."""
        return self._start > 0.0

    def braking_from(self, highest: tuple[float, ...]) -> Array:
        """Speeds at the start from which the motion comes to rest at its end [rad/s], (m,)."""
        return np.asarray(self._curves(highest)[1][0])

    def times(self, highest: tuple[float, ...]) -> Array:
        """Lower bounds of the duration [s], (m,)."""
        if self.under_way and (self._start > self.braking_from(highest)).any():
            return np.full(len(highest), math.inf)
        speed = self.speeds(highest)
        steps = np.diff(self.alpha[::2])[:, None]
        with np.errstate(divide="ignore"):
            return np.asarray((2 * steps / (speed[1:] + speed[:-1])).sum(axis=0))

    def speeds(self, highest: tuple[float, ...]) -> Array:
        """Speeds that no motion exceeds [rad/s], (STEPS + 1, m)."""
        return np.minimum(*self._curves(highest))

    def reach(self, highest: tuple[float, ...], least: Array) -> Array:
        """Whether speeds of at least `least` are reached before they have to be left, (m,)."""
        forwards, backwards = self._curves(highest)
        first = np.argmax(forwards >= least, axis=0)
        last = STEPS - np.argmax(backwards[::-1] >= least, axis=0)
        some = (forwards >= least).any(axis=0) & (backwards >= least).any(axis=0)
        # each lies in the step before the point that is found
        return np.asarray(some & (first <= last + 2))

    def least_own(self, top: Array) -> Array:
        """Least acceleration without a rope, at speeds up to `top`, (STEPS + 1,)."""
        # quadratic in the speed
        places = slice(None, None, 2)
        with np.errstate(divide="ignore", invalid="ignore"):
            turning = -self._damping[places] / self._inertia_slope[places]
        speeds = (0.0, top, np.clip(np.nan_to_num(turning, posinf=0.0, neginf=0.0), 0.0, top))
        return np.min([self._own(places, np.asarray(speed)) for speed in speeds], axis=0)

    def _curves(self, highest: tuple[float, ...]) -> tuple[Array, Array]:
        """Speeds (STEPS + 1, m) from rest at the start, and to rest at the end."""
        if highest not in self._known:
            top = np.array(highest)
            forwards = self._marched(top, range(2 * STEPS + 1), self._speeding_up, self._start)
            backwards = self._marched(top, range(2 * STEPS, -1, -1), self._braking)
            self._known[highest] = forwards, backwards[::-1]
        return self._known[highest]

    def _marched(
        self,
        top: Array,
        places: range,
        most: Callable[[int, Array], Array],
        start: float = 0.0,
    ) -> Array:
        """Speeds at each second place, from that at the first, by the midpoint rule for omega^2."""
        ways = np.abs(self.alpha[list(places)] - self.alpha[places[0]])
        first = most(places[0], np.zeros_like(top))
        if not np.isfinite(np.minimum(first, self._rate_cap(np.zeros_like(top), top))).all():
            return np.broadcast_to(top, (STEPS + 1, top.size))  # at once

        def rate(place: int, square: Array) -> Array:
            speed = np.sqrt(square)
            return 2 * np.minimum(self._rate_cap(speed, top), most(place, speed))

        squares = [np.full_like(top, start**2)]
        for k in range(STEPS):
            step, half_step = ways[2 * k + 2] - ways[2 * k], ways[2 * k + 1] - ways[2 * k]
            if k == 0 and not start:  # from rest, where the slope of the root is infinite
                half = self._from_rest(half_step, first, top)
            else:
                half = np.maximum(squares[-1] + half_step * rate(places[2 * k], squares[-1]), 0.0)
            rise = step * rate(places[2 * k + 1], np.minimum(half, top**2))
            near = self._nearing(places[2 * k], squares[-1], step, top, most)
            squares.append(np.maximum(np.clip(squares[-1] + rise, 0.0, top**2), near))
        return np.sqrt(np.array(squares))

    def _nearing(
        self,
        place: int,
        square: Array,
        step: float,
        top: Array,
        most: Callable[[int, Array], Array],
    ) -> Array:
        """omega^2 after a step in which the jerk lets the speed near its highest value w.

        There sqrt(w - omega) falls by sqrt(j / 2) / omega a radian, while (w - omega)' jumps.
        """
        if not math.isfinite(self._jerk) or self.under_way:
            return np.zeros_like(square)
        speed = np.sqrt(square)
        left = np.sqrt(np.maximum(top - speed, 0.0))
        grown = np.sqrt(2 * self._jerk) * left
        limits = self._rate_cap(speed, top), most(place, speed)
        near = (speed > left**2) & (grown <= np.minimum(*limits)) & np.isfinite(grown)
        with np.errstate(divide="ignore", invalid="ignore"):
            left = np.maximum(left - step * math.sqrt(self._jerk / 2) / speed, 0.0)
            return np.where(near, np.maximum(top - left**2, 0.0) ** 2, 0.0)

    def _rate_cap(self, speed: Array, top: Array) -> Array:
        """Largest acceleration that the caps on jerk and acceleration leave at a speed."""
        if not math.isfinite(self._jerk) or self.under_way:
            return np.full_like(speed, self._most)
        way = np.minimum(speed, np.maximum(top - speed, 0.0))
        return np.minimum(np.sqrt(2 * self._jerk * way), self._most)

    def _from_rest(self, way: float, most: Array, top: Array) -> Array:
        """omega^2 at a short way from rest with at most an acceleration `most`."""
        square = 2 * np.maximum(np.minimum(most, self._most), 0.0) * way
        if math.isfinite(self._jerk):
            square = np.minimum(square, (self._jerk / 2 * (6 * way / self._jerk) ** (2 / 3)) ** 2)
        return np.minimum(square, top**2)

    def _own(self, place: int | slice, speed: Array) -> Array:
        """What accelerates the truss without a rope [rad/s^2]."""
        torque = -self._slope[place] - self._inertia_slope[place] * speed**2 / 2
        return np.asarray((torque - self._damping[place] * speed) / self._inertia[place])

    def _speeding_up(self, place: int, speed: Array) -> Array:
        return self._own(place, speed) + self._pull[place] / self._inertia[place]

    def _braking(self, place: int, speed: Array) -> Array:
        return -self._own(place, speed)
