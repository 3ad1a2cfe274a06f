"""Kernels under construction: local variables, and the signals of a phase at points of intervals.

A kernel is written once for all intervals of a group. Its local variables and its data are symbols;
`KernelBuilder` collects them together with the columns and numbers of each instance.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np

from ocp.arrays import Array, Integers
from ocp.numerics.piecewise_polynomial import bernstein, elevation, lagrange
from ocp.problem.instants import within
from ocp.problem.kinks import crossable_kinks
from ocp.problem.problem import Problem
from ocp.problem.symbols import TIME, column_of
from ocp.scaling.scales import Scales
from ocp.transcription.columns import Columns, IntervalGroup, PhaseColumns
from ocp.transcription.kernels import Block, Kernel


@dataclass(frozen=True, eq=False, repr=False)
class KernelContext:
    """What every kernel of a problem shares.

    Attributes
    ----------
    kernels : dict
        Those built so far. They depend on no mesh.
    constants : (n_k,)
        Symbols of the named constants.
    """

    problem: Problem
    scales: Scales
    columns: Columns
    kernels: dict[tuple[Any, ...], Kernel] = field(default_factory=dict, repr=False)
    constants: ca.SX = field(init=False, repr=False)

    def __post_init__(self) -> None:
        constants = column_of(self.problem.constants)
        object.__setattr__(self, "constants", constants)

    def sizes(self, signals: Sequence[Any]) -> list[float]:
        """Typical sizes of signals."""
        return [self.scales.signals[s.name] for s in signals]

    def unknowns(self, builder: KernelBuilder) -> ca.SX:
        """Static unknowns as local variables."""
        if not self.problem.unknowns:
            return ca.SX(0, 1)
        sizes = [self.scales.unknowns[u.name] for u in self.problem.unknowns]
        return builder.variables(self.columns.unknowns[None, :], sizes)

    def expressions(
        self, columns: PhaseColumns, point: Point, wanted: Sequence[Any]
    ) -> list[ca.SX]:
        """Expressions of the phase's signals at a point."""
        if not wanted:
            return []
        signals = column_of(columns.signals)
        unknowns = column_of(self.problem.unknowns)
        stacked = ca.vertcat(*[ca.densify(ca.SX(expression)) for expression in wanted])
        sides = ca.SX.sym("side", point.sides.numel())
        if point.sides.numel():
            kinks = crossable_kinks(self.problem, columns.phase.name)
            stacked = ca.vertcat(*kinks.with_sides(ca.vertsplit(stacked), sides))
        inputs = [signals, unknowns, TIME.symbol, self.constants, sides]
        function = ca.Function("expressions", inputs, [stacked])
        values = function(point.signals, point.unknowns, point.time, self.constants, point.sides)
        return ca.vertsplit(values)


class KernelBuilder:
    """Collects a kernel's local variables and data together with their instances."""

    def __init__(self, instances: int) -> None:
        self.instances = instances
        self._variables: list[ca.SX] = []
        self._columns: list[Integers] = []
        self._symbols: list[ca.SX] = []
        self._data: list[Array] = []
        self._inner: list[tuple[ca.SX, ca.SX]] = []

    def variables(self, ids: Integers, sizes: Sequence[float]) -> ca.SX:
        """Unscaled values of decision variables ``ids`` (instances, m)."""
        ids = np.broadcast_to(ids, (self.instances, len(sizes)))
        w = ca.SX.sym("w", len(sizes))
        self._variables.append(w)
        self._columns.append(ids)
        return w * ca.DM(np.asarray(sizes, dtype=float)) if len(sizes) else w

    def data(self, values: Array) -> ca.SX:
        """Symbols for numbers that differ from instance to instance, (instances, m)."""
        values = np.broadcast_to(values, (self.instances, np.shape(values)[-1]))
        d = ca.SX.sym("d", values.shape[1])
        self._symbols.append(d)
        self._data.append(values)
        return d

    def absorb(self, other: KernelBuilder) -> None:
        """Take over the variables and data of another kernel of as many instances."""
        self._variables += other._variables
        self._columns += other._columns
        self._symbols += other._symbols
        self._data += other._data
        self._inner += other._inner

    def combination(self, combined: ca.SX) -> ca.SX:
        """Symbols for combinations of variables, through which derivatives take the chain rule.

        `combined` has to be linear in the variables. What is computed from few combinations of
        many variables has few second derivatives of its own.
        """
        y = ca.SX.sym("y", combined.numel())
        self._inner.append((y, combined))
        return y

    def shape(self) -> tuple[int, int]:
        """Numbers of local variables and of data."""
        variables = sum(w.numel() for w in self._variables)
        return variables, sum(d.numel() for d in self._symbols)

    def block(self, name: str, kernel: Kernel, rows: Integers) -> Block:
        """The finished block; `rows` (instances, m) are those of the program."""
        empty = np.empty((self.instances, 0))
        columns = np.hstack([empty.astype(np.int64), *self._columns])
        return Block(name, kernel, columns, np.hstack([empty, *self._data]), rows)

    def kernel(self, objective: Any, rows: Sequence[Any], constants: ca.SX) -> Kernel:
        """The kernel of an objective and of rows, expressions of what was collected."""
        w, d, c = ca.vertcat(*self._variables), ca.vertcat(*self._symbols), constants
        f = ca.densify(ca.SX(objective))
        g = ca.densify(ca.vertcat(*rows) if rows else ca.SX(0, 1))
        y = ca.vertcat(*[symbol for symbol, _ in self._inner], ca.SX(0, 1))
        combined = ca.densify(ca.vertcat(*[value for _, value in self._inner], ca.SX(0, 1)))
        outer = ca.Function("outer", [w, y, d, c], ca.cse([f, g]))
        return Kernel(outer, ca.Function("inner", [w, d], [combined]))


