"""Linear expressions, and the degree of an expression of polynomials.

Whether an expression is linear is asked with steps taken into account. CasADi looks at derivatives
only, and those of a comparison, a sign or a rounding are zero: an expression that steps is linear
to it, and one that has a kink is quadratic.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import casadi as ca
import numpy as np

from ocp.arrays import ROUNDING, Array
from ocp.numerics.expression_graph import graph_of
from ocp.numerics.kinks import stepwise_operations


def curves_upwards(curvature: Array) -> bool:
    """Whether symmetric matrices (m, n, n) are finite and have no negative eigenvalue."""
    if not np.isfinite(curvature).all():
        return False
    sizes = np.abs(curvature).max(axis=(1, 2))
    return bool((np.linalg.eigvalsh(curvature)[:, 0] >= -ROUNDING * sizes).all())


def is_linear(expression: ca.SX, variables: ca.SX) -> bool:
    """Whether an expression (m,) is linear in variables (n,), and steps with none of them."""
    return ca.is_linear(expression, variables) and not _steps_with(expression, variables)


def is_quadratic(expression: ca.SX, variables: ca.SX) -> bool:
    """Whether one expression is quadratic in variables (n,), without steps and kinks in them."""
    if _steps_with(expression, variables):
        return False
    return is_linear(ca.gradient(expression, variables), variables)


def _steps_with(expression: ca.SX, variables: ca.SX) -> bool:
    """Whether a stepwise operation of an expression depends on a variable."""
    if expression.is_empty():
        return False
    found = stepwise_operations(ca.vertsplit(ca.densify(expression)), ca.symvar(expression))
    return found is not None and ca.depends_on(ca.vertcat(*found.results), variables)


_SUMS = {"add", "sub", "neg", "twice"}


def polynomial_degree(
    expression: ca.SX, symbols: Sequence[ca.SX], degrees: Sequence[int]
) -> int | None:
    """Degree of an expression of polynomials of given degrees; None if it is no polynomial.

    Symbols that are not listed count as numbers.
    """
    known = {s.element_hash(): d for s, d in zip(symbols, degrees, strict=True)}
    bare = ca.symvar(expression)
    graph, found = graph_of([expression], bare), list[float]()
    for instruction in graph.instructions:
        operation, operands = instruction.operation, instruction.operands
        if operation == "symbol":
            found.append(known.get(bare[operands[0]].element_hash(), 0))
            continue
        last = graph.instructions[operands[-1]] if operands else instruction
        power = last.number if last.operation == "number" else math.nan
        found.append(_combined(operation, [found[i] for i in operands], power))
    degree = found[graph.results[0]]
    return int(degree) if math.isfinite(degree) else None


def _combined(operation: str, degrees: Sequence[float], power: float) -> float:
    """Degree of the result of an operation; infinite if it is no polynomial."""
    if max(degrees, default=0.0) == 0:
        return 0.0
    if operation in _SUMS:
        return max(degrees)
    if operation == "mul":
        return sum(degrees)
    if operation == "sq":
        return 2 * degrees[0]
    if operation == "div" and degrees[1] == 0:
        return degrees[0]
    if operation in ("pow", "constpow") and degrees[1] == 0 and power >= 0 and power % 1 == 0:
        return degrees[0] * power
    return math.inf
