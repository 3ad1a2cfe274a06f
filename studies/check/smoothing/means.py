"""What the peak of a derivative of noisy rows is at least, whatever curve is behind them.

A polynomial of degree k is fitted by least squares to the rows of a window. Its leading coefficient
times k! is a mean of the k-th derivative over the window, with weights that are positive: it is the
mean of all divided differences of order k, weighted by their squared Vandermonde determinants. So
no curve through the rows without their noise has a smaller peak. Wide windows average the noise,
narrow ones follow the peak, and all of them are looked at. Jumps of the derivative do no harm here,
while a smooth curve swings beside them.
"""

from __future__ import annotations

import math

import numpy as np

from ocp.arrays import Array

NARROWEST = 64  # windows side by side in all rows
GROWTH = 1.3  # of the width of windows from one round to the next
SHIFTS = 8  # windows that overlap
LIKELY = 4.0  # standard deviations that are taken off: of thousands of windows none errs by more


def noisy_peak(time: Array, values: Array, deviations: Array, rounding: Array, order: int) -> float:
    """The least that the peak of a derivative can be.

    Parameters
    ----------
    time, values, deviations, rounding : (m,)
        And the standard deviation of each value, and by how much its digits may be wrong: noise is
        independent from row to row, and digits cut off even steps are not.
    order : int
        Of the derivative.
    """
    highest, width = 0.0, float(max(order + 2, time.size // NARROWEST))
    while width <= time.size:
        found = peak_by_windows(time, values, deviations, rounding, order, int(width))
        highest, width = max(highest, found), width * GROWTH + 1
    return highest


def proven_peak(time: Array, values: Array, wrong: Array, order: int) -> float:
    """What the peak of a derivative is at least, whatever the curve between the rows does.

    The narrowest windows give divided differences.

    Parameters
    ----------
    time, values : (m,)
    wrong : (m,)
        By how much each value may be wrong.
    order : int
        Of the derivative.
    """
    return peak_by_windows(time, values, np.zeros_like(wrong), wrong, order, order + 1)


def peak_by_windows(
    time: Array, values: Array, deviations: Array, rounding: Array, order: int, width: int
) -> float:
    """The same as `noisy_peak` by the windows of so many rows."""
    starts = np.arange(0, time.size - width + 1, max(1, width // SHIFTS))
    places = starts[:, None] + np.arange(width)
    begin = time[places[:, :1]]
    length = time[places[:, -1:]] - begin
    powers = ((time[places] - begin) / length)[..., None] ** np.arange(order + 1)

    # the highest power, less what the lower ones explain of it: its weights find its coefficient
    rest = np.linalg.qr(powers)[0][..., -1]
    weights = rest / np.einsum("wn,wn->w", rest, powers[..., -1])[:, None]
    # equal parts of all values are no motion, and cost digits
    mean = np.abs(np.einsum("wn,wn->w", weights, values[places] - values[places[:, :1]]))
    wrong = LIKELY * np.sqrt(np.einsum("wn,wn->w", weights**2, deviations[places] ** 2))
    wrong += np.einsum("wn,wn->w", np.abs(weights), rounding[places])
    sizes = math.factorial(order) / length[:, 0] ** order
    return float((sizes * np.maximum(mean - wrong, 0.0)).max())
