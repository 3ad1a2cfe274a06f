"""Piecewise polynomials of time: the one representation of states, controls and algebraic signals.

A constant control has one Bernstein coefficient in an interval, a linear one two, a polynomial one
as many as it has degrees of freedom. States have a Lagrange basis on the support points of their
collocation. All of them are values of `PiecewisePolynomial`, which may have several components.
What the bases are on the unit interval, with derivatives and quadrature, stands at the end.

The largest values of smooth functions in each of many intervals are found between samples, too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.polynomial import legendre

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
    return chebyshev_extrema(_SAMPLES_PER_POINT * degree + 9)


def chebyshev_extrema(count: int) -> Array:
    """Where a Chebyshev polynomial on [0, 1] is largest, its ends among them, shape (count,)."""
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
    level: float | None = None,
) -> Extremes:
    """Largest value in every interval from dense samples, by repeated zooming in.

    Parameters
    ----------
    function : callable
        Takes intervals and local times, (m,) each, and returns (m,) values.
    values : (N, m)
        The function at the local times `grid` (m,) of all intervals.
    level : float or None
        Only what may reach it is zoomed in on; None for the largest value of all.
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
        near = _reach(values[row, peak], lowest) >= (best.max() if level is None else level)
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


@dataclass(frozen=True)
class Bernstein:
    """The Bernstein basis on [0, 1]: coefficients bound the polynomial from both sides."""

    count: int

    def values(self, tau: Array) -> Array:
        """The basis at local times, shape (m, count)."""
        return bernstein(self.count, tau)

    def slopes(self, tau: Array) -> Array:
        """Its derivative by local time, shape (m, count)."""
        return bernstein_slopes(self.count, tau)


@dataclass(frozen=True)
class Lagrange:
    """The Lagrange basis on given support points: coefficients are values at these."""

    support: tuple[float, ...]

    @property
    def count(self) -> int:
        """Number of coefficients."""
        return len(self.support)

    def values(self, tau: Array) -> Array:
        """The basis at local times, shape (m, count)."""
        return _lagrange(*_with_weights(self.support), tau)

    def slopes(self, tau: Array) -> Array:
        """Its derivative by local time, shape (m, count)."""
        return derivative_matrix(np.array(self.support), tau)


Basis = Bernstein | Lagrange


@lru_cache
def to_bernstein(basis: Basis) -> Array:
    """Matrix (count, count) from the coefficients of a basis to Bernstein coefficients."""
    if isinstance(basis, Bernstein):
        return np.eye(basis.count)
    points = _chebyshev(basis.count)
    return np.asarray(np.linalg.solve(bernstein(basis.count, points), basis.values(points)))


@lru_cache
def to_powers(basis: Basis) -> Array:
    """Matrix (count, count) from the coefficients of a basis to those of powers of local time."""
    points = _chebyshev(basis.count)
    vandermonde = np.vander(points, increasing=True)
    return np.asarray(np.linalg.solve(vandermonde, basis.values(points)))


def _chebyshev(count: int) -> Array:
    """Extrema of Chebyshev's polynomial on [0, 1]: a change of basis is well conditioned there."""
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * np.arange(count) / max(count - 1, 1)))


@dataclass(frozen=True, eq=False, repr=False)
class Piece:
    """The intervals that share a basis.

    Attributes
    ----------
    intervals : (m,)
        Their numbers, in increasing order.
    coefficients : (m, count, n)
        Coefficients of each interval and component.
    """

    intervals: Integers
    basis: Basis
    coefficients: Array


