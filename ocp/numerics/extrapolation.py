"""The integrator of the replay: extrapolated modified midpoint steps (Gragg, Bulirsch, Stoer).

It shares nothing with collocation: it is explicit, of order 8, and has its own error estimate.
Source: Hairer, Norsett, Wanner, "Solving Ordinary Differential Equations I", section II.9.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca

# Midpoint substeps of the rows of the extrapolation table. The harmonic sequence of even numbers
# needs the fewest evaluations for its order, two for each row.
SUBSTEPS = (2, 4, 6, 8)


def extrapolated_step(rate: Callable[[Any, Any], Any], x: Any, span: Any) -> tuple[Any, Any]:
    """One step from local time 0 to `span` of ``x' = rate(x, tau)``.

    Parameters
    ----------
    rate : callable
        Takes a state (n_x, 1) and a local time, and returns the derivative by local time (n_x, 1).

    Returns
    -------
    end : (n_x, 1)
        The state at the end, of order ``2 * len(SUBSTEPS)``.
    error : (n_x, 1)
        Its difference to the value of two orders less.
    """
    row: list[Any] = []
    for j, count in enumerate(SUBSTEPS):
        above, row = row, [_midpoint(rate, x, span, count)]

        # the error of the midpoint rule has even powers of the step only (Aitken and Neville)
        for i in range(j):
            ratio = (count / SUBSTEPS[j - i - 1]) ** 2
            row.append(row[i] + (row[i] - above[i]) / (ratio - 1.0))
    return row[-1], row[-1] - row[-2]


def _midpoint(rate: Callable[[Any, Any], Any], x: Any, span: Any, count: int) -> Any:
    """The modified midpoint rule with smoothing at the end."""
    h = span / count
    before, now = x, x + h * rate(x, 0 * span)
    for i in range(1, count):
        before, now = now, before + 2.0 * h * rate(now, i * h)
    return 0.5 * (before + now + h * rate(now, span))


def accumulated(step: ca.Function, count: int) -> ca.Function:
    """The step applied `count` times in sequence, all intermediate values returned."""
    # a tree of maps of ten keeps the built function short for thousands of steps
    return step.mapaccum("sequence", count, {"base": 10})
