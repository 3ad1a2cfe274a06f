"""CasADi's functions, called with arrays.

Matrices made of arrays, number by number, take longer than most functions take to be evaluated.
A function's buffer reads and writes the arrays themselves.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache

import casadi as ca
import numpy as np

from ocp.arrays import Array, Integers

# Columns that are evaluated at once. CasADi takes longer to make a map than to evaluate it, by the
# more the longer it is: maps of this length are made once, and what is left over has a short one.
_SPAN = 128

# Halvings of the way between two points until their difference is rounding
_HALVINGS = 60


def called(function: ca.Function, *arguments: Array) -> list[Array]:
    """Outputs (c, r) of a function for its inputs (c, r), all transposed.

    Matrices of CasADi lie column by column, arrays row by row.

    Parameters
    ----------
    function : casadi.Function
        Its inputs are dense.
    arguments : array
        One for each input, with a row for each column of it.

    Raises
    ------
    ValueError
        An argument has not as many numbers as its input.
    """
    found = nonzeros(function, *arguments)
    return [_full(function.sparsity_out(i), values, 1) for i, values in enumerate(found)]


def nonzeros(function: ca.Function, *arguments: Array) -> list[Array]:
    """The same, but the non-zeros of each output alone, (n,) in the order of its pattern."""
    outputs = [np.empty(function.nnz_out(i)) for i in range(function.n_out())]
    _evaluate(function, _contiguous(function, arguments, 1), outputs)
    return outputs


def columnwise(function: ca.Function, *arguments: Array) -> list[Array]:
    """Outputs of a function of columns for many columns at once, (m, r) each.

    Parameters
    ----------
    function : casadi.Function
        Its inputs and outputs are columns.
    arguments : (m, r) or (r,)
        One for each input: a row for each evaluation, or one column for all.
    """
    count = next(len(argument) for argument in arguments if np.ndim(argument) == 2)
    if count == 0:
        return [np.empty((0, function.size1_out(i))) for i in range(function.n_out())]
    rows = [np.broadcast_to(argument, (count, np.shape(argument)[-1])) for argument in arguments]
    inputs = _contiguous(function, rows, count)
    outputs = [np.empty((count, function.nnz_out(i))) for i in range(function.n_out())]

    for begin in range(0, count, _SPAN):
        here = slice(begin, min(begin + _SPAN, count))
        mapped = _mapped(function, here.stop - begin)
        _evaluate(mapped, [given[here] for given in inputs], [found[here] for found in outputs])
    return [_full(function.sparsity_out(i), found, count) for i, found in enumerate(outputs)]


def enclosed(
    function: Callable[[Array], Array], low: Array, high: Array, numbers: Integers
) -> tuple[Array, Array]:
    """Pairs of points, halved until they enclose a change of a function to rounding, (c, n) each.

    Parameters
    ----------
    function : callable
        Takes points (c, n), and returns (c, r) values that are constant piece by piece.
    low, high : (c, n)
        Pairs between which a value changes.
    numbers : (c,)
        Which value it is, of each pair.
    """
    rows = np.arange(numbers.size)
    before = function(low)[rows, numbers]
    for _ in range(_HALVINGS if numbers.size else 0):
        middle = 0.5 * (low + high)
        same = (function(middle)[rows, numbers] == before)[:, None]
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return low, high


@lru_cache
def _mapped(function: ca.Function, count: int) -> ca.Function:
    """A function for so many columns side by side."""
    return function.map(count)


def _contiguous(function: ca.Function, arguments: Sequence[Array], times: int) -> list[Array]:
    """Arguments as CasADi reads them, each with so many times the numbers of its input.

    Raises
    ------
    ValueError
        One has not.
    """
    inputs = [np.ascontiguousarray(argument, dtype=float) for argument in arguments]
    for i, given in enumerate(inputs):
        if given.size != times * function.nnz_in(i):
            shape = function.size_in(i)
            raise ValueError(f"input {i} has {given.size} numbers; {function} takes {shape}")
    return inputs


def _evaluate(function: ca.Function, inputs: Sequence[Array], outputs: Sequence[Array]) -> None:
    """Read the inputs and write the non-zeros of the outputs in place."""
    buffer, evaluate = function.buffer()
    for i, given in enumerate(inputs):
        if given.size:
            buffer.set_arg(i, given.data)
    for i, found in enumerate(outputs):
        if found.size:
            buffer.set_res(i, found.data)
    evaluate()


def _full(pattern: ca.Sparsity, nonzeros: Array, count: int) -> Array:
    """Matrices of their non-zeros (count, nnz), each transposed, below each other."""
    rows, columns = pattern.shape
    if pattern.is_dense():
        return nonzeros.reshape(count * columns, rows)
    full = np.zeros((count, rows * columns))
    full[:, pattern.find()] = nonzeros.reshape(count, -1)
    return full.reshape(count * columns, rows)
