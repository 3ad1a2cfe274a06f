"""Checks before a solve: limits at the values of the constants, guesses, and what is left out.

What needs no values is checked when it is stated, by `ocp.problem.statement_checks`. Each error
names the thing, the value and the remedy.

Where all that a path limit depends on is prescribed at an end, its value there is a number, and no
motion changes it. A solver would look for one all the same, from start to start.
"""

from __future__ import annotations

import itertools
import math
import warnings
from collections.abc import Iterator, Mapping
from typing import Any

import casadi as ca
import numpy as np

from ocp.errors import Infeasible, StatementError, StatementWarning
from ocp.problem.bounds import Bound
from ocp.problem.display import with_unit
from ocp.problem.functionals import BoundaryValue, PointValue
from ocp.problem.parameters import Interval, Parameters, limit_slopes
from ocp.problem.phase import Phase
from ocp.problem.problem import Problem
from ocp.problem.symbols import TIME, Between, State, Symbol, is_real, scalar


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
                f"{what} contradict each other{_at(parameters)}: lower {low:g} is above upper "
                f"{high:g}; change one of them"
            )

    for first, second in itertools.pairwise(problem.phases):
        shared = _unlinked(problem, first, second)
        if shared:
            warnings.warn(
                f"phase '{second.name}' begins {_when(second)}, when '{first.name}' ends, and "
                f"both have the state '{shared}', but nothing links them; add links=joined(first, "
                f"second) with these phases, or give '{shared}' an initial value in "
                f"'{second.name}' if it starts from a new value",
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
            remedy = "give the signal itself" if stranger else "remove the guess, or use the signal"
            raise StatementError(
                f"phase '{phase.name}' has a guess for '{getattr(signal, 'name', signal)}', but "
                f"its dynamics, bounds and objective do not use this signal; {remedy}"
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


# A stated number, or an expression of constants, and its name among the sensitivities
Named = tuple[str, Any]

# Part of a limit's size that its value may be beyond it: from here on no mesh was solved to its end
_BEYOND = 3e-8

# Below this a number is what a computation leaves of zero, and tells no size
_ZERO = 1e-12


def limits_broken_at_ends(problem: Problem, parameters: Parameters) -> Iterator[str]:
    """What is wrong with each limit that prescribed values break, in words."""
    for phase in problem.phases:
        for what, time, values in (
            ("initial", phase.start, parameters.initial_values),
            ("final", phase.end, parameters.final_values),
        ):
            numbers = _prescribed(phase, time, values, parameters)
            for bound in phase.bounds:
                limits = parameters.bound_limits[phase.name, bound.name]
                found = _broken(bound, limits, numbers, _sizes(phase, parameters))
                if found is not None:
                    value, limit, beyond = (with_unit(f"{n:.6g}", bound.unit) for n in found)
                    yield (
                        f"the {what} values of phase '{phase.name}' make '{bound.name}' {value}, "
                        f"which is beyond its limit of {limit} by {beyond}"
                    )


def sides_closed_by_ends(problem: Problem, parameters: Parameters) -> dict[str, tuple[bool, bool]]:
    """Named numbers that cannot fall or cannot rise, as a prescribed value lies at its limit.

    Names are those of sensitivities. Limits of states count, and not those of expressions.

    Returns
    -------
    mapping of str to (bool, bool)
        Whether no motion is left below, and above, the number as it is.
    """
    closed: dict[str, tuple[bool, bool]] = {}
    for phase in problem.phases:
        sizes = _sizes(phase, parameters)
        for what, stated in (("initial", phase.initial), ("final", phase.final)):
            values = getattr(parameters, f"{what}_values")
            for state in stated:
                low, high = values[phase.name, state.name]
                least, largest = parameters.signal_limits[state.name]
                if low != high or isinstance(stated[state], tuple):
                    continue
                own = f"{phase.name}: {state.name} {what}", stated[state]
                lower, upper = (f"{state.name} {side}" for side in ("lower", "upper"))
                at = _BEYOND * sizes[state.name]
                if low - least <= at:
                    _close(closed, own, (lower, state.lower), parameters)
                if largest - high <= at:
                    _close(closed, (upper, state.upper), own, parameters)
    return closed


def _close(
    closed: dict[str, tuple[bool, bool]], larger: Named, smaller: Named, parameters: Parameters
) -> None:
    """Close the side of each number on which less than no room is between two stated numbers."""
    room = scalar(larger[1], "a limit") - scalar(smaller[1], "a limit")
    slopes = {larger[0]: 1.0, smaller[0]: -1.0, **limit_slopes(room, parameters)}
    for name, slope in slopes.items():
        below, above = closed.get(name, (False, False))
        closed[name] = below or slope > 0.0, above or slope < 0.0


def _prescribed(
    phase: Phase,
    time: object,
    values: Mapping[tuple[str, str], Interval],
    parameters: Parameters,
) -> dict[str, float]:
    """The numbers of states, constants and time that are fixed at an end, by name."""
    numbers = dict(parameters.values)
    if is_real(time):
        numbers[TIME.name] = float(time)  # type: ignore[arg-type]
    own = {name: limits for (where, name), limits in values.items() if where == phase.name}
    return numbers | {name: low for name, (low, high) in own.items() if low == high}


def _sizes(phase: Phase, parameters: Parameters) -> dict[str, float]:
    """How large each state is by what is stated of it."""
    sizes = {}
    for state in phase.states:
        stated = list(parameters.signal_limits[state.name])
        for values in (parameters.initial_values, parameters.final_values):
            stated += values.get((phase.name, state.name), ())
        known = [abs(number) for number in stated if math.isfinite(number)]
        largest = max(known, default=0.0)
        sizes[state.name] = largest if largest > _ZERO else 1.0
    return sizes


def _broken(
    bound: Bound, limits: Interval, numbers: Mapping[str, float], sizes: Mapping[str, float]
) -> tuple[float, float, float] | None:
    """Value, limit and excess where a limit is broken by numbers alone; None elsewhere."""
    if not bound.symbols or any(s.name not in numbers for s in bound.symbols):
        return None
    symbols = ca.vertcat(*[s.symbol for s in bound.symbols])
    slopes = ca.jacobian(bound.expression, symbols)
    function = ca.Function("at_end", [symbols], [bound.expression, ca.densify(slopes)])
    out = function([numbers[s.name] for s in bound.symbols])
    value, by = float(out[0]), np.abs(np.asarray(out[1]).ravel())
    lower, upper = limits
    beyond, limit = max((value - upper, upper), (lower - value, lower))
    if not (math.isfinite(beyond) and np.all(np.isfinite(by))):
        return None

    # how far the expression moves when its states move by their sizes
    moves = [by[i] * sizes.get(s.name, 0.0) for i, s in enumerate(bound.symbols)]
    size = bound.scale if bound.scale is not None else max(sum(moves), abs(value), abs(limit))
    return (value, limit, beyond) if beyond > _BEYOND * size else None
