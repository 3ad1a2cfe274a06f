"""Bounds on expressions, with names and units for messages."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from ocp.errors import StatementError
from ocp.keywords import as_written, checked_keywords
from ocp.problem.symbols import (
    LIMIT_WORDS,
    check_interval,
    check_name,
    check_scale,
    check_unit,
    is_number,
    scalar,
)


@checked_keywords(elsewhere=LIMIT_WORDS)
@dataclass(frozen=True)
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
    lower, upper : number, Constant or expression of constants
        [unit].
    scale : float or None
        Typical size of the expression [unit]. It is derived from the guess if None.

    Raises
    ------
    StatementError
        When the expression is no scalar, the limits cross, or there is none.
    """

    name: str
    expression: Any
    unit: str = "1"
    lower: Any = -math.inf
    upper: Any = math.inf
    scale: float | None = None

    def __post_init__(self) -> None:
        check_name("bound", self.name)
        check_unit(self.name, self.unit)
        object.__setattr__(self, "expression", scalar(self.expression, f"the bound '{self.name}'"))
        check_interval(self.name, self.lower, self.upper)
        check_scale(self.name, self.scale)
        if not is_limited(self.lower, self.upper):
            raise StatementError(
                f"the bound '{self.name}' has neither a lower nor an upper limit; give one"
            )

    def __repr__(self) -> str:
        return as_written(self)

    @property
    def is_equation(self) -> bool:
        """Whether lower and upper limit are the same."""
        if is_number(self.lower) and is_number(self.upper):
            return bool(self.lower == self.upper)
        return self.lower is self.upper


def is_limited(*limits: Any) -> bool:
    """Whether any of the limits may be finite; expressions of constants count as finite."""
    return not all(is_number(limit) and math.isinf(limit) for limit in limits)


def checked_bounds(bounds: Any, where: str) -> tuple[Bound, ...]:
    """The bounds of a phase or problem; relations such as ``x <= 2`` are turned into bounds.

    Raises
    ------
    StatementError
        When an entry is neither a `Bound` nor a relation.
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
    return tuple(e if isinstance(e, Bound) else _from_relation(e, where) for e in entries)


def _from_relation(relation: Any, where: str) -> Bound:
    from ocp.problem.relations import bound_of  # which needs this module

    return bound_of(relation, where)
