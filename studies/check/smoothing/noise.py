"""How much the values of a profile scatter, from differences that no smooth curve has.

A divided difference of high order of a smooth curve is next to nothing, while that of noise stays.
Divided by the size that noise of unit size would give it, its median over all rows is the noise,
whatever the spacing of the rows.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ocp.arrays import Array

ORDERS = range(3, 10)  # of differences; the one that leaves least of the curve counts
MOST = 50_000  # windows that are looked at
NORMAL_MEDIAN = 1.4826  # from the median of |x| to the standard deviation of normal x
ROUNDING = 4 * np.finfo(float).eps  # relative scatter of numbers that were computed
DECIDES = 1e-3  # noise of the jerk over the jerk itself, below which the rows are taken as exact
FAR_ABOVE = 20.0  # of rounding: what several computations on the way to a file may add up to
APART = 50  # of the rows lie on either side of one, between which its speed is taken
NOTHING = 0.01  # of a variance: what is below it changes nothing
STEPS = 1e-3  # of a step of rounding: what the digits of a text leave of it


class NoiseEstimate(NamedTuple):
    """The scatter of a column.

    Attributes
    ----------
    deviation : standard deviation, in the unit of the values over their scale.
    step : distance between the values that occur, where they are rounded; 0 else.
    matters : whether derivatives of the rows as they are would be spoiled.
    """

    deviation: float
    step: float
    matters: bool


def differences(time: Array, order: int) -> tuple[Any, Array]:
    """Places (w, order + 1) and weights of the divided differences of an order."""
    count = time.size - order
    starts = np.unique(np.linspace(0, count - 1, min(count, MOST)).round().astype(int))
    places = starts[:, None] + np.arange(order + 1)
    t = time[places]
    # of the window's own length, so that powers of small steps do not underflow
    length = (t[:, -1] - t[:, 0])[:, None]
    u = (t - t[:, :1]) / length
    products = np.ones_like(u)
    for k in range(order + 1):
        gap = u - u[:, k : k + 1]
        gap[:, k] = 1.0
        products *= gap
    return places, 1 / (products * length**order)


def steepest_slopes(time: Array, values: Array) -> Array:
    """What the slope at each row (m,) is at most: that of either side, and by how much it turns."""
    slopes = np.diff(values) / np.diff(time)
    before, after = np.append(slopes[:1], slopes), np.append(slopes, slopes[-1:])
    found: Array = np.maximum(np.abs(before), np.abs(after)) + np.abs(after - before)
    return found


def scale_with_times(time: Array, values: Array, scale: Array, half: Array) -> Array:
    """The relative scatter (m,) of values whose times are rounded, by `half` (m,) at most.

    A time that is wrong is a value that is, by as much as the motion is fast there.
    """
    wide = max(1, time.size // APART)
    first, last = (np.clip(np.arange(time.size) + k, 0, time.size - 1) for k in (-wide, wide))
    slopes = (values[last] - values[first]) / (time[last] - time[first])
    by_times = (half * slopes) ** 2 / 3  # variance of an even distribution

    whole = estimate_noise(time, values, scale).deviation
    if whole == 0.0 or float(by_times.max()) < NOTHING * (whole * float(scale.max())) ** 2:
        return scale
    alone = max(whole**2 - float(np.median(by_times / scale**2)), NOTHING * whole**2)
    found: Array = np.sqrt(alone * scale**2 + by_times) / whole
    return found


def estimate_noise(time: Array, values: Array, scale: Array) -> NoiseEstimate:
    """The scatter of values (m,) at times (m,) about a smooth curve, over their scale (m,)."""
    found = []
    for order in ORDERS:
        if time.size < 2 * order + 4:
            break
        places, weights = differences(time, order)
        size = np.sqrt(((weights * scale[places]) ** 2).sum(axis=1))
        found.append(np.median(np.abs((weights * values[places]).sum(axis=1)) / size))
    deviation = NORMAL_MEDIAN * float(min(found))

    step = _step(values / scale) if np.ptp(scale) == 0 else 0.0
    deviation = max(deviation, step / math.sqrt(12))
    # what rounding alone leaves is none of noise, however smooth the curve
    rounding = FAR_ABOVE * ROUNDING * float(np.abs(values / scale).max())
    matters = bool(deviation > rounding) and _matters(time, values, scale, deviation)
    return NoiseEstimate(deviation, step, matters)


def _step(values: Array) -> float:
    """Distance between the values that occur, where all are multiples of it."""
    jumps = np.unique(np.abs(np.diff(values[: 4 * MOST])))
    jumps = jumps[jumps > ROUNDING * np.abs(values).max()]
    if not jumps.size:
        return 0.0
    multiples = jumps / jumps[0]
    off = np.abs(multiples - multiples.round())
    coarse = jumps[0] > 1e4 * ROUNDING * np.abs(values).max()
    return float(jumps[0]) if coarse and off.max() < STEPS * max(1.0, len(jumps) ** 0.5) else 0.0


def _matters(time: Array, values: Array, scale: Array, deviation: float) -> bool:
    """Whether the third difference of the noise shows beside that of the curve."""
    places, weights = differences(time, 3)
    jerk = np.abs((weights * values[places]).sum(axis=1))
    noise = deviation * np.sqrt(((weights * scale[places]) ** 2).sum(axis=1))
    return bool(np.quantile(noise, 0.9) > DECIDES * np.quantile(jerk, 0.9))
