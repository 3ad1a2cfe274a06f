"""The integrator of the replay: extrapolated modified midpoint steps (Gragg, Bulirsch, Stoer).

It shares nothing with collocation: explicit, of order 8, with its own error estimate.
Source: Hairer, Norsett, Wanner, "Solving Ordinary Differential Equations I", section II.9.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca

SUBSTEPS = (2, 4, 6, 8)


def extrapolated_step(rate: Callable[[Any, Any], Any], x: Any, span: Any) -> tuple[Any, Any]:
    """One step from local time 0 to `span` of ``x' = rate(x, tau)``.

    Returns
    -------
    end : (n_x, 1) of order 2 * len(SUBSTEPS)
    error : (n_x, 1) difference to the value of two orders less
    """
    table: list[Any] = []
    last = x
    for j, n in enumerate(SUBSTEPS):
        row = [_midpoint(rate, x, span, n)]
        for i in range(j):
            ratio = (n / SUBSTEPS[j - i - 1]) ** 2
            row.append(row[i] + (row[i] - table[i]) / (ratio - 1.0))
        last, table = row[-2] if j else x, row
    return table[-1], table[-1] - last


def _midpoint(rate: Callable[[Any, Any], Any], x: Any, span: Any, n: int) -> Any:
    h = span / n
    before, now = x, x + h * rate(x, 0 * span)
    for i in range(1, n):
        before, now = now, before + 2.0 * h * rate(now, i * h)
    return 0.5 * (before + now + h * rate(now, span))


def accumulated(step: ca.Function, count: int) -> ca.Function:
    """The step applied `count` times in sequence, all intermediate values returned."""
    return step.mapaccum("sequence", count, {"base": 10})
