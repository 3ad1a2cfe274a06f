"""Largest values of smooth functions in each of many intervals, between samples too."""

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
_PEAKS = 3  # of the samples in an interval, that are looked at


@dataclass(frozen=True, eq=False, repr=False)
class Extremes:
    """The largest value of a function in each interval.

    Attributes
    ----------
    values, tau : (N,)
        The value and the local time at which it is taken.
    size : float
        By which the values were divided.
    """

    values: Array
    tau: Array
    size: float = 1.0


def dense_grid(degree: int) -> Array:
    """Local times of dense sampling where the collocation has `degree` points, shape (m,)."""
    count = _SAMPLES_PER_POINT * degree + 9
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * np.arange(count) / (count - 1)))


def _reach(top: Array, lowest: Array) -> Array:
    """How high a smooth function may rise at a sample: by less than its neighbours differ."""
    return np.where(np.isfinite(top), 2.0 * top, np.nan) - lowest


def _reach_of_peaks(values: Array) -> Array:
    """The reach of each sample that is higher than its neighbours, (N, m); -inf elsewhere.

    The highest of all has the greatest, so that it is always looked at.
    """
    padded = np.pad(values, ((0, 0), (1, 1)), mode="edge")
    left, right = padded[:, :-2], padded[:, 2:]
    higher = (values >= left) & (values >= right) & ((values > left) | (values > right))
    reach = np.where(
        higher, np.nan_to_num(_reach(values, np.minimum(left, right)), nan=np.inf), -np.inf
    )
    reach[np.arange(len(values)), np.argmax(values, axis=1)] = np.inf
    return reach


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
    # what is not a number exceeds every limit
    values = np.where(np.isfinite(values), values, np.inf)
    best, best_tau = values.max(axis=1), grid[np.argmax(values, axis=1)]

    # a lower sample may stand beside a higher peak, so that several are looked at
    peak = np.argsort(-_reach_of_peaks(values), axis=1)[:, :_PEAKS].ravel()
    intervals = np.repeat(np.arange(len(values)), peak.size // len(values))
    values, tau = values[intervals], np.broadcast_to(grid, (intervals.size, grid.size))

    for _ in range(_ZOOMS - 1):
        row = np.arange(intervals.size)
        left, right = np.maximum(peak - 1, 0), np.minimum(peak + 1, tau.shape[1] - 1)
        lowest = np.minimum(values[row, left], values[row, right])
        near = _reach(values[row, peak], lowest) >= min(level, best.max())
        if not near.any():
            break

        first, last = tau[row, left][near, None], tau[row, right][near, None]
        intervals = intervals[near]
        tau = first + np.linspace(0.0, 1.0, _ZOOM_SAMPLES) * (last - first)
        values = function(np.repeat(intervals, tau.shape[1]), tau.ravel()).reshape(tau.shape)
        values = np.where(np.isfinite(values), values, np.inf)

        # the highest of an interval comes last, and stays
        peak = np.argmax(values, axis=1)
        top, top_tau = values.max(axis=1), tau[np.arange(peak.size), peak]
        order = np.argsort(top, kind="stable")
        order = order[top[order] > best[intervals[order]]]
        best[intervals[order]], best_tau[intervals[order]] = top[order], top_tau[order]

    return Extremes(best, best_tau)