@dataclass(frozen=True, eq=False, repr=False)
class Point:
    """Signals, time and interval length at one point of an interval, as local expressions.

    Attributes
    ----------
    sides : (k,)
        The sides of kinks that are given there; empty where none is.
    """

    signals: ca.SX
    time: Any
    length: Any
    unknowns: ca.SX
    sides: ca.SX


@dataclass(frozen=True, eq=False, repr=False)
class CollocationPoint(Point):
    """A collocation point.

    Attributes
    ----------
    slope : (n_x,)
        Derivative of the state polynomials by local time.
    weight : SX
        Quadrature weight of the point on [0, 1].
    """

    slope: ca.SX
    weight: ca.SX


def collocation_point(
    context: KernelContext, columns: PhaseColumns, group: IntervalGroup
) -> tuple[KernelBuilder, CollocationPoint]:
    """Local expressions at the collocation points of a group; one instance a point."""
    rule = group.collocation
    m, s = group.intervals.size, rule.degree
    builder = KernelBuilder(m * s)
    intervals, tau = np.repeat(group.intervals, s), np.tile(rule.points, m)
    row = np.repeat(np.arange(m), s)

    # the state at the point itself comes first, then those at the other support points
    others = np.array([[i for i in range(s + 1) if i != j] for j in rule.own])
    n_x, sizes = len(columns.states), context.sizes(columns.states)
    x = builder.variables(group.support[:, rule.own, :].reshape(m * s, -1), sizes)
    rest = builder.variables(group.support[:, others, :].reshape(m * s, -1), sizes * s)

    slopes = np.hstack(
        [
            np.take_along_axis(rule.derivative, rule.own[:, None], axis=1),
            np.take_along_axis(rule.derivative, others, axis=1),
        ]
    )
    d = builder.data(np.tile(slopes, (m, 1)))
    slope = d[0] * x + ca.mtimes(ca.reshape(rest, n_x, s), d[1:])
    weight = builder.data(np.tile(rule.weights, m)[:, None])

    controls = _controls(context, columns, builder, group, row, tau, lambda value: value)
    algebraic_ids = group.algebraics.reshape(m * s, -1)
    z = builder.variables(algebraic_ids, context.sizes(columns.algebraics))
    t, h = _clock(context, columns, builder, group, intervals, tau)
    signals = ca.vertcat(x, *controls, z)
    unknowns, sides = context.unknowns(builder), _sides(columns, builder, intervals)
    return builder, CollocationPoint(signals, t, h, unknowns, sides, slope, weight)


def sample_point(
    context: KernelContext,
    columns: PhaseColumns,
    group: IntervalGroup,
    intervals: Integers,
    tau: Array,
) -> tuple[KernelBuilder, Point]:
    """Local expressions at arbitrary local times of some intervals of a group."""
    rule, builder = group.collocation, KernelBuilder(intervals.size)
    row = np.searchsorted(group.intervals, intervals)

    def interpolated(ids: Integers, signals: Sequence[Any], support: Array) -> Any:
        if not signals:
            return ca.SX(0, 1)
        sizes = context.sizes(signals)
        return builder.combination(_combined(builder, ids[row], sizes, lagrange(support, tau)))

    x = interpolated(group.support, columns.states, rule.support)
    controls = _controls(context, columns, builder, group, row, tau, builder.combination)
    z = interpolated(group.algebraics, columns.algebraics, rule.points)
    t, h = _clock(context, columns, builder, group, intervals, tau)
    sides = _sides(columns, builder, intervals)
    return builder, Point(ca.vertcat(x, *controls, z), t, h, context.unknowns(builder), sides)


