"""Checks of a phase's statement, each with a sentence that names the remedy."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import casadi as ca

from ocp.errors import StatementError
from ocp.problem.symbols import (
    Between,
    Constant,
    Signal,
    State,
    Time,
    Unknown,
    check_interval,
    is_number,
    is_real,
    resolve,
)
from ocp.problem.terms import Functional

if TYPE_CHECKING:
    from ocp.problem.statement import Phase, Problem


def check_names(what: str, names: list[str], problem: str) -> None:
    """StatementError if a name appears twice."""
    twice = {name for name in names if names.count(name) > 1}
    if twice:
        raise StatementError(
            f"problem '{problem}' has more than one {what} called '{sorted(twice)[0]}'; "
            "rename one of them"
        )


def check_all_names(problem: Problem) -> None:
    """StatementError if two phases, signals, numbers or bounds of a problem share a name."""
    signals = [s.name for s in problem.symbols if isinstance(s, Signal)]
    numbers = [s.name for s in problem.symbols if isinstance(s, (Unknown, Constant))]
    check_names("phase", [phase.name for phase in problem.phases], problem.name)
    check_names("signal", signals, problem.name)
    check_names("unknown or constant", numbers, problem.name)
    check_names("bound or link", [b.name for b in (*problem.bounds, *problem.links)], problem.name)
    for phase in problem.phases:
        check_names("bound of one phase", [b.name for b in phase.bounds], problem.name)


def check_times(phase: Phase) -> None:
    """StatementError unless the phase begins and ends at sensible times."""
    for what, value in (("start", phase.start), ("end", phase.end)):
        if not isinstance(value, Between) and not (is_real(value) and math.isfinite(value)):
            raise StatementError(
                f"the {what} of phase '{phase.name}' is {value!r}; give a finite number of "
                "seconds or Between(lower, upper)"
            )
    first = phase.start.lower if isinstance(phase.start, Between) else phase.start
    last = phase.end.upper if isinstance(phase.end, Between) else phase.end
    if not last > first:
        raise StatementError(
            f"phase '{phase.name}' ends at {last} s, not after its start at {first} s"
        )


def check_boundary(phase: Phase, what: str, values: Mapping[State, Any]) -> None:
    """StatementError unless boundary values are of known states and inside their bounds."""
    for state, value in values.items():
        if state not in phase.dynamics:
            raise StatementError(
                f"phase '{phase.name}' has an {what} value for "
                f"'{getattr(state, 'name', state)}' but no dynamics for it; add its derivative"
            )
        pair = value if isinstance(value, tuple) else (value, value)
        if len(pair) != 2:
            raise StatementError(
                f"the {what} value of '{state.name}' is {value!r}; give a number or a pair "
                "(lower, upper)"
            )
        check_interval(f"{what} {state.name}", *pair)
        low, high = pair
        below = is_number(high) and is_number(state.lower) and high < state.lower
        above = is_number(low) and is_number(state.upper) and low > state.upper
        if below or above:
            raise StatementError(
                f"the {what} value {value} of '{state.name}' lies outside its bounds "
                f"[{state.lower}, {state.upper}]; change one of them"
            )
        for limit in pair:
            check_limit(limit, f"the {what} value of '{state.name}'")


def check_limit(value: Any, what: str) -> None:
    """StatementError if a limit depends on anything but constants."""
    for symbol in resolve(value, what):
        if not isinstance(symbol, Constant):
            raise StatementError(
                f"{what} depends on '{symbol.name}'; limits are numbers or expressions of "
                "Constants: bring the rest into the expression that is bounded"
            )


def check_peaks(problem: Problem) -> None:
    """StatementError if a problem gains from a larger peak, which has no limit from above."""
    terms = [(problem.objective, "the objective", True, False)]
    terms += [
        (b.expression, f"the bound '{b.name}'", _limited(b.upper), _limited(b.lower))
        for b in (*problem.bounds, *problem.links)
    ]
    for f in problem.functionals:
        for expression, what, upper, lower in terms if f.kind == "peak" else ():
            slope = ca.jacobian(expression, f.symbol)
            if slope.nnz() == 0 or not slope.is_constant():
                continue
            if (lower and float(slope) > 0) or (upper and float(slope) < 0):
                raise StatementError(
                    f"{what} asks for a large peak '{f.name}'; a peak can be limited from above "
                    "and minimised only"
                )


def _limited(value: Any) -> bool:
    return not (is_number(value) and math.isinf(value))


def check_problem(problem: Problem) -> None:
    """StatementError unless names are unique and terminal expressions are of numbers."""
    if not problem.phases:
        raise StatementError(f"problem '{problem.name}' has no phase; give at least one")
    check_all_names(problem)
    for symbol in problem.terminal_symbols:
        if isinstance(symbol, (Signal, Time)):
            raise StatementError(
                f"the objective or a bound of problem '{problem.name}' uses the signal "
                f"'{symbol.name}' as if it were a number; wrap it in at_start, at_end, at, "
                "integral or peak of a phase"
            )
    if not any(isinstance(s, (Functional, Unknown)) for s in resolve(problem.objective, "it")):
        raise StatementError(
            f"the objective of problem '{problem.name}' is a fixed number; minimise a value of "
            "the motion, such as an integral, a peak or an end time"
        )
    names = {phase.name for phase in problem.phases}
    for functional in problem.functionals:
        for phase_name, _ in functional.pieces:
            if phase_name not in names:
                raise StatementError(
                    f"'{functional.name}' belongs to phase '{phase_name}', which problem "
                    f"'{problem.name}' does not have; add the phase"
                )
    for symbol in [s for s in problem.symbols if isinstance(s, (Signal, Unknown))]:
        check_limit(symbol.lower, f"the lower bound of '{symbol.name}'")
        check_limit(symbol.upper, f"the upper bound of '{symbol.name}'")
    for bound in (*problem.bounds, *problem.links, *[b for p in problem.phases for b in p.bounds]):
        check_limit(bound.lower, f"the lower limit of '{bound.name}'")
        check_limit(bound.upper, f"the upper limit of '{bound.name}'")
    check_peaks(problem)


def check_symbols(phase: Phase) -> None:
    """StatementError if a phase uses a state without dynamics or a number of the motion."""
    for symbol in phase.symbols:
        if isinstance(symbol, State) and symbol not in phase.dynamics:
            raise StatementError(
                f"phase '{phase.name}' uses the state '{symbol.name}' but has no dynamics for "
                "it; add its derivative"
            )
        if isinstance(symbol, Functional):
            raise StatementError(
                f"phase '{phase.name}' uses '{symbol.name}', a number of the whole motion, in "
                "its own expressions; bring it in as an Unknown linked by a Bound"
            )
