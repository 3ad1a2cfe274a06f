"""Checks of a statement, each with a sentence that names the thing, the value and the remedy.

`check_phase` and `check_problem` run when a statement is made. `check_values` runs before a solve,
when the values of the constants are known.
"""

from __future__ import annotations

import itertools
import math
import warnings
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import casadi as ca

from ocp.errors import StatementError, StatementWarning
from ocp.numerics.expression_graph import graph_of
from ocp.problem.functionals import BoundaryValue, Functional, PhaseTime, PointValue
from ocp.problem.symbols import (
    Between,
    Constant,
    Signal,
    State,
    Symbol,
    Time,
    Unknown,
    check_interval,
    is_limited,
    is_number,
    is_real,
    resolve,
)

if TYPE_CHECKING:
    from ocp.problem.parameters import Parameters
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
                f"phase '{phase.name}' uses '{symbol.name}', a number of the whole motion, in "
                "its own expressions; bring it in as an Unknown linked by a Bound"
            )


def _check_times(phase: Phase) -> None:
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


def _check_boundary(phase: Phase, what: str, values: Mapping[State, Any]) -> None:
    """Boundary values are of states of the phase, inside their bounds, and known beforehand."""
    for state, value in values.items():
        if state not in phase.dynamics:
            raise StatementError(
                f"phase '{phase.name}' has {'an' if what == 'initial' else 'a'} {what} value for "
                f"'{getattr(state, 'name', state)}' but no dynamics for it; "
                f"{_remedy_for(state, what)}"
            )
        pair = value if isinstance(value, tuple) else (value, value)
        if len(pair) != 2 or isinstance(value, list):
            raise StatementError(
                f"the {what} value of '{state.name}' is {value!r}; give a number or a pair "
                "(lower, upper)"
            )
        check_interval(f"{what} {state.name}", *pair)

        # expressions of constants are checked when their values are known, by `check_values`
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


def _remedy_for(thing: Any, what: str) -> str:
    """What to write instead of a boundary value of something that is no state of the phase."""
    if isinstance(thing, State):
        return "add its derivative"
    if isinstance(thing, Signal):
        end = "start" if what == "initial" else "end"
        return f"bound it in the problem: bounds=[phase.at_{end}({thing.name}) == ...]"
    return "give the State itself, not its name"


def _check_limit(value: Any, what: str) -> None:
    """StatementError if a limit depends on anything but constants."""
    for symbol in resolve(value, what):
        if not isinstance(symbol, Constant):
            raise StatementError(
                f"{what} depends on '{symbol.name}'; limits are numbers or expressions of "
                "Constants: bring the rest into the expression that is bounded"
            )


def check_meeting(first: Phase, second: Phase) -> None:
    """StatementError unless the second of two phases can begin where the first ends."""
    end, start = first.end, second.start
    earliest, latest = (end.lower, end.upper) if isinstance(end, Between) else (end, end)
    begins = (start.lower, start.upper) if isinstance(start, Between) else (start, start)
    if latest < begins[0] or earliest > begins[1]:
        raise StatementError(
            f"phase '{second.name}' cannot begin where phase '{first.name}' ends: the one starts "
            f"at {start} s, the other ends at {end} s; give both the same time"
        )


def check_jump(second: Phase, jump: Mapping[State, Any]) -> None:
    """StatementError unless all that jumps are states of the phase that begins."""
    for state in jump:
        if not isinstance(state, State) or state not in second.dynamics:
            remedy = (
                "give the State itself, not its name"
                if not isinstance(state, Symbol)
                else f"give one of {', '.join(s.name for s in second.states)}"
            )
            raise StatementError(
                f"the jump into phase '{second.name}' is of '{getattr(state, 'name', state)}', "
                f"which is no state of it; {remedy}"
            )


def _check_coupled(problem: Problem) -> None:
    """StatementError for a limit by an unknown of a signal that no expression of a phase has."""
    for phase in problem.phases:
        known = set(phase.symbols)
        for signal in problem.signals[phase.name]:
            if isinstance(signal, Signal) and signal.coupled and signal not in known:
                raise StatementError(
                    f"the limit of '{signal.name}' depends on an unknown, but phase "
                    f"'{phase.name}' has '{signal.name}' in an integral, a peak or an end value "
                    "only; state the limit in the phase's bounds"
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
                    f"of the name '{name}', with other states or dynamics than the phase '{name}' "
                    "of the problem; make it from the phase that you give to the problem"
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
                    f"{what} asks for a large peak '{peak.name}'; a peak can be limited from above "
                    "and minimised only"
                )


def check_values(problem: Problem, parameters: Parameters) -> None:
    """Check all limits at the values of the constants, and that every state has a use.

    Raises
    ------
    StatementError
        When two limits cross, a boundary value lies outside its state's bounds, or a guess is of
        a signal that its phase does not have.

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
                f"'{shared}' an initial value in '{second.name}' if it begins anew",
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
                f"nothing depends on the state '{state.name}' of phase '{phase.name}': it is "
                "carried along without effect; bound it, use it or take it out",
                StatementWarning,
                stacklevel=3,
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
    initial value, or a range of them, is known to begin anew.
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
