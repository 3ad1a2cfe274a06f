"""CasADi's functions, called with arrays.

Matrices made of arrays, number by number, take longer than most functions take to be evaluated.
A function's buffer reads and writes the arrays themselves.
"""

from __future__ import annotations

import casadi as ca
import numpy as np

from ocp.arrays import Array


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
    inputs = [np.ascontiguousarray(argument, dtype=float) for argument in arguments]
    outputs = [np.empty(function.nnz_out(i)) for i in range(function.n_out())]
    for i, given in enumerate(inputs):
        if given.size != function.nnz_in(i):
            shape = function.size_in(i)
            raise ValueError(f"input {i} has {given.size} numbers; {function} takes {shape}")

    buffer, evaluate = function.buffer()
    for i, given in enumerate(inputs):
        if given.size:
            buffer.set_arg(i, given.data)
    for i, found in enumerate(outputs):
        if found.size:
            buffer.set_res(i, found.data)
    evaluate()
    return [_full(function.sparsity_out(i), found) for i, found in enumerate(outputs)]


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
    return called(function.map(count), *rows)


def _full(pattern: ca.Sparsity, nonzeros: Array) -> Array:
    """A matrix, transposed."""
    rows, columns = pattern.shape
    if pattern.is_dense():
        return nonzeros.reshape(columns, rows)
    full = np.zeros(rows * columns)
    full[pattern.find()] = nonzeros
    return full.reshape(columns, rows)
