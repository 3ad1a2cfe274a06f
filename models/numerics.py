"""Numerical methods that several models share.

Nodes of Gauss-Legendre and of Radau quadrature on [0, 1], the inside of an interval, and the
greatest value of a function of one variable, located between samples as well as on them.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.polynomial import legendre

from models.arrays import Array
from models.errors import require

VectorFunction: TypeAlias = Callable[[Array], Array]
"""Maps points to values of the same shape, (m,) unless another is stated."""

# Highest maxima of the grid, all of which are refined: beside the highest one, a narrower and
# truly higher ridge may show a lower sample.
_CANDIDATES = 8
# Brackets are narrowed so many times, below which values of double precision no longer tell
# neighbours apart near a smooth maximum.
_NARROWER = 1e10


def gauss_legendre(points: int) -> tuple[Array, Array]:
    """Nodes and weights (points,) on [0, 1], exact for polynomials of degree 2 points - 1."""
    nodes, weights = legendre.leggauss(points)
    return (1 + nodes) / 2, weights / 2


def radau_nodes(points: int) -> Array:
    """Nodes (points,) of the right Radau quadrature on [0, 1], the last of which is 1.

    They are the roots of P_s - P_(s-1), with P_s the Legendre polynomial of degree s = points on
    [-1, 1]. Their quadrature is exact for polynomials of degree 2 points - 2.
    """
    difference = np.zeros(points + 1)
    difference[-2:] = -1.0, 1.0
    # all roots are real; NumPy 2.5 and later return them as complex numbers all the same
    nodes: Array = (1 + np.sort(legendre.legroots(difference).real)) / 2

    # The end is a root by construction: its rounding would leave a gap between two steps.
    nodes[-1] = 1.0
    return nodes


def interior(start: float, end: float) -> tuple[float, float]:
    """The interval moved inward by some rounding: a function that jumps at an end is inside it."""
    edge = 1e-13 * max(1.0, abs(start), abs(end))
    return start + edge, end - edge


class Maximum(NamedTuple):
    """Greatest value of a function and where it is taken."""

    where: float
    value: float


def dense_peak(
    function: VectorFunction,
    start: float,
    end: float,
    *,
    breakpoints: Sequence[float] = (),
    samples: int = 2001,
) -> Maximum:
    """Greatest value of `function` on [start, end].

    Parameters
    ----------
    function : callable
        Maps an array (m,) to values (m,). Pass the absolute value where that is meant.
    start, end : float
    breakpoints : sequence of float
        Points inside at which it need not be smooth. It is sampled piece by piece.
    samples : int
        Points on each piece. The highest maxima among them are refined by zooming in.

    Raises
    ------
    ModelError
        If the interval is empty or there are fewer than 3 samples.
    """
    require(start < end, f"the interval [{start:g}, {end:g}] is empty; give start < end.")
    require(samples >= 3, f"samples is {samples}; give at least 3.")

    inside = sorted({point for point in breakpoints if start < point < end})
    brackets = [
        bracket
        for left, right in itertools.pairwise([start, *inside, end])
        for bracket in _brackets(function, np.linspace(left, right, samples))
    ]

    highest = sorted(brackets, reverse=True)[:_CANDIDATES]
    _, left, right = map(np.array, zip(*highest, strict=True))
    maxima = peaks_in(lambda points: function(points.ravel()).reshape(points.shape), left, right)
    return max(maxima, key=lambda maximum: maximum.value)


def _brackets(function: VectorFunction, grid: Array) -> list[tuple[float, float, float]]:
    """Height and both neighbours of each local maximum on the grid."""
    values = np.asarray(function(grid), dtype=float)

    # An end counts as a maximum if it exceeds its one neighbour.
    walled = np.concatenate([[-np.inf], values, [-np.inf]])
    tops = np.flatnonzero((values >= walled[:-2]) & (values >= walled[2:]))

    left, right = grid[np.maximum(tops - 1, 0)], grid[np.minimum(tops + 1, grid.size - 1)]
    return list(zip(values[tops].tolist(), left.tolist(), right.tolist(), strict=True))


def peaks_in(
    function: VectorFunction, left: Array, right: Array, points: int = 201
) -> list[Maximum]:
    """Maximum in each of several brackets, by grids that shrink about the highest sample.

    A search by derivatives or parabolas would fail at the kinks and plateaus that are allowed.

    Parameters
    ----------
    function : callable
        Maps points (n, m) to values (n, m); each row may be another function.
    left, right : (n,)
        Ends of the brackets.
    points : int
        Of each grid, 5 or more. Many see several maxima in a bracket, ten are the fastest.
    """
    rows = np.arange(len(left))
    for _ in range(math.ceil(math.log(_NARROWER) / math.log((points - 1) / 2))):
        grid = np.linspace(left, right, points, axis=1)
        values = np.asarray(function(grid), dtype=float)
        top = np.argmax(values, axis=1)
        left = grid[rows, np.maximum(top - 1, 0)]
        right = grid[rows, np.minimum(top + 1, points - 1)]

    found = zip(grid[rows, top].tolist(), values[rows, top].tolist(), strict=True)
    return [Maximum(where, value) for where, value in found]
