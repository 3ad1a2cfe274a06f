"""Bounds on expressions, with names and units for messages."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import casadi as ca

from ocp.errors import StatementError
from ocp.keywords import as_written, checked_keywords
from ocp.problem.relations import check_no_relation, meant_by
from ocp.problem.symbols import (
    LIMIT_WORDS,
    Symbol,
    check_interval,
    check_name,
    check_scale,
    check_unit,
    is_limited,
    is_number,
    is_plain,
    resolve,
    scalar,
)


@checked_keywords(LIMIT_WORDS)
@dataclass(frozen=True, eq=False, repr=False)
class Bound:
    """``lower <= expression <= upper``.

    In a phase it holds at all times. In a problem it bounds one number. Equal bounds make an
    equation.

    Parameters
    ----------
    name, unit : str
        For messages, tables and plots.
    expression : SX
        Of signals, unknowns and constants in a phase, of functionals, unknowns and constants in a
        problem.
    lower, upper : number, Constant or expression of constants and unknowns
        [unit]. A limit that depends on an unknown is brought into the expression where the bound is
        used: ``u <= p`` becomes ``u - p <= 0``.
    scale : float or None
        Typical size of the expression [unit], of which an excess is a part. If None it is derived
        from the guess, and an excess is a part of the largest value on the motion.
    of_cost : bool
        Whether it only holds a cost above what it stands for, as a reformulation may state it: no
        limit of the motion is exceeded with it, and an excess changes the cost alone.

    Attributes
    ----------
    symbols : tuple of Symbol
        What the expression depends on.
    is_equation : bool
        Whether lower and upper limit are the same.

    Raises
    ------
    StatementError
        When the expression is no scalar or is itself a relation, the limits cross, or there is no
        limit.
    """

    name: str
    expression: Any
    unit: str = "1"
    lower: Any = -math.inf
    upper: Any = math.inf
    scale: float | None = None
    of_cost: bool = False
    symbols: tuple[Symbol, ...] = field(init=False, repr=False)
    is_equation: bool = field(init=False, repr=False)

    def __post_init__(self) -> None:
        check_name("bound", self.name)
        check_unit(self.name, self.unit)
        where = f"the bound '{self.name}'"
        object.__setattr__(self, "expression", scalar(self.expression, where))
        object.__setattr__(self, "symbols", resolve(self.expression, where))
        check_no_relation(self.expression, self.name)
        check_interval(self.name, self.lower, self.upper)
        check_scale(self.name, self.scale)
        if not is_limited(self.lower, self.upper):
            raise StatementError(
                f"the bound '{self.name}' has neither a lower nor an upper limit; give one"
            )
        numbers = is_number(self.lower) and is_number(self.upper)
        same = self.lower == self.upper if numbers else self.lower is self.upper
        object.__setattr__(self, "is_equation", bool(same))

    def __repr__(self) -> str:
        return as_written(self)


def checked_bounds(bounds: Any, where: str) -> tuple[Bound, ...]:
    """The bounds of a phase or problem; relations such as ``x <= 2`` are turned into bounds.

    Raises
    ------
    StatementError
        When an entry is neither a `Bound` nor a relation, or bounds a mere number.
    """
    if isinstance(bounds, Bound):
        raise StatementError(
            f"the bounds of {where} are the one bound '{bounds.name}'; give a list: [Bound(...)]"
        )
    try:
        entries = tuple(bounds)
    except TypeError as error:
        raise StatementError(
            f"the bounds of {where} are {bounds!r}; give a list of Bound(...) or of relations such "
            "as [x <= 2]"
        ) from error
    stated = [
        e if isinstance(e, Bound) else Bound(**vars(meant_by(e, where)))
        for entry in entries
        for e in _each(entry)
    ]
    plain = tuple(bound for entry in stated for bound in _with_plain_limits(entry))
    for bound in plain:
        _check_depends(bound, where)
    return plain


def _each(entry: Any) -> Sequence[Any]:
    """The relations of a vector's components; anything else as it is."""
    vector = isinstance(entry, ca.SX) and entry.is_column() and not entry.is_scalar()
    return ca.vertsplit(entry) if vector else [entry]


def _check_depends(bound: Bound, where: str) -> None:
    """StatementError where nothing that a solver could change is bounded."""
    if not bound.symbols:
        raise StatementError(
            f"the bound '{bound.name}' of {where} is on the number {float(bound.expression):g}, "
            "which is constant; give an expression of signals, or remove the bound"
        )


def _with_plain_limits(bound: Bound) -> Iterator[Bound]:
    """The same bound with limits that hold no unknown: one for each side where one did."""
    moving = [side for side in (bound.lower, bound.upper) if not is_plain(side)]
    if not moving:
        yield bound
    elif bound.is_equation:
        yield replace(bound, expression=bound.expression - moving[0], lower=0.0, upper=0.0)
    else:
        both = is_limited(bound.lower) and is_limited(bound.upper)
        for side, limit in (("lower", bound.lower), ("upper", bound.upper)):
            if not is_limited(limit):
                continue
            name = f"{bound.name} {side}" if both else bound.name
            expression = bound.expression if is_plain(limit) else bound.expression - limit
            plain = limit if is_plain(limit) else 0.0
            lower, upper = (plain, math.inf) if side == "lower" else (-math.inf, plain)
            yield replace(bound, name=name, expression=expression, lower=lower, upper=upper)
