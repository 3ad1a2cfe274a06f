"""Values of a problem's constants, and its limits at these values.

A limit may be a number or an expression of constants. All expressions of a problem are evaluated by
one function, once for each set of values.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from ocp.arrays import Array
from ocp.errors import StatementError
from ocp.problem.symbols import Constant, Symbol, resolve, scalar

if TYPE_CHECKING:
    from ocp.problem.problem import Problem


@dataclass(frozen=True, eq=False)
class Parameters:
    """The constants of a problem at given values.

    Attributes
    ----------
    values : mapping of name to number
    vector : (n_k,)
        The values in the order of `Problem.constants`.
    limits : mapping of CasADi's hash of an expression to number
        The problem's limits that are expressions.
    """

    values: Mapping[str, float]
    vector: Array
    limits: Mapping[int, float] = field(default_factory=dict, repr=False)

    def limit(self, limit: Any) -> float:
        """A limit or boundary value as a number."""
        if not isinstance(limit, (Symbol, ca.SX)):
            return float(limit)
        expression = scalar(limit, "a limit")
        value = self.limits.get(expression.element_hash())
        return self._evaluated(expression) if value is None else value

    def pair(self, item: Any) -> tuple[float, float]:
        """Lower and upper limit of a signal, an unknown, a bound or a path constraint."""
        return self.limit(item.lower), self.limit(item.upper)

    def _evaluated(self, expression: ca.SX) -> float:
        """A limit that the problem does not state itself, such as one derived from another."""
        symbols = resolve(expression, "a limit")
        function = ca.Function("limit", [s.symbol for s in symbols], [expression])
        return float(function(*[self.values[s.name] for s in symbols]))


def parameters_of(
    problem: Problem, changed: Mapping[Constant, float] | Mapping[str, float] | None = None
) -> Parameters:
    """The constants of a problem, those that are changed at their new values.

    Parameters
    ----------
    changed : mapping of Constant, or its name, to number

    Raises
    ------
    StatementError
        When the problem does not use such a constant.
    """
    if changed is not None and not isinstance(changed, Mapping):
        raise StatementError(
            f"the argument 'constants' is {changed!r}; give a dictionary: constants={{constant: "
            "value}"
        )
    values = {c.name: float(c.value) for c in problem.constants}
    for constant, value in (changed or {}).items():
        name = constant if isinstance(constant, str) else constant.name
        if name not in values:
            raise StatementError(f"problem '{problem.name}' does not use the constant '{name}'")
        values[name] = float(value)

    vector = np.array(list(values.values()), dtype=float)
    expressions, function = problem.limit_expressions
    limits: dict[int, float] = {}
    if expressions:
        numbers = np.array(function(vector)).ravel()
        limits = {e.element_hash(): float(v) for e, v in zip(expressions, numbers, strict=True)}
    return Parameters(values, vector, limits)