@dataclass(frozen=True, eq=False, repr=False)
class PiecewisePolynomial:
    """Polynomials of local time in each interval, with `n` components.

    Attributes
    ----------
    breakpoints : (N + 1,)
        Times of the breakpoints [s].
    pieces : tuple of Piece
        Together they hold every interval once.
    components, intervals : int
        Their numbers n and N.
    orders : (N,)
        Degree of the polynomials in each interval.
    """

    breakpoints: Array
    pieces: tuple[Piece, ...]
    components: int = field(init=False)
    intervals: int = field(init=False)
    orders: Integers = field(init=False)

    def __post_init__(self) -> None:
        intervals = len(self.breakpoints) - 1
        orders = np.empty(intervals, dtype=np.int64)
        for piece in self.pieces:
            orders[piece.intervals] = piece.basis.count - 1
        object.__setattr__(self, "components", int(self.pieces[0].coefficients.shape[2]))
        object.__setattr__(self, "intervals", intervals)
        object.__setattr__(self, "orders", orders)

    def __repr__(self) -> str:
        lowest, highest = int(self.orders.min()), int(self.orders.max())
        degree = f"{lowest}" if lowest == highest else f"{lowest} to {highest}"
        return (
            f"PiecewisePolynomial({self.intervals} intervals of degree {degree}, "
            f"{self.components} components, {self.breakpoints[0]:.6g} to "
            f"{self.breakpoints[-1]:.6g} s)"
        )

    def part(self, components: Sequence[int]) -> PiecewisePolynomial:
        """Some of the components on their own."""
        pieces = tuple(
            Piece(p.intervals, p.basis, p.coefficients[:, :, list(components)]) for p in self.pieces
        )
        return PiecewisePolynomial(self.breakpoints, pieces)

    def value(self, intervals: Integers, tau: Array) -> Array:
        """Values at local times of intervals, both (m,), shape (m, n)."""
        return self._combined(intervals, lambda basis, here: basis.values(tau[here]))

    def rate(self, intervals: Integers, tau: Array) -> Array:
        """Time derivatives at local times of intervals, shape (m, n) [unit / s]."""
        slopes = self._combined(intervals, lambda basis, here: basis.slopes(tau[here]))
        return slopes / np.diff(self.breakpoints)[intervals][:, None]

    def _combined(self, intervals: Integers, weights: Callable[[Basis, Any], Array]) -> Array:
        """Coefficients of intervals, weighted by numbers of their basis."""
        values = np.empty((intervals.size, self.components))
        for piece, here, row in self._by_piece(intervals):
            own = weights(piece.basis, here)
            values[here] = np.einsum("ms,msn->mn", own, piece.coefficients[row])
        return values

    def at(self, times: Array) -> Array:
        """Values at times (m,) [s], shape (m, n); a breakpoint belongs to its right."""
        return self.value(*located(self.breakpoints, times))

    def ends(self) -> Array:
        """Values at both ends of every interval, shape (N, 2, n)."""
        every = np.arange(self.intervals)
        sides = [self.value(every, np.full(every.size, end)) for end in (0.0, 1.0)]
        return np.stack(sides, axis=1)

    def range(self) -> tuple[Array, Array]:
        """Bounds of each component in each interval, (N, n) each, by Bernstein coefficients."""
        lower, upper = np.empty((2, self.intervals, self.components))
        for piece in self.pieces:
            coefficients = np.einsum("bs,msn->mbn", to_bernstein(piece.basis), piece.coefficients)
            lower[piece.intervals] = coefficients.min(axis=1)
            upper[piece.intervals] = coefficients.max(axis=1)
        return lower, upper

    def powers(self) -> Array:
        """Coefficients of the powers of local time, padded with zeros, shape (N, n, highest)."""
        highest = max(piece.basis.count for piece in self.pieces)
        table = np.zeros((self.intervals, self.components, highest))
        for piece in self.pieces:
            powers = np.einsum("ps,msn->mnp", to_powers(piece.basis), piece.coefficients)
            table[piece.intervals, :, : piece.basis.count] = powers
        return table

    def _by_piece(self, intervals: Integers) -> Iterator[tuple[Piece, Any, Integers]]:
        """The pieces that some intervals belong to: which of them, and their rows there."""
        if len(self.pieces) == 1:
            piece = self.pieces[0]
            yield piece, slice(None), np.searchsorted(piece.intervals, intervals)
            return
        owner = np.empty(self.intervals, dtype=np.int64)
        for number, piece in enumerate(self.pieces):
            owner[piece.intervals] = number
        owners = owner[intervals]
        for number, piece in enumerate(self.pieces):
            here = np.flatnonzero(owners == number)
            if here.size:
                yield piece, here, np.searchsorted(piece.intervals, intervals[here])


