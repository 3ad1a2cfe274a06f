"""Values of a problem's constants, and all of its limits at these values.

A limit may be a number or an expression of constants. All expressions of a problem are evaluated by
one function, once for each set of values, and everybody reads the numbers.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from ocp.arrays import Array
from ocp.errors import StatementError
from ocp.problem.problem import Problem
from ocp.problem.symbols import Constant, Signal, column_of, is_number, is_real, resolve, scalar

Interval = tuple[float, float]


@dataclass(frozen=True, eq=False)
class Parameters:
    """The constants of a problem at given values, and its limits there.

    Attributes
    ----------
    values : mapping of name to number
    vector : (n_k,)
        The values in the order of `Problem.constants`.
    limits : mapping of CasADi's hash of an expression to number
        The problem's limits that are expressions.
    signal_limits, unknown_limits : mapping of name to (lower, upper)
    bound_limits : mapping of (phase name, bound name) to (lower, upper)
        The phase is "" for bounds and links of the problem.
    initial_values, final_values : mapping of (phase name, state name) to (lower, upper)
        Of the states that have any; both are the same where one number is stated.
    """

    values: Mapping[str, float]
    vector: Array
    limits: Mapping[int, float] = field(repr=False)
    signal_limits: Mapping[str, Interval] = field(repr=False)
    unknown_limits: Mapping[str, Interval] = field(repr=False)
    bound_limits: Mapping[tuple[str, str], Interval] = field(repr=False)
    initial_values: Mapping[tuple[str, str], Interval] = field(repr=False)
    final_values: Mapping[tuple[str, str], Interval] = field(repr=False)

    def limit(self, limit: Any) -> float:
        """A limit or boundary value as a number, one that the problem does not state included."""
        if is_number(limit):
            return float(limit)
        expression = scalar(limit, "a limit")
        value = self.limits.get(expression.element_hash())
        return self._evaluated(expression) if value is None else value

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
        When the problem does not use such a constant, or a value is no finite number.
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
            names = ", ".join(f"'{known}'" for known in values) or "none"
            raise StatementError(
                f"problem '{problem.name}' does not use the constant '{name}'; there are: {names}"
            )
        if not (is_real(value) and math.isfinite(value)):
            raise StatementError(f"the constant '{name}' is {value!r}; give it a finite number")
        values[name] = float(value)
    vector = np.array(list(values.values()), dtype=float)

    # all limits that are expressions at once
    stated, hashes, function = _stated_limits(problem)
    limits = dict(zip(hashes, function(vector).nonzeros(), strict=True))

    def number(limit: Any) -> float:
        known = is_number(limit)
        return float(limit) if known else limits[scalar(limit, "a limit").element_hash()]

    intervals = [
        {key: (number(low), number(high)) for key, (low, high) in each.items()} for each in stated
    ]
    return Parameters(values, vector, limits, *intervals)


def limit_slopes(limit: Any, parameters: Parameters) -> dict[str, float]:
    """Derivatives of a limit by the constants it depends on."""
    symbols = resolve(limit, "a limit")
    if not symbols:
        return {}
    inputs = ca.vertcat(*[s.symbol for s in symbols])
    jacobian = ca.densify(ca.jacobian(scalar(limit, "a limit"), inputs))
    slope = ca.Function("slope", [inputs], [jacobian])
    values = np.array(slope([parameters.values[s.name] for s in symbols])).ravel()
    return {s.name: float(v) for s, v in zip(symbols, values, strict=True)}


@lru_cache
def _stated_limits(
    problem: Problem,
) -> tuple[list[dict[Any, tuple[Any, Any]]], list[int], ca.Function]:
    """The limits of a problem, and those that are expressions.

    Returns
    -------
    limits : five mappings to (lower, upper)
        Of signals, unknowns, bounds, initial and final values, by the keys of `Parameters`.
    hashes : list of int
        CasADi's, of the expressions among them.
    function : Function
        Of the constants; its results are these expressions.
    """
    bounds = [("", bound) for bound in problem.boundary_constraints]
    bounds += [(phase.name, bound) for phase in problem.phases for bound in phase.bounds]
    limits: list[dict[Any, tuple[Any, Any]]] = [
        {s.name: (s.lower, s.upper) for s in problem.symbols if isinstance(s, Signal)},
        {u.name: (u.lower, u.upper) for u in problem.unknowns},
        {(where, b.name): (b.lower, b.upper) for where, b in bounds},
    ]
    for end in ("initial", "final"):
        limits.append(
            {
                (phase.name, state.name): value if isinstance(value, tuple) else (value, value)
                for phase in problem.phases
                for state, value in getattr(phase, end).items()
            }
        )
    stated = [limit for each in limits for pair in each.values() for limit in pair]
    expressions = [scalar(limit, "a limit") for limit in stated if not is_number(limit)]
    results = ca.densify(ca.vertcat(*expressions, ca.SX(0, 1)))
    function = ca.Function("limits", [column_of(problem.constants)], [results])
    return limits, [expression.element_hash() for expression in expressions], function
