"""The planar two-node ANCF cable element, equations (1)-(10) of the paper.

Lu, Qi, Hu, Li, Zhang, IEEE Access 2019, DOI 10.1109/ACCESS.2019.2918614.

Symbols: e element coordinates (8,) `[r_i, r'_i, r_j, r'_j]` [m, -], L element length [m],
xi = x/L in [0, 1], eps axial strain [-], kappa curvature [1/m], EA axial stiffness [N],
EI bending stiffness [N m^2].

Expressions are CasADi symbols in, CasADi symbols out; tables are NumPy arrays. Quadrature is
exact: the axial energy has degree 8 in x (5 Gauss points), the bending energy 2 (2 points).
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from models.arrays import Array
from models.numerics import gauss_legendre

AXIAL_POINTS = 5
BENDING_POINTS = 2


def shape_row(xi: float, L: float, derivative: int = 0) -> Array:
    """Return S_1..S_4 of (2), or their derivative by x of order 1 or 2, at one point; (4,)."""
    rows = (
        (
            1 - 3 * xi**2 + 2 * xi**3,
            L * (xi - 2 * xi**2 + xi**3),
            3 * xi**2 - 2 * xi**3,
            L * (xi**3 - xi**2),
        ),
        (
            (6 * xi**2 - 6 * xi) / L,
            1 - 4 * xi + 3 * xi**2,
            (6 * xi - 6 * xi**2) / L,
            3 * xi**2 - 2 * xi,
        ),
        (
            (12 * xi - 6) / L**2,
            (6 * xi - 4) / L,
            (6 - 12 * xi) / L**2,
            (6 * xi - 2) / L,
        ),
    )
    return np.array(rows[derivative])


def mass_matrix(L: float, linear_density: float) -> Array:
    """Return M of (5), constant, (8, 8) [kg and kg m, kg m^2 on the slopes]."""
    m = np.array(
        [
            [13 / 35, 11 * L / 210, 9 / 70, -13 * L / 420],
            [11 * L / 210, L**2 / 105, 13 * L / 420, -(L**2) / 140],
            [9 / 70, 13 * L / 420, 13 / 35, -11 * L / 210],
            [-13 * L / 420, -(L**2) / 140, -11 * L / 210, L**2 / 105],
        ]
    )
    return linear_density * L * np.kron(m, np.eye(2))


def strain_energy(e: Any, EA: Any, EI: Any, L: Any) -> Any:
    """Return U of (6) [J] with strain and curvature (7), for symbols `e` (8, 1).

    The curvature is `|r''|`, right where `|r'|` is near 1.
    """
    nodes = ca.reshape(e, 2, 4)
    energy = 0

    for xi, weight in zip(*gauss_legendre(AXIAL_POINTS), strict=True):
        slope = nodes @ _symbolic_row(xi, L, 1)
        eps = (ca.dot(slope, slope) - 1) / 2
        energy += weight * L * EA * eps**2 / 2

    for xi, weight in zip(*gauss_legendre(BENDING_POINTS), strict=True):
        curvature = nodes @ _symbolic_row(xi, L, 2)
        energy += weight * L * EI * ca.dot(curvature, curvature) / 2

    return energy


@lru_cache(maxsize=1)
def element_kernel() -> ca.Function:
    """Compile one element: `(e, EA, EI, L) -> (energy, gradient (8,), tangent (8, 8))`.

    The tangent is the Hessian of (6); it has the term
    `int EA (S'^T S' e)(S'^T S' e)^T dx` beside the secant stiffness (9).
    """
    e = ca.SX.sym("e", 8)
    EA, EI, L = (ca.SX.sym(name) for name in ("EA", "EI", "L"))
    energy = strain_energy(e, EA, EI, L)
    tangent, gradient = ca.hessian(energy, e)
    names = ["e", "EA", "EI", "L"], ["energy", "gradient", "tangent"]
    return ca.Function("ancf_element", [e, EA, EI, L], [energy, gradient, tangent], *names)


def moment_force(slope_x: Any, slope_y: Any, moment: Any) -> tuple[Any, Any]:
    """Generalised force of a counter-clockwise moment on the slope of its node, (10) [N m].

    The paper's labels of the two nodes are swapped and the right-hand one lacks a zero; for
    either node the force is `moment * [-r'_y, r'_x] / |r'|^2` on that node's slope.
    Plain arithmetic: takes floats, arrays and symbols alike.
    """
    factor = moment / (slope_x**2 + slope_y**2)
    return -factor * slope_y, factor * slope_x


def _symbolic_row(xi: float, L: Any, derivative: int) -> Any:
    """`shape_row` for a symbolic length, (4, 1)."""
    at_length_one = shape_row(xi, 1.0, derivative)
    return ca.vertcat(*(at_length_one[i] * L ** (i % 2 - derivative) for i in range(4)))
