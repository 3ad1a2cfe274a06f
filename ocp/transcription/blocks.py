"""The blocks of a program: those of each phase, and one over numbers of the whole motion.

Those of a phase are the dynamics and path constraints at points, and what joins the intervals. The
last block holds the objective, the bounds and the links. Each maker adds the rows that it takes to
the map of the rows.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, assert_never

import casadi as ca
import numpy as np

from ocp.arrays import Array, Integers
from ocp.mesh.mesh import ExtraPoints
from ocp.problem.functionals import (
    AnyFunctional,
    BoundaryValue,
    Functional,
    Integral,
    Peak,
    PhaseTime,
    PointValue,
)
from ocp.problem.problem import Problem
from ocp.problem.symbols import column_of, resolve
from ocp.transcription.columns import IntervalGroup, PhaseColumns
from ocp.transcription.kernel_builder import (
    KernelBuilder,
    KernelContext,
    Point,
    coefficient_point,
    collocation_point,
    sample_point,
)
from ocp.transcription.kernels import Block
from ocp.transcription.path_constraints import PathConstraint
from ocp.transcription.rows import PathRows, PhaseRows, Rows

_SHORTEST = 0.02  # of its width on the mesh: the least length of an interval whose ends move

# Of the typical duration: what a phase with a free time lasts at least. It is too short to change a
# result, and rates of states, which are slopes divided by the duration, have a value.
_LEAST_DURATION = 1e-9


def blocks_of(
    context: KernelContext,
    extra: Sequence[Sequence[ExtraPoints]],
    constraints: Sequence[tuple[PathConstraint, ...]],
) -> tuple[tuple[Block, ...], Rows]:
    """All blocks of a program, and the map of their rows.

    Parameters
    ----------
    context : KernelContext
    extra : sequence of sequence of ExtraPoints
        Of each phase: where path constraints are imposed beside the collocation points.
    constraints : sequence of tuple of PathConstraint
        Of each phase.
    """
    rows = Rows()
    blocks: list[Block] = []
    for index, points in enumerate(extra):
        blocks += PhaseBlocks(context, index, constraints[index], rows).all(points)
    blocks.append(_boundary_block(context, rows))
    return tuple(blocks), rows


@dataclass(frozen=True, eq=False, repr=False)
class PhaseBlocks:
    """Makes the blocks of one phase.

    Attributes
    ----------
    context : KernelContext
    index : int
        Number of the phase.
    constraints : tuple of PathConstraint
        Of the phase.
    rows : Rows
        The map that is being filled.
    columns : PhaseColumns
        The unknowns of the phase.
    name : str
        Of the phase.
    """

    context: KernelContext
    index: int
    constraints: tuple[PathConstraint, ...]
    rows: Rows
    columns: PhaseColumns = field(init=False)
    name: str = field(init=False)

    def __post_init__(self) -> None:
        columns = self.context.columns.phases[self.index]
        object.__setattr__(self, "columns", columns)
        object.__setattr__(self, "name", columns.phase.name)

    def all(self, extra: Sequence[ExtraPoints]) -> Iterator[Block]:
        """All blocks; path constraints at the points `extra` too."""
        columns, limits = self.columns, self.rows.limits
        own = PhaseRows(limits.take_equations(columns.intervals, len(columns.integrals)))
        self.rows.phases.append(own)

        for group in columns.groups:
            yield self._collocation(group, own)
        for group in columns.groups:
            if not group.collocation.ends_on_support:
                yield self._continuity(group, own)
        for number, constraint in enumerate(self.constraints):
            for group in columns.groups if constraint.of_controls else ():
                yield self._of_controls(group, number, own)
        yield from self._joints(own)

        for points in (*self._ends_of_phase(), *extra):
            for group in columns.groups:
                here = np.isin(points.intervals, group.intervals)
                if here.any():
                    intervals, tau = points.intervals[here], points.tau[here]
                    yield self._sampled(group, points.constraint, intervals, tau, own)

    def _collocation(self, group: IntervalGroup, own: PhaseRows) -> Block:
        """Dynamics, path constraints and integrands at the collocation points of a group."""
        columns, context, scales = self.columns, self.context, self.context.scales
        phase, rule = columns.phase, group.collocation
        builder, point, slope, weight = collocation_point(context, columns, group)

        weights = context.problem.summed
        summed = [f for f in weights if f.phase == phase.name]
        sampled = [c for c in self.constraints if _at_points(c)]
        peaks = [self._peak(c, builder) for c in sampled]
        sizes = context.sizes(columns.states)
        n_x, n_w, n_q = len(columns.states), len(summed), len(columns.integrals)

        def build() -> tuple[Any, list[Any]]:
            wanted = [
                *phase.dynamics.values(),
                *[f.expression for f in (*summed, *columns.integrals)],
                *[c.expression for c in sampled],
            ]
            values = context.expressions(columns, point, wanted)
            rates, costs = values[:n_x], values[n_x : n_x + n_w]
            integrands, paths = values[n_x + n_w : n_x + n_w + n_q], values[n_x + n_w + n_q :]

            measure = weight * point.length
            terms = [weights[f] * measure * v for f, v in zip(summed, costs, strict=True)]
            objective = sum(terms, ca.SX(0)) / scales.objective
            defects = [(slope[j] - point.length * rates[j]) / sizes[j] for j in range(n_x)]
            limited = [
                _path_row(c, value, peak)
                for c, value, peak in zip(sampled, paths, peaks, strict=True)
            ]
            increments = [
                -measure * value / scales.functionals[f]
                for f, value in zip(columns.integrals, integrands, strict=True)
            ]
            return objective, [*defects, *limited, *increments]

        # every collocation point of an interval adds to the same row of a running total
        limits = [(0.0, 0.0, 1.0)] * n_x + [(c.lower, c.upper, c.scale) for c in sampled]
        taken = self.rows.limits.take(builder.instances, limits)
        totals = np.repeat(own.totals[group.intervals], rule.degree, axis=0)

        own.defects.append(taken[:, :n_x].reshape(-1, rule.degree, n_x))
        intervals = np.repeat(group.intervals, rule.degree)
        tau = np.tile(rule.points, group.intervals.size)
        quadrature = np.tile(rule.weights, group.intervals.size)
        numbers = [i for i, c in enumerate(self.constraints) if _at_points(c)]
        for n, number in enumerate(numbers):
            rows = taken[:, n_x + n]
            self._add(PathRows(self.index, number, rows, intervals, tau, quadrature), own)

        key = (rule.degree, group.moving)
        name = f"{phase.name}: collocation"
        return _block(context, builder, name, key, build, np.hstack([taken, totals]))

    def _peak(self, constraint: PathConstraint, builder: KernelBuilder) -> Any:
        """The peak that bounds a constraint from above, 0 where there is none."""
        if constraint.peak is None:
            return 0
        column = self.context.columns.peaks[constraint.peak]
        return builder.variables(np.array([[column]]), [constraint.scale])

    def _joints(self, own: PhaseRows) -> Iterator[Block]:
        """What joins the intervals: running totals, and the order of times and breakpoints."""
        if self.columns.integrals:
            yield self._running_totals(own)
        if self.columns.ends is not None:
            yield self._duration(own)
        if self.columns.mesh.moving.any():
            yield self._breakpoints(own)

    def _of_controls(self, group: IntervalGroup, number: int, own: PhaseRows) -> Block:
        """A constraint of controls alone at its Bernstein coefficients, which bound it."""
        context, columns, constraint = self.context, self.columns, self.constraints[number]
        symbols = resolve(constraint.expression, constraint.name)
        builder, point, count = coefficient_point(context, columns, group, set(symbols))
        tau = np.array([0.5]) if count == 1 else np.arange(count) / (count - 1)
        intervals = np.repeat(group.intervals, count)
        # the integral of each Bernstein polynomial is the same, and so is its weight
        weights = np.full(intervals.size, 1.0 / count)
        places = intervals, np.tile(tau, group.intervals.size), weights
        key = "coefficients", group.collocation.degree, count
        return self._limited(number, builder, point, places, key, own)

    def _limited(
        self,
        number: int,
        builder: KernelBuilder,
        point: Point,
        places: tuple[Integers, Array, Array],
        key: tuple[Any, ...],
        own: PhaseRows,
    ) -> Block:
        """A path constraint at a point; `places` are intervals, local times and weights."""
        context, constraint = self.context, self.constraints[number]
        peak = self._peak(constraint, builder)

        def build() -> tuple[Any, list[Any]]:
            (value,) = context.expressions(self.columns, point, [constraint.expression])
            return 0, [_path_row(constraint, value, peak)]

        limits = [(constraint.lower, constraint.upper, constraint.scale)]
        rows = self.rows.limits.take(builder.instances, limits)
        self._add(PathRows(self.index, number, rows[:, 0], *places), own)
        name = f"{self.name}: {constraint.name}"
        return _block(context, builder, name, (number, *key), build, rows)

    def _continuity(self, group: IntervalGroup, own: PhaseRows) -> Block:
        """The right ends of intervals whose scheme has no support point there."""
        columns, builder = self.columns, KernelBuilder(group.intervals.size)
        n_x, s = len(columns.states), group.collocation.support.size
        inside = group.support.reshape(builder.instances, -1)
        values = builder.variables(inside, [1.0] * n_x * s)
        end = builder.variables(columns.nodes[group.intervals + 1], [1.0] * n_x)
        gap = end - ca.mtimes(ca.reshape(values, n_x, s), ca.DM(group.collocation.end))

        rows = self.rows.limits.take_equations(builder.instances, n_x)
        own.continuity.append(rows)
        return self._joint(builder, "ends", (s,), gap, rows)

    def _running_totals(self, own: PhaseRows) -> Block:
        """Totals at the right end of each interval; the collocation adds the increments."""
        columns, builder = self.columns, KernelBuilder(self.columns.intervals)
        n_q = len(columns.integrals)
        left = builder.variables(columns.totals[:-1], [1.0] * n_q)
        right = builder.variables(columns.totals[1:], [1.0] * n_q)
        return self._joint(builder, "integrals", (), right - left, own.totals)

    def _duration(self, own: PhaseRows) -> Block:
        """The end is behind the start, by the least duration at least."""
        builder = KernelBuilder(1)
        assert self.columns.ends is not None
        ends = builder.variables(self.columns.ends[None, :], [1.0, 1.0])
        rows = self.rows.limits.take(1, [(_LEAST_DURATION, np.inf, 1.0)])
        own.duration = rows.ravel()
        return self._joint(builder, "duration", (), ends[1] - ends[0], rows)

    def _breakpoints(self, own: PhaseRows) -> Block:
        """Intervals whose ends move keep a part of their width, and grow no longer than allowed."""
        columns = self.columns
        moving = np.flatnonzero(columns.mesh.moving)
        builder = KernelBuilder(moving.size)
        ids = np.stack([columns.moved[moving], columns.moved[moving + 1]], axis=1)
        sides = builder.variables(ids, [1.0, 1.0])
        width = builder.data(np.diff(columns.mesh.breakpoints)[moving][:, None])

        rows = self.rows.limits.take(moving.size, [(_SHORTEST, columns.mesh.longest, 1.0)])
        own.breakpoints = rows.ravel()
        return self._joint(builder, "breakpoints", (), (sides[1] - sides[0]) / width, rows)

    def _joint(
        self,
        builder: KernelBuilder,
        what: str,
        key: tuple[Any, ...],
        expression: ca.SX,
        rows: Integers,
    ) -> Block:
        """A block of rows without objective."""
        name = f"{self.name}: {what}"
        return _block(self.context, builder, name, key, lambda: (0, [expression]), rows)

    def _ends_of_phase(self) -> list[ExtraPoints]:
        """The ends of the phase, where the scheme has no collocation point there."""
        rule, last = self.columns.groups[0].collocation, self.columns.intervals - 1
        points = []
        for number, constraint in enumerate(self.constraints):
            if _at_points(constraint) and not constraint.is_equation:
                if rule.points[0] != 0.0:
                    points.append(ExtraPoints(number, np.array([0]), np.array([0.0])))
                if rule.points[-1] != 1.0:
                    points.append(ExtraPoints(number, np.array([last]), np.array([1.0])))
        return points

    def _sampled(
        self, group: IntervalGroup, number: int, intervals: Integers, tau: Array, own: PhaseRows
    ) -> Block:
        """A path constraint at points between the collocation points of a group."""
        builder, point = sample_point(self.context, self.columns, group, intervals, tau)
        places = intervals, tau, np.full(intervals.size, np.nan)
        key = group.collocation.degree, group.moving
        return self._limited(number, builder, point, places, key, own)

    def _add(self, path: PathRows, own: PhaseRows) -> None:
        """Note rows of a path constraint, in the map of the phase and in that of all."""
        own.path.append(path)
        self.rows.path.append(path)


def _block(
    context: KernelContext,
    builder: KernelBuilder,
    name: str,
    key: tuple[Any, ...],
    build: Callable[[], tuple[Any, list[Any]]],
    rows: Integers,
) -> Block:
    """A block, its kernel built unless the context has it already.

    Parameters
    ----------
    key : tells the kernel from the others of the context that have this name and size.
    build : gives objective and rows of the kernel.
    rows : (instances, m) rows of the program.
    """
    whole_key = (name, *key, *builder.shape())
    if whole_key not in context.kernels:
        context.kernels[whole_key] = builder.kernel(*build(), context.constants)
    return builder.block(name, context.kernels[whole_key], rows)


def _at_points(constraint: PathConstraint) -> bool:
    """Whether the rows of a constraint are its values at points."""
    return constraint.sampled and not constraint.of_controls


def _path_row(constraint: PathConstraint, value: ca.SX, peak: Any) -> ca.SX:
    """The scaled row of a path constraint."""
    return (constraint.sign * value - peak) / constraint.scale


def _boundary_block(context: KernelContext, rows: Rows) -> Block:
    """Objective (without the integrals that it sums up), bounds and links."""
    problem, scales = context.problem, context.scales
    builder = KernelBuilder(1)
    unknowns = context.unknowns(builder)
    reader = _FunctionalExpressions(context, builder, unknowns)
    values = [
        ca.SX(0) if f in problem.summed else reader.expression(f) for f in problem.functionals
    ]

    bounds = problem.boundary_constraints
    sizes = [scales.bounds["", b.name] for b in bounds]

    def build() -> tuple[Any, list[Any]]:
        scaled = [b.expression / size for b, size in zip(bounds, sizes, strict=True)]
        expressions = ca.vertcat(problem.objective / scales.objective, *scaled)
        inputs = [
            column_of(problem.functionals),
            column_of(problem.unknowns),
            context.constants,
        ]
        function = ca.Function("boundary", inputs, [expressions])
        out = function(ca.vertcat(*values, ca.SX(0, 1)), unknowns, context.constants)
        return out[0], [out[1:]] if bounds else []

    limits = [(b.lower, b.upper, size) for b, size in zip(bounds, sizes, strict=True)]
    taken = rows.limits.take(1, limits)
    rows.boundary = taken.ravel()
    key = tuple(_kind_of_values(columns, problem) for columns in context.columns.phases)
    return _block(context, builder, "boundary", key, build, taken)


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


@dataclass(frozen=True, eq=False, repr=False)
class _FunctionalExpressions:
    """Functionals as expressions of local variables."""

    context: KernelContext
    builder: KernelBuilder
    unknowns: ca.SX

    def expression(self, functional: AnyFunctional) -> ca.SX:
        """What stands for a functional in the program."""
        match functional:
            case Integral():
                # the running total at the end of the phase
                columns = self._columns(functional)
                # by identity: `==` of functionals states an equation
                number = next(i for i, own in enumerate(columns.integrals) if own is functional)
                place = columns.totals[-1:, [number]]
                return self._variable(place, functional)
            case Peak():
                # the unknown that the expression does not exceed
                place = np.array([[self.context.columns.peaks[functional]]])
                return self._variable(place, functional)
            case BoundaryValue() | PointValue():
                columns = self._columns(functional)
                point = self._point(functional, columns)
                (value,) = self.context.expressions(columns, point, [functional.expression])
                return value
            case PhaseTime():
                end = 0 if functional.end == "start" else -1
                return self._time(self._columns(functional), end)
            case _:
                assert_never(functional)

    def _variable(self, place: Integers, functional: Functional) -> ca.SX:
        return self.builder.variables(place, [self.context.scales.functionals[functional]])

    def _columns(self, functional: Functional) -> PhaseColumns:
        phases = self.context.columns.phases
        return next(columns for columns in phases if columns.phase.name == functional.phase)

    def _time(self, columns: PhaseColumns, end: int) -> ca.SX:
        if columns.ends is None:
            return ca.SX(columns.fixed_times[end])
        return self.builder.variables(columns.ends[[end]][None, :], [self.context.scales.time])

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
            return Point(signals, time, ca.SX(0), self.unknowns, ca.SX(0, 1))

        interval, tau = _interval_before(node), 0.0 if node == 0 else 1.0
        places, group = (np.array([interval]), np.array([tau])), columns.group_of(interval)
        _, point = sample_point(self.context, columns, group, *places, self.builder)
        return replace(point, unknowns=self.unknowns, sides=ca.SX(0, 1))
