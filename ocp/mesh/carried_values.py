"""Values that a guess carries over links, from the end of a phase to the start of the next one.

A mass that the first phase states is the mass of the next one, less what is dropped. Without that
it would be guessed to be 0, and its inverse has no value there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping

import casadi as ca

from ocp.problem.bounds import Bound
from ocp.problem.functionals import BoundaryValue
from ocp.problem.parameters import Parameters
from ocp.problem.phase import Phase
from ocp.problem.problem import Problem
from ocp.problem.symbols import Constant, State, Symbol

# The value of a state at the end of a phase, None where its guess does not know any.
EndValue = Callable[[State], float | None]


def carried_values(
    problem: Problem,
    phase: Phase,
    states: Collection[State],
    parameters: Parameters,
    before: Mapping[str, EndValue],
) -> Iterator[tuple[State, float]]:
    """States at the start of a phase to which a link gives a value, and the value.

    Parameters
    ----------
    states : collection of State
        Those of the phase that may take one.
    parameters : Parameters
        Values of the constants.
    before : mapping of str to EndValue
        Of the phases whose guesses are known already, by name.

    Raises
    ------
    StatementError
        From an `EndValue`, if the guess of that state is not finite or has a wrong shape.
    """
    for bound in problem.boundary_constraints if states else ():
        for start in bound.symbols if bound.is_equation else ():
            state = _started(start, phase, states)
            if state is not None:
                value = _by_link(bound, start, parameters, before)
                if value is not None:
                    yield state, value


def _started(start: Symbol, phase: Phase, states: Collection[State]) -> State | None:
    """The one of these states whose value at the start of a phase a symbol is, if any."""
    if not isinstance(start, BoundaryValue) or (start.phase, start.end) != (phase.name, "start"):
        return None
    found = start.expression.element_hash()
    return next((s for s in states if s.symbol.element_hash() == found), None)


def _by_link(
    link: Bound, start: Symbol, parameters: Parameters, before: Mapping[str, EndValue]
) -> float | None:
    """The value at a start that an equation asks for; None where it takes more than is stated."""
    others = [symbol for symbol in link.symbols if symbol is not start]
    stated = [_known(symbol, parameters, before) for symbol in others]
    known = [value for value in stated if value is not None]
    slope = ca.jacobian(link.expression, start.symbol)
    if len(known) < len(others) or not (slope.is_constant() and slope.nnz() == 1):
        return None
    symbols = ca.vertcat(start.symbol, *[symbol.symbol for symbol in others])
    rest = float(ca.substitute(link.expression, symbols, ca.SX([0.0, *known])))
    value = (parameters.limit(link.lower) - rest) / float(slope)
    return value if math.isfinite(value) else None


def _known(symbol: Symbol, parameters: Parameters, before: Mapping[str, EndValue]) -> float | None:
    """A constant, or a value at the end of a phase of states that are stated there; else None."""
    if isinstance(symbol, Constant):
        return parameters.values[symbol.name]
    if not isinstance(symbol, BoundaryValue) or symbol.end != "end" or symbol.phase not in before:
        return None
    at_end, values = before[symbol.phase], list[float]()
    for part in symbol.symbols:
        value = None
        if isinstance(part, Constant):
            value = parameters.values[part.name]
        elif isinstance(part, State):
            value = at_end(part)
        if value is None:
            return None
        values.append(value)
    symbols = ca.vertcat(*[part.symbol for part in symbol.symbols], ca.SX(0, 1))
    return float(ca.substitute(symbol.expression, symbols, ca.SX(values)))
