"""Local variables of a kernel, and the expressions of a phase at one point of an interval."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.numerics.schemes import bernstein, lagrange
from ocp.problem.statement import Problem
from ocp.problem.symbols import time
from ocp.transcription.kernels import Block, Kernel, RowName
from ocp.transcription.variables import Group, PhaseLayout

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


class Local:
    """Collects a kernel's local variables and data together with their instances."""

    def __init__(self, instances: int) -> None:
        self.instances = instances
        self._variables: list[ca.SX] = []
        self._columns: list[Integers] = []
        self._symbols: list[ca.SX] = []
        self._data: list[Array] = []
        self._inner: list[tuple[ca.SX, ca.SX]] = []

    def variables(self, ids: Integers, scales: Sequence[float]) -> ca.SX:
        """Unscaled values of decision variables ``ids`` (instances, m)."""
        ids = np.broadcast_to(ids, (self.instances, len(scales)))
        w = ca.SX.sym("w", len(scales))
        self._variables.append(w)
        self._columns.append(ids)
        return w * ca.DM(np.asarray(scales, dtype=float)) if len(scales) else w

    def data(self, values: Array) -> ca.SX:
        """Symbols for numbers that differ from instance to instance, (instances, m)."""
        values = np.broadcast_to(values, (self.instances, np.shape(values)[-1]))
        d = ca.SX.sym("d", values.shape[1])
        self._symbols.append(d)
        self._data.append(values)
        return d

    def absorb(self, other: Local) -> None:
        """Take over the variables and data of another kernel of as many instances."""
        self._variables += other._variables
        self._columns += other._columns
        self._symbols += other._symbols
        self._data += other._data
        self._inner += other._inner

    def between(self, combined: ca.SX) -> ca.SX:
        """Symbols for combinations of variables, through which derivatives take the chain rule.

        `combined` has to be linear in the variables; what is computed from few combinations of
        many variables has few second derivatives of its own.
        """
        y = ca.SX.sym("y", combined.numel())
        self._inner.append((y, combined))
        return y

    def block(
        self, name: str, context: Context, key: tuple[Any, ...],
        build: Callable[[], tuple[Any, Sequence[Any]]], ids: Integers,
        label: Callable[[int, int], RowName],
    ) -> Block:  # fmt: skip
        """The finished block.

        Parameters
        ----------
        key : tells the kernel from the others of the context that have this name and size.
        build : gives objective and rows of the kernel; not called where it is known already.
        """
        empty = np.empty((self.instances, 0))
        columns = np.hstack([empty.astype(np.int64), *self._columns])
        data = np.hstack([empty, *self._data])
        known = (name, *key, columns.shape[1], data.shape[1])
        if known not in context.kernels:
            context.kernels[known] = self._kernel(context, *build())
        return Block(name, context.kernels[known], columns, data, ids, label, context.native)

    def _kernel(self, context: Context, objective: Any, rows: Sequence[Any]) -> Kernel:
        w, d, c = ca.vertcat(*self._variables), ca.vertcat(*self._symbols), context.constants
        g = ca.vertcat(*rows) if rows else ca.SX(0, 1)
        f = ca.densify(ca.SX(objective))
        y = ca.vertcat(*[symbol for symbol, _ in self._inner], ca.SX(0, 1))
        combined = ca.vertcat(*[value for _, value in self._inner], ca.SX(0, 1))
        return Kernel(
            ca.Function("outer", [w, y, d, c], ca.cse([f, ca.densify(g)])),
            ca.Function("inner", [w, d], [ca.densify(combined)]),
        )


@dataclass(frozen=True, eq=False)
class Point:
    """Signals, time and interval length at one point of an interval, as local expressions."""

    signals: ca.SX
    time: Any
    length: Any
    unknowns: ca.SX
    rate_rows: Any = None


@dataclass(frozen=True, eq=False)
class Context:
    """What every kernel of a problem shares.

    Attributes
    ----------
    kernels : those built so far; they depend on no mesh.
    native : whether their derivatives are compiled.
    """

    problem: Problem
    signal_scales: Mapping[str, float]
    unknown_ids: Integers
    unknown_scales: tuple[float, ...]
    time_scale: float
    kernels: dict[tuple[Any, ...], Kernel] = field(default_factory=dict, repr=False)
    native: bool = False

    @property
    def constants(self) -> ca.SX:
        """Symbols of the named constants (n_k,)."""
        return ca.vertcat(*[c.symbol for c in self.problem.constants], ca.SX(0, 1))

    def scales(self, signals: Sequence[Any]) -> list[float]:
        """Sizes of signals."""
        return [self.signal_scales[s.name] for s in signals]

    def unknowns(self, local: Local) -> ca.SX:
        """Static unknowns as local variables."""
        if not self.unknown_scales:
            return ca.SX(0, 1)
        return local.variables(self.unknown_ids[None, :], self.unknown_scales)

    def expressions(self, layout: PhaseLayout, point: Point, wanted: Sequence[Any]) -> list[ca.SX]:
        """Expressions of the phase's signals at a point."""
        if not wanted:
            return []
        symbols = [s.symbol for s in layout.signals]
        unknowns = [u.symbol for u in self.problem.unknowns]
        f = ca.Function(
            "at", [ca.vertcat(*symbols, ca.SX(0, 1)), ca.vertcat(*unknowns, ca.SX(0, 1)),
                   time.symbol, self.constants],
            [ca.vertcat(*[ca.densify(ca.SX(e)) for e in wanted])],
        )  # fmt: skip
        return ca.vertsplit(f(point.signals, point.unknowns, point.time, self.constants))


