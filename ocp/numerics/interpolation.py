"""Polynomials on the unit interval: Lagrange and Bernstein bases, derivatives, quadrature."""

from __future__ import annotations

import math

import numpy as np
from numpy.polynomial import legendre

from ocp.arrays import Array


def barycentric_weights(support: Array) -> Array:
    """Barycentric weights ``1 / prod_j (x_i - x_j)`` of support points, shape (m,)."""
    gaps = support[:, None] - support[None, :]
    np.fill_diagonal(gaps, 1.0)
    return 1.0 / np.asarray(np.prod(gaps, axis=1))


def lagrange(support: Array, tau: Array) -> Array:
    """Values of the Lagrange basis on the support points, shape ``tau.shape + (m,)``."""
    weights = barycentric_weights(support)
    gaps = np.asarray(tau)[..., None] - support

    # at a support point the barycentric form divides by zero: the basis is 0 or 1 there
    hit = gaps == 0.0
    terms = weights / np.where(hit, 1.0, gaps)
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
    binomials = np.array([math.comb(count - 1, k) for k in i], dtype=float)
    return np.asarray(binomials * local**i * (1.0 - local) ** (count - 1 - i))


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