def coefficient_point(
    context: KernelContext, columns: PhaseColumns, group: IntervalGroup, involved: set[Any]
) -> tuple[KernelBuilder, Point, int]:
    """Bernstein coefficients in place of controls; one instance a coefficient of an interval.

    Coefficients of different orders are those of the highest, to which the others are elevated. All
    signals that are not `involved` are zero.

    Returns
    -------
    builder, point
        Local expressions.
    count : int
        Coefficients in an interval.
    """
    pairs = list(zip(columns.control_sets, group.controls, strict=True))
    counts = [table.shape[1] for members, table in pairs if involved & set(members.controls)]
    count, m = max(counts), group.intervals.size
    builder = KernelBuilder(m * count)
    row, place = np.repeat(np.arange(m), count), np.tile(np.arange(count), m)

    controls = []
    for members, table in pairs:
        sizes = context.sizes(members.controls)
        if not involved & set(members.controls):
            controls.append(ca.SX.zeros(len(sizes)))
        elif table.shape[1] == count:
            controls.append(builder.variables(table[row, place], sizes))
        else:
            weights = elevation(table.shape[1], count)[place]
            controls.append(_combined(builder, table[row], sizes, weights))

    nothing = [ca.SX.zeros(len(signals)) for signals in (columns.states, columns.algebraics)]
    signals = ca.vertcat(nothing[0], *controls, nothing[1])
    return builder, Point(signals, 0, ca.SX(0), context.unknowns(builder), ca.SX(0, 1)), count


def _sides(columns: PhaseColumns, builder: KernelBuilder, intervals: Integers) -> ca.SX:
    """The sides of kinks that the mesh gives in intervals, one an instance."""
    sides = columns.mesh.sides
    return ca.SX(0, 1) if sides is None else builder.data(sides[intervals].astype(float))


def _controls(
    context: KernelContext,
    columns: PhaseColumns,
    builder: KernelBuilder,
    group: IntervalGroup,
    row: Integers,
    tau: Array,
    wrapped: Callable[[ca.SX], ca.SX],
) -> list[ca.SX]:
    """All controls from their Bernstein coefficients, in rows of the group.

    What is combined of several coefficients is `wrapped`.
    """
    values = []
    for members, table in zip(columns.control_sets, group.controls, strict=True):
        count, sizes = table.shape[1], context.sizes(members.controls)
        if count == 1:
            values.append(builder.variables(table[row][:, 0], sizes))
        else:
            weights = bernstein(count, tau)
            values.append(wrapped(_combined(builder, table[row], sizes, weights)))
    return values


def _combined(
    builder: KernelBuilder, ids: Integers, sizes: Sequence[float], weights: Array
) -> ca.SX:
    """Sums over unknowns ``ids`` (n, m, signals) weighted by numbers (n, m).

    Unknowns that have weight nowhere, as all but one at a support point, are left out.
    """
    used = np.any(weights != 0.0, axis=0)
    count = int(used.sum())
    values = builder.variables(ids[:, used].reshape(len(ids), -1), list(sizes) * count)
    return ca.mtimes(ca.reshape(values, len(sizes), count), builder.data(weights[:, used]))


def _clock(
    context: KernelContext,
    columns: PhaseColumns,
    builder: KernelBuilder,
    group: IntervalGroup,
    intervals: Integers,
    tau: Array,
) -> tuple[Any, Any]:
    """Time and interval length at local times ``tau`` (instances,) of the group's intervals."""
    points = columns.mesh.breakpoints
    left, width = points[intervals], np.diff(points)[intervals]

    # all known: plain numbers
    stepping = bool(context.problem.steps[columns.phase.name])
    if columns.ends is None and not group.moving:
        start, end = columns.fixed_times
        h = width * (end - start)
        first = start + left * (end - start)
        t = within(first + tau * h, first, first + h) if stepping else first + tau * h
        d = builder.data(np.stack([t, h], axis=1))
        return d[0], d[1]

    # where in the phase, as fractions of it
    if group.moving:
        place, length = _moving_interval(columns, builder, intervals)
        fraction = place + builder.data(tau[:, None]) * length
        if stepping:
            # to the inner side of a breakpoint, wherever it moves
            inner = within(left + tau * width, left, left + width) - (left + tau * width)
            fraction += builder.data(inner[:, None])
    else:
        d = builder.data(np.stack([left + tau * width, width], axis=1))
        fraction, length = d[0], d[1]

    if columns.ends is None:
        begin: Any = columns.fixed_times[0]
        span: Any = columns.fixed_times[1] - begin
    else:
        ends = builder.variables(columns.ends[None, :], [context.scales.time] * 2)
        begin, span = ends[0], ends[1] - ends[0]
    return begin + fraction * span, length * span


def _moving_interval(
    columns: PhaseColumns, builder: KernelBuilder, intervals: Integers
) -> tuple[Any, Any]:
    """Where intervals whose breakpoints are unknowns begin, and how long they are."""
    ids = np.stack([columns.moved[intervals], columns.moved[intervals + 1]], axis=1)
    sides = builder.variables(ids, [1.0, 1.0])
    return sides[0], sides[1] - sides[0]
