"""Peaks of a function of one variable, located between samples as well as on them."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from models.errors import require

_CANDIDATES = 8  # grid maxima that are refined in each piece
_ZOOMS = 8  # each narrows the bracket 20 times: 4e10 in all
_ZOOM_POINTS = 41


class Peak(NamedTuple):
    """Greatest value of a function and where it is taken."""

    where: float
    value: float


def dense_peak(
    function: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    start: float,
    end: float,
    *,
    breakpoints: Sequence[float] = (),
    samples: int = 2001,
) -> Peak:
    """Greatest value of `function` on [start, end].

    Parameters
    ----------
    function : maps an array (m,) to values (m,); pass the absolute value where that is meant.
    breakpoints : points inside at which it need not be smooth; it is sampled piece by piece.
    samples : points on each piece; the highest grid maxima are then refined by zooming in.

    Raises
    ------
    ModelError
        If the interval is empty or there are fewer than 3 samples.
    """
    require(start < end, f"the interval [{start:g}, {end:g}] is empty; give start < end.")
    require(samples >= 3, f"samples is {samples}; give at least 3.")
    inside = sorted({b for b in breakpoints if start < b < end})
    edges = [start, *inside, end]
    found = [
        _zoom(function, low, high)
        for left, right in itertools.pairwise(edges)
        for low, high in _brackets(function, np.linspace(left, right, samples))
    ]
    return max(found, key=lambda peak: peak.value)


def _brackets(
    function: Callable[[NDArray[np.float64]], NDArray[np.float64]], grid: NDArray[np.float64]
) -> list[tuple[float, float]]:
    """Neighbours on both sides of the highest local maxima on the grid."""
    values = np.asarray(function(grid), dtype=float)
    walled = np.concatenate([[-np.inf], values, [-np.inf]])
    tops = np.flatnonzero((values >= walled[:-2]) & (values >= walled[2:]))
    highest = tops[np.argsort(-values[tops], kind="stable")][:_CANDIDATES]
    last = grid.size - 1
    return [(float(grid[max(k - 1, 0)]), float(grid[min(k + 1, last)])) for k in highest]


def _zoom(
    function: Callable[[NDArray[np.float64]], NDArray[np.float64]], low: float, high: float
) -> Peak:
    for _ in range(_ZOOMS):
        grid = np.linspace(low, high, _ZOOM_POINTS)
        values = np.asarray(function(grid), dtype=float)
        top = int(np.argmax(values))
        low, high = float(grid[max(top - 1, 0)]), float(grid[min(top + 1, _ZOOM_POINTS - 1)])
    return Peak(float(grid[top]), float(values[top]))
