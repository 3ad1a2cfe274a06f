"""A measured curve of resisting torque against the deployment angle."""

from __future__ import annotations

import csv
import math
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from ocp.arrays import Array
from studies.common.configuration import finite
from studies.common.exit_codes import StudyError, quoted

Curve = tuple[tuple[float, float], ...]  # (angle, torque) [rad, N m]
MOST_ROWS = 40  # of the curve that the problem sees: its expressions grow with them
_RADIANS = {"rad": 1.0, "deg": math.pi / 180}


def curve_of(name: str, value: Any) -> Curve:
    """Rows of a curve, or those of a CSV file.

    Raises
    ------
    StudyError
        If they are no curve with rising angles.
    """
    rows = _rows_of_a_file(name, Path(value)) if isinstance(value, str) else value
    pairs = isinstance(rows, list | tuple) and len(rows) >= 2
    if not pairs or not all(isinstance(row, list | tuple) and len(row) == 2 for row in rows):
        raise StudyError(
            f"{name} is {quoted(value)}; give rows [angle in rad, torque in N m], two or more"
        )
    curve = tuple((finite(name, angle), finite(name, torque)) for angle, torque in rows)
    for (before, _), (angle, _) in pairwise(curve):
        if angle <= before:
            raise StudyError(
                f"{name} has the angle {angle:g} rad after {before:g} rad; sort it by rising "
                "angles, one row each"
            )
    return curve


def _rows_of_a_file(name: str, path: Path) -> list[list[float]]:
    """Rows of a CSV file whose head names angle and torque with their units."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            rows = [row for row in csv.reader(stream) if row and not row[0].startswith("#")]
    except (OSError, UnicodeDecodeError) as error:
        raise StudyError(f"{name}: the file {path} cannot be read ({error})") from error

    head = [cell.strip().lower() for cell in rows[0]] if rows else []
    factor = next((f for unit, f in _RADIANS.items() if f"angle [{unit}]" in head), None)
    if factor is None or "torque [n m]" not in head:
        raise StudyError(
            f"{name}: the file {path} begins with {','.join(head) or 'nothing'}; its head has to "
            "name the columns 'angle [deg]' or 'angle [rad]', and 'torque [N m]'"
        )
    first = next(i for i, cell in enumerate(head) if cell.startswith("angle ["))
    second = head.index("torque [n m]")
    try:
        return [[float(row[first]) * factor, float(row[second])] for row in rows[1:]]
    except (ValueError, IndexError) as error:
        raise StudyError(f"{name}: a row of {path} is no pair of numbers ({error})") from error


def check_covers(curve: Curve, low: float, high: float) -> None:
    """Refuse a curve that ends inside the travel: nothing is known beyond it.

    Raises
    ------
    StudyError
        With both ranges.
    """
    slack = 1e-3  # [rad], a twentieth of a degree
    if curve[0][0] > low + slack or curve[-1][0] < high - slack:
        ends = [math.degrees(angle) for angle in (curve[0][0], curve[-1][0], low, high)]
        raise StudyError(
            f"margin.resistance runs from {ends[0]:.4g} to {ends[1]:.4g} deg, the travel from "
            f"{ends[2]:.4g} to {ends[3]:.4g} deg; measure all of it"
        )


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
        return ca.pw_const(alpha, inner, ca.DM(values)) if inner.numel() else float(values[0])

    x = alpha - piece(angle[:-1])
    cubic, square, slope, value = (piece(row) for row in coefficients)
    return ((cubic * x + square) * x + slope) * x + value
