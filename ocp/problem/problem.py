"""Problems: phases, the bounds and links between them, and what to minimise or maximise."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeVar

import casadi as ca

from ocp.errors import StatementError, StatementWarning
from ocp.keywords import checked_keywords
from ocp.numerics.polynomial_expressions import is_linear
from ocp.problem.bounds import Bound, checked_bounds
from ocp.problem.discontinuities import Discontinuity, discontinuities
from ocp.problem.functionals import (
    AnyFunctional,
    Functional,
    Integral,
    Peak,
    PointValue,
    functional_text,
    pieces_over,
)
from ocp.problem.instants import stepping_times
from ocp.problem.phase import Phase, time_range
from ocp.problem.statement_checks import check_problem
from ocp.problem.symbols import (
    Algebraic,
    Between,
    Constant,
    Control,
    Relation,
    Signal,
    Symbol,
    Time,
    Unknown,
    check_name,
    check_scale,
    resolve,
    scalar,
    symbols_of,
)

Kind = TypeVar("Kind", bound=Symbol)

# Calls between the line that states a problem and the warning of it
_STATED = 4

_ELSEWHERE = {
    **dict.fromkeys(("objective", "cost"), "write minimise=... or maximise=..."),
    **dict.fromkeys(("phase",), "write phases=..."),
    **dict.fromkeys(("constraints",), "write bounds=[...]"),
}


@checked_keywords(_ELSEWHERE)
@dataclass(frozen=True, eq=False, repr=False)
class Problem:
    """Phases, the bounds and links between them, and what to minimise or maximise.

    Parameters
    ----------
    name : str
    phases : Phase or sequence of Phase
    minimise, maximise : expression of functionals, unknowns and constants
        Exactly one of them.
    bounds, links : sequence of Bound
        Of functionals, unknowns and constants.
    scale : float or None
        Typical size of the objective. It is derived from its terms if None.

    Attributes
    ----------
    objective : SX
        The expression to minimise (the negative of what is maximised).
    objective_symbols : tuple of Symbol
        What it depends on.
    sense : float
        1 when minimising, -1 when maximising.
    boundary_constraints : tuple of Bound
        The bounds and the links: the constraints on numbers of the whole motion.
    boundary_symbols : tuple of Symbol
        Symbols of the objective, the bounds and the links.
    functionals, peaks : tuple of Functional, of Peak
        Those in use.
    integrals : mapping of phase name to tuple of Integral
        Those in use over each phase.
    summed : mapping of Integral to SX
        Those that enter the objective linearly and nothing else, with their weights there. A
        program sums them up in its objective. All others become running totals, which are unknowns.
    symbols, unknowns, constants : tuple of Symbol, of Unknown, of Constant
        All declared symbols in use, and those of two kinds.
    steps, instants : mapping of phase name to tuple of float
        Times at which expressions of a phase step or bend, stated or read off them, and these with
        the instants that `Phase.at` names, in order [s]. Every mesh has a breakpoint there, unless
        the phase has free times and does not last until then.
    controls, algebraics, signals : mapping of phase name to tuple of Signal
        Controls and algebraic signals of each phase, those of its functionals included, and all
        its signals: states, controls, algebraic signals.

    Raises
    ------
    StatementError
        When there is no or more than one objective, a name appears twice, or an expression uses
        what the problem does not have.
    """

    name: str
    phases: Sequence[Phase]
    minimise: Any = None
    maximise: Any = None
    bounds: Sequence[Bound] = ()
    links: Sequence[Bound] = ()
    scale: float | None = None

    objective: ca.SX = field(init=False, repr=False)
    objective_symbols: tuple[Symbol, ...] = field(init=False, repr=False)
    sense: float = field(init=False, repr=False)
    boundary_constraints: tuple[Bound, ...] = field(init=False, repr=False)
    boundary_symbols: tuple[Symbol, ...] = field(init=False, repr=False)
    functionals: tuple[AnyFunctional, ...] = field(init=False, repr=False)
    peaks: tuple[Peak, ...] = field(init=False, repr=False)
    integrals: Mapping[str, tuple[Integral, ...]] = field(init=False, repr=False)
    summed: Mapping[Integral, ca.SX] = field(init=False, repr=False)
    symbols: tuple[Symbol, ...] = field(init=False, repr=False)
    unknowns: tuple[Unknown, ...] = field(init=False, repr=False)
    constants: tuple[Constant, ...] = field(init=False, repr=False)
    steps: Mapping[str, tuple[float, ...]] = field(init=False, repr=False)
    instants: Mapping[str, tuple[float, ...]] = field(init=False, repr=False)
    controls: Mapping[str, tuple[Control, ...]] = field(init=False, repr=False)
    algebraics: Mapping[str, tuple[Algebraic, ...]] = field(init=False, repr=False)
    signals: Mapping[str, tuple[Signal, ...]] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        check_name("problem", self.name)
        check_scale("the objective", self.scale)
        where = f"problem '{self.name}'"
        phases = _checked_phases(self.phases, where)
        object.__setattr__(self, "phases", phases)
        object.__setattr__(self, "bounds", checked_bounds(self.bounds, where))
        object.__setattr__(self, "links", checked_bounds(self.links, f"the links of {where}"))
        if (self.minimise is None) == (self.maximise is None):
            raise StatementError(f"{where} needs exactly one of minimise and maximise")

        # what follows from the statement is worked out once
        for name, value in self._derived().items():
            object.__setattr__(self, name, value)
        check_problem(self)
        self._warn_of_jumps()

    @cached_property
    def discontinuities(self) -> tuple[Discontinuity, ...]:
        """Jumps of the statement's expressions, see `ocp.problem.discontinuities`."""
        found = list(discontinuities("", list(self.of_numbers())))
        for phase in self.phases:
            free, along = not phase.has_fixed_times, list(self.along(phase))
            found += discontinuities(phase.name, along, time_range(phase), free_times=free)
        return tuple(found)

    @property
    def is_discontinuous(self) -> bool:
        """Whether an expression jumps at a place that depends on the motion."""
        return any(found.moves for found in self.discontinuities)

    def of_numbers(self) -> Iterator[tuple[str, ca.SX]]:
        """Expressions of numbers of the whole motion, with what they are."""
        yield "the objective", self.objective
        for bound in self.boundary_constraints:
            yield f"the bound '{bound.name}'", bound.expression

    def along(self, phase: Phase) -> Iterator[tuple[str, ca.SX]]:
        """Expressions along a phase, with what they are."""
        for state, rate in phase.dynamics.items():
            yield f"the rate of '{state.name}'", rate
        for bound in phase.bounds:
            yield f"the bound '{bound.name}'", bound.expression
        for functional, piece in pieces_over(self.functionals, phase.name):
            yield f"the {functional_text(functional)}", piece

    def _warn_of_jumps(self) -> None:
        """A warning for each expression that jumps at a place that depends on the motion."""
        moving = [found for found in self.discontinuities if found.moves]
        for found in {(each.phase, each.what): each for each in reversed(moving)}.values():
            sentence = f"'{self.name}': {found.sentence}"
            warnings.warn(sentence, StatementWarning, stacklevel=_STATED)

    def _derived(self) -> dict[str, Any]:
        """The derived fields, by name."""
        sense = 1.0 if self.minimise is not None else -1.0
        stated = self.minimise if self.minimise is not None else self.maximise
        if isinstance(stated, Relation):
            raise StatementError(
                f"the objective of problem '{self.name}' is the relation '{stated}'; minimise one "
                "number, and give relations as bounds=[...]"
            )
        objective = sense * scalar(stated, "the objective")
        constraints = (*self.bounds, *self.links)
        objective_symbols = resolve(objective, "the objective")
        limits = [e for b in constraints for e in (b.expression, b.lower, b.upper)]
        boundary_symbols = symbols_of([objective, *limits], f"problem '{self.name}'")
        functionals = tuple(s for s in boundary_symbols if isinstance(s, AnyFunctional))
        symbols = _all_symbols(self.phases, functionals, boundary_symbols)

        by_phase = _symbols_by_phase(self.phases, functionals)
        controls = {name: _of_kind(Control, found) for name, found in by_phase.items()}
        algebraics = {name: _of_kind(Algebraic, found) for name, found in by_phase.items()}
        signals = {
            phase.name: (*phase.states, *controls[phase.name], *algebraics[phase.name])
            for phase in self.phases
        }
        integrals = _of_kind(Integral, functionals)
        steps = {phase.name: _steps(phase, functionals) for phase in self.phases}
        return {
            "sense": sense,
            "objective": objective,
            "objective_symbols": objective_symbols,
            "boundary_constraints": constraints,
            "boundary_symbols": boundary_symbols,
            "functionals": functionals,
            "peaks": _of_kind(Peak, functionals),
            "integrals": {
                phase.name: tuple(f for f in integrals if f.phase == phase.name)
                for phase in self.phases
            },
            "summed": _summed(objective, integrals, constraints),
            "symbols": symbols,
            "steps": steps,
            "instants": {
                phase.name: _instants(phase, steps[phase.name], functionals)
                for phase in self.phases
            },
            "unknowns": _of_kind(Unknown, symbols),
            "constants": _of_kind(Constant, symbols),
            "controls": controls,
            "algebraics": algebraics,
            "signals": signals,
        }

    def __repr__(self) -> str:
        from ocp.problem.display import problem_summary

        return problem_summary(self)

    def __str__(self) -> str:
        from ocp.problem.display import problem_text

        return problem_text(self)

    def phase(self, name: str) -> Phase:
        """The phase of that name."""
        return next(phase for phase in self.phases if phase.name == name)


