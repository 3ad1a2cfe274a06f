"""Least peak acceleration of any coordinate that goes from rest to rest in a given time.

Symbols: D stroke; T [s] duration; j jerk cap; A peak acceleration. The coordinate may be an
angle [rad], a rope length [m] or a position [m]; the rates are per second.
"""

from __future__ import annotations

import math

from models.errors import require


def least_peak_acceleration(stroke: float, duration: float, *, jerk: float | None = None) -> float:
    """Least peak acceleration: 4 D/T^2, or (j T/4)(1 - sqrt(1 - 32 D/(j T^3))) under a jerk cap.

    The first is an infimum, not attained if the acceleration is to vanish at both ends; the
    second is attained by `JerkLimited`.

    Raises
    ------
    ModelError
        If stroke or duration is not positive and finite, or the jerk cap is below 32 D/T^3.
    """
    require(0 < stroke < math.inf, f"stroke is {stroke!r}; give a positive finite stroke.")
    require(0 < duration < math.inf, f"duration is {duration!r} s; give a positive finite time.")
    if jerk is None:
        return 4 * stroke / duration**2

    least = least_jerk_cap(stroke, duration)
    require(
        math.isfinite(jerk) and jerk >= least * (1 - 1e-12),  # rounding of a cap set to `least`
        f"jerk cap {jerk!r} cannot cover the stroke {stroke:g} in {duration:g} s; "
        f"raise it to at least {least!r} or lengthen the duration.",
    )

    # The formula above, multiplied by 1 + root: it would cancel where j is large.
    root = math.sqrt(max(0.0, 1 - least / jerk))
    return 8 * stroke / duration**2 / (1 + root)


def least_jerk_cap(stroke: float, duration: float) -> float:
    """Least jerk that covers the stroke from rest to rest, accelerations zero at both ends."""
    return 32 * stroke / duration**3
