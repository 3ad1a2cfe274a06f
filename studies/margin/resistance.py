"""A measured curve of resisting torque against the deployment angle."""

from __future__ import annotations

import csv
import math
from itertools import pairwise
from pathlib import Path
from typing import Any

from models.truss.measured import Curve
from studies.common.configuration import finite
from studies.common.exit_codes import StudyError, quoted

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
            f"{name}: the file {path} begins with {','.join(head) or 'nothing'}; its header must "
            "have the columns 'angle [deg]' or 'angle [rad]', and 'torque [N m]'"
        )
    first = next(i for i, cell in enumerate(head) if cell.startswith("angle ["))
    second = head.index("torque [n m]")
    try:
        return [[float(row[first]) * factor, float(row[second])] for row in rows[1:]]
    except (ValueError, IndexError) as error:
        raise StudyError(f"{name}: a row of {path} is not a pair of numbers ({error})") from error


def check_covers(curve: Curve, low: float, high: float, name: str) -> None:
    """Refuse a curve, stated under a name, that ends inside the travel: beyond it nothing is known.

    Raises
    ------
    StudyError
        With both ranges.
    """
    slack = 1e-3  # [rad], a twentieth of a degree
    if curve[0][0] > low + slack or curve[-1][0] < high - slack:
        ends = [math.degrees(angle) for angle in (curve[0][0], curve[-1][0], low, high)]
        raise StudyError(
            f"{name} covers {ends[0]:.4g} to {ends[1]:.4g} deg, but the travel is {ends[2]:.4g} to "
            f"{ends[3]:.4g} deg; measure the whole travel"
        )