def located(breakpoints: Array, times: Array) -> tuple[Integers, Array]:
    """Interval and local time in [0, 1] of each time; a breakpoint belongs to its right."""
    t = np.asarray(times, dtype=float)
    intervals = np.searchsorted(breakpoints, t, side="right") - 1
    intervals = np.clip(intervals, 0, len(breakpoints) - 2)
    return intervals, (t - breakpoints[intervals]) / np.diff(breakpoints)[intervals]


def barycentric_weights(support: Array) -> Array:
    """Barycentric weights ``1 / prod_j (x_i - x_j)`` of support points, shape (m,)."""
    gaps = support[:, None] - support[None, :]
    np.fill_diagonal(gaps, 1.0)
    return 1.0 / np.asarray(np.prod(gaps, axis=1))


@lru_cache
def _with_weights(support: tuple[float, ...]) -> tuple[Array, Array]:
    """Support points as an array, and their barycentric weights."""
    points = np.array(support)
    return points, barycentric_weights(points)


def lagrange(support: Array, tau: Array) -> Array:
    """Values of the Lagrange basis on the support points, shape ``tau.shape + (m,)``."""
    return _lagrange(support, barycentric_weights(support), tau)


def _lagrange(support: Array, weights: Array, tau: Array) -> Array:
    """The same with the barycentric weights."""
    gaps = np.asarray(tau)[..., None] - support

    # at a support point the barycentric form divides by zero: the basis is 0 or 1 there
    hit = gaps == 0.0
    some = bool(hit.any())
    terms = weights / (np.where(hit, 1.0, gaps) if some else gaps)
    if some:
        terms = np.where(hit.any(axis=-1, keepdims=True), hit, terms)
    return np.asarray(terms / terms.sum(axis=-1, keepdims=True))


def derivative_matrix(support: Array, tau: Array) -> Array:
    """Derivative of the interpolating polynomial at local times, shape (len(tau), m)."""
    weights = barycentric_weights(support)
    gaps = support[:, None] - support[None, :]
    np.fill_diagonal(gaps, 1.0)
    nodal = (weights[None, :] / weights[:, None]) / gaps

    # each row sums to zero, because the derivative of a constant is zero
    np.fill_diagonal(nodal, 0.0)
    np.fill_diagonal(nodal, -nodal.sum(axis=1))
    return np.asarray(lagrange(support, tau) @ nodal)


def bernstein(count: int, tau: Array) -> Array:
    """Values of the Bernstein basis of `count` polynomials of degree ``count - 1``.

    A polynomial on [0, 1] lies between its least and largest Bernstein coefficient (Farouki,
    "The Bernstein polynomial basis: a centennial retrospective", Computer Aided Geometric Design
    29, 2012). The shape is ``tau.shape + (count,)``.
    """
    local, i = np.asarray(tau, dtype=float)[..., None], np.arange(count)
    if count == 1:
        return np.ones_like(local)
    binomials = np.array([math.comb(count - 1, k) for k in i], dtype=float)
    return np.asarray(binomials * local**i * (1.0 - local) ** (count - 1 - i))


def elevation(count: int, higher: int) -> Array:
    """From Bernstein coefficients to those of the same polynomial in a larger basis.

    Shape (higher, count); see Farouki's review, section 3.2.
    """
    n, m = count - 1, higher - 1
    table = [
        [
            math.comb(n, i) * math.comb(m - n, j - i) / math.comb(m, j) if j >= i else 0.0
            for i in range(count)
        ]
        for j in range(higher)
    ]
    return np.array(table)


def bernstein_slopes(count: int, tau: Array) -> Array:
    """Derivatives of the Bernstein basis by local time, shape ``tau.shape + (count,)``."""
    if count == 1:
        return np.zeros((*np.shape(tau), 1))

    # B'_{i,n} = n (B_{i-1,n-1} - B_{i,n-1})
    lower = bernstein(count - 1, tau)
    padded = np.pad(lower, [(0, 0)] * (lower.ndim - 1) + [(1, 1)])
    return np.asarray((count - 1) * (padded[..., :-1] - padded[..., 1:]))


def quadrature_weights(points: Array) -> Array:
    """Weights on [0, 1] of the interpolatory quadrature on the points, shape (m,)."""
    nodes, gauss = legendre.leggauss(len(points))
    return np.asarray(0.5 * gauss @ lagrange(points, 0.5 * (nodes + 1.0)))
