"""Checks of a statement when it is made: each error names the thing, the value and the remedy.

Phases call `check_phase` and problems `check_problem`. What needs the values of the constants is
checked before a solve, by `ocp.problem.checks_before_solve`.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import casadi as ca

from ocp.errors import StatementError
from ocp.numerics.expression_graph import expression_text, graph_of
from ocp.problem.functionals import Functional
from ocp.problem.symbols import (
    Between,
    Constant,
    Signal,
    State,
    Time,
    Unknown,
    check_interval,
    is_limited,
    is_number,
    is_real,
    resolve,
)

if TYPE_CHECKING:
    from ocp.problem.phase import Phase
    from ocp.problem.problem import Problem


def check_mapping(phase: str, what: str, given: Any) -> None:
    """StatementError unless an argument of a phase is a dictionary."""
    if not isinstance(given, Mapping):
        form = "state: expression" if what == "dynamics" else "signal: value"
        raise StatementError(
            f"the argument '{what}' of phase '{phase}' is {given!r}; give a dictionary: "
            f"{what}={{{form}}}"
        )


def check_phase(phase: Phase) -> None:
    """StatementError unless times, boundary values and expressions of a phase make sense."""
    _check_times(phase)
    _check_boundary(phase, "initial", phase.initial)
    _check_boundary(phase, "final", phase.final)

    for symbol in phase.symbols:
        if isinstance(symbol, State) and symbol not in phase.dynamics:
            raise StatementError(
                f"phase '{phase.name}' uses the state '{symbol.name}' but has no dynamics for "
                "it; add its derivative"
            )
        if isinstance(symbol, Functional):
            raise StatementError(
                f"phase '{phase.name}' uses '{symbol.name}', a number of the whole motion, in its "
                "own expressions; use an Unknown there, and link it by a Bound of the problem"
            )


def _check_times(phase: Phase) -> None:
    for what, value in (("start", phase.start), ("end", phase.end)):
        if not isinstance(value, Between) and not (is_real(value) and math.isfinite(value)):
            raise StatementError(
                f"the {what} of phase '{phase.name}' is {value!r}; give a finite number of "
                "seconds or Between(lower, upper)"
            )
    if phase.breakpoints and not phase.has_fixed_times:
        raise StatementError(
            f"phase '{phase.name}' has a free time and breakpoints at fixed times; use two phases "
            f"that meet at {phase.breakpoints[0]:.6g} s, linked by joined(first, second), the "
            "later of which may have zero duration"
        )
    first = phase.start.lower if isinstance(phase.start, Between) else phase.start
    last = phase.end.upper if isinstance(phase.end, Between) else phase.end
    if not last > first:
        raise StatementError(
            f"phase '{phase.name}' ends at {last} s, not after its start at {first} s"
        )


def _check_boundary(phase: Phase, what: str, values: Mapping[State, Any]) -> None:
    """Boundary values are of states of the phase, inside their bounds, and known beforehand."""
    for state, value in values.items():
        if state not in phase.dynamics:
            raise _no_state(phase, state, what)
        pair = value if isinstance(value, tuple) else (value, value)
        if len(pair) != 2 or isinstance(value, list):
            raise StatementError(
                f"the {what} value of '{state.name}' is {value!r}; give a number or a pair "
                "(lower, upper)"
            )
        check_interval(f"{what} {state.name}", *pair)

        # expressions of constants are checked when their values are known, by `check_before_solve`
        low, high = pair
        below = is_number(high) and is_number(state.lower) and high < state.lower
        above = is_number(low) and is_number(state.upper) and low > state.upper
        if below or above:
            raise StatementError(
                f"the {what} value {value} of '{state.name}' lies outside its bounds "
                f"[{state.lower}, {state.upper}]; change one of them"
            )
        for limit in pair:
            _check_limit(limit, f"the {what} value of '{state.name}'")


def _no_state(phase: Phase, thing: Any, what: str) -> StatementError:
    """A boundary value of something that is no state of the phase, with what to write instead."""
    end = "start" if what == "initial" else "end"
    text = expression_text(thing) if isinstance(thing, ca.SX) else getattr(thing, "name", thing)
    remedy = "give the State object, not its name"
    if isinstance(thing, State):
        remedy = "add its derivative"
    elif isinstance(thing, (Signal, ca.SX)):
        remedy = (
            "only a State has one: bound this expression in the problem, "
            f"bounds=[phase.at_{end}({text}) == ...]"
        )
    return StatementError(
        f"phase '{phase.name}' has {'an' if what == 'initial' else 'a'} {what} value for '{text}' "
        f"but no dynamics for it; {remedy}"
    )


def _check_limit(value: Any, what: str) -> None:
    """StatementError if a limit depends on anything but constants."""
    for symbol in resolve(value, what):
        if not isinstance(symbol, Constant):
            raise StatementError(
                f"{what} depends on '{symbol.name}'; limits are numbers or expressions of "
                "Constants: move the rest into the bounded expression"
            )


def check_meeting(first: Phase, second: Phase) -> None:
    """StatementError unless the second of two phases can begin where the first ends."""
    end, start = first.end, second.start
    earliest, latest = (end.lower, end.upper) if isinstance(end, Between) else (end, end)
    begins = (start.lower, start.upper) if isinstance(start, Between) else (start, start)
    if latest < begins[0] or earliest > begins[1]:
        raise StatementError(
            f"phase '{second.name}' cannot begin when phase '{first.name}' ends: it starts at "
            f"{start} s, but '{first.name}' ends at {end} s; give both the same time"
        )


def check_jump(second: Phase, jump: Mapping[State, Any]) -> None:
    """StatementError unless all that jumps are states of the phase that begins."""
    states = ", ".join(state.name for state in second.states)
    for state in jump:
        if not isinstance(state, State) or state not in second.dynamics:
            raise StatementError(
                f"the jump into phase '{second.name}' is of '{getattr(state, 'name', state)}', "
                f"which is not a state of this phase; give a State object, one of {states}"
            )


def _check_coupled(problem: Problem) -> None:
    """StatementError for a limit by an unknown of a signal that no expression of a phase has."""
    for phase in problem.phases:
        known = set(phase.symbols)
        for signal in problem.signals[phase.name]:
            if isinstance(signal, Signal) and signal.coupled and signal not in known:
                raise StatementError(
                    f"the limit of '{signal.name}' depends on an unknown, but phase '{phase.name}' "
                    f"has '{signal.name}' in an integral, a peak or an end value only; write the "
                    "limit in the bounds of the phase"
                )


def check_problem(problem: Problem) -> None:
    """StatementError unless names are unique and terminal expressions are of numbers."""
    if not problem.phases:
        raise StatementError(f"problem '{problem.name}' has no phase; give at least one")
    _check_origins(problem)
    _check_names(problem)
    _check_coupled(problem)

    for symbol in problem.boundary_symbols:
        if isinstance(symbol, (Signal, Time)):
            raise StatementError(
                f"the objective or a bound of problem '{problem.name}' uses the signal "
                f"'{symbol.name}' as if it were a number; wrap it in at_start, at_end, at, "
                "integral or peak of a phase"
            )
    if not any(isinstance(s, (Functional, Unknown)) for s in problem.objective_symbols):
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
        _check_limit(symbol.lower, f"the lower bound of '{symbol.name}'")
        _check_limit(symbol.upper, f"the upper bound of '{symbol.name}'")
    path = [bound for phase in problem.phases for bound in phase.bounds]
    for bound in (*problem.boundary_constraints, *path):
        _check_limit(bound.lower, f"the lower limit of '{bound.name}'")
        _check_limit(bound.upper, f"the upper limit of '{bound.name}'")
    _check_peaks(problem)


def _check_origins(problem: Problem) -> None:
    """StatementError if a functional is of another phase that has the name of one of the problem.

    A notebook cell that is run again leaves such phases behind, and their functionals would be
    evaluated on the phase of the problem. A copy of a phase with another guess, other times or
    limits has the same dynamics, and may take the functionals of the original.
    """
    phases = {phase.name: phase for phase in problem.phases}
    for functional in problem.functionals:
        # those that no phase has made know no dynamics
        for (name, _), dynamics in zip(functional.pieces, functional.phase_dynamics, strict=False):
            if name in phases and not _same_dynamics(dynamics, phases[name].dynamics):
                raise StatementError(
                    f"'{functional.name}' in problem '{problem.name}' was made from another phase "
                    f"named '{name}', with other states or dynamics than the phase '{name}' of the "
                    "problem; make it from the phase that you give to the problem"
                )


def _same_dynamics(one: Mapping[State, Any], other: Mapping[State, Any]) -> bool:
    """Whether two phases have the same states, with the same rates."""
    if one is other:
        return True
    if len(one) != len(other) or not all(state in other for state in one):
        return False
    pairs = [(one[state], other[state]) for state in one]
    different = [(a, b) for a, b in pairs if a.element_hash() != b.element_hash()]
    if not different:
        return True
    # the same code may have written them twice
    symbols = ca.symvar(ca.vertcat(*itertools.chain(*different)))
    ours, theirs = (graph_of(rates, symbols) for rates in zip(*different, strict=True))
    return ours == theirs


def _check_names(problem: Problem) -> None:
    """StatementError if two phases, signals, numbers or bounds of a problem share a name."""
    signals = [s.name for s in problem.symbols if isinstance(s, Signal)]
    numbers = [s.name for s in problem.symbols if isinstance(s, (Unknown, Constant))]
    kinds = [
        ("phase", [phase.name for phase in problem.phases]),
        ("signal", signals),
        ("unknown or constant", numbers),
        ("bound or link", [bound.name for bound in problem.boundary_constraints]),
        *(("bound of one phase", [b.name for b in phase.bounds]) for phase in problem.phases),
    ]
    for what, names in kinds:
        twice = {name for name in names if names.count(name) > 1}
        if twice:
            raise StatementError(
                f"problem '{problem.name}' has more than one {what} called '{sorted(twice)[0]}'; "
                "rename one of them"
            )


def _check_peaks(problem: Problem) -> None:
    """StatementError if a problem gains from a larger peak, which has no limit from above.

    A peak is an unknown that the expression must not exceed, so it can only be pressed down.
    """
    terms = [(problem.objective, "the objective", True, False)]
    terms += [
        (b.expression, f"the bound '{b.name}'", is_limited(b.upper), is_limited(b.lower))
        for b in problem.boundary_constraints
    ]
    for peak in problem.peaks:
        for expression, what, upper, lower in terms:
            slope = ca.jacobian(expression, peak.symbol)
            if slope.nnz() == 0 or not slope.is_constant():
                continue
            if (lower and float(slope) > 0) or (upper and float(slope) < 0):
                raise StatementError(
                    f"{what} requires a large peak '{peak.name}'; a peak can only be limited from "
                    "above and minimised"
                )
