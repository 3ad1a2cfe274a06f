"""Whether expressions are linear or quadratic in variables, with steps taken into account.

CasADi looks at derivatives only, and those of a comparison, a sign or a rounding are zero: an
expression that steps is linear to it, and one that has a kink is quadratic.
"""

from __future__ import annotations

import casadi as ca

from ocp.numerics.stepwise_operations import stepwise_operations


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
