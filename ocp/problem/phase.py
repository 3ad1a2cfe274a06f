"""Phases: stretches of time with one set of dynamics, and the links between them.

Nothing here is numerical: a ``Phase`` holds expressions of declared symbols.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeVar

import casadi as ca
import numpy as np

from ocp.errors import StatementError
from ocp.keywords import checked_keywords, checked_methods
from ocp.problem.bounds import Bound, checked_bounds
from ocp.problem.functionals import (
    BoundaryValue,
    Functional,
    Integral,
    Peak,
    PhaseTime,
    PointValue,
)
from ocp.problem.instants import checked_breakpoints
from ocp.problem.statement_checks import check_jump, check_mapping, check_meeting, check_phase
from ocp.problem.symbols import (
    Between,
    Signal,
    State,
    Symbol,
    check_name,
    is_real,
    resolve,
    scalar,
    symbols_of,
)
from ocp.problem.vectors import by_component

# of expressions that are held against each other: that of a limit
_DEPTH = 20

Kind = TypeVar("Kind", bound=Functional)
_END = "write end={value}, or end=Between(lower, upper) for a free time"
_ELSEWHERE = {
    **dict.fromkeys(("duration", "tf", "t_end", "time", "final_time", "end_time"), _END),
    **dict.fromkeys(("t0", "start_time", "initial_time"), "write start={value}"),
    **dict.fromkeys(("ode", "rhs", "derivatives"), "write dynamics={{state: expression}}"),
    **dict.fromkeys(
        ("constraints", "path", "path_constraints"),
        "write bounds=[...], with relations such as x <= 2 or with Bound(...)",
    ),
    **dict.fromkeys(("states", "controls"), "they follow from dynamics={{state: expression}}"),
    **dict.fromkeys(
        ("minimise", "maximise", "minimize", "maximize", "objective"),
        "write it in the problem: Problem(name, phase, minimise=...)",
    ),
}

Guess = Any  # number, (first, last), callable of time, (times, values), or `ByFraction` of these


@checked_methods("integral", "misfit")
@checked_keywords(_ELSEWHERE)
@dataclass(frozen=True, eq=False, repr=False)
class Phase:
    """A stretch of time with one set of dynamics.

    Parameters
    ----------
    name : str
    dynamics : mapping of State to expression
        Time derivative of each state [unit of the state / s].
    initial, final : mapping of State to number, expression of constants or (lower, upper)
        Boundary values. A state left out is free.
    start, end : number or Between
        Initial and final time [s]. The start is 0 unless stated, the end must be stated.
    bounds : sequence of Bound or of relations such as ``x <= 2``
        Path constraints. Those whose limits agree are algebraic equations, imposed at the
        collocation points, and the mesh is refined until they hold between these too.
    guess : mapping of Signal to guess
        A number, a pair (first, last), a callable of time (vectorised), (times, values), or
        `ByFraction` of the last two, where the times are fractions of the phase. A signal without
        one is a straight line between its boundary values. A state without boundary values has the
        value that a link carries over from the phase before. Where no signal of a problem has a
        guess, and a rate is not linear, the first mesh is solved from simulated motions as well,
        and the best answer counts.
    breakpoints : sequence of number
        Times at which the mesh has a breakpoint [s], because something steps there. Where an
        expression compares time, or a function of time alone, with a number, as
        ``if_else(TIME < 3, ...)`` does, such a time is one without being stated. Where a time of
        the phase is free, it counts if it lies inside.

    Attributes
    ----------
    states : tuple of State
        In the order of the dynamics.
    rate_symbols : mapping of State to tuple of Symbol
        What the derivative of each state depends on.
    symbols : tuple of Symbol
        All declared symbols that the expressions depend on, in order of appearance.
    has_fixed_times : bool
        Whether both times are given numbers.

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
    end: float | Between = field(kw_only=True)
    bounds: Sequence[Bound] = ()
    guess: Mapping[Signal, Guess] = field(default_factory=dict)
    breakpoints: Sequence[float] = field(default=(), kw_only=True)

    states: tuple[State, ...] = field(init=False, repr=False)
    rate_symbols: Mapping[State, tuple[Symbol, ...]] = field(init=False, repr=False)
    symbols: tuple[Symbol, ...] = field(init=False, repr=False)
    has_fixed_times: bool = field(init=False, repr=False)

    # see `kept_alive`
    _functionals: list[Functional] = field(init=False, repr=False, default_factory=list)

    def __post_init__(self) -> None:
        check_name("phase", self.name)
        for what in ("dynamics", "initial", "final", "guess"):
            check_mapping(self.name, what, getattr(self, what))
            object.__setattr__(self, what, by_component(what, getattr(self, what)))

        if not self.dynamics:
            raise StatementError(
                f"phase '{self.name}' has no state; write dynamics={{state: its rate}}"
            )
        derivatives = {}
        for state, rate in self.dynamics.items():
            if not isinstance(state, State):
                raise StatementError(
                    f"the dynamics of phase '{self.name}' contain {state!r}, which is not a State; "
                    "declare it as State(name, unit), and give its derivative"
                )
            derivatives[state] = scalar(rate, f"the derivative of '{state.name}'")
        object.__setattr__(self, "dynamics", derivatives)
        object.__setattr__(self, "bounds", checked_bounds(self.bounds, f"phase '{self.name}'"))
        stated = checked_breakpoints(self.breakpoints, self.name, *time_range(self))
        object.__setattr__(self, "breakpoints", stated)

        # what follows from the statement is worked out once
        free = any(isinstance(time, Between) for time in (self.start, self.end))
        object.__setattr__(self, "has_fixed_times", not free)
        object.__setattr__(self, "states", tuple(self.dynamics))
        rate_symbols = {
            state: resolve(rate, f"the derivative of '{state.name}' in '{self.name}'")
            for state, rate in derivatives.items()
        }
        object.__setattr__(self, "rate_symbols", rate_symbols)
        object.__setattr__(self, "bounds", (*self.bounds, *self._coupled_limits()))
        object.__setattr__(self, "symbols", self._symbols())
        check_phase(self)

    def __repr__(self) -> str:
        from ocp.problem.display import phase_summary

        return phase_summary(self)

    def _coupled_limits(self) -> list[Bound]:
        """Limits of signals that depend on unknowns, as bounds; none twice."""
        stated = {bound.name: bound for bound in self.bounds}
        limits = []
        for symbol in self._symbols():
            for side, limit in symbol.coupled if isinstance(symbol, Signal) else ():
                name, excess = f"{symbol.name} {side}", symbol.symbol - limit
                if name not in stated:
                    lower, upper = (0.0, math.inf) if side == "lower" else (-math.inf, 0.0)
                    limits.append(Bound(name, excess, symbol.unit, lower, upper))
                # a copy of the phase has it already
                elif not ca.is_equal(stated[name].expression, excess, _DEPTH):
                    raise StatementError(
                        f"the {side} limit of '{symbol.name}' depends on an unknown and becomes "
                        f"the bound '{name}' of phase '{self.name}', but another bound has this "
                        "name; rename that bound"
                    )
        return limits

    def _symbols(self) -> tuple[Symbol, ...]:
        """All declared symbols the phase's expressions depend on, in order of appearance."""
        rates = [e for state, rate in self.dynamics.items() for e in (state.symbol, rate)]
        limited = [e for bound in self.bounds for e in (bound.expression, bound.lower, bound.upper)]
        return symbols_of([*rates, *limited], f"an expression of phase '{self.name}'")

    def integral(
        self, expression: Any, name: str = "integral", unit: str = "1", scale: float | None = None
    ) -> Integral:
        """Integral of an expression over the phase.

        Parameters
        ----------
        expression : SX
            Of signals, unknowns and constants [unit / s].
        name, unit : str
            For messages and tables.
        scale : float or None
            Typical size [unit]. It is derived from the guess if None.
        """
        return self._made(Integral, name, unit, expression, scale=scale)

    def at_start(self, expression: Any) -> BoundaryValue:
        """Value of an expression at the start of the phase."""
        return self._made(BoundaryValue, f"start of {self.name}", "1", expression, end="start")

    def at_end(self, expression: Any) -> BoundaryValue:
        """Value of an expression at the end of the phase."""
        return self._made(BoundaryValue, f"end of {self.name}", "1", expression, end="end")

    def at(self, instant: float, expression: Any) -> PointValue:
        """Value of an expression at a given time [s] inside a phase of fixed times.

        Raises
        ------
        StatementError
            When a time of the phase is free, or the instant lies outside.
        """
        if not is_real(instant):
            raise StatementError(
                f"an instant of phase '{self.name}' is {instant!r}; write phase.at(instant, "
                "expression) with a number of seconds"
            )
        if isinstance(self.start, Between) or isinstance(self.end, Between):
            raise StatementError(
                f"a value at {instant} s needs fixed times, but phase '{self.name}' has a free "
                "time; split the phase there"
            )
        if not self.start <= instant <= self.end:
            raise StatementError(
                f"{instant} s lies outside phase '{self.name}' ({self.start} to {self.end} s)"
            )
        return self._made(PointValue, f"value at {instant} s", "1", expression, instant=instant)

    def misfit(self, expression: Any, times: Any, values: Any, weights: Any = 1.0) -> ca.SX:
        """Weighted sum of squared differences between an expression and data.

        Parameters
        ----------
        expression : SX
            Of signals, unknowns and constants, what was measured.
        times, values : (m,)
            Data, times inside a phase of fixed times [s]. Values are in the unit of the
            expression.
        weights : number or (m,)
            Of each squared difference.

        Raises
        ------
        StatementError
            When there are not as many values as times, a value is not finite, or a time lies
            outside.
        """
        t, data = np.atleast_1d(times).astype(float), np.atleast_1d(values).astype(float)
        if t.shape != data.shape or t.ndim != 1 or np.shape(weights) not in ((), t.shape):
            raise StatementError(
                f"data of phase '{self.name}' have {t.size} times, {data.size} values and "
                f"{np.size(weights)} weights; give as many values as times, and one weight or as "
                "many weights as times"
            )
        if not np.all(np.isfinite(data)):
            first = t[~np.isfinite(data)][0]
            raise StatementError(
                f"the data of phase '{self.name}' at {first:.6g} s are not finite; remove them"
            )
        w = np.broadcast_to(np.asarray(weights, dtype=float), t.shape)
        squares = [
            float(w[i]) * (self.at(float(t[i]), expression) - float(data[i])) ** 2
            for i in range(t.size)
        ]
        return ca.SX(sum(squares))

    @cached_property
    def start_time(self) -> PhaseTime:
        """The initial time [s]."""
        return self._made(PhaseTime, f"start of {self.name}", "s", 0, end="start")

    @cached_property
    def end_time(self) -> PhaseTime:
        """The final time [s]."""
        return self._made(PhaseTime, f"end of {self.name}", "s", 0, end="end")

    @property
    def duration(self) -> ca.SX:
        """Final minus initial time [s]."""
        return self.end_time - self.start_time

    def peak(self, expression: Any, **options: Any) -> Peak:
        """Largest value of an expression over this phase, see `peak`."""
        return peak((self, expression), **options)

    def _made(
        self, kind: type[Kind], name: str, unit: str, expression: Any, **options: Any
    ) -> Kind:
        """A functional of one piece."""
        return _of_pieces(kind, name, unit, [(self, expression)], **options)


