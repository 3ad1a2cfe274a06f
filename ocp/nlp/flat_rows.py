"""Limits and equations whose slope vanishes where they are met, as that of a square does.

Next to ``(x - 1)**2 + v**2 == 0`` the left side has no slope. No multiplier holds such an equation,
and a solver that looks for one ends in numerical trouble, or a root of the tolerance away.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ocp.arrays import Array
from ocp.transcription.row_names import row_kinds
from ocp.transcription.transcribe import ProgramLimits, Transcription

# Slopes of scaled rows are about one
_FLAT = 1e-3

# Scaled distance from a limit, below which a row is met
_MET = 1e-6

# Part of the rows of an equation or limit that has to be flat
_MOST = 0.5


def flat_rows(
    transcription: Transcription, x: Array, rows: Array, limits: ProgramLimits, constants: Array
) -> Iterator[str]:
    """Names of stated limits and equations that are met, and have next to no slope there.

    Parameters
    ----------
    x, rows : (n,), (m,)
        Scaled unknowns, and the values of the rows there.
    constants : (c,)
        Values of the problem's constants.
    """
    lower, upper = limits.rows
    met = (np.abs(rows - lower) < _MET) | (np.abs(rows - upper) < _MET)
    jacobian = transcription.program.constraint_jacobian(x, constants)[1]
    steepest = np.zeros(rows.size)
    np.maximum.at(steepest, np.array(jacobian.row()), np.abs(jacobian.nonzeros()))
    flat = met & (steepest < _FLAT)
    stated = (kind for kind in row_kinds(transcription) if kind.is_stated)
    yield from (kind.what for kind in stated if flat[kind.rows].mean() > _MOST)


def remedy_for_flat_rows(names: Iterator[str]) -> str:
    """What has no slope, and what to do; ends with "or", as other remedies follow.

    Empty if there are no such names.
    """
    for name in names:
        return (
            f"{name} has no slope where it is met, as a sum of squares that is to be zero has "
            "none, and so no multiplier: state each term, without its power, as an equation of its "
            "own; or "
        )
    return ""
