"""The statement of an optimal control problem: phases, bounds, links, objective.

Nothing here is numerical: a ``Problem`` holds expressions of declared symbols, and
`ocp.transcription.transcribe` turns it into a nonlinear program.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from ocp.errors import StatementError
from ocp.problem.checks import check_boundary, check_problem, check_symbols, check_times
from ocp.problem.symbols import (
    Between,
    Constant,
    Signal,
    State,
    Symbol,
    Unknown,
    check_scale,
    resolve,
    scalar,
)
from ocp.problem.terms import Bound, Functional, FunctionalKind

Guess = Any  # number, (first, last), callable of time, or (times, values)


@dataclass(frozen=True, eq=False)
class Phase:
    """A stretch of time with one set of dynamics.

    Parameters
    ----------
    name : str
    dynamics : mapping of State to expression
        Time derivative of each state.
    initial, final : mapping of State to number, expression of constants or (lower, upper)
        Boundary values; a state left out is free.
    start, end : number or Between
        Initial and final time [s].
    bounds : sequence of Bound
        Path constraints; those whose limits agree are algebraic equations, imposed at the
        collocation points, and the mesh is refined until they hold between these too.
    guess : mapping of Signal to guess
        A number, a pair (first, last), a callable of time (vectorised), or (times, values).

    Raises
    ------
    StatementError
        When something is missing, misspelt or contradicts itself.
    """

    name: str
    dynamics: Mapping[State, Any]
    initial: Mapping[State, Any] = field(default_factory=dict)
    final: Mapping[State, Any] = field(default_factory=dict)
    start: float | Between = 0.0
    end: float | Between = 1.0
    bounds: Sequence[Bound] = ()
    guess: Mapping[Signal, Guess] = field(default_factory=dict)
    _functionals: list[Functional] = field(init=False, repr=False, default_factory=list)

    def __post_init__(self) -> None:
        derivatives = {}
        for state, rate in self.dynamics.items():
            if not isinstance(state, State):
                raise StatementError(
                    f"the dynamics of phase '{self.name}' name {state!r}, which is no State"
                )
            derivatives[state] = scalar(rate, f"the derivative of '{state.name}'")
        object.__setattr__(self, "dynamics", derivatives)
        check_times(self)
        check_boundary(self, "initial", self.initial)
        check_boundary(self, "final", self.final)
        check_symbols(self)

    @cached_property
    def symbols(self) -> tuple[Symbol, ...]:
        """All declared symbols the phase's expressions depend on, in order of appearance."""
        found: dict[Symbol, None] = {}
        for state, rate in self.dynamics.items():
            found[state] = None
            for symbol in resolve(rate, f"the derivative of '{state.name}' in '{self.name}'"):
                found[symbol] = None
        for bound in self.bounds:
            for expression in (bound.expression, bound.lower, bound.upper):
                for symbol in resolve(expression, f"the bound '{bound.name}' in '{self.name}'"):
                    found[symbol] = None
        return tuple(found)

    @property
    def states(self) -> tuple[State, ...]:
        """The states, in the order of the dynamics."""
        return tuple(self.dynamics)

    def integral(
        self, expression: Any, name: str = "integral", unit: str = "1", scale: float | None = None
    ) -> Functional:
        """Integral of an expression over the phase."""
        return self._functional("integral", name, unit, expression, scale=scale)

    def at_start(self, expression: Any) -> Functional:
        """Value of an expression at the start of the phase."""
        return self._functional("start", f"start of {self.name}", "1", expression)

    def at_end(self, expression: Any) -> Functional:
        """Value of an expression at the end of the phase."""
        return self._functional("end", f"end of {self.name}", "1", expression)

    def at(self, instant: float, expression: Any) -> Functional:
        """Value of an expression at a given time [s] inside a phase of fixed times."""
        if isinstance(self.start, Between) or isinstance(self.end, Between):
            raise StatementError(
                f"a value at {instant} s needs fixed times, but phase '{self.name}' has a free "
                "one; split the phase there"
            )
        if not self.start <= instant <= self.end:
            raise StatementError(
                f"{instant} s lies outside phase '{self.name}' ({self.start} to {self.end} s)"
            )
        return self._functional("value", f"value at {instant} s", "1", expression, at=instant)

    def misfit(self, expression: Any, times: Any, values: Any, weights: Any = 1.0) -> ca.SX:
        """Weighted sum of squared differences between an expression and data.

        Parameters
        ----------
        times, values : (m,) data, times inside a phase of fixed times [s].
        weights : number or (m,)

        Raises
        ------
        StatementError
            When there are not as many values as times, or a time lies outside.
        """
        t, data = np.atleast_1d(times).astype(float), np.atleast_1d(values).astype(float)
        if t.shape != data.shape or t.ndim != 1 or np.shape(weights) not in ((), t.shape):
            raise StatementError(
                f"data of phase '{self.name}' have {t.size} times, {data.size} values and "
                f"{np.size(weights)} weights; give as many values as times, and one weight or as "
                "many"
            )
        w = np.broadcast_to(np.asarray(weights, dtype=float), t.shape)
        terms = [float(w[i]) * (self.at(float(t[i]), expression) - float(data[i])) ** 2
                 for i in range(t.size)]  # fmt: skip
        return ca.SX(sum(terms))

    @cached_property
    def start_time(self) -> Functional:
        """The initial time [s]."""
        return self._functional("start time", f"start of {self.name}", "s", 0)

    @cached_property
    def end_time(self) -> Functional:
        """The final time [s]."""
        return self._functional("end time", f"end of {self.name}", "s", 0)

    @property
    def duration(self) -> ca.SX:
        """Final minus initial time [s]."""
        return self.end_time - self.start_time

    def peak(self, expression: Any, **options: Any) -> Functional:
        """Largest value of an expression over this phase, see `peak`."""
        return peak((self, expression), **options)

    def _functional(
        self, kind: FunctionalKind, name: str, unit: str, expression: Any,
        at: float | None = None, scale: float | None = None,
    ) -> Functional:  # fmt: skip
        sx = scalar(expression, f"the {name}")
        made = Functional(
            name, unit, kind, ((self.name, sx),), at, symbols=resolve(sx, f"the {name}"),
            scale=scale,
        )  # fmt: skip
        self._functionals.append(made)
        return made


