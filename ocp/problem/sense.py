"""Whether a statement makes sense at the values of its constants, before anything is solved."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Mapping
from typing import Any

from ocp.errors import StatementError, StatementWarning
from ocp.mesh.initial_guess import evaluate_limit
from ocp.problem.statement import Phase, Problem
from ocp.problem.symbols import Signal, State, Symbol, is_number, resolve


def check_sense(problem: Problem, constants: Mapping[str, float]) -> None:
    """Check all limits at the values of the constants, and that every state has a use.

    Raises
    ------
    StatementError
        When two limits cross, a boundary value lies outside its state's bounds, or a guess is of
        a signal that its phase does not have.

    Warns
    -----
    StatementWarning
        When a state has dynamics but nothing depends on it.
    """
    for what, lower, upper in _limits(problem):
        low, high = evaluate_limit(lower, constants), evaluate_limit(upper, constants)
        if low > high:
            raise StatementError(
                f"{what} cross{_at(constants)}: lower {low:g} is above upper {high:g}; change one "
                "of them"
            )
    for phase in problem.phases:
        for what, values in (("initial", phase.initial), ("final", phase.final)):
            for state, value in values.items():
                _check_inside(phase, what, state, value, constants)
        _check_guess(problem, phase)
        for state in _unused(problem, phase):
            warnings.warn(
                f"nothing depends on the state '{state.name}' of phase '{phase.name}': it is "
                "carried along without effect; bound it, use it or take it out",
                StatementWarning, stacklevel=3,
            )  # fmt: skip


def _limits(problem: Problem) -> Iterator[tuple[str, Any, Any]]:
    for symbol in problem.symbols:
        if hasattr(symbol, "lower"):
            yield f"the bounds of '{symbol.name}'", symbol.lower, symbol.upper
    for phase in problem.phases:
        for bound in phase.bounds:
            yield f"the limits of '{bound.name}' in '{phase.name}'", bound.lower, bound.upper
        for what, values in (("initial", phase.initial), ("final", phase.final)):
            for state, value in values.items():
                if isinstance(value, tuple):
                    yield f"the {what} values of '{state.name}' in '{phase.name}'", *value
    for bound in (*problem.bounds, *problem.links):
        yield f"the limits of '{bound.name}'", bound.lower, bound.upper


def _check_inside(
    phase: Phase, what: str, state: State, value: Any, constants: Mapping[str, float]
) -> None:
    pair = value if isinstance(value, tuple) else (value, value)
    low, high = (evaluate_limit(v, constants) for v in pair)
    lower, upper = (evaluate_limit(v, constants) for v in (state.lower, state.upper))
    if low > upper or high < lower:
        given = f"{low:g}" if low == high else f"({low:g}, {high:g})"
        raise StatementError(
            f"the {what} value {given} of '{state.name}' in phase '{phase.name}' lies outside its "
            f"bounds [{lower:g}, {upper:g}]{_at(constants)}; change one of them"
        )


def _at(constants: Mapping[str, float]) -> str:
    return f" at {', '.join(f'{k} = {v:g}' for k, v in constants.items())}" if constants else ""


def _check_guess(problem: Problem, phase: Phase) -> None:
    known = {*phase.states, *problem.signals_of(phase, Signal)}
    for signal in phase.guess:
        if signal not in known:
            raise StatementError(
                f"phase '{phase.name}' has a guess for '{getattr(signal, 'name', signal)}', which "
                "its dynamics, bounds and objective do not use; take it out or use it"
            )


def _unused(problem: Problem, phase: Phase) -> list[State]:
    """States with dynamics that no other dynamics, bound, end value or functional depends on."""
    used: set[Symbol] = set(phase.final)
    for state, rate in phase.dynamics.items():
        used.update(s for s in resolve(rate, "a derivative") if s is not state)
    for bound in phase.bounds:
        used.update(resolve(bound.expression, bound.name))
    for functional in problem.functionals:
        used.update(functional.symbols)
    free = [s for s in phase.states if s not in used]
    return [s for s in free if not any(_is_finite(v) for v in (s.lower, s.upper))]


def _is_finite(limit: Any) -> bool:
    return not is_number(limit) or math.isfinite(limit)
