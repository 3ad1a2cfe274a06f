"""How far a number may be from what was meant, by the digits that a file gives it."""

from __future__ import annotations

from decimal import Decimal

import numpy as np

from ocp.arrays import Array

SEEN = 2000  # numbers of a column from which its digits are told


def half_a_digit(values: Array) -> Array:
    """Half a unit of the last digit of numbers (m,) as a file states them.

    A column has a number of decimals or a number of significant digits, and single numbers hide
    zeros at their end. So the most of either counts, and of both units the larger one. If single
    precision gives the same numbers, its digits count. What is no number, such as a rate that is
    not known at a row, tells nothing.
    """
    known = values[np.isfinite(values)]
    some = np.unique(np.linspace(0, known.size - 1, min(known.size, SEEN)).round().astype(int))
    decimals, significant = 0, 1
    for value in known[some].tolist():
        _, digits, exponent = Decimal(repr(float(value))).normalize().as_tuple()
        decimals = max(decimals, -int(exponent))
        significant = max(significant, len(digits))

    sizes = np.abs(values)
    exponents = np.floor(np.log10(sizes, out=np.full(sizes.size, -np.inf), where=sizes > 0))
    half: Array = np.maximum(10.0**-decimals, 10.0 ** (exponents - significant + 1)) / 2

    with np.errstate(over="ignore"):
        single = values.astype(np.float32)
    if not (np.abs(single - values) > half).any():
        half = np.maximum(half, np.spacing(np.abs(single)).astype(float) / 2)
    return half


def half_a_digit_of_times(time: Array) -> Array:
    """The same of the times of rows (m,) in their own unit.

    Times that are even are those that were meant, to the precision of a number in memory.
    """
    precision: Array = np.spacing(np.abs(time))
    uneven = float(np.ptp(np.diff(time)))
    if uneven <= 4 * float(precision.max()):
        return precision
    return np.maximum(half_a_digit(time), precision)
