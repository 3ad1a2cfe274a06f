"""Where a given law jumps though it states no breakpoint, and laws that are no numbers.

A step across a jump meets no tolerance, so the integration is split there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from models.ancf.joints.kinds import Driven, Joint, Torque, law_values
from models.arrays import Array

_SAMPLES = 4001  # instants at which a law is looked at
_STANDS_OUT = 30.0  # times the typical change from one instant to the next
_ALONE = 3.0  # times the smaller one of the changes before and after
_BISECTIONS = 48  # from a sample's interval down to rounding
_EDGE = 1e-9  # of the motion's time
_STAYS = 0.5  # share of a change that is left within rounding where the law jumps


def breakpoints(joints: Sequence[Joint], start: float, end: float) -> list[float]:
    """All instants between start and end at which the integration is split [s].

    Those that the joints state, and those at which a torque, or the acceleration of a driven
    angle, jumps.

    Raises
    ------
    ModelError
        If a law is not finite somewhere, or does not return a number for each instant.
    """
    found: set[float] = set()
    for number, joint in enumerate(joints):
        found.update(b for b in joint.breakpoints if start < b < end)
        laws: tuple[Callable[[Array], Array], ...] = ()
        if isinstance(joint, Torque):
            laws = (joint.torque,)
        elif isinstance(joint, Driven):
            laws = (joint.acceleration, joint.angle, joint.rate)
        for law in laws:
            times, values = _sampled(law, number, start, end)
            # a spline's knots are stated by no one and jump in nothing
            if law is laws[0]:
                found.update(_jumps(law, times, values, joint.breakpoints))
    return sorted(found)


def _sampled(
    law: Callable[[Array], Array], joint: int, start: float, end: float
) -> tuple[Array, Array]:
    """Instants and values of a law, all of them finite."""
    times = np.linspace(start, end, _SAMPLES)
    return times, law_values(law, times, f"simulate: the law of joint {joint}", end)


def _jumps(
    law: Callable[[Array], Array], times: Array, values: Array, stated: Sequence[float]
) -> list[float]:
    """Instants at which a law jumps, each to rounding."""
    change = np.abs(np.diff(values))
    typical = max(float(np.median(change)), 1e-9 * float(np.abs(values).max()))
    found = []
    # a steep part has steep neighbours, a jump has none
    beside = np.minimum(np.append(change[1:], np.inf), np.insert(change[:-1], 0, np.inf))
    for k in np.flatnonzero((change > _STANDS_OUT * typical) & (change > _ALONE * beside)):
        low, high = float(times[k]), float(times[k + 1])
        if any(low <= b <= high for b in stated):
            continue
        below, above = float(values[k]), float(values[k + 1])
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            value = float(np.asarray(law(np.array([middle])))[0])
            if abs(value - below) > abs(above - value):
                high, above = middle, value
            else:
                low, below = middle, value
        # at the ends of the motion there is nothing to split
        inside = min(high - times[0], times[-1] - high) > _EDGE * (times[-1] - times[0])
        if inside and abs(above - below) > _STAYS * change[k]:
            found.append(high)
    return found