@contextmanager
def without_repeated_warnings() -> Iterator[None]:
    """Problems that are made of another one here do not warn of its jumps again."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", StatementWarning)
        yield


def _checked_phases(phases: Any, where: str) -> tuple[Phase, ...]:
    """One phase or several as a tuple; StatementError if it is something else."""
    entries = tuple(phases) if isinstance(phases, (list, tuple)) else (phases,)
    for entry in entries:
        if not isinstance(entry, Phase):
            raise StatementError(
                f"a phase of {where} is {entry!r}; give a Phase(...), or a list of them"
            )
    return entries


def _of_kind(kind: type[Kind], symbols: Iterable[Symbol]) -> tuple[Kind, ...]:
    return tuple(symbol for symbol in symbols if isinstance(symbol, kind))


def _summed(
    objective: ca.SX, integrals: Iterable[Integral], constraints: Iterable[Bound]
) -> dict[Integral, ca.SX]:
    """Weights of the integrals that enter the objective linearly and nothing else."""
    elsewhere = {symbol for bound in constraints for symbol in bound.symbols}
    weights = {}
    for integral in integrals:
        # an objective that steps with an integral has a slope by it that is a constant, too
        if integral not in elsewhere and is_linear(objective, integral.symbol):
            weight = ca.jacobian(objective, integral.symbol)
            symbols = resolve(weight, "a weight")
            if all(isinstance(symbol, Constant) for symbol in symbols):
                weights[integral] = ca.densify(weight)
    return weights


def _steps(phase: Phase, functionals: Iterable[Functional]) -> tuple[float, ...]:
    """Times inside a phase at which its expressions step or bend; none where its times are free."""
    if isinstance(phase.start, Between) or isinstance(phase.end, Between):
        return ()
    start, end = float(phase.start), float(phase.end)
    bounds = [bound.expression for bound in phase.bounds]
    pieces = [piece for _, piece in pieces_over(functionals, phase.name)]
    read = stepping_times([*phase.dynamics.values(), *bounds, *pieces], start, end)
    times = {*phase.breakpoints, *read}
    return tuple(sorted(time for time in times if start < time < end))


def _instants(
    phase: Phase, steps: Iterable[float], functionals: Iterable[Functional]
) -> tuple[float, ...]:
    """Steps of a phase, and the instants that `Phase.at` names, in order."""
    named = {f.instant for f in functionals if isinstance(f, PointValue) and f.phase == phase.name}
    return tuple(sorted({*steps, *named}))


def _all_symbols(
    phases: Iterable[Phase],
    functionals: Iterable[Functional],
    boundary_symbols: Iterable[Symbol],
) -> tuple[Symbol, ...]:
    """All declared symbols in use."""
    values = [v for p in phases for ends in (p.initial, p.final) for v in ends.values()]
    at_ends = [limit for v in values for limit in (v if isinstance(v, tuple) else (v,))]
    symbols = dict.fromkeys(symbol for phase in phases for symbol in phase.symbols)
    symbols |= dict.fromkeys(symbols_of(at_ends, "a boundary value"))
    symbols |= dict.fromkeys(symbol for f in functionals for symbol in f.symbols)
    symbols |= dict.fromkeys(boundary_symbols)

    # the limits of what was found so far may bring in further constants
    limited = [symbol for symbol in symbols if isinstance(symbol, (Signal, Unknown))]
    for symbol in limited:
        where = f"a bound of '{symbol.name}'"
        symbols |= dict.fromkeys(symbols_of((symbol.lower, symbol.upper), where))
    return tuple(symbols)


def _symbols_by_phase(
    phases: Iterable[Phase], functionals: Iterable[Functional]
) -> dict[str, tuple[Symbol, ...]]:
    """Symbols of each phase, those of its functionals in use included."""
    symbols = {phase.name: dict.fromkeys(phase.symbols) for phase in phases}
    for functional in functionals:
        for name, expression in functional.pieces:
            # a functional of a phase that the problem lacks is refused by `check_problem`
            if name in symbols:
                symbols[name].update(dict.fromkeys(resolve(expression, functional.name)))
    return {name: tuple(found) for name, found in symbols.items()}


def check_is_problem(thing: Any) -> None:
    """StatementError, with what to write, unless the thing is a problem."""
    if isinstance(thing, Phase):
        raise StatementError(
            f"'{thing.name}' is a phase, which has no objective; write Problem('{thing.name}', "
            "phase, minimise=...)"
        )
    if not isinstance(thing, Problem):
        raise StatementError(
            f"the argument 'problem' is of type {type(thing).__name__}; give a Problem(name, "
            "phases, minimise=...)"
        )


def with_objective(problem: Problem, minimise: Any, extra_bounds: Sequence[Bound] = ()) -> Problem:
    """The same phases and links with another objective and further bounds.

    Parameters
    ----------
    problem : Problem
    minimise : expression of functionals, unknowns and constants
        The objective in place of the problem's own.
    extra_bounds : sequence of Bound
        Beside those of the problem.
    """
    check_is_problem(problem)
    objective = scalar(minimise, "the objective")
    further = checked_bounds(extra_bounds, f"problem '{problem.name}'")
    bounds = (*problem.bounds, *further)
    return Problem(
        problem.name, problem.phases, minimise=objective, bounds=bounds, links=problem.links
    )


def named(problem: Problem, name: Any, phase: str | None = None) -> Any:
    """What a name stands for; anything but a string is handed back as it is.

    Parameters
    ----------
    name : of a signal, unknown, constant, functional, or bound, or "objective" (as it was stated).
    phase : whose bounds are meant; those of all phases if None.

    Raises
    ------
    StatementError
        When nothing or more than one thing has the name.
    """
    if not isinstance(name, str):
        return name
    found = [value for key, value in _all_named(problem, phase) if key == name]
    if not found and name == "objective":
        return problem.minimise if problem.minimise is not None else problem.maximise
    if len(found) != 1:
        known = ", ".join(sorted({f"'{key}'" for key, _ in _all_named(problem, phase)}))
        how_many = (
            f"{len(found)} signals, bounds or values of '{problem.name}' are"
            if found
            else f"no signal, bound or value of '{problem.name}' is"
        )
        raise StatementError(f"{how_many} named '{name}'; the names are {known}")
    return found[0]


def _all_named(problem: Problem, phase: str | None) -> Iterator[tuple[str, Any]]:
    for symbol in problem.symbols:
        if not isinstance(symbol, Time):
            yield symbol.name, symbol
    for bound in problem.boundary_constraints:
        yield bound.name, bound.expression
    for own in problem.phases:
        if phase in (None, own.name):
            for bound in own.bounds:
                yield bound.name, bound.expression
