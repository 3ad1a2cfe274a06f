"""Collocation schemes, each determined by its collocation points on [0, 1].

On an interval of length ``h`` a state is the polynomial through ``s + 1`` support points, the first
at 0. Its derivative meets the dynamics at the ``s`` collocation points. Radau IIA, Gauss and
Lobatto IIIA of every degree are of this kind. So are the trapezoidal rule and Hermite-Simpson,
which are Lobatto IIIA of two and three points (Hairer, Norsett, Wanner, "Solving Ordinary
Differential Equations I", theorem II.7.7 and section II.7). Orders on smooth problems:

===================================================  ======================  =====================
scheme of s points                                   end state and optimum   controls and costates
===================================================  ======================  =====================
Radau                                                2 s - 1                 s
Gauss                                                2 s                     s
Lobatto, Hermite-Simpson (s = 3), trapezoid (s = 2)  2 s - 2                 s - 1
===================================================  ======================  =====================

Controls and costates are meant between the points, too.

To add a scheme, write a subclass of `Scheme` that gives its points and its order, and add it to
`SCHEMES`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from numbers import Integral
from typing import ClassVar

import numpy as np
from numpy.polynomial import legendre

from ocp.arrays import Array, Integers
from ocp.errors import StatementError
from ocp.numerics.piecewise_polynomial import derivative_matrix, lagrange, quadrature_weights


@dataclass(frozen=True, eq=False, repr=False)
class Collocation:
    """The numbers of one scheme at one degree.

    Attributes
    ----------
    degree : int
        Number ``s`` of collocation points.
    points : (s,)
        Collocation points on [0, 1].
    support : (s + 1,)
        Support points of the state polynomial, the first is 0.
    own : (s,)
        Index into `support` of each collocation point.
    derivative : (s, s + 1)
        Derivative at each collocation point from the support values.
    weights : (s,)
        Quadrature weights of the collocation points.
    end : (s + 1,)
        Weights of the support values in the value at 1.
    order : int
        Order of the end state of an initial-value problem.
    choices : int
        Number of coefficients of a free polynomial control in an interval. Schemes that collocate
        at both ends have one less than points.
    control_order : int
        Order of polynomial controls and of costates, between the points too.
    ends_on_support : bool
        Whether the last support point is the right end of the interval.
    inner : int
        Number of support points between the ends of the interval.
    """

    degree: int
    points: Array
    support: Array
    own: Integers
    derivative: Array
    weights: Array
    end: Array
    order: int
    choices: int = field(init=False)
    control_order: int = field(init=False)
    ends_on_support: bool = field(init=False)
    inner: int = field(init=False)

    def __post_init__(self) -> None:
        # At a switch that lies on a breakpoint the value at the end has no influence on the
        # optimum, and a control with as many coefficients as points would be undetermined there.
        # The optimum keeps its order, because it feels an error of the control squared.
        choices = self.degree - 1 if self.points[0] == 0.0 else self.degree
        ends_on_support = bool(self.support[-1] == 1.0)
        object.__setattr__(self, "choices", choices)
        object.__setattr__(self, "control_order", choices)
        object.__setattr__(self, "ends_on_support", ends_on_support)
        object.__setattr__(self, "inner", self.support.size - 1 - ends_on_support)


@dataclass(frozen=True)
class Scheme:
    """A family of collocation schemes, and the degree of the first mesh.

    Parameters
    ----------
    degree : int
        Collocation points in each interval of the first mesh. Refinement may raise it.

    Attributes
    ----------
    name : str
        As messages and files call it.
    fixed_degree : bool
        Whether the rule has one degree only, so that refinement cannot raise it.
    exact_for_chains : bool
        Whether degree ``d`` integrates a chain whose last state is a polynomial of degree ``d``
        without error.
    informative_multipliers : bool
        Whether the multipliers tell what a finer control would gain. Those of the schemes that
        collocate at both ends meet the minimum principle on any mesh.

    Raises
    ------
    StatementError
        For a degree that the scheme does not have.
    """

    degree: int = 4

    name: ClassVar[str] = ""
    least_degree: ClassVar[int] = 1
    fixed_degree: ClassVar[bool] = False
    exact_for_chains: ClassVar[bool] = True
    informative_multipliers: ClassVar[bool] = True

    def __post_init__(self) -> None:
        degree: object = self.degree
        only = type(self).degree
        if self.fixed_degree and degree != only:
            raise StatementError(
                f"{self.name} always has {only} points in an interval, got {degree!r}; leave it out"
            )
        if not isinstance(degree, Integral) or self.degree < self.least_degree:
            raise StatementError(
                f"{self.name} has {self.degree!r} points in an interval; give a whole number of at "
                f"least {self.least_degree}"
            )

    def at(self, degree: int) -> Collocation:
        """The numbers of the scheme with `degree` collocation points.

        A rule of fixed degree has the same numbers whatever is asked for.
        """
        return _collocation(
            self.points_and_order, self.degree if self.fixed_degree else int(degree)
        )

    @classmethod
    def points_and_order(cls, degree: int) -> tuple[Array, int]:
        """Collocation points on [0, 1], shape (degree,), and the order of the end state."""
        raise TypeError(f"{cls.__name__} is not a scheme; choose one of {', '.join(SCHEMES)}")


class Radau(Scheme):
    """Radau IIA: collocates at the right end of each interval; stiffly accurate. The default.

    Parameters
    ----------
    degree : int
        Collocation points in each interval of the first mesh, at least 1. Refinement may raise it.
    """

    name: ClassVar[str] = "radau"

    @classmethod
    def points_and_order(cls, degree: int) -> tuple[Array, int]:
        """Right Radau points and their order ``2 s - 1``."""
        return radau_points(degree), 2 * degree - 1


class Gauss(Scheme):
    """Gauss: of the highest order; the right end of each interval is extrapolated.

    Parameters
    ----------
    degree : int
        Collocation points in each interval of the first mesh, at least 1. Refinement may raise it.
    """

    name: ClassVar[str] = "gauss"

    @classmethod
    def points_and_order(cls, degree: int) -> tuple[Array, int]:
        """Gauss points and their order ``2 s``."""
        return 0.5 * (legendre.leggauss(degree)[0] + 1.0), 2 * degree


class Lobatto(Scheme):
    """Lobatto IIIA: collocates at both ends of each interval.

    Parameters
    ----------
    degree : int
        Collocation points in each interval of the first mesh, at least 2. Refinement may raise it.
    """

    name: ClassVar[str] = "lobatto"
    least_degree: ClassVar[int] = 2
    informative_multipliers: ClassVar[bool] = False

    @classmethod
    def points_and_order(cls, degree: int) -> tuple[Array, int]:
        """Lobatto points and their order ``2 s - 2``."""
        return lobatto_points(degree), 2 * degree - 2


@dataclass(frozen=True)
class HermiteSimpson(Lobatto):
    """Hermite-Simpson: Lobatto IIIA of three points.

    Parameters
    ----------
    degree : int
        Collocation points in each interval of the first mesh: 3, always.
    """

    degree: int = 3
    name: ClassVar[str] = "hermite-simpson"
    fixed_degree: ClassVar[bool] = True
    exact_for_chains: ClassVar[bool] = False


@dataclass(frozen=True)
class Trapezoid(Lobatto):
    """The trapezoidal rule: Lobatto IIIA of two points.

    Parameters
    ----------
    degree : int
        Collocation points in each interval of the first mesh: 2, always.
    """

    degree: int = 2
    name: ClassVar[str] = "trapezoid"
    fixed_degree: ClassVar[bool] = True
    exact_for_chains: ClassVar[bool] = False


SCHEMES = {scheme.__name__: scheme for scheme in (Radau, Gauss, Lobatto, HermiteSimpson, Trapezoid)}


@lru_cache
def _collocation(points_and_order: Callable[[int], tuple[Array, int]], degree: int) -> Collocation:
    points, order = points_and_order(degree)

    if points[0] == 0.0:
        # a point at 0 adds no unknown: a free support point completes the degree
        support = np.insert(points, 1, 0.5 * (points[0] + points[1]))
        own = np.delete(np.arange(degree + 1), 1)
    else:
        support = np.concatenate([[0.0], points])
        own = np.arange(1, degree + 1)

    return Collocation(
        degree=degree,
        points=points,
        support=support,
        own=own,
        derivative=derivative_matrix(support, points),
        weights=quadrature_weights(points),
        end=lagrange(support, np.array([1.0]))[0],
        order=order,
    )


def radau_points(degree: int) -> Array:
    """Right Radau points on (0, 1]: roots of ``P_{s-1} - P_s``, shifted."""
    if degree == 1:
        return np.array([1.0])
    coefficients = np.zeros(degree + 1)
    coefficients[degree - 1], coefficients[degree] = 1.0, -1.0
    roots = _polished(np.sort(legendre.legroots(coefficients).real), coefficients)

    # the last root is 1 exactly, which the root finder meets to rounding only
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
    """Roots of a Legendre series after three Newton steps, which reach rounding."""
    slope = legendre.legder(coefficients)
    for _ in range(3):
        roots = roots - legendre.legval(roots, coefficients) / legendre.legval(roots, slope)
    return roots