def peak(
    *pieces: tuple[Phase, Any], name: str = "peak", unit: str = "1", absolute: bool = False,
    scale: float | None = None,
) -> Functional:  # fmt: skip
    """Largest value of expressions over all times of their phases.

    Parameters
    ----------
    *pieces : (Phase, expression)
        The peak is the largest over all of them.
    absolute : bool
        Take the largest absolute value.
    scale : float or None
        Typical size; derived from the guess if None.
    """
    if not pieces:
        raise StatementError(f"the peak '{name}' has no (phase, expression) piece; give one")
    sx = tuple((phase.name, scalar(e, f"the peak '{name}'")) for phase, e in pieces)
    symbols = tuple(dict.fromkeys(s for _, e in sx for s in resolve(e, f"the peak '{name}'")))
    made = Functional(name, unit, "peak", sx, absolute=absolute, symbols=symbols, scale=scale)
    for phase, _ in pieces:
        phase._functionals.append(made)
    return made


def joined(
    first: Phase, second: Phase, jump: Mapping[State, Any] | None = None
) -> tuple[Bound, ...]:
    """Links that make time and shared states continuous from one phase to the next.

    Parameters
    ----------
    jump : mapping of State to expression of the first phase's signals, optional
        The value right after the instant, where it differs from the value right before.
    """
    after = dict(jump or {})
    links = [
        Bound(
            f"time from {first.name} to {second.name}",
            second.start_time - first.end_time, "s", 0, 0,
        )
    ]  # fmt: skip
    for state in second.states:
        if state in first.dynamics or state in after:
            before = after.get(state, state)
            links.append(
                Bound(
                    f"{state.name} from {first.name} to {second.name}",
                    second.at_start(state) - first.at_end(before), state.unit, 0, 0,
                )
            )  # fmt: skip
    return tuple(links)


