"""Trajectories: values of signals over the phases of a problem, and of expressions of them.

A guess, an iterate and a solution are all trajectories: numbers only, without CasADi objects. Each
can start the next solve, whatever its mesh. An `Evaluator` gives expressions of the problem's
signals, unknowns, constants and functionals along any of them.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, TypeVar, assert_never

import casadi as ca
import numpy as np

from ocp.arrays import Array, Integers
from ocp.errors import StatementError
from ocp.numerics.columnwise import columnwise
from ocp.numerics.piecewise_polynomial import PiecewisePolynomial, located
from ocp.numerics.schemes import Scheme
from ocp.problem.functionals import (
    AnyFunctional,
    BoundaryValue,
    Functional,
    Integral,
    Peak,
    PhaseTime,
    PointValue,
)
from ocp.problem.instants import within
from ocp.problem.problem import Problem
from ocp.problem.symbols import TIME, Constant, Signal, Time, Unknown, column_of, resolve, scalar

SignalKind = Literal["state", "control", "algebraic"]

_T = TypeVar("_T")


@dataclass(frozen=True, eq=False, repr=False)
class SignalGroup:
    """Signals of one kind whose polynomials have the same bases.

    Attributes
    ----------
    names : tuple of str
        One for each component of the polynomial.
    """

    kind: SignalKind
    names: tuple[str, ...]
    polynomial: PiecewisePolynomial


@dataclass(frozen=True, eq=False, repr=False)
class PhaseTrajectory:
    """Piecewise polynomials of one phase.

    Attributes
    ----------
    name : str
    scheme : Scheme
    breakpoints : (N + 1,)
        Times [s].
    degrees : (N,)
        Collocation points in each interval.
    groups : tuple of SignalGroup
        States first, then controls, then algebraic signals.
    start, end : float
        Initial and final time [s].
    intervals : int
        Their number N.
    signals, states, controls, algebraics : tuple of str
        Names of all signals in the order of the groups, and of those of each kind.
    state_polynomial : PiecewisePolynomial
        The polynomials of all states.
    fractions : (N + 1,)
        Breakpoints as fractions of the phase, from 0 to 1.
    """

    name: str
    scheme: Scheme
    breakpoints: Array
    degrees: Integers
    groups: tuple[SignalGroup, ...]
    start: float = field(init=False)
    end: float = field(init=False)
    intervals: int = field(init=False)
    signals: tuple[str, ...] = field(init=False)
    states: tuple[str, ...] = field(init=False)
    controls: tuple[str, ...] = field(init=False)
    algebraics: tuple[str, ...] = field(init=False)
    state_polynomial: PiecewisePolynomial = field(init=False)
    fractions: Array = field(init=False)

    def __post_init__(self) -> None:
        start, end = float(self.breakpoints[0]), float(self.breakpoints[-1])
        fractions = np.linspace(0.0, 1.0, len(self.breakpoints))
        if end > start:  # a motion that takes no time is refused later, with a sentence
            fractions = (self.breakpoints - start) / (end - start)
            fractions[0], fractions[-1] = 0.0, 1.0
        derived = {
            "start": start,
            "end": end,
            "intervals": len(self.breakpoints) - 1,
            "signals": tuple(name for group in self.groups for name in group.names),
            "states": self._names("state"),
            "controls": self._names("control"),
            "algebraics": self._names("algebraic"),
            "state_polynomial": self.groups[0].polynomial,
            "fractions": fractions,
        }
        for name, value in derived.items():
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        return (
            f"PhaseTrajectory('{self.name}': {', '.join(self.signals)}; {self.intervals} "
            f"intervals, {self.start:.6g} to {self.end:.6g} s)"
        )

    def _names(self, kind: SignalKind) -> tuple[str, ...]:
        return tuple(name for group in self.groups if group.kind == kind for name in group.names)

    def polynomial(self, name: str) -> PiecewisePolynomial:
        """The polynomial of one signal.

        Raises
        ------
        StatementError
            When the phase has no such signal.
        """
        for group in self.groups:
            if name in group.names:
                return group.polynomial.part([group.names.index(name)])
        raise StatementError(
            f"phase '{self.name}' has no signal '{name}'; its signals are {', '.join(self.signals)}"
        )

    def locate(self, times: Array) -> tuple[Integers, Array]:
        """Interval and local time in [0, 1] of each time; a breakpoint belongs to its right."""
        return located(self.breakpoints, times)

    def local(self, intervals: Integers, tau: Array) -> Array:
        """All signals at local times of given intervals, shape (m, n)."""
        k, tau = np.broadcast_arrays(np.asarray(intervals), np.asarray(tau, dtype=float))
        return np.hstack([group.polynomial.value(k, tau) for group in self.groups])

    def rates(self, intervals: Integers, tau: Array) -> Array:
        """Time derivatives of the state polynomials, shape (m, n_x)."""
        k, tau = np.broadcast_arrays(np.asarray(intervals), np.asarray(tau, dtype=float))
        return self.state_polynomial.rate(k, tau)

    def sample(self, times: Array) -> Array:
        """All signals at given times, shape (m, n)."""
        return self.local(*self.locate(np.atleast_1d(np.asarray(times, dtype=float))))

    def fractions_of(self, times: Array | Sequence[float]) -> Array:
        """Times [s] as fractions of the phase."""
        return (np.asarray(times, dtype=float) - self.start) / (self.end - self.start)

    def at_fractions(self, fractions: Array) -> Mapping[str, Array]:
        """Signals by name at fractions of the phase."""
        values = self.sample(self.start + np.asarray(fractions) * (self.end - self.start))
        return dict(zip(self.signals, values.T, strict=True))


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory:
    """A motion: the values of all signals over time, and of the numbers beside them.

    Attributes
    ----------
    phases : tuple of PhaseTrajectory
        In the order of the problem.
    unknowns, constants : mapping of str to float
        Values by name [unit of the statement].
    peaks : tuple of float
        Epigraph values, in the order of the problem's peaks [unit of the statement].
    """

    phases: tuple[PhaseTrajectory, ...]
    unknowns: Mapping[str, float] = field(default_factory=dict)
    constants: Mapping[str, float] = field(default_factory=dict)
    peaks: tuple[float, ...] = ()

    def __repr__(self) -> str:
        phases = (f"'{p.name}' {p.start:.6g} to {p.end:.6g} s" for p in self.phases)
        unknowns = "".join(f", {name} = {v:.6g}" for name, v in self.unknowns.items())
        return f"Trajectory({', '.join(phases)}{unknowns})"

    @property
    def duration(self) -> float:
        """Of all phases together [s]."""
        return sum(float(np.ptp(phase.breakpoints)) for phase in self.phases)

    def peaks_of(self, problem: Problem) -> dict[Peak, float]:
        """Values of a problem's peaks by functional [unit of the statement]."""
        return dict(zip(problem.peaks, self.peaks, strict=True))

    def phase(self, name: str) -> PhaseTrajectory:
        """The phase of that name; StatementError if there is none."""
        for phase in self.phases:
            if phase.name == name:
                return phase
        names = ", ".join(f"'{phase.name}'" for phase in self.phases)
        raise StatementError(f"there is no phase {name!r}; give one of {names}")


