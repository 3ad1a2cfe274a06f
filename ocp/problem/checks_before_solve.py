"""Checks before a solve: limits at the values of the constants, guesses, and what is left out.

What needs no values is checked when it is stated, by `ocp.problem.statement_checks`. Each error
names the thing, the value and the remedy.
"""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import casadi as ca

from ocp.errors import Infeasible, StatementError, StatementWarning
from ocp.problem.end_limits import limits_broken_at_ends
from ocp.problem.functionals import BoundaryValue, Functional, PhaseTime, PointValue
from ocp.problem.symbols import Between, Constant, State, Symbol

if TYPE_CHECKING:
    from ocp.problem.parameters import Parameters
    from ocp.problem.phase import Phase
    from ocp.problem.problem import Problem


def check_before_solve(problem: Problem, parameters: Parameters) -> None:
    """Check limits at the values of the constants, guesses, links, and that states have a use.

    Raises
    ------
    StatementError
        When two limits cross, a boundary value lies outside its state's bounds, or a guess is of
        a signal that its phase does not have.
    Infeasible
        When the prescribed values of an end break a path limit by themselves.

    Warns
    -----
    StatementWarning
        When a state has dynamics but nothing depends on it, or a phase begins where another ends
        without a link.
    """
    for what, (low, high) in _limits(problem, parameters):
        if low > high:
            raise StatementError(
                f"{what} cross{_at(parameters)}: lower {low:g} is above upper {high:g}; change one "
                "of them"
            )

    for first, second in itertools.pairwise(problem.phases):
        where, shared = _unlinked(problem, first, second)
        if where:
            warnings.warn(
                f"phase '{second.name}' begins {where}, and both have the state '{shared}', but "
                "nothing links them; add links=joined(first, second) with these phases, or give "
                f"'{shared}' an initial value in '{second.name}' if it starts afresh",
                StatementWarning,
                stacklevel=3,
            )

    for phase in problem.phases:
        for what, values in _boundary_values(parameters):
            for state in phase.states:
                if (phase.name, state.name) in values:
                    _check_inside(phase, what, state, values[phase.name, state.name], parameters)
        _check_guess(problem, phase)
        for state in _unused(problem, phase):
            warnings.warn(
                f"the state '{state.name}' of phase '{phase.name}' is never used: bound it, use it "
                "or remove it",
                StatementWarning,
                stacklevel=3,
            )

    _check_ends(problem, parameters)


def _check_ends(problem: Problem, parameters: Parameters) -> None:
    broken = list(limits_broken_at_ends(problem, parameters))
    if broken:
        raise Infeasible(
            f"no motion meets all constraints of '{problem.name}'{_at(parameters)}: "
            f"{'; '.join(broken)}; change the limit or one of these values "
            "(ocp.relaxed(problem) finds the smallest change)"
        )


def _limits(problem: Problem, parameters: Parameters) -> Iterator[tuple[str, tuple[float, float]]]:
    """All pairs of limits, with what they are limits of."""
    for name, limits in (*parameters.signal_limits.items(), *parameters.unknown_limits.items()):
        yield f"the bounds of '{name}'", limits
    for phase in problem.phases:
        for bound in phase.bounds:
            limits = parameters.bound_limits[phase.name, bound.name]
            yield f"the limits of '{bound.name}' in '{phase.name}'", limits
        for what, values in _boundary_values(parameters):
            for state in phase.states:
                if (phase.name, state.name) in values:
                    limits = values[phase.name, state.name]
                    yield f"the {what} values of '{state.name}' in '{phase.name}'", limits
    for bound in problem.boundary_constraints:
        yield f"the limits of '{bound.name}'", parameters.bound_limits["", bound.name]


def _boundary_values(
    parameters: Parameters,
) -> tuple[tuple[str, Mapping[tuple[str, str], tuple[float, float]]], ...]:
    """Both ends, in words, and the boundary values there."""
    return ("initial", parameters.initial_values), ("final", parameters.final_values)


