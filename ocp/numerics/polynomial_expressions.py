"""Linear expressions, and the degree of an expression of polynomials.

Whether an expression is linear is asked with steps taken into account. CasADi looks at derivatives
only, and those of a comparison, a sign or a rounding are zero: an expression that steps is linear
to it, and one that has a kink is quadratic.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import casadi as ca

from ocp.numerics.kinks import stepwise_operations


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


_LINEAR = {ca.OP_ASSIGN, ca.OP_ADD, ca.OP_SUB, ca.OP_NEG, ca.OP_TWICE}
_PRODUCTS = {ca.OP_MUL, ca.OP_SQ}
_POWERS = {ca.OP_CONSTPOW, ca.OP_POW}


def polynomial_degree(
    expression: ca.SX, symbols: Sequence[ca.SX], degrees: Sequence[int]
) -> int | None:
    """Degree of an expression of polynomials of given degrees; None if it is no polynomial.

    Symbols that are not listed count as numbers.
    """
    own = {s.element_hash(): d for s, d in zip(symbols, degrees, strict=True)}
    bare = ca.symvar(expression)
    f = ca.Function("expression", [ca.vertcat(*bare, ca.SX(0, 1))], [expression])
    work: dict[int, float] = {}
    numbers: dict[int, float] = {}
    for k in range(f.n_instructions()):
        code, inputs, out = f.instruction_id(k), f.instruction_input(k), f.instruction_output(k)
        if code == ca.OP_OUTPUT:
            return int(work[inputs[0]]) if math.isfinite(work[inputs[0]]) else None
        for register in out:
            numbers.pop(register, None)
        if code == ca.OP_CONST:
            work[out[0]], numbers[out[0]] = 0.0, f.instruction_constant(k)
        elif code == ca.OP_INPUT:
            work[out[0]] = own.get(bare[inputs[1]].element_hash(), 0)
        else:
            power = numbers.get(inputs[-1], math.nan)
            degree = _combined(code, [work[i] for i in inputs], power)
            work |= dict.fromkeys(out, degree)  # a call has several, each a number
    return 0


def _combined(code: int, degrees: Sequence[float], power: float) -> float:
    """Degree of the result of an operation; infinite if it is no polynomial."""
    if max(degrees, default=0.0) == 0:
        return 0.0
    if code in _LINEAR:
        return max(degrees)
    if code in _PRODUCTS:
        return sum(degrees) if code == ca.OP_MUL else 2 * degrees[0]
    if code == ca.OP_DIV and degrees[1] == 0:
        return degrees[0]
    if code in _POWERS and degrees[1] == 0 and power >= 0 and power == int(power):
        return degrees[0] * power
    return math.inf