@dataclass(frozen=True, eq=False)
class Problem:
    """Phases, the bounds and links between them, and what to minimise or maximise.

    ``scale`` is the typical size of the objective; derived from its terms if None.

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

    def __post_init__(self) -> None:
        check_scale("the objective", self.scale)
        if isinstance(self.phases, Phase):
            object.__setattr__(self, "phases", (self.phases,))
        object.__setattr__(self, "phases", tuple(self.phases))
        object.__setattr__(self, "bounds", tuple(self.bounds))
        object.__setattr__(self, "links", tuple(self.links))
        if (self.minimise is None) == (self.maximise is None):
            raise StatementError(
                f"problem '{self.name}' needs exactly one of minimise and maximise"
            )
        check_problem(self)

    @property
    def objective(self) -> ca.SX:
        """The expression to minimise (the negative of what is maximised)."""
        if self.minimise is not None:
            return scalar(self.minimise, "the objective")
        return -scalar(self.maximise, "the objective")

    @property
    def sense(self) -> float:
        """1 when minimising, -1 when maximising."""
        return 1.0 if self.minimise is not None else -1.0

    @cached_property
    def terminal_symbols(self) -> tuple[Symbol, ...]:
        """Symbols of the objective, the bounds and the links."""
        found = dict.fromkeys(resolve(self.objective, "the objective"))
        for bound in (*self.bounds, *self.links):
            for expression in (bound.expression, bound.lower, bound.upper):
                found.update(dict.fromkeys(resolve(expression, f"the bound '{bound.name}'")))
        return tuple(found)

    @cached_property
    def functionals(self) -> tuple[Functional, ...]:
        """The functionals in use."""
        return tuple(s for s in self.terminal_symbols if isinstance(s, Functional))

    @cached_property
    def symbols(self) -> tuple[Symbol, ...]:
        """All declared symbols in use."""
        found: dict[Symbol, None] = {}
        for phase in self.phases:
            found.update(dict.fromkeys(phase.symbols))
            for values in (phase.initial, phase.final):
                for value in values.values():
                    for item in value if isinstance(value, tuple) else (value,):
                        found.update(dict.fromkeys(resolve(item, "a boundary value")))
        for functional in self.functionals:
            found.update(dict.fromkeys(functional.symbols))
        found.update(dict.fromkeys(self.terminal_symbols))
        for signal in list(found):
            if isinstance(signal, (Signal, Unknown)):
                for limit in (signal.lower, signal.upper):
                    found.update(dict.fromkeys(resolve(limit, f"a bound of '{signal.name}'")))
        return tuple(found)

    @cached_property
    def unknowns(self) -> tuple[Unknown, ...]:
        """The static decision parameters."""
        return tuple(s for s in self.symbols if isinstance(s, Unknown))

    @cached_property
    def constants(self) -> tuple[Constant, ...]:
        """The named constants."""
        return tuple(s for s in self.symbols if isinstance(s, Constant))

    def phase(self, name: str) -> Phase:
        """The phase of that name."""
        return next(phase for phase in self.phases if phase.name == name)

    def signals_of(self, phase: Phase, kind: type[Signal]) -> tuple[Any, ...]:
        """Controls or algebraic signals of a phase, those of its functionals in use included."""
        return tuple(s for s in self._symbols_by_phase[phase.name] if isinstance(s, kind))

    @cached_property
    def _symbols_by_phase(self) -> dict[str, tuple[Symbol, ...]]:
        found = {phase.name: dict.fromkeys(phase.symbols) for phase in self.phases}
        for functional in self.functionals:
            for name, expression in functional.pieces:
                found[name].update(dict.fromkeys(resolve(expression, functional.name)))
        return {name: tuple(symbols) for name, symbols in found.items()}


def with_objective(problem: Problem, minimise: Any, extra_bounds: Sequence[Bound] = ()) -> Problem:
    """The same phases and links with another objective and further bounds."""
    return Problem(
        problem.name, problem.phases, minimise=minimise,
        bounds=(*problem.bounds, *extra_bounds), links=problem.links,
    )  # fmt: skip