def _check_inside(
    phase: Phase, what: str, state: State, value: tuple[float, float], parameters: Parameters
) -> None:
    low, high = value
    lower, upper = parameters.signal_limits[state.name]
    if low > upper or high < lower:
        given = f"{low:g}" if low == high else f"({low:g}, {high:g})"
        raise StatementError(
            f"the {what} value {given} of '{state.name}' in phase '{phase.name}' lies outside its "
            f"bounds [{lower:g}, {upper:g}]{_at(parameters)}; change one of them"
        )


def _at(parameters: Parameters) -> str:
    listed = ", ".join(f"{name} = {value:g}" for name, value in parameters.values.items())
    return f" at {listed}" if listed else ""


def _check_guess(problem: Problem, phase: Phase) -> None:
    known = {*phase.states, *problem.signals[phase.name]}
    for signal in phase.guess:
        if signal not in known:
            stranger = not isinstance(signal, Symbol)
            remedy = "give the signal itself" if stranger else "take it out or use it"
            raise StatementError(
                f"phase '{phase.name}' has a guess for '{getattr(signal, 'name', signal)}', which "
                f"its dynamics, bounds and objective do not use; {remedy}"
            )


def _unlinked(problem: Problem, first: Phase, second: Phase) -> tuple[str, str]:
    """Where two phases meet without a link and a state that both have; empty if they do not.

    They are linked where anything of the problem is a value at the start of the second phase, be it
    in a jump, in a price or in a bound with an unknown that stands between the two. A state with an
    initial value, or a range of them, is known to start again.
    """
    shared = [s for s in second.states if s in first.dynamics and s not in second.initial]
    if not shared or any(_is_at_start(f, second, shared) for f in problem.functionals):
        return "", ""
    return _meeting(problem, first, second), shared[0].name


def _is_at_start(functional: Functional, phase: Phase, states: Sequence[State]) -> bool:
    """Whether a functional is a value of one of the states at the start of a phase."""
    match functional:
        case BoundaryValue():
            there = functional.end == "start"
        case PointValue():
            there = functional.instant == phase.start
        case _:
            there = False
    # a set, because symbols that are compared make a relation
    return there and functional.phase == phase.name and bool({*states} & {*functional.symbols})


def _meeting(problem: Problem, first: Phase, second: Phase) -> str:
    """Where one phase begins as another one ends, in words; empty if nothing says that it does.

    The end of the one and the start of the other have the same limits, or a bound links the two
    times alone. Phases that have both times in common run side by side.
    """
    (begins, ends), (low, high) = _ranges(first), _ranges(second)[0]
    if ends == (low, high) and (begins, ends) != _ranges(second):
        where = f"at {low} s" if low == high else f"between {low} s and {high} s"
        return f"{where}, where '{first.name}' {'ends' if low == high else 'may end'}"
    times = {(first.name, "end"), (second.name, "start")}
    for bound in problem.boundary_constraints:
        named = [s for s in bound.symbols if not isinstance(s, Constant)]
        of_phases = {(s.phase, s.end) for s in named if isinstance(s, PhaseTime)}
        if bound.is_equation and of_phases == times and len(named) == len(times):
            symbols = ca.vertcat(*[s.symbol for s in named])
            gap = ca.substitute(bound.expression - bound.lower, symbols, ca.SX.ones(len(named)))
            if gap.is_zero():
                return f"when '{first.name}' ends"
    return ""


def _ranges(phase: Phase) -> tuple[tuple[float, float], tuple[float, float]]:
    """The limits of both times of a phase [s]."""
    start, end = (
        (float(time.lower), float(time.upper))
        if isinstance(time, Between)
        else (float(time), float(time))
        for time in (phase.start, phase.end)
    )
    return start, end


def _unused(problem: Problem, phase: Phase) -> list[State]:
    """States with dynamics that no other dynamics, bound, end value or functional depends on."""
    used: set[Symbol] = set(phase.final)
    for state, symbols in phase.rate_symbols.items():
        used.update(s for s in symbols if s is not state)
    for bound in phase.bounds:
        used.update(bound.symbols)
    for functional in problem.functionals:
        used.update(functional.symbols)
    return [state for state in phase.states if state not in used and not state.is_limited]
