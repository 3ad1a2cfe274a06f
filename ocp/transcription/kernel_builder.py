"""Kernels under construction: local variables, and the signals of a phase at points of intervals.

A kernel is written once for all intervals of a group. Its local variables and its data are symbols;
`KernelBuilder` collects them together with the columns and numbers of each instance.
"""

from __future__ import annotations

from collections.abc import Sequence
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

    def variables(self, ids: Integers, sizes: Sequence[float]) -> ca.SX:
        """Unscaled values of decision variables ``ids`` (instances, m)."""
        ids = np.broadcast_to(ids, (self.instances, len(sizes)))
        w = ca.SX.sym("w", len(sizes))
        self._variables.append(w)
        self._columns.append(ids)
        return w * ca.SX(list(sizes)) if len(sizes) else w

    def data(self, values: Array) -> ca.SX:
        """Symbols for numbers that differ from instance to instance, (instances, m)."""
        values = np.broadcast_to(values, (self.instances, np.shape(values)[-1]))
        d = ca.SX.sym("d", values.shape[1])
        self._symbols.append(d)
        self._data.append(values)
        return d

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
        inputs = [ca.vertcat(*self._variables), ca.vertcat(*self._symbols), constants]
        f = ca.densify(ca.SX(objective))
        g = ca.densify(ca.vertcat(*rows) if rows else ca.SX(0, 1))
        return Kernel(ca.Function("kernel", inputs, ca.cse([f, g])))


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
class _Places:
    """Local times of some intervals of a group, one an instance, at which a point is built.

    Attributes
    ----------
    row : (n,)
        The interval of each instance, as its place in the group.
    tau : (n,)
        The local time of each instance.
    """

    context: KernelContext
    columns: PhaseColumns
    group: IntervalGroup
    builder: KernelBuilder
    row: Integers
    tau: Array

    def point(self, signals: ca.SX) -> Point:
        """The point with these signals."""
        time, length = self._clock()
        unknowns, sides = self.context.unknowns(self.builder), self.columns.mesh.sides
        given = ca.SX(0, 1)
        if sides is not None:
            given = self.builder.data(sides[self.group.intervals[self.row]].astype(float))
        return Point(signals, time, length, unknowns, given)

    def interpolated(self, ids: Integers, signals: Sequence[Any], support: Array) -> ca.SX:
        """Signals from their values (m, s, n) at support points."""
        if not signals:
            return ca.SX(0, 1)
        weights, sizes = lagrange(support, self.tau), self.context.sizes(signals)
        return _combined(self.builder, ids[self.row], sizes, weights)

    def controls(self) -> list[ca.SX]:
        """All controls from their Bernstein coefficients."""
        values = []
        for members, table in zip(self.columns.control_sets, self.group.controls, strict=True):
            count, sizes = table.shape[1], self.context.sizes(members.controls)
            if count == 1:
                values.append(self.builder.variables(table[self.row][:, 0], sizes))
            else:
                weights = bernstein(count, self.tau)
                values.append(_combined(self.builder, table[self.row], sizes, weights))
        return values

    def _clock(self) -> tuple[Any, Any]:
        """Time and length of the interval."""
        columns, builder, points = self.columns, self.builder, self.columns.mesh.breakpoints
        intervals, tau = self.group.intervals[self.row], self.tau
        left, width = points[intervals], np.diff(points)[intervals]
        stepping = bool(self.context.problem.steps[columns.phase.name])

        # all known: plain numbers
        if columns.ends is None and not self.group.moving:
            start, end = columns.fixed_times
            h = width * (end - start)
            first = start + left * (end - start)
            t = within(first + tau * h, first, first + h) if stepping else first + tau * h
            d = builder.data(np.stack([t, h], axis=1))
            return d[0], d[1]

        # where in the phase, as fractions of it
        if self.group.moving:
            ids = np.stack([columns.moved[intervals], columns.moved[intervals + 1]], axis=1)
            sides = builder.variables(ids, [1.0, 1.0])
            length = sides[1] - sides[0]
            fraction = sides[0] + builder.data(tau[:, None]) * length
            if stepping:
                # to the inner side of a breakpoint, wherever it moves
                inner = within(left + tau * width, left, left + width) - (left + tau * width)
                fraction += builder.data(inner[:, None])
        else:
            d = builder.data(np.stack([left + tau * width, width], axis=1))
            fraction, length = d[0], d[1]

        begin, span = columns.fixed_times[0], columns.fixed_times[1] - columns.fixed_times[0]
        if columns.ends is not None:
            ends = builder.variables(columns.ends[None, :], [self.context.scales.time] * 2)
            begin, span = ends[0], ends[1] - ends[0]
        return begin + fraction * span, length * span


def collocation_point(
    context: KernelContext, columns: PhaseColumns, group: IntervalGroup
) -> tuple[KernelBuilder, Point, ca.SX, ca.SX]:
    """Local expressions at the collocation points of a group; one instance a point.

    Returns
    -------
    builder, point
    slope : (n_x,)
        Derivative of the state polynomials by local time.
    weight : SX
        Quadrature weight of the point on [0, 1].
    """
    rule = group.collocation
    m, s = group.intervals.size, rule.degree
    builder = KernelBuilder(m * s)
    row, tau = np.repeat(np.arange(m), s), np.tile(rule.points, m)
    places = _Places(context, columns, group, builder, row, tau)

    # the state at the point itself comes first, then those at the other support points
    others = np.array([[i for i in range(s + 1) if i != j] for j in rule.own])
    n_x, sizes = len(columns.states), context.sizes(columns.states)
    x = builder.variables(group.support[:, rule.own, :].reshape(m * s, -1), sizes)
    rest = builder.variables(group.support[:, others, :].reshape(m * s, -1), sizes * s)

    order = np.hstack([rule.own[:, None], others])
    d = builder.data(np.tile(np.take_along_axis(rule.derivative, order, axis=1), (m, 1)))
    slope = d[0] * x + ca.mtimes(ca.reshape(rest, n_x, s), d[1:])
    weight = builder.data(np.tile(rule.weights, m)[:, None])

    controls = places.controls()
    algebraic_ids = group.algebraics.reshape(m * s, -1)
    z = builder.variables(algebraic_ids, context.sizes(columns.algebraics))
    return builder, places.point(ca.vertcat(x, *controls, z)), slope, weight


def sample_point(
    context: KernelContext,
    columns: PhaseColumns,
    group: IntervalGroup,
    intervals: Integers,
    tau: Array,
    builder: KernelBuilder | None = None,
) -> tuple[KernelBuilder, Point]:
    """Local expressions at arbitrary local times of some intervals of a group.

    Parameters
    ----------
    builder : KernelBuilder or None
        Of as many instances, which gets the variables; a new one if None.
    """
    builder = KernelBuilder(intervals.size) if builder is None else builder
    row = np.searchsorted(group.intervals, intervals)
    places = _Places(context, columns, group, builder, row, tau)
    x = places.interpolated(group.support, columns.states, group.collocation.support)
    controls = places.controls()
    z = places.interpolated(group.algebraics, columns.algebraics, group.collocation.points)
    return builder, places.point(ca.vertcat(x, *controls, z))


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
    count = max(t.shape[1] for members, t in pairs if involved & set(members.controls))
    m = group.intervals.size
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
