"""Expressions of a problem along trajectories, at any time."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

import casadi as ca
import numpy as np

from ocp.arrays import Array
from ocp.errors import StatementError
from ocp.mesh.trajectory import PhaseTrajectory, Trajectory
from ocp.problem.functionals import BoundaryValue, Functional, Integral, Peak, PhaseTime, PointValue
from ocp.problem.parameters import Parameters, parameters_of
from ocp.problem.phase import Phase
from ocp.problem.problem import Problem
from ocp.problem.symbols import TIME, Constant, Signal, Time, Unknown, resolve, scalar

Kept = TypeVar("Kept")


@dataclass(frozen=True, eq=False)
class Evaluator:
    """Evaluates expressions of one problem; keeps the compiled functions."""

    problem: Problem
    _functions: dict[tuple[str, tuple[int, ...]], Any] = field(default_factory=dict, repr=False)
    _kept: dict[Hashable, Any] = field(default_factory=dict, repr=False)

    def kept(self, key: Hashable, build: Callable[[], Kept]) -> Kept:
        """What `build` gives, built once for this problem and `key`."""
        if key not in self._kept:
            self._kept[key] = build()
        value: Kept = self._kept[key]
        return value

    def parameters(self, trajectory: Trajectory) -> Parameters:
        """The constants of a trajectory, and the problem's limits at these values."""
        key = ("parameters", tuple(trajectory.constants.items()))
        return self.kept(key, lambda: parameters_of(self.problem, trajectory.constants))

    def phase(self, name: str) -> Phase:
        """The phase of that name."""
        return self.problem.phase(name)

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
        times = motion.breakpoints[k] + tau * np.diff(motion.breakpoints)[k]
        return self.of_signals(trajectory, phase, expressions, motion.local(k, tau), times)

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
        out = function(signals.T, np.asarray(times)[None, :], self.numbers(trajectory))
        return out.full().reshape(len(expressions), len(times)).T

    def numbers(self, trajectory: Trajectory) -> ca.DM:
        """Values of the unknowns, then of the constants, as a column."""
        values = [trajectory.unknowns[u.name] for u in self.problem.unknowns]
        values += [trajectory.constants[c.name] for c in self.problem.constants]
        return ca.DM(values) if values else ca.DM(0, 1)

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
                        f"'{symbol.name}' is one number of the whole motion; ask for its value "
                        "by solution.value(...) instead of sampling it"
                    )
                if symbol not in known:
                    raise StatementError(
                        f"'{symbol.name}' is no symbol of phase '{phase}' of '{problem.name}'; "
                        "take the symbol that the statement uses, not another of its name"
                    )

    def number(self, trajectory: Trajectory, expression: Any, peaks: Mapping[Peak, float]) -> float:
        """An expression of functionals, unknowns and constants.

        Parameters
        ----------
        peaks : mapping of Peak to number
            Their values, which depend on how densely they are looked for.
        """
        sx = scalar(expression, "an expression")
        symbols = resolve(sx, "an expression")
        reader = FunctionalValues(self, trajectory, peaks)
        values = [self._symbol_value(trajectory, symbol, reader) for symbol in symbols]
        inputs = ca.vertcat(*[s.symbol for s in symbols], ca.SX(0, 1))
        function = ca.Function("number", [inputs], [sx])
        return float(function(ca.DM(values) if values else ca.DM(0, 1)))

    def _symbol_value(self, trajectory: Trajectory, symbol: Any, reader: FunctionalValues) -> float:
        if isinstance(symbol, Unknown):
            return trajectory.unknowns[symbol.name]
        if isinstance(symbol, Constant):
            return trajectory.constants[symbol.name]
        if isinstance(symbol, (Signal, Time)):
            raise StatementError(
                f"'{symbol.name}' varies in time; sample it at times instead of asking for one "
                "number"
            )
        value: float = symbol.accept(reader)
        return value

    def integral(self, trajectory: Trajectory, phase: str, expression: Any) -> float:
        """Integral over a phase by Gauss quadrature of three points more than the degree."""
        motion = trajectory.phase(phase)
        nodes, weights = np.polynomial.legendre.leggauss(int(motion.degrees.max()) + 3)
        count = motion.intervals
        k = np.repeat(np.arange(count), nodes.size)
        tau = np.tile(0.5 * (nodes + 1.0), count)
        values = self.values(trajectory, phase, [expression], k, tau).reshape(count, -1)
        return float((0.5 * values @ weights) @ np.diff(motion.breakpoints))


@dataclass(frozen=True, eq=False)
class FunctionalValues:
    """Values of functionals on a trajectory, one method a kind."""

    evaluator: Evaluator
    trajectory: Trajectory
    peaks: Mapping[Peak, float]

    def integral(self, functional: Integral) -> float:
        """By quadrature over the phase."""
        return self.evaluator.integral(self.trajectory, functional.phase, functional.expression)

    def peak(self, functional: Peak) -> float:
        """As it was given."""
        return self.peaks[functional]

    def boundary_value(self, functional: BoundaryValue) -> float:
        """At the first or last instant of the phase."""
        last = self.trajectory.phase(functional.phase).intervals - 1
        interval, tau = (0, 0.0) if functional.end == "start" else (last, 1.0)
        return self._value(functional, interval, tau)

    def point_value(self, functional: PointValue) -> float:
        """At the instant."""
        motion = self.trajectory.phase(functional.phase)
        interval, tau = motion.locate(np.array([functional.instant]))
        return self._value(functional, int(interval[0]), float(tau[0]))

    def phase_time(self, functional: PhaseTime) -> float:
        """The phase's own time."""
        motion = self.trajectory.phase(functional.phase)
        return motion.start if functional.end == "start" else motion.end

    def _value(self, functional: BoundaryValue | PointValue, interval: int, tau: float) -> float:
        expressions = [functional.expression]
        values = self.evaluator.values(
            self.trajectory, functional.phase, expressions, interval, [tau]
        )
        return float(values[0, 0])
