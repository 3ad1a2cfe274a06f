"""Least time to rest at the end of a stroke, under caps on speed, acceleration and jerk.

A motion from rest begins without acceleration if the jerk is capped, and so does every motion end.
One that is under way already begins with any acceleration: nothing says what went before.

The fastest motion rises to a top speed v, keeps it, and falls to rest. The larger v, the shorter is
the time. If it has to brake at once, it is the later part of a fall from a speed above its own.

Symbols: D stroke; v0 speed at the start; v top speed; a acceleration; j jerk.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

BISECTIONS = 200
FASTEST = 1e9  # beyond any speed


@dataclass(frozen=True)
class RateCaps:
    """Caps on the rates of a motion; infinite where there is none.

    Attributes
    ----------
    speed, acceleration, jerk : [1/s, 1/s^2, 1/s^3] times the unit of the stroke.
    """

    speed: float = math.inf
    acceleration: float = math.inf
    jerk: float = math.inf

    @property
    def none(self) -> bool:
        """Whether nothing is capped."""
        return math.isinf(min(self.speed, self.acceleration, self.jerk))


def least_time(stroke: float, caps: RateCaps, start_speed: float = 0.0) -> float:
    """Least time to rest at the end of a stroke; infinite if the motion cannot brake before it."""
    if caps.none:
        return 0.0
    if start_speed > min(caps.speed, greatest_start_speed(stroke, caps)):
        return math.inf
    if start_speed and _fall(start_speed, caps)[1] > stroke:
        return _braking_at_once(stroke, caps, start_speed)

    def way(speed: float) -> float:
        return _rise(start_speed, speed, caps)[1] + _fall(speed, caps)[1]

    top = min(caps.speed, FASTEST)
    if way(top) > stroke:
        top = _largest(lambda speed: way(speed) < stroke, start_speed, top)
    cruise = 0.0 if math.isinf(top) or not top else (stroke - way(top)) / top
    return cruise + (_rise(start_speed, top, caps)[0] + _fall(top, caps)[0])


def greatest_start_speed(stroke: float, caps: RateCaps) -> float:
    """The speed from which a motion just comes to rest within a stroke, braking at once."""
    a, j = caps.acceleration, caps.jerk
    if math.isinf(j):
        return math.sqrt(2 * a * stroke)
    alone = (9 * stroke**2 * j / 2) ** (1 / 3)  # a rises from -sqrt(2 j v0) to zero
    if 2 * j * alone <= a**2:
        return alone
    return math.sqrt((a**2 / (2 * j)) ** 2 + 2 * a * (stroke - a**3 / (6 * j**2)))


def least_cap(
    name: str, others: RateCaps, stroke: float, duration: float, start_speed: float
) -> float:
    """The least value of a cap under which a motion of at most a duration is possible.

    Parameters
    ----------
    name : of the cap, as "jerk".
    others : caps that hold beside it.
    stroke, duration, start_speed : D, T [s] and v0.

    Returns
    -------
    float
        Infinite if no value is enough.
    """

    def misses(value: float) -> bool:
        return least_time(stroke, replace(others, **{name: value}), start_speed) > duration

    if misses(FASTEST):
        return math.inf
    high = 1.0
    while misses(high):
        high *= 2
    return _largest(misses, 0.0, high)


def _largest(holds: Callable[[float], bool], low: float, high: float) -> float:
    """The value up to which a statement holds, by bisection."""
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low


def _fall(speed: float, caps: RateCaps) -> tuple[float, float]:
    """Time and way from a speed without acceleration to rest."""
    a, j = caps.acceleration, caps.jerk
    if math.isinf(j):
        time = speed / a
    elif a**2 >= speed * j:
        time = 2 * math.sqrt(speed / j)
    else:
        time = speed / a + a / j
    return time, speed * time / 2


def _rise(start_speed: float, speed: float, caps: RateCaps) -> tuple[float, float]:
    """Time and way up to a speed without acceleration; from rest as a fall, backwards."""
    if not start_speed:
        return _fall(speed, caps)
    gain = speed - start_speed
    if math.isinf(caps.jerk):
        time = gain / caps.acceleration
        return time, (start_speed + speed) / 2 * time
    # with all the acceleration at once, which falls to zero in the end
    steep = min(caps.acceleration, math.sqrt(2 * caps.jerk * gain))
    ramp = steep / caps.jerk
    level = 0.0 if math.isinf(caps.acceleration) else (gain - steep * ramp / 2) / caps.acceleration
    before = level * (start_speed + steep * level / 2)
    return level + ramp, before + ramp * (speed - caps.jerk * ramp**2 / 6)


def _braking_at_once(stroke: float, caps: RateCaps, start_speed: float) -> float:
    """Least time where the fall from the first speed itself would be too long a way."""

    def rest_of_a_fall(speed: float) -> tuple[float, float]:
        passed = math.sqrt(2 * (speed - start_speed) / caps.jerk)  # in which it fell to v0
        time, way = _fall(speed, caps)
        return time - passed, way - passed * (speed - caps.jerk * passed**2 / 6)

    steepest = start_speed + min(start_speed, caps.acceleration**2 / (2 * caps.jerk))
    fallen_from = _largest(lambda v: rest_of_a_fall(v)[1] > stroke, start_speed, steepest)
    return rest_of_a_fall(fallen_from)[0]