def clock(
    context: Context, layout: PhaseLayout, local: Local, group: Group, intervals: Integers,
    tau: Array,
) -> tuple[Any, Any]:  # fmt: skip
    """Time and interval length at local times ``tau`` (instances,) of the group's intervals."""
    points = layout.mesh.breakpoints
    if layout.ends is None and not group.moving:  # all known: plain numbers
        start, end = layout.fixed_times
        h = np.diff(points)[intervals] * (end - start)
        t = start + points[intervals] * (end - start) + tau * h
        d = local.data(np.stack([t, h], axis=1))
        return d[0], d[1]
    if group.moving:
        ids = np.stack([layout.moved[intervals], layout.moved[intervals + 1]], axis=1)
        sides = local.variables(ids, [1.0, 1.0])
        at = sides[0] + local.data(tau[:, None]) * (sides[1] - sides[0])
        length = sides[1] - sides[0]
    else:
        d = local.data(np.stack([points[intervals] + tau * np.diff(points)[intervals],
                                 np.diff(points)[intervals]], axis=1))  # fmt: skip
        at, length = d[0], d[1]
    if layout.ends is None:
        begin: Any = layout.fixed_times[0]
        span: Any = layout.fixed_times[1] - begin
    else:
        ends = local.variables(layout.ends[None, :], [context.time_scale] * 2)
        begin, span = ends[0], ends[1] - ends[0]
    return begin + at * span, length * span


def collocation_point(
    context: Context, layout: PhaseLayout, group: Group
) -> tuple[Local, Point, Any]:
    """Local expressions at the collocation points of a group; one instance a point.

    Returns
    -------
    local, point
        ``point.rate_rows`` is the derivative of the state polynomial times the interval length.
    weight : SX
        Quadrature weight of the point on [0, 1].
    """
    method = group.scheme
    m, s = group.intervals.size, method.degree
    local = Local(m * s)
    intervals, tau = np.repeat(group.intervals, s), np.tile(method.points, m)
    others = np.array([[i for i in range(s + 1) if i != j] for j in method.own])
    own = group.support[:, method.own, :].reshape(m * s, -1)
    rest = group.support[:, others, :].reshape(m * s, -1)
    n_x = len(layout.states)
    scales = context.scales(layout.states)
    x = local.variables(own, scales)
    other = ca.reshape(local.variables(rest, scales * s), n_x, s)
    slopes = np.hstack([
        np.take_along_axis(method.derivative, method.own[:, None], axis=1),
        np.take_along_axis(method.derivative, others, axis=1),
    ])  # fmt: skip
    d = local.data(np.tile(slopes, (m, 1)))
    rate = d[0] * x + ca.mtimes(other, d[1:])
    weight = local.data(np.tile(method.weights, m)[:, None])
    controls = [
        local.variables(layout.steps[intervals], context.scales(layout.constant)),
        _linear(context, layout, local, intervals, tau),
        _polynomial(context, layout, local, group, np.repeat(np.arange(m), s), tau),
    ]
    z = local.variables(group.algebraics.reshape(m * s, -1), context.scales(layout.algebraics))
    t, h = clock(context, layout, local, group, intervals, tau)
    point = Point(ca.vertcat(x, *controls, z), t, h, context.unknowns(local), rate)
    return local, point, weight


def sample_point(
    context: Context, layout: PhaseLayout, group: Group, intervals: Integers, tau: Array
) -> tuple[Local, Point]:
    """Local expressions at arbitrary local times of some intervals of a group."""
    method, n = group.scheme, intervals.size
    local = Local(n)
    row = np.searchsorted(group.intervals, intervals)

    def interpolated(ids: Integers, signals: Sequence[Any], nodes: Array) -> Any:
        if not signals:
            return ca.SX(0, 1)
        return local.between(
            _combined(local, ids[row], context.scales(signals), lagrange(nodes, tau))
        )

    x = interpolated(group.support, layout.states, method.support)
    controls = [
        local.variables(layout.steps[intervals], context.scales(layout.constant)),
        _linear(context, layout, local, intervals, tau),
        local.between(_polynomial(context, layout, local, group, row, tau)),
    ]
    z = interpolated(group.algebraics, layout.algebraics, method.points)
    t, h = clock(context, layout, local, group, intervals, tau)
    return local, Point(ca.vertcat(x, *controls, z), t, h, context.unknowns(local))


def _polynomial(
    context: Context, layout: PhaseLayout, local: Local, group: Group, row: Integers, tau: Array
) -> Any:
    """Polynomial controls from their Bernstein coefficients, in rows of the group."""
    if not layout.polynomial:
        return ca.SX(0, 1)
    weights = bernstein(group.controls.shape[1], tau)
    return _combined(local, group.controls[row], context.scales(layout.polynomial), weights)


def _combined(local: Local, ids: Integers, scales: Sequence[float], weights: Array) -> Any:
    """Sums over unknowns ``ids`` (n, m, signals) weighted by numbers (n, m).

    Unknowns that have weight nowhere, as all but one at a support point, are left out.
    """
    used = np.any(weights != 0.0, axis=0)
    count = int(used.sum())
    values = local.variables(ids[:, used].reshape(len(ids), -1), list(scales) * count)
    return ca.mtimes(ca.reshape(values, len(scales), count), local.data(weights[:, used]))


def _linear(
    context: Context, layout: PhaseLayout, local: Local, intervals: Integers, tau: Array
) -> Any:
    if not layout.linear:
        return ca.SX(0, 1)
    scales = context.scales(layout.linear)
    left = local.variables(layout.ramps[intervals, 0], scales)
    right = local.variables(layout.ramps[intervals, 1], scales)
    d = local.data(np.stack([1.0 - tau, tau], axis=1))
    return d[0] * left + d[1] * right
