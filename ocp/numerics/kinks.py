"""Operations of expressions whose derivative jumps: moduli, and the lesser or larger of two."""

from __future__ import annotations

import casadi as ca

_KINKED = {ca.OP_FABS: "fabs", ca.OP_FMIN: "fmin", ca.OP_FMAX: "fmax"}


def kinked_operations(expression: ca.SX) -> list[str]:
    """CasADi's names of the operations of an expression that have a kink, in order."""
    function = ca.Function("expression", ca.symvar(expression), [expression])
    codes = {function.instruction_id(k) for k in range(function.n_instructions())}
    return [name for code, name in _KINKED.items() if code in codes]
