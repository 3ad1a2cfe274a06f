"""The objective, the bounds and the links of a problem: one kernel over numbers of the motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from ocp.problem.functionals import (
    BoundaryValue,
    Functional,
    Integral,
    Peak,
    PhaseTime,
    PointValue,
)
from ocp.problem.problem import Problem
from ocp.problem.symbols import Constant, resolve
from ocp.transcription.columns import PhaseColumns
from ocp.transcription.kernel_builder import KernelBuilder, KernelContext, Point, sample_point
from ocp.transcription.kernels import Block
from ocp.transcription.rows import Rows


def inline_weights(problem: Problem) -> dict[Integral, ca.SX]:
    """Weights of the integrals that enter the objective linearly and nothing else.

    They are summed up in the objective. All others become running totals, which are unknowns.
    """
    elsewhere = {
        symbol
        for bound in problem.boundary_constraints
        for symbol in resolve(bound.expression, bound.name)
    }
    weights = {}
    for functional in problem.functionals:
        if isinstance(functional, Integral) and functional not in elsewhere:
            weight = ca.jacobian(problem.objective, functional.symbol)
            symbols = resolve(weight, "a weight")
            if all(isinstance(symbol, Constant) for symbol in symbols):
                weights[functional] = ca.densify(weight)
    return weights


def boundary_block(context: KernelContext, weights: Mapping[Integral, ca.SX], rows: Rows) -> Block:
    """Objective (without the integrals in `weights`), bounds and links; fills `rows.boundary`."""
    problem, scales = context.problem, context.scales
    builder = KernelBuilder(1)
    unknowns = context.unknowns(builder)
    reader = _FunctionalExpressions(context, builder, unknowns)
    values = [ca.SX(0) if f in weights else f.accept(reader) for f in problem.functionals]

    bounds = problem.boundary_constraints
    sizes = [scales.bounds["", b.name] for b in bounds]

    def build() -> tuple[Any, list[Any]]:
        scaled = [b.expression / size for b, size in zip(bounds, sizes, strict=True)]
        expressions = ca.vertcat(problem.objective / scales.objective, *scaled)
        inputs = [
            ca.vertcat(*[f.symbol for f in problem.functionals], ca.SX(0, 1)),
            ca.vertcat(*[u.symbol for u in problem.unknowns], ca.SX(0, 1)),
            context.constants,
        ]
        function = ca.Function("boundary", inputs, [expressions])
        out = function(ca.vertcat(*values, ca.SX(0, 1)), unknowns, context.constants)
        return out[0], [out[1:]] if bounds else []

    limits = [(b.lower, b.upper, size) for b, size in zip(bounds, sizes, strict=True)]
    taken = rows.limits.take(1, limits)
    rows.boundary = taken.ravel()
    key = tuple(_kind_of_values(columns, problem) for columns in context.columns.phases)
    return builder.block("boundary", context, key, build, taken)


def _kind_of_values(columns: PhaseColumns, problem: Problem) -> tuple[tuple[int, bool], ...]:
    """Degree and mobility of the intervals at whose ends a value may be taken."""
    mesh, phase = columns.mesh, columns.phase.name
    functionals = [f for f in problem.functionals if f.phase == phase]
    intervals = [_interval_before(_node(columns, f)) for f in functionals]
    return tuple((int(mesh.degrees[k]), bool(mesh.moving[k])) for k in intervals)


def _interval_before(node: int) -> int:
    """The interval on the left of a breakpoint, the first one at the start."""
    return max(node - 1, 0)


def _node(columns: PhaseColumns, functional: Functional) -> int:
    """The breakpoint at which a value is taken."""
    if isinstance(functional, PointValue):
        start, end = columns.fixed_times
        fraction = (functional.instant - start) / (end - start)
        return int(np.argmin(np.abs(columns.mesh.breakpoints - fraction)))
    at_start = isinstance(functional, BoundaryValue) and functional.end == "start"
    return 0 if at_start else columns.intervals


@dataclass(frozen=True, eq=False)
class _FunctionalExpressions:
    """Functionals as expressions of local variables, one method a kind."""

    context: KernelContext
    builder: KernelBuilder
    unknowns: ca.SX

    def integral(self, functional: Integral) -> ca.SX:
        """The running total at the end of the phase."""
        columns = self._columns(functional)
        column = columns.totals[-1:, [columns.integrals.index(functional)]]
        return self.builder.variables(column, [self.context.scales.functionals[functional]])

    def peak(self, functional: Peak) -> ca.SX:
        """The unknown that the expression does not exceed."""
        column = np.array([[self.context.columns.peaks[functional]]])
        return self.builder.variables(column, [self.context.scales.functionals[functional]])

    def boundary_value(self, functional: BoundaryValue) -> ca.SX:
        """The expression at the first or last breakpoint."""
        return self._value(functional)

    def point_value(self, functional: PointValue) -> ca.SX:
        """The expression at the breakpoint of its instant."""
        return self._value(functional)

    def phase_time(self, functional: PhaseTime) -> ca.SX:
        """The time itself."""
        return self._time(self._columns(functional), 0 if functional.end == "start" else -1)

    def _columns(self, functional: Functional) -> PhaseColumns:
        phases = self.context.columns.phases
        return next(columns for columns in phases if columns.phase.name == functional.phase)

    def _time(self, columns: PhaseColumns, end: int) -> ca.SX:
        if columns.ends is None:
            return ca.SX(columns.fixed_times[end])
        return self.builder.variables(columns.ends[[end]][None, :], [self.context.scales.time])

    def _value(self, functional: BoundaryValue | PointValue) -> ca.SX:
        columns = self._columns(functional)
        point = self._point(functional, columns)
        (value,) = self.context.expressions(columns, point, [functional.expression])
        return value

    def _point(self, functional: BoundaryValue | PointValue, columns: PhaseColumns) -> Point:
        """Signals at a breakpoint; controls as in the interval on its left (right at the start)."""
        node = _node(columns, functional)
        others = {signal.name for signal in columns.signals[len(columns.states) :]}
        if not others & {symbol.name for symbol in functional.symbols}:
            sizes = self.context.sizes(columns.states)
            x = self.builder.variables(columns.nodes[[node]], sizes)
            signals = ca.vertcat(x, ca.SX.zeros(len(others)))
            is_point = isinstance(functional, PointValue)
            time = functional.instant if is_point else self._time(columns, 0 if node == 0 else -1)
            return Point(signals, time, ca.SX(0), self.unknowns)

        interval, tau = _interval_before(node), 0.0 if node == 0 else 1.0
        group = columns.group_of(interval)
        sub, point = sample_point(
            self.context, columns, group, np.array([interval]), np.array([tau])
        )
        self.builder.absorb(sub)
        return Point(point.signals, point.time, point.length, self.unknowns)
