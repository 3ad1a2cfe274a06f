"""Checks before a solve: limits at the values of the constants, guesses, and what is left out.

What needs no values is checked when it is stated, by `ocp.problem.statement_checks`. Each error
names the thing, the value and the remedy.
"""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Iterator
from typing import TYPE_CHECKING

from ocp.errors import Infeasible, StatementError, StatementWarning
from ocp.problem.end_limits import limits_broken_at_ends
from ocp.problem.functionals import BoundaryValue, PointValue
from ocp.problem.symbols import Between, State, Symbol

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
        shared = _unlinked(problem, first, second)
        if shared:
            warnings.warn(
                f"phase '{second.name}' begins {_when(second)}, where '{first.name}' ends, and "
                f"both have the state '{shared}', but nothing links them; add links=joined(first, "
                f"second) with these phases, or give '{shared}' an initial value in "
                f"'{second.name}' if it starts afresh",
                StatementWarning,
                stacklevel=3,
            )

    for phase in problem.phases:
        for what, state, (low, high) in _boundary_values(phase, parameters):
            lower, upper = parameters.signal_limits[state.name]
            if low > upper or high < lower:
                given = f"{low:g}" if low == high else f"({low:g}, {high:g})"
                raise StatementError(
                    f"the {what} value {given} of '{state.name}' in phase '{phase.name}' lies "
                    f"outside its bounds [{lower:g}, {upper:g}]{_at(parameters)}; change one of "
                    "them"
                )
        _check_guess(problem, phase)
        for state in _unused(problem, phase):
            warnings.warn(
                f"the state '{state.name}' of phase '{phase.name}' is never used: bound it, use it "
                "or remove it",
                StatementWarning,
                stacklevel=3,
            )

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
        for what, state, limits in _boundary_values(phase, parameters):
            yield f"the {what} values of '{state.name}' in '{phase.name}'", limits
    for bound in problem.boundary_constraints:
        yield f"the limits of '{bound.name}'", parameters.bound_limits["", bound.name]


def _boundary_values(
    phase: Phase, parameters: Parameters
) -> Iterator[tuple[str, State, tuple[float, float]]]:
    """The end in words, the state, and the limits of each boundary value of a phase."""
    for what, values in (
        ("initial", parameters.initial_values),
        ("final", parameters.final_values),
    ):
        for state in phase.states:
            if (phase.name, state.name) in values:
                yield what, state, values[phase.name, state.name]


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


def _unlinked(problem: Problem, first: Phase, second: Phase) -> str:
    """A state that two phases have which meet without a link; empty if there is none.

    They meet where the end of the one and the start of the other have the same limits, unless they
    have both times in common and run side by side. They are linked where anything of the problem is
    a value at the start of the second phase, be it in a jump, in a price or in a bound with an
    unknown that stands between the two. A state with an initial value is known to start again.
    """
    (begins, ends), (again, end) = ([_range(t) for t in (p.start, p.end)] for p in (first, second))
    shared = [s for s in second.states if s in first.dynamics and s not in second.initial]
    if not shared or ends != again or (begins, ends) == (again, end):
        return ""
    for functional in problem.functionals:
        # a set, because symbols that are compared make a relation
        if functional.phase == second.name and {*shared} & {*functional.symbols}:
            if isinstance(functional, BoundaryValue) and functional.end == "start":
                return ""
            if isinstance(functional, PointValue) and functional.instant == second.start:
                return ""
    return shared[0].name


def _range(time: float | Between) -> tuple[float, float]:
    """The limits of a time of a phase [s]."""
    limits = (time.lower, time.upper) if isinstance(time, Between) else (time, time)
    return float(limits[0]), float(limits[1])


def _when(phase: Phase) -> str:
    """When a phase begins, in words."""
    low, high = _range(phase.start)
    return f"at {low} s" if low == high else f"between {low} s and {high} s"


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