@dataclass(frozen=True, eq=False, repr=False)
class Evaluator:
    """Evaluates expressions of one problem; keeps the compiled functions.

    Attributes
    ----------
    problem : Problem
    """

    problem: Problem
    _made: dict[Hashable, Any] = field(init=False, default_factory=dict, repr=False)
    _functions: dict[tuple[str, tuple[int, ...]], Any] = field(default_factory=dict, repr=False)

    def values(
        self,
        trajectory: Trajectory,
        phase: str,
        expressions: Sequence[Any],
        intervals: Any,
        tau: Any,
    ) -> Array:
        """Expressions at local times of intervals of a phase, shape (m, len(expressions))."""
        if not expressions:
            return np.empty((np.size(tau), 0))
        motion = trajectory.phase(phase)
        k, tau = np.broadcast_arrays(np.asarray(intervals), np.asarray(tau, dtype=float))
        k, tau = k.ravel(), tau.ravel()
        times = self.times(motion, k, tau)
        return self.of_signals(trajectory, phase, expressions, motion.local(k, tau), times)

    def once(self, key: Hashable, make: Callable[[], _T]) -> _T:
        """What else is built for the problem, made at the first call: it serves other meshes too.

        Parameters
        ----------
        key : hashable
            What tells it apart from all else that is kept.
        make : callable
            Builds it.
        """
        if key not in self._made:
            self._made[key] = make()
        kept: _T = self._made[key]
        return kept

    def times(self, motion: PhaseTrajectory, intervals: Integers, tau: Array) -> Array:
        """Times of local times of intervals, (m,) [s]; at a step those of the interval's side."""
        left, right = motion.breakpoints[intervals], motion.breakpoints[intervals + 1]
        times = left + tau * (right - left)
        return within(times, left, right) if self.problem.steps[motion.name] else times

    def of_signals(
        self,
        trajectory: Trajectory,
        phase: str,
        expressions: Sequence[Any],
        signals: Array,
        times: Array,
    ) -> Array:
        """Expressions of given signal values (m, n) and times (m,), (m, len(expressions))."""
        function = self._function(trajectory.phase(phase), phase, expressions)
        (values,) = columnwise(
            function, signals, np.asarray(times)[:, None], self.numbers(trajectory)
        )
        return values

    def numbers(self, trajectory: Trajectory) -> Array:
        """Values of the unknowns, then of the constants, (n,)."""
        values = [trajectory.unknowns[u.name] for u in self.problem.unknowns]
        values += [trajectory.constants[c.name] for c in self.problem.constants]
        return np.array(values, dtype=float)

    def _function(
        self, motion: PhaseTrajectory, phase: str, expressions: Sequence[Any]
    ) -> ca.Function:
        """``(signals, time, unknowns and constants) -> expressions``, compiled once."""
        sx = [scalar(expression, "an expression") for expression in expressions]
        key = (phase, tuple(expression.element_hash() for expression in sx))
        if key not in self._functions:
            symbols = {s.name: s.symbol for s in self.problem.signals[phase]}
            signals = ca.vertcat(*[symbols[name] for name in motion.signals])
            self._check_known(sx, phase)
            numbers = [s.symbol for s in (*self.problem.unknowns, *self.problem.constants)]
            inputs = [signals, TIME.symbol, ca.vertcat(*numbers, ca.SX(0, 1))]
            outputs = ca.cse([ca.densify(ca.vertcat(*sx))])
            # the expressions are kept too: a hash is unique while its expression lives
            self._functions[key] = (ca.Function("values", inputs, outputs), sx)
        function: ca.Function = self._functions[key][0]
        return function

    def _check_known(self, expressions: Sequence[ca.SX], phase: str) -> None:
        """StatementError unless all symbols are signals or given numbers of the phase."""
        problem = self.problem
        known = {*problem.signals[phase], *problem.unknowns, *problem.constants, TIME}
        for expression in expressions:
            for symbol in resolve(expression, "an expression"):
                if isinstance(symbol, Functional):
                    raise StatementError(
                        f"'{symbol.name}' is one number of the whole motion; read its value with "
                        "solution.value(...) instead of sampling it"
                    )
                if symbol not in known:
                    raise StatementError(
                        f"'{symbol.name}' is not a symbol of phase '{phase}' of '{problem.name}'; "
                        "use the symbol of the problem, not another one with the same name"
                    )

    def number(self, trajectory: Trajectory, expression: Any, known: Mapping[Any, float]) -> float:
        """An expression of functionals, unknowns and constants.

        Parameters
        ----------
        known : mapping of Peak or Integral to number
            Values of the peaks, which depend on how densely they are looked for, and of integrals
            that were found otherwise than by quadrature on the mesh.
        """
        sx = scalar(expression, "an expression")
        symbols = resolve(sx, "an expression")
        values = [self._symbol_value(trajectory, symbol, known) for symbol in symbols]
        inputs = column_of(symbols)
        function = ca.Function("number", [inputs], [sx])
        return float(function(ca.DM(values) if values else ca.DM(0, 1)))

    def _symbol_value(
        self, trajectory: Trajectory, symbol: Any, known: Mapping[Any, float]
    ) -> float:
        if isinstance(symbol, (Unknown, Constant)):
            unknown = isinstance(symbol, Unknown)
            values = trajectory.unknowns if unknown else trajectory.constants
            if symbol.name in values:
                return values[symbol.name]
            names = ", ".join(f"'{name}'" for name in values) or "none"
            raise StatementError(
                f"the problem has no {type(symbol).__name__} '{symbol.name}'; there are: {names}"
            )
        if isinstance(symbol, (Signal, Time)):
            raise StatementError(
                f"'{symbol.name}' varies in time; sample it at times instead of reading one value"
            )
        return self._functional_value(trajectory, symbol, known)

    def _functional_value(
        self, trajectory: Trajectory, functional: AnyFunctional, known: Mapping[Any, float]
    ) -> float:
        motion = trajectory.phase(functional.phase)
        match functional:
            case Integral() if functional in known:
                return known[functional]
            case Integral():
                return self.integral(trajectory, functional.phase, functional.expression)
            case Peak():
                return known[functional]
            case BoundaryValue():
                at_start = functional.end == "start"
                interval, tau = (0, 0.0) if at_start else (motion.intervals - 1, 1.0)
            case PointValue():
                intervals, local = motion.locate(np.array([functional.instant]))
                interval, tau = int(intervals[0]), float(local[0])
            case PhaseTime():
                return motion.start if functional.end == "start" else motion.end
            case _:
                assert_never(functional)

        expressions = [functional.expression]
        values = self.values(trajectory, functional.phase, expressions, interval, [tau])
        return float(values[0, 0])

    def integral(self, trajectory: Trajectory, phase: str, expression: Any) -> float:
        """Integral over a phase by Gauss quadrature of three points more than the degree."""
        motion = trajectory.phase(phase)
        nodes, weights = np.polynomial.legendre.leggauss(int(motion.degrees.max()) + 3)
        count = motion.intervals
        k = np.repeat(np.arange(count), nodes.size)
        tau = np.tile(0.5 * (nodes + 1.0), count)
        values = self.values(trajectory, phase, [expression], k, tau).reshape(count, -1)
        return float((0.5 * values @ weights) @ np.diff(motion.breakpoints))
