"""Expressions of a problem along trajectories, at any time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.errors import StatementError
from ocp.mesh.initial_guess import signals_of
from ocp.mesh.trajectory import PhaseTrajectory, Trajectory
from ocp.problem.statement import Phase, Problem
from ocp.problem.symbols import Constant, Signal, Time, Unknown, resolve, scalar, time
from ocp.problem.terms import Functional

Array = NDArray[np.float64]
Kept = TypeVar("Kept")


@dataclass(frozen=True, eq=False)
class Evaluator:
    """Evaluates expressions of one problem; keeps the compiled functions."""

    problem: Problem
    _functions: dict[tuple[str, tuple[int, ...]], Any] = field(default_factory=dict, repr=False)
    _kept: dict[Any, Any] = field(default_factory=dict, repr=False)

    def kept(self, key: Any, build: Callable[[], Kept]) -> Kept:
        """What `build` gives, built once for this problem and `key`."""
        if key not in self._kept:
            self._kept[key] = build()
        found: Kept = self._kept[key]
        return found

    def values(
        self, trajectory: Trajectory, phase: str, expressions: Sequence[Any],
        intervals: Any, tau: Any,
    ) -> Array:  # fmt: skip
        """Expressions at local times of intervals of a phase, shape (m, len(expressions))."""
        if not expressions:
            return np.empty((np.size(tau), 0))
        own = trajectory.phase(phase)
        k, tau = np.broadcast_arrays(np.asarray(intervals), np.asarray(tau, dtype=float))
        k, tau = k.ravel(), tau.ravel()
        times = own.breakpoints[k] + tau * np.diff(own.breakpoints)[k]
        return self.of_signals(trajectory, phase, expressions, own.local(k, tau), times)

    def of_signals(
        self, trajectory: Trajectory, phase: str, expressions: Sequence[Any],
        signals: Array, times: Array,
    ) -> Array:  # fmt: skip
        """Expressions of given signal values, shape (m, len(expressions))."""
        function = self._function(trajectory.phase(phase), phase, expressions)
        fixed = [trajectory.unknowns[u.name] for u in self.problem.unknowns]
        fixed += [trajectory.constants[c.name] for c in self.problem.constants]
        out = function(
            signals.T, np.asarray(times)[None, :], ca.DM(fixed) if fixed else ca.DM(0, 1)
        )
        return out.full().reshape(len(expressions), len(times)).T

    def _function(
        self, own: PhaseTrajectory, phase: str, expressions: Sequence[Any]
    ) -> ca.Function:
        sx = [scalar(e, "an expression") for e in expressions]
        key = (phase, tuple(e.element_hash() for e in sx))
        if key not in self._functions:
            named = {s.name: s for s in signals_of(self.problem, self.problem.phase(phase))}
            signals = [named[name].symbol for name in own.signals]
            fixed = [s.symbol for s in (*self.problem.unknowns, *self.problem.constants)]
            f = ca.Function(
                "values", [ca.vertcat(*signals), time.symbol, ca.vertcat(*fixed, ca.SX(0, 1))],
                ca.cse([ca.densify(ca.vertcat(*sx))]),
            )  # fmt: skip
            self._functions[key] = (f, sx)
        return self._functions[key][0]

    def number(
        self, trajectory: Trajectory, expression: Any, peaks: Mapping[Functional, float]
    ) -> float:
        """An expression of functionals, unknowns and constants."""
        sx = scalar(expression, "an expression")
        symbols = resolve(sx, "an expression")
        values = [self._terminal(trajectory, s, peaks) for s in symbols]
        inputs = ca.vertcat(*[s.symbol for s in symbols], ca.SX(0, 1))
        return float(
            ca.Function("number", [inputs], [sx])(ca.DM(values) if values else ca.DM(0, 1))
        )

    def _terminal(
        self, trajectory: Trajectory, symbol: Any, peaks: Mapping[Functional, float]
    ) -> float:
        if isinstance(symbol, Unknown):
            return trajectory.unknowns[symbol.name]
        if isinstance(symbol, Constant):
            return trajectory.constants[symbol.name]
        if isinstance(symbol, (Signal, Time)):
            raise StatementError(
                f"'{symbol.name}' varies in time; sample it at times instead of asking for one "
                "number"
            )
        return self._functional(trajectory, symbol, peaks)

    def _functional(
        self, trajectory: Trajectory, f: Functional, peaks: Mapping[Functional, float]
    ) -> float:
        if f.kind == "peak":
            return peaks[f]
        name, expression = f.pieces[0]
        own = trajectory.phase(name)
        if f.kind == "start time":
            return own.start
        if f.kind == "end time":
            return own.end
        if f.kind == "integral":
            return self.integral(trajectory, name, expression)
        if f.kind == "start":
            return float(self.values(trajectory, name, [expression], 0, [0.0])[0, 0])
        if f.kind == "end":
            last = len(own.breakpoints) - 2
            return float(self.values(trajectory, name, [expression], last, [1.0])[0, 0])
        k, tau = own.locate(np.array([f.at]))
        return float(self.values(trajectory, name, [expression], k, tau)[0, 0])

    def integral(self, trajectory: Trajectory, phase: str, expression: Any) -> float:
        """Integral over a phase by Gauss quadrature of three points more than the degree."""
        own = trajectory.phase(phase)
        nodes, weights = np.polynomial.legendre.leggauss(int(own.degrees.max()) + 3)
        count = len(own.breakpoints) - 1
        k = np.repeat(np.arange(count), nodes.size)
        tau = np.tile(0.5 * (nodes + 1.0), count)
        values = self.values(trajectory, phase, [expression], k, tau).reshape(count, -1)
        return float((0.5 * values @ weights) @ np.diff(own.breakpoints))

    def phase_of(self, name: str) -> Phase:
        """The phase of that name."""
        return self.problem.phase(name)
