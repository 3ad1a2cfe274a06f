"""Collocation schemes, each determined by its collocation points on [0, 1].

On an interval of length ``h`` a state is the polynomial through ``s + 1`` support points, the
first at 0; its derivative meets the dynamics at the ``s`` collocation points.  Radau IIA, Gauss
and Lobatto IIIA of every degree are of this kind, and so are the trapezoidal rule and
Hermite-Simpson, which are Lobatto IIIA of two and three points (Hairer, Norsett, Wanner, "Solving
Ordinary Differential Equations I", theorem II.7.7 and section II.7).  Orders on smooth problems:

===================================================  ======================  =====================
scheme of s points                                   end state and optimum   controls and costates
===================================================  ======================  =====================
Radau                                                2 s - 1                 s
Gauss                                                2 s                     s
Lobatto, Hermite-Simpson (s = 3), trapezoid (s = 2)  2 s - 2                 s - 1
===================================================  ======================  =====================

Controls and costates are meant between the points, too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from ocp.errors import StatementError

Array = NDArray[np.float64]
SchemeName = Literal["radau", "gauss", "lobatto", "hermite-simpson", "trapezoid"]
FIXED_DEGREE = {"trapezoid": 2, "hermite-simpson": 3}


@dataclass(frozen=True, eq=False)
class Scheme:
    """One collocation scheme.

    Attributes
    ----------
    points : (s,) collocation points.
    support : (s + 1,) support points of the state polynomial, the first is 0.
    own : (s,) index into `support` of each collocation point.
    derivative : (s, s + 1) derivative at each collocation point from the support values.
    weights : (s,) quadrature weights of the collocation points.
    end : (s + 1,) weights of the support values in the value at 1.
    order : int
        Order of the end state of an initial-value problem.
    """

    name: SchemeName
    degree: int
    points: Array
    support: Array
    own: NDArray[np.int64]
    derivative: Array
    weights: Array
    end: Array
    order: int

    @property
    def choices(self) -> int:
        """Number of coefficients of a free polynomial control in an interval.

        Schemes that collocate at both ends have one less than points: at a switch that lies on a
        breakpoint the value at the end has no influence on the optimum, and a control with as
        many coefficients as points would be undetermined there.  The optimum keeps its order,
        because it feels an error of the control squared.
        """
        return self.degree - 1 if self.points[0] == 0.0 else self.degree

    @property
    def control_order(self) -> int:
        """Order of polynomial controls and of costates, between the points too."""
        return self.choices

    @property
    def ends_on_support(self) -> bool:
        """Whether the last support point is the right end of the interval."""
        return bool(self.support[-1] == 1.0)

    @property
    def inner(self) -> int:
        """Number of support points between the ends of the interval."""
        return self.support.size - 1 - self.ends_on_support


@lru_cache(maxsize=256)
def scheme(name: SchemeName, degree: int) -> Scheme:
    """The scheme of that name with `degree` collocation points.

    Raises
    ------
    StatementError
        For an unknown name or a degree that the scheme does not have.
    """
    if name in FIXED_DEGREE:
        degree = FIXED_DEGREE[name]
    if name not in ("radau", "gauss", "lobatto", *FIXED_DEGREE):
        raise StatementError(
            f"'{name}' is no transcription; choose radau, gauss, lobatto, hermite-simpson or "
            "trapezoid"
        )
    least = 2 if name == "lobatto" else 1
    if degree < least:
        raise StatementError(f"{name} needs at least {least} points an interval, got {degree}")
    if name == "radau":
        points, order = radau_points(degree), 2 * degree - 1
    elif name == "gauss":
        points, order = 0.5 * (legendre.leggauss(degree)[0] + 1.0), 2 * degree
    else:
        points, order = lobatto_points(degree), 2 * degree - 2
    if points[0] == 0.0:  # a point at 0 adds no unknown: a free support point completes the degree
        support = np.insert(points, 1, 0.5 * (points[0] + points[1]))
        own = np.delete(np.arange(degree + 1), 1)
    else:
        support = np.concatenate([[0.0], points])
        own = np.arange(1, degree + 1)
    return Scheme(
        name, degree, points, support, own,
        derivative=derivative_matrix(support, points),
        weights=quadrature_weights(points),
        end=lagrange(support, np.array([1.0]))[0],
        order=order,
    )  # fmt: skip


def radau_points(degree: int) -> Array:
    """Right Radau points on (0, 1]: roots of ``P_{s-1} - P_s``, shifted."""
    if degree == 1:
        return np.array([1.0])
    coefficients = np.zeros(degree + 1)
    coefficients[degree - 1], coefficients[degree] = 1.0, -1.0
    roots = _polished(np.sort(legendre.legroots(coefficients).real), coefficients)
    points = 0.5 * (roots + 1.0)
    points[-1] = 1.0
    return points


def lobatto_points(degree: int) -> Array:
    """Lobatto points on [0, 1]: the ends and the roots of the derivative of ``P_{s-1}``."""
    coefficients = legendre.legder(np.eye(degree)[degree - 1])
    inner = legendre.legroots(coefficients).real if degree > 2 else np.empty(0)
    inner = _polished(np.sort(inner), coefficients)
    return np.concatenate([[0.0], 0.5 * (inner + 1.0), [1.0]])


def _polished(roots: Array, coefficients: Array) -> Array:
    slope = legendre.legder(coefficients)
    for _ in range(3):
        roots = roots - legendre.legval(roots, coefficients) / legendre.legval(roots, slope)
    return roots


def barycentric_weights(support: Array) -> Array:
    """Barycentric weights ``1 / prod_j (x_i - x_j)`` of support points, shape (m,)."""
    gaps = support[:, None] - support[None, :]
    np.fill_diagonal(gaps, 1.0)
    return 1.0 / np.asarray(np.prod(gaps, axis=1))


def lagrange(support: Array, at: Array) -> Array:
    """Values of the Lagrange basis, shape ``at.shape + (m,)``."""
    weights = barycentric_weights(support)
    gaps = np.asarray(at)[..., None] - support
    hit = gaps == 0.0
    terms = weights / np.where(hit, 1.0, gaps)
    terms = np.where(hit.any(axis=-1, keepdims=True), hit, terms)
    return np.asarray(terms / terms.sum(axis=-1, keepdims=True))


def bernstein(count: int, at: Array) -> Array:
    """Values of the Bernstein basis of `count` polynomials of degree ``count - 1``.

    A polynomial on [0, 1] lies between its least and largest Bernstein coefficient (Farouki,
    "The Bernstein polynomial basis: a centennial retrospective", 2012); shape ``at.shape +
    (count,)``.
    """
    tau, i = np.asarray(at, dtype=float)[..., None], np.arange(count)
    binomials = np.array([math.comb(count - 1, k) for k in i], dtype=float)
    return np.asarray(binomials * tau**i * (1.0 - tau) ** (count - 1 - i))


def derivative_matrix(support: Array, at: Array) -> Array:
    """Derivative of the interpolating polynomial at given points, shape (len(at), m)."""
    weights = barycentric_weights(support)
    gaps = support[:, None] - support[None, :]
    np.fill_diagonal(gaps, 1.0)
    nodal = (weights[None, :] / weights[:, None]) / gaps
    np.fill_diagonal(nodal, 0.0)
    np.fill_diagonal(nodal, -nodal.sum(axis=1))
    return np.asarray(lagrange(support, at) @ nodal)


def quadrature_weights(points: Array) -> Array:
    """Weights on [0, 1] of the interpolatory quadrature on the points."""
    nodes, gauss = legendre.leggauss(len(points))
    return np.asarray(0.5 * gauss @ lagrange(points, 0.5 * (nodes + 1.0)))
