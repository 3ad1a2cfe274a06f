"""Least peak acceleration of any coordinate that goes from rest to rest in a given time.

Symbols: D stroke; T [s] duration; v speed cap; j jerk cap; A peak acceleration. The coordinate may
be an angle [rad], a rope length [m] or a position [m]; the rates are per second.

With W the time of both ramps of the speed, all closed forms are one: A = 2 u / (W + root), where

    u = 2 D/T,  W = T/2    if no speed cap acts (v >= 2 D/T)
    u = v,      W = T - D/v    if it does: the ramps end at v, and the coordinate cruises between
    root = sqrt(W^2 - 4 u/j)

as a ramp from rest to u under A and j takes u/A + A/j.
"""

from __future__ import annotations

import math

import numpy as np

from models.errors import require


def least_peak_acceleration(
    stroke: float, duration: float, *, jerk: float | None = None, speed: float | None = None
) -> float:
    """Least peak acceleration from rest to rest, under caps on jerk and speed if there are any.

    Without caps it is 4 D/T^2, under a jerk cap (j T/4)(1 - sqrt(1 - 32 D/(j T^3))), and under
    both, if D/T < v < 2 D/T, (j/2)(W - sqrt(W^2 - 4 v/j)) with W = T - D/v. Without a jerk cap it
    is an infimum, not attained if the acceleration is to vanish at both ends.

    Raises
    ------
    ModelError
        If stroke, duration or a cap is not positive and finite, the jerk cap is below 32 D/T^3, or
        the speed cap is too low for the duration. The message names the least one.
    """
    require(0 < stroke < math.inf, f"stroke is {stroke!r}; give a positive finite stroke.")
    require(0 < duration < math.inf, f"duration is {duration!r} s; give a positive finite time.")
    if jerk is not None:
        least = least_jerk_cap(stroke, duration)
        require(
            math.isfinite(jerk) and jerk >= least * _ROUNDED,
            f"jerk cap {jerk!r} cannot cover the stroke {stroke:g} in {duration:g} s; "
            f"raise it to at least {least!r} or lengthen the duration.",
        )
    top, ramps = 2 * stroke / duration, duration / 2
    if speed is not None and speed < top:
        slowest = least_speed_cap(stroke, duration, jerk)
        # without a jerk cap the least one itself would ask for an infinite acceleration
        kept = speed >= slowest * _ROUNDED if jerk is not None else speed > slowest
        require(
            kept,
            f"speed cap {speed!r} cannot cover the stroke {stroke:g} in {duration:g} s; raise it "
            f"to {'at least' if jerk else 'more than'} {slowest!r} or lengthen the duration.",
        )
        top, ramps = speed, duration - stroke / speed

    # multiplied by 1 + root, as W - root would cancel where j is large
    root = ramps if jerk is None else math.sqrt(max(0.0, ramps**2 - 4 * top / jerk))
    return 2 * top / (ramps + root)


_ROUNDED = 1 - 1e-12  # of a cap that was set to the least one itself


def least_speed_cap(stroke: float, duration: float, jerk: float | None = None) -> float:
    """Least top speed that covers the stroke from rest to rest, under a jerk cap if there is one.

    D/T, or the v below 2 D/T with T - D/v = 2 sqrt(v/j): both ramps are as short as the jerk lets
    them be. The jerk cap has to be one that covers the stroke.
    """
    if jerk is None:
        return stroke / duration
    # in x = sqrt(v), 2 x^3/sqrt(j) - T x^2 + D = 0: the smaller one of its positive roots
    roots = np.roots([2 / math.sqrt(jerk), -duration, 0.0, stroke]).real
    return float(min(roots[roots > 0.0]) ** 2)


def least_jerk_cap(stroke: float, duration: float) -> float:
    """Least jerk that covers the stroke from rest to rest, accelerations zero at both ends."""
    return 32 * stroke / duration**3
