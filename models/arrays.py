"""The array types of the models, and CasADi's functions along arrays."""

from __future__ import annotations

from functools import lru_cache
from typing import TypeAlias

import casadi as ca
import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
"""Real numbers, of any shape."""
Flags: TypeAlias = NDArray[np.bool_]
"""Truth values, of any shape."""
Places: TypeAlias = NDArray[np.intp]
"""Whole numbers that index another array."""

_SPAN = 128  # values at once: CasADi takes longer to make a long map than to evaluate it


def elementwise(function: ca.Function, *rows: Array) -> list[Array]:
    """Outputs of a function of scalars for many values at once.

    The arrays themselves are read and written, by maps of one length. CasADi takes ten times as
    long if it repeats a call by itself.

    Parameters
    ----------
    function : casadi.Function
        Its inputs are scalars, its outputs dense columns.
    rows : (m,) arrays
        One for each input.

    Returns
    -------
    list of (m, r) arrays
        One for each output, which has r rows.
    """
    count = rows[0].size
    given = [np.ascontiguousarray(row, dtype=float) for row in rows]
    found = [np.empty((count, function.nnz_out(i))) for i in range(function.n_out())]
    for begin in range(0, count, _SPAN):
        here = slice(begin, min(begin + _SPAN, count))
        buffer, evaluate = _mapped(function, here.stop - begin).buffer()
        for i, row in enumerate(given):
            buffer.set_arg(i, row[here].data)
        for i, output in enumerate(found):
            buffer.set_res(i, output[here].data)
        evaluate()
    return found


@lru_cache(maxsize=256)
def _mapped(function: ca.Function, count: int) -> ca.Function:
    """The function for so many values side by side."""
    return function.map(count)