def _of_pieces(
    kind: type[Kind],
    name: str,
    unit: str,
    pieces: Sequence[tuple[Phase, Any]],
    **options: Any,
) -> Kind:
    """A functional that knows the dynamics of its phases."""
    phases = [phase for phase, _ in pieces]
    expressions = [scalar(expression, f"the {name}") for _, expression in pieces]
    symbols = symbols_of(expressions, f"the {name}")
    for symbol in symbols:
        if isinstance(symbol, Functional):
            raise StatementError(
                f"the {name} contains '{symbol.name}', which is itself a number of the whole "
                "motion; use signals in it, and combine the numbers afterwards"
            )
    named = zip([phase.name for phase in phases], expressions, strict=True)
    functional = kind(name, unit, tuple(named), symbols, **options)
    functional.remember_phases(phase.dynamics for phase in phases)
    return kept_alive(functional, phases)


def kept_alive(functional: Kind, phases: Iterable[Phase]) -> Kind:
    """The functional, which lives from now on as long as one of the phases.

    Expressions hold its bare symbol only, and would not keep it.
    """
    for phase in phases:
        phase._functionals.append(functional)
    return functional


def time_range(phase: Phase) -> tuple[float, float]:
    """The earliest start and the latest end [s]; infinite where nothing limits a free one."""
    start, end = phase.start, phase.end
    earliest = start.lower if isinstance(start, Between) else start
    latest = end.upper if isinstance(end, Between) else end
    return float(earliest), float(latest)


