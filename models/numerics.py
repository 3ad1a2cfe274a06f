"""Peaks of a function of one variable, located between samples as well as on them."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from models.arrays import Array
from models.errors import require

_CANDIDATES = 8  # highest grid maxima, all of which are refined
_ZOOMS = 5  # each narrows the bracket 100 times: 1e10 in all
_ZOOM_POINTS = 201


class Maximum(NamedTuple):
    """Greatest value of a function and where it is taken."""

    where: float
    value: float


def dense_peak(
    function: Callable[[Array], Array],
    start: float,
    end: float,
    *,
    breakpoints: Sequence[float] = (),
    samples: int = 2001,
) -> Maximum:
    """Greatest value of `function` on [start, end].

    Parameters
    ----------
    function : maps an array (m,) to values (m,); pass the absolute value where that is meant.
    breakpoints : points inside at which it need not be smooth; it is sampled piece by piece.
    samples : points on each piece; the highest maxima among them are refined by zooming in.

    Raises
    ------
    ModelError
        If the interval is empty or there are fewer than 3 samples.
    """
    require(start < end, f"the interval [{start:g}, {end:g}] is empty; give start < end.")
    require(samples >= 3, f"samples is {samples}; give at least 3.")
    inside = sorted({b for b in breakpoints if start < b < end})
    brackets = [
        bracket
        for left, right in itertools.pairwise([start, *inside, end])
        for bracket in _brackets(function, np.linspace(left, right, samples))
    ]
    highest = sorted(brackets, reverse=True)[:_CANDIDATES]
    return max((_zoom(function, low, high) for _, low, high in highest), key=lambda p: p.value)


def _brackets(function: Callable[[Array], Array], grid: Array) -> list[tuple[float, float, float]]:
    """Height and both neighbours of each local maximum on the grid."""
    values = np.asarray(function(grid), dtype=float)
    walled = np.concatenate([[-np.inf], values, [-np.inf]])
    tops = np.flatnonzero((values >= walled[:-2]) & (values >= walled[2:]))
    left, right = grid[np.maximum(tops - 1, 0)], grid[np.minimum(tops + 1, grid.size - 1)]
    return list(zip(values[tops].tolist(), left.tolist(), right.tolist(), strict=True))


def _zoom(function: Callable[[Array], Array], low: float, high: float) -> Maximum:
    for _ in range(_ZOOMS):
        grid = np.linspace(low, high, _ZOOM_POINTS)
        values = np.asarray(function(grid), dtype=float)
        top = int(np.argmax(values))
        low, high = float(grid[max(top - 1, 0)]), float(grid[min(top + 1, _ZOOM_POINTS - 1)])
    return Maximum(float(grid[top]), float(values[top]))
