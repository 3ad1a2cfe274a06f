"""A smoothing spline with a stated criterion, and the band in which the true curve lies.

The spline is quintic on even knots, and its roughness is the integral of the squared fourth
derivative. How much it smooths follows from restricted maximum likelihood (REML): the curve is
taken as a sum of a polynomial and a random part, whose size and the noise are those under which
the data are most likely (Wahba 1985; Wood 2011). The same view gives the scatter of the curve and
of its derivatives about the truth, in which the smoothing's bias is contained (Nychka 1988).

Symbols: y data, s their relative scatter, B the basis at their times, c coefficients, D roughness
matrix, l its weight, a = 1 / (1 + l d) the shrinking of each mode.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.interpolate import BSpline
from scipy.linalg import cholesky, eigh, solve_triangular
from scipy.optimize import minimize_scalar

from ocp.arrays import Array

DEGREE = 5
PENALISED = 4  # order of the derivative whose square is the roughness
SHARE = 0.95  # of curves that lie within a band, everywhere at once
DRAWS = 400  # of curves, for the width of a band
GRID = 1001  # instants at which a band is worked out
WEIGHTS = np.linspace(-50.0, 30.0, 161)  # logarithms of l that are tried first
_GAUSS = 6  # points an interval; exact for the squared fourth derivative of a quintic


@dataclass(frozen=True, eq=False)
class SmoothingSpline:
    """A fitted spline and how sure it is.

    Attributes
    ----------
    curve : the spline itself, a SciPy BSpline.
    again : the curve smoothed once more: what it lost shows the bias of smoothing once.
    noise : standard deviation of the data about it, in their unit.
    freedom : effective number of parameters.
    scatter : (n, k) times standard normal numbers (k,) is a draw of the coefficients' error.
    """

    curve: Any
    again: Any
    noise: float
    freedom: float
    scatter: Array

    @cached_property
    def grid(self) -> Array:
        """Instants (GRID,) from start to end."""
        return np.linspace(self.curve.t[0], self.curve.t[-1], GRID)

    def deviation(self, time: Array, order: int) -> Array:
        """Standard deviations (m,) of a derivative of the curve from that of the truth."""
        spread = self._basis(time, order) @ self.scatter
        return np.sqrt((spread**2).sum(axis=1))

    def band(self, order: int) -> Array:
        """Half-widths (GRID,) of the band that holds a derivative everywhere at once."""
        spread = self._basis(self.grid, order) @ self.scatter
        return simultaneous(spread @ _normal(spread.shape[1]))

    def draws(self, count: int) -> list[Any]:
        """Curves that the data allow as well."""
        shifts = (self.scatter @ _normal(self.scatter.shape[1], count)).T
        return [BSpline(self.curve.t, self.curve.c + shift, DEGREE) for shift in shifts]

    def _basis(self, time: Array, order: int) -> Array:
        return _basis(self.curve.t, time, order)


def simultaneous(deviations: Array) -> Array:
    """Half-widths (m,) of the band that holds a share `SHARE` of draws (m, n) everywhere."""
    size = np.sqrt((deviations**2).mean(axis=1))
    size = np.maximum(size, 1e-12 * size.max() + 1e-300)  # nothing scatters where an end is given
    return np.asarray(np.quantile(np.abs(deviations / size[:, None]).max(axis=0), SHARE) * size)


def _normal(size: int, count: int = DRAWS) -> Array:
    # always the same draws, so that a check can be repeated
    return np.random.default_rng(20190529).standard_normal((size, count))


def smooth(
    time: Array, values: Array, scale: Array, intervals: int, rest: tuple[int, int]
) -> SmoothingSpline:
    """Fit the smoothing spline.

    Parameters
    ----------
    time, values : (m,)
    scale : (m,)
        Relative standard deviation of each value.
    intervals : int
        Between its knots.
    rest : (int, int)
        Derivatives that vanish at start and end: 0 none, 1 the speed, 2 the acceleration, too.
    """
    begin, end = float(time[0]), float(time[-1])
    edges = np.linspace(begin, end, intervals + 1)
    knots = np.concatenate([[begin] * DEGREE, edges, [end] * DEGREE])
    tied = _tied(intervals + DEGREE, rest)

    # equal parts of the first value are taken out, so that squares lose no digits
    level = float(values[0])
    basis = BSpline.design_matrix(time, knots, DEGREE).multiply(1 / scale[:, None]).tocsr()
    data = (values - level) / scale
    gram = tied.T @ (basis.T @ basis).toarray() @ tied
    rough = _roughness(knots, edges, tied)

    # a knot interval without data would leave its coefficients open
    gram += 1e-14 * np.trace(gram) / len(gram) * np.eye(len(gram))
    root = cholesky(gram, lower=True)
    rough_free, outside = _least_squares(basis, data, tied, root)

    # modes in which both data and roughness are diagonal (Demmler and Reinsch)
    half = solve_triangular(root, rough, lower=True)
    d, modes = eigh(_symmetric(solve_triangular(root, half.T, lower=True)))
    smooth_modes = max(1, PENALISED - sum(rest))  # polynomials that no roughness touches
    d = np.maximum(d, 0.0)
    d[:smooth_modes] = 0.0
    z = modes.T @ (root.T @ rough_free)

    fit = _Likelihood(d, z, outside, time.size, smooth_modes)
    shrink = fit.shrink(fit.best)
    noise = float(np.sqrt(fit.residual(shrink) / max(time.size - shrink.sum(), 1.0)))
    back = tied @ solve_triangular(root.T, modes, lower=False)
    curve, again = (BSpline(knots, back @ (a * z) + level, DEGREE) for a in (shrink, shrink**2))
    scatter = noise * back * np.sqrt(shrink)
    return SmoothingSpline(curve, again, noise, float(shrink.sum()), scatter)


@dataclass(frozen=True, eq=False)
class _Likelihood:
    """How likely the data are under a weight of the roughness.

    `outside` is the sum of squares that no spline of these knots removes.
    """

    d: Array
    z: Array
    outside: float
    rows: int
    free: int

    def shrink(self, log_weight: float) -> Array:
        return np.asarray(1 / (1 + np.exp(log_weight) * self.d))

    def residual(self, a: Array) -> float:
        return max(self.outside + float((((1 - a) * self.z) ** 2).sum()), 1e-300)

    def restricted(self, log_weight: float) -> float:
        """Twice the negative logarithm of the restricted likelihood, but for a constant."""
        a = self.shrink(log_weight)
        penalty = np.exp(log_weight) * float((self.d * (a * self.z) ** 2).sum())
        random = len(self.d) - self.free
        size = (self.rows - self.free) * np.log(self.residual(a) + penalty)
        return float(size - np.log(a).sum() - random * log_weight)

    @cached_property
    def best(self) -> float:
        tried = [self.restricted(weight) for weight in WEIGHTS]
        place = int(np.argmin(tried))
        low, high = WEIGHTS[max(place - 1, 0)], WEIGHTS[min(place + 1, len(WEIGHTS) - 1)]
        return float(minimize_scalar(self.restricted, bounds=(low, high), method="bounded").x)


def _tied(size: int, rest: tuple[int, int]) -> Array:
    """Coefficients from those that are free: equal ones at an end make derivatives vanish there."""
    first, last = rest
    place = np.clip(np.arange(size) - first, 0, size - 1 - first - last)
    return np.eye(size - first - last)[place]


def _basis(knots: Array, time: Array, order: int = 0) -> Array:
    every = BSpline(knots, np.eye(len(knots) - DEGREE - 1), DEGREE)
    return np.asarray(every(time, nu=order))


def _least_squares(basis: Any, data: Array, tied: Array, root: Array) -> tuple[Array, float]:
    """Coefficients without smoothing, refined once, and the sum of squares that they leave."""
    coefficients, left = np.zeros(tied.shape[1]), data
    for _ in range(2):
        half = solve_triangular(root, tied.T @ (basis.T @ left), lower=True)
        coefficients = coefficients + solve_triangular(root.T, half, lower=False)
        left = data - basis @ (tied @ coefficients)
    return coefficients, float(left @ left)


def _roughness(knots: Array, edges: Array, tied: Array) -> Array:
    """Integral of the squared fourth derivative as a matrix, in units of the duration."""
    nodes, weights = np.polynomial.legendre.leggauss(_GAUSS)
    half = np.diff(edges)[:, None] / 2
    inside = (edges[:-1, None] + half * (1 + nodes)).ravel()
    rows = _basis(knots, inside, PENALISED) @ tied
    scaled = (half * weights).ravel() * (edges[-1] - edges[0]) ** (2 * PENALISED - 1)
    return _symmetric((rows.T * scaled) @ rows)


def _symmetric(matrix: Array) -> Array:
    return (matrix + matrix.T) / 2
