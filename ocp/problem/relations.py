"""Bounds written as relations: ``x <= 2``, ``ca.sin(q) >= 0``, ``x == v``.

CasADi turns a relation between symbols into an expression whose value is 0 or 1.  Its last
operation tells the relation, and the operands of that are its two sides.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import casadi as ca

from ocp.errors import StatementError
from ocp.problem.symbols import Constant, Symbol, resolve, scalar
from ocp.problem.texts import text_of, unit_of

_SIGNS = {ca.OP_LE: "<=", ca.OP_LT: "<=", ca.OP_EQ: "=="}
_LOGICAL = {*_SIGNS, ca.OP_NE, ca.OP_NOT, ca.OP_AND, ca.OP_OR}
_MIRRORED = {"<=": ">=", ">=": "<=", "==": "=="}
_WRITE = "write a relation such as x <= 2, or Bound(name, expression, unit, lower, upper)"
_LONGEST_NAME = 80


@dataclass(frozen=True, eq=False)
class Meant:
    """What a relation limits, and by what: the arguments of a `Bound`."""

    name: str
    expression: ca.SX
    unit: str
    lower: Any
    upper: Any


def meant_by(relation: Any, where: str) -> Meant:
    """The bound that a relation means; ``<`` means the same as ``<=``.

    A side that depends on nothing but constants is the limit.  Where both sides vary, their
    difference is bounded by zero.  Name and unit are derived from the sides.

    Parameters
    ----------
    where : such as "phase 'travel'", for messages.

    Raises
    ------
    StatementError
        When it is no relation, or one that always or never holds.
    """
    left, right, sign = _sides(relation, where)
    if _is_limit(left):
        # CasADi turns x >= 2 into 2 <= x
        left, right, sign = right, left, _MIRRORED[sign]
    name = f"{text_of(left, _LONGEST_NAME)} {sign} {text_of(right, _LONGEST_NAME)}"
    if _is_limit(left):
        raise StatementError(
            f"the bound '{name}' of {where} relates numbers and constants only; bound a signal, "
            "an unknown or a value of the motion"
        )

    expression, limit = (left, _limit(right)) if _is_limit(right) else (left - right, 0.0)
    return Meant(
        name,
        expression,
        unit=unit_of(left) or unit_of(right) or "1",
        lower=-math.inf if sign == "<=" else limit,
        upper=math.inf if sign == ">=" else limit,
    )


def check_no_relation(expression: ca.SX, name: str) -> None:
    """StatementError if the expression of a bound is itself a relation, or several.

    It would be 0 or 1, and a limit of that has no slope that a solver could follow. Relations
    inside an expression, as ``ca.if_else`` has them, are allowed.
    """
    if expression.is_constant() or expression.is_symbolic() or expression.op() not in _LOGICAL:
        return
    raise StatementError(
        f"the expression of the bound '{name}' is '{text_of(expression, _LONGEST_NAME)}', which is "
        "0 or 1; give the relation itself as a bound, or an expression and its limits: "
        "Bound(name, x, unit, upper=2)"
    )


def _sides(relation: Any, where: str) -> tuple[ca.SX, ca.SX, str]:
    """Both sides of a relation and its sign; StatementError if it is none."""
    if not isinstance(relation, (ca.SX, Symbol)):
        raise StatementError(f"a bound of {where} is {relation!r}; {_WRITE}")
    expression = scalar(relation, f"a bound of {where}")
    resolve(expression, f"a bound of {where}")
    if expression.is_constant():
        raise StatementError(
            f"a bound of {where} is {'always' if float(expression) else 'never'} satisfied, for "
            "all values of its symbols; remove or correct it"
        )
    sign = None if expression.is_symbolic() else _SIGNS.get(expression.op())
    if sign is None:
        text = text_of(expression)
        if not expression.is_symbolic() and expression.op() == ca.OP_AND:
            raise StatementError(
                f"a bound of {where} combines two relations: '{text}'; give each relation as a "
                "separate entry"
            )
        raise StatementError(f"a bound of {where} is '{text}', which is not a relation; {_WRITE}")
    return expression.dep(0), expression.dep(1), sign


def _is_limit(side: ca.SX) -> bool:
    return all(isinstance(symbol, Constant) for symbol in resolve(side, "a side of a relation"))


def _limit(side: ca.SX) -> Any:
    return float(side) if side.is_constant() else side
