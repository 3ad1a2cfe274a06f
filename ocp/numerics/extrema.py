"""Maxima of functions that are known by sampling, interval by interval."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ocp.arrays import Array, Integers

# A function that rides a limit has a bump between any two of the collocation points, so a dense
# grid takes several samples for each of these.
_SAMPLES_PER_POINT = 6

# Each zoom narrows the bracket of a maximum to a quarter or less, from a tenth of an interval.
# After five it is located to 1e-4, and a smooth maximum is known to the square of that.
_ZOOMS = 5
_ZOOM_SAMPLES = 9


@dataclass(frozen=True, eq=False)
class Extremes:
    """The largest value of a function in each interval.

    Attributes
    ----------
    values, tau : (N,)
        The value and the local time at which it is taken.
    """

    values: Array
    tau: Array


def dense_grid(degree: int) -> Array:
    """Local times of dense sampling where the collocation has `degree` points, shape (m,)."""
    count = _SAMPLES_PER_POINT * degree + 9
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * np.arange(count) / (count - 1)))


def maxima(
    function: Callable[[Integers, Array], Array],
    values: Array,
    grid: Array,
    level: float = np.inf,
) -> Extremes:
    """Largest value in every interval from dense samples, by repeated zooming in.

    Parameters
    ----------
    function : callable
        Takes intervals and local times, (m,) each, and returns (m,) values.
    values : (N, m)
        The function at the local times `grid` (m,) of all intervals.
    level : float
        What lies below it and below the largest value of all needs no zoom.
    """
    tau = np.broadcast_to(grid, values.shape)
    best, best_tau = np.full(len(values), -np.inf), np.zeros(len(values))
    intervals = np.arange(len(values))

    for zoom in range(_ZOOMS):
        if zoom:
            values = function(np.repeat(intervals, tau.shape[1]), tau.ravel()).reshape(tau.shape)

        # what is not a number exceeds every limit
        values = np.where(np.isfinite(values), values, np.inf)
        row, peak = np.arange(intervals.size), np.argmax(values, axis=1)
        left, right = np.maximum(peak - 1, 0), np.minimum(peak + 1, tau.shape[1] - 1)

        top = values[row, peak]
        better = top > best[intervals]
        best[intervals] = np.where(better, top, best[intervals])
        best_tau[intervals] = np.where(better, tau[row, peak], best_tau[intervals])

        # a smooth function rises above its samples by less than these differ
        lowest = np.minimum(values[row, left], values[row, right])
        reach = np.where(np.isfinite(top), 2.0 * top, np.nan) - lowest
        near = reach >= min(level, best.max())
        if not near.any():
            break

        first, last = tau[row, left][near, None], tau[row, right][near, None]
        intervals = intervals[near]
        tau = first + np.linspace(0.0, 1.0, _ZOOM_SAMPLES) * (last - first)

    return Extremes(best, best_tau)
