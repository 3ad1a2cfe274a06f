"""Checks of a phase's statement, each with a sentence that names the remedy."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ocp.errors import StatementError
from ocp.symbols import Between, State, check_interval, is_number, is_real
from ocp.terms import Functional

if TYPE_CHECKING:
    from ocp.statement import Phase


def check_names(what: str, names: list[str], problem: str) -> None:
    """StatementError if a name appears twice."""
    twice = {name for name in names if names.count(name) > 1}
    if twice:
        raise StatementError(
            f"problem '{problem}' has more than one {what} called '{sorted(twice)[0]}'; "
            "rename one of them"
        )


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
        outside = [
            v for v in pair
            if is_number(v) and math.isfinite(v)
            and ((is_number(state.lower) and v < state.lower)
                 or (is_number(state.upper) and v > state.upper))
        ]  # fmt: skip
        if outside and not isinstance(value, tuple):
            raise StatementError(
                f"the {what} value {outside[0]} of '{state.name}' lies outside its bounds "
                f"[{state.lower}, {state.upper}]; change one of them"
            )


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