@checked_keywords()
def peak(
    *pieces: tuple[Phase, Any],
    name: str = "peak",
    unit: str = "1",
    absolute: bool = False,
    scale: float | None = None,
) -> Peak:
    """Largest value of expressions over all times of their phases.

    Parameters
    ----------
    *pieces : (Phase, expression)
        The peak is the largest over all of them.
    name, unit : str
        For messages and tables.
    absolute : bool
        Take the largest absolute value.
    scale : float or None
        Typical size [unit]. It is derived from the guess if None. Where it is stated, an excess is
        a part of it or of the peak, whichever is larger.

    Raises
    ------
    StatementError
        When there is no piece.
    """
    if not pieces:
        raise StatementError(
            f"the peak '{name}' has no (phase, expression) pair; give at least one"
        )
    for piece in pieces:
        if not (isinstance(piece, tuple) and len(piece) == 2 and isinstance(piece[0], Phase)):
            raise StatementError(
                f"an entry of the peak '{name}' is {piece!r}; write phase.peak(expression), or "
                "peak((phase, expression), ...)"
            )
    return _of_pieces(Peak, name, unit, pieces, scale=scale, absolute=absolute)


@checked_keywords()
def joined(
    first: Phase, second: Phase, jump: Mapping[State, Any] | None = None
) -> tuple[Bound, ...]:
    """Links that make time and shared states continuous from one phase to the next.

    Parameters
    ----------
    first, second : Phase
        The second begins where the first ends.
    jump : mapping of State to expression of the first phase's signals, optional
        The value right after the instant, where it differs from the value right before.

    Raises
    ------
    StatementError
        Where the two phases cannot meet, or something jumps that is no state of the second one.
    """
    for phase in (first, second):
        if not isinstance(phase, Phase):
            raise StatementError(
                f"joined links two phases, but one is {phase!r}; write joined(first, second), "
                "with the phases themselves"
            )
    if first is second:
        raise StatementError(
            f"joined links phase '{first.name}' with itself; give the phase that follows it"
        )
    if jump is not None:
        check_mapping(first.name, "jump", jump)
        check_jump(second, jump)
    check_meeting(first, second)
    pair = f"from {first.name} to {second.name}"
    gap = second.start_time - first.end_time
    links = [Bound(f"time {pair}", gap, "s", lower=0, upper=0)]

    after = dict(jump or {})
    for state in second.states:
        if state in first.dynamics or state in after:
            before = after.get(state, state)
            step = second.at_start(state) - first.at_end(before)
            links.append(Bound(f"{state.name} {pair}", step, state.unit, lower=0, upper=0))
    return tuple(links)
