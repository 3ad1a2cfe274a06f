"""Terms of a statement: bounds on expressions, and numbers that a trajectory has."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Literal

import casadi as ca

from ocp.errors import StatementError
from ocp.problem.symbols import Symbol, check_interval, check_scale, is_number, scalar

FunctionalKind = Literal["start", "end", "integral", "value", "start time", "end time", "peak"]


@dataclass(frozen=True)
class Bound:
    """``lower <= expression <= upper``, with a name and a unit for messages.

    In a phase it holds at all times, in a problem it bounds one number.  Equal bounds make an
    equation.
    """

    name: str
    expression: Any
    unit: str = "1"
    lower: Any = -math.inf
    upper: Any = math.inf
    scale: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "expression", scalar(self.expression, f"the bound '{self.name}'"))
        check_interval(self.name, self.lower, self.upper)
        check_scale(self.name, self.scale)
        if all(is_number(v) and math.isinf(v) for v in (self.lower, self.upper)):
            raise StatementError(
                f"the bound '{self.name}' has neither a lower nor an upper limit; give one"
            )

    @property
    def is_equation(self) -> bool:
        """Whether lower and upper limit are the same."""
        if is_number(self.lower) and is_number(self.upper):
            return bool(self.lower == self.upper)
        return self.lower is self.upper


@dataclass(frozen=True, eq=False)
class Functional(Symbol):
    """A number that a trajectory has: an end value, an integral, a time, a peak.

    ``pieces`` pairs phase names with expressions (one piece, except for a peak over phases).
    """

    name: str
    unit: str
    kind: FunctionalKind
    pieces: tuple[tuple[str, ca.SX], ...]
    at: float | None = None
    absolute: bool = False
    symbols: tuple[Symbol, ...] = ()
    scale: float | None = None
    symbol: ca.SX = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._declare()
        check_scale(self.name, self.scale)
