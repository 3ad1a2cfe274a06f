"""A measured curve of resisting torque against the deployment angle, as an expression.

Between its rows it is a monotone cubic (PCHIP): smooth, through every row, and never beyond the two
rows beside it.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from models.arrays import Array

if TYPE_CHECKING:
    from models.truss.parameters import TrussParameters

Curve = tuple[tuple[float, float], ...]  # (angle, torque) [rad, N m]
MOST_ROWS = 40  # of the curve that the problem sees: its expressions grow with them


def measured_torque(parameters: TrussParameters, alpha: Any) -> Any:
    """Measured load of a truss that opens [N m], at an angle; 0 without a curve."""
    curve = parameters.measured_torque
    return torque_at(curve, 1.0, alpha) if curve else 0.0


@lru_cache(maxsize=8)
def knots(curve: Curve, factor: float) -> tuple[Array, Array]:
    """Angles (n,) and cubic coefficients (4, n - 1) of the factored curve, monotone between rows.

    A torque that helps is not multiplied. A curve of more than `MOST_ROWS` rows is taken at as many
    even angles.
    """
    from scipy.interpolate import PchipInterpolator

    angle, torque = np.array(curve).T
    torque = np.where(torque > 0, factor * torque, torque)
    shape = PchipInterpolator(angle, torque)
    if angle.size > MOST_ROWS:
        angle = np.linspace(angle[0], angle[-1], MOST_ROWS)
        shape = PchipInterpolator(angle, shape(angle))
    return angle, np.asarray(shape.c)


def thinning_error(curve: Curve) -> float:
    """By how much the curve that is used misses the rows at most [N m]."""
    angle, torque = np.array(curve).T
    used, coefficients = knots(curve, 1.0)
    piece = np.clip(np.searchsorted(used, angle) - 1, 0, used.size - 2)
    x = angle - used[piece]
    cubic, square, slope, value = coefficients[:, piece]
    return float(np.abs(((cubic * x + square) * x + slope) * x + value - torque).max())


def torque_at(curve: Curve, factor: float, alpha: Any) -> Any:
    """Factored resisting torque [N m] at an angle, as an expression or a DM."""
    angle, coefficients = knots(curve, factor)
    inner = ca.DM(angle[1:-1])

    def piece(values: Array) -> Any:
        if isinstance(alpha, float | ca.DM):  # CasADi has the step for expressions alone
            place = np.searchsorted(angle[1:-1], np.array(alpha), side="right")
            return ca.DM(values[place])
        return ca.pw_const(alpha, inner, ca.DM(values)) if inner.numel() else float(values[0])

    x = alpha - piece(angle[:-1])
    cubic, square, slope, value = (piece(row) for row in coefficients)
    return ((cubic * x + square) * x + slope) * x + value
