"""From a problem and a mesh to a nonlinear program."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.blocks import Block, Program, assemble
from ocp.continuous import Continuous, continuous_constraints
from ocp.errors import StatementError
from ocp.layout import PhaseLayout, lay_out
from ocp.limits import Limits
from ocp.local import Context, Local, collocation_point, sample_point
from ocp.mesh import PhaseMesh, with_points
from ocp.scaling import Scales
from ocp.schemes import SchemeName
from ocp.statement import Bound, Functional, Problem
from ocp.symbols import Between, Constant, ControlShape, resolve
from ocp.terminal import terminal_block

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
_SHORTEST = 0.02


@dataclass(frozen=True)
class Extra:
    """Points between the collocation points at which a continuous constraint is imposed too.

    Attributes
    ----------
    constraint : index into the phase's continuous constraints.
    intervals : (m,) intervals.
    tau : (m,) local times.
    """

    constraint: int
    intervals: Integers
    tau: Array


@dataclass(frozen=True)
class Mesh:
    """Meshes of all phases, with the extra points of their continuous constraints."""

    phases: tuple[PhaseMesh, ...]
    extra: tuple[tuple[Extra, ...], ...] = ()

    def __post_init__(self) -> None:
        if not self.extra:
            object.__setattr__(self, "extra", ((),) * len(self.phases))

    @property
    def intervals(self) -> int:
        """Intervals of all phases."""
        return sum(mesh.intervals for mesh in self.phases)


@dataclass(frozen=True)
class Method:
    """How signals are discretised."""

    scheme: SchemeName = "radau"
    control_shape: ControlShape = "polynomial"


@dataclass(frozen=True)
class Transcription:
    """A nonlinear program and the way back to the problem.

    Attributes
    ----------
    columns, rows : bounds of the unknowns and of the constraint rows.
    sizes : (n,) scale of each unknown.
    peak_ids : unknown of each peak.
    names : name of each row's block, by block, for messages.
    """

    problem: Problem
    mesh: Mesh
    method: Method
    scales: Scales
    layouts: tuple[PhaseLayout, ...]
    constraints: tuple[tuple[Continuous, ...], ...]
    blocks: tuple[Block, ...]
    program: Program
    columns: Limits
    rows: Limits
    sizes: Array
    unknown_ids: Integers
    peak_ids: Mapping[Functional, int] = field(default_factory=dict)


def transcribe(problem: Problem, mesh: Mesh, method: Method, scales: Scales) -> Transcription:
    """Build the nonlinear program of a problem on a mesh.

    Raises
    ------
    StatementError
        When the statement cannot be transcribed.
    """
    mesh = with_instants(problem, mesh)
    weights = inline_weights(problem)
    layouts, first = [], 0
    for phase, phase_mesh in zip(problem.phases, mesh.phases, strict=True):
        chained = tuple(
            f for f in problem.functionals
            if f.kind == "integral" and f.pieces[0][0] == phase.name and f not in weights
        )  # fmt: skip
        layouts.append(lay_out(
            problem, phase, phase_mesh, method.scheme, method.control_shape, chained, first))
        first = layouts[-1].stop
    unknown_ids = first + np.arange(len(problem.unknowns))
    first += unknown_ids.size
    peaks = [f for f in problem.functionals if f.kind == "peak"]
    peak_ids = {f: first + i for i, f in enumerate(peaks)}
    context = Context(
        problem, scales.signals, unknown_ids,
        tuple(scales.unknowns[u.name] for u in problem.unknowns), scales.time,
    )  # fmt: skip
    constraints = tuple(continuous_constraints(problem, lay, scales) for lay in layouts)
    columns, sizes = _column_limits(problem, layouts, unknown_ids, peak_ids, scales,
                                    first + len(peaks))  # fmt: skip
    rows, blocks = Limits(), []
    for layout, found, extra in zip(layouts, constraints, mesh.extra, strict=True):
        blocks += _phase_blocks(context, layout, found, scales, weights, peak_ids, rows, extra)
    blocks.append(terminal_block(context, layouts, scales, weights, peak_ids, rows))
    program = assemble(blocks, columns.count, rows.count, len(problem.constants))
    return Transcription(
        problem, mesh, method, scales, tuple(layouts), constraints, tuple(blocks), program,
        columns, rows, sizes, unknown_ids, peak_ids,
    )  # fmt: skip


def with_instants(problem: Problem, mesh: Mesh) -> Mesh:
    """The mesh with a breakpoint at every instant that `Phase.at` names."""
    phases = []
    for phase, phase_mesh in zip(problem.phases, mesh.phases, strict=True):
        instants = [f.at for f in problem.functionals
                    if f.kind == "value" and f.pieces[0][0] == phase.name]  # fmt: skip
        if instants and not isinstance(phase.start, Between) and not isinstance(phase.end, Between):
            span = phase.end - phase.start
            fractions = (np.array(instants, dtype=float) - phase.start) / span
            phase_mesh = with_points(phase_mesh, fractions)
        phases.append(phase_mesh)
    if all(a is b for a, b in zip(phases, mesh.phases, strict=True)):
        return mesh
    if any(mesh.extra):
        same = [a.intervals == b.intervals for a, b in zip(phases, mesh.phases, strict=True)]
        if all(same):
            return mesh
    return Mesh(tuple(phases))


def inline_weights(problem: Problem) -> dict[Functional, ca.SX]:
    """Weights of the integrals that enter the objective linearly and nothing else."""
    elsewhere = {s for b in (*problem.bounds, *problem.links)
                 for s in resolve(b.expression, b.name)}  # fmt: skip
    weights = {}
    for f in problem.functionals:
        if f.kind == "integral" and f not in elsewhere:
            weight = ca.jacobian(problem.objective, f.symbol)
            symbols = resolve(weight, "a weight")
            if all(isinstance(s, Constant) for s in symbols):
                weights[f] = ca.densify(weight)
    return weights


def _column_limits(
    problem: Problem,
    layouts: Sequence[PhaseLayout],
    unknown_ids: Integers,
    peak_ids: Mapping[Functional, int],
    scales: Scales,
    count: int,
) -> tuple[Limits, Array]:
    columns, sizes = Limits(), np.ones(count)
    columns.count = count

    def put(ids: Any, lower: Any, upper: Any, scale: float) -> None:
        columns.bound(np.asarray(ids), lower, upper, scale)
        sizes[np.asarray(ids).ravel()] = scale

    for layout in layouts:
        phase = layout.phase
        for j, state in enumerate(layout.states):
            size = scales.signals[state.name]
            for group in layout.groups:
                put(group.support[:, :, j], state.lower, state.upper, size)
            put(layout.nodes[:, j], state.lower, state.upper, size)
            for node, values in ((0, phase.initial), (-1, phase.final)):
                value = values.get(state)
                if value is not None:
                    pair = value if isinstance(value, tuple) else (value, value)
                    put(layout.nodes[node, j], *pair, size)
        for signals, ids in ((layout.constant, layout.steps), (layout.linear, layout.ramps)):
            for j, control in enumerate(signals):
                put(ids[..., j], control.lower, control.upper, scales.signals[control.name])
        for group in layout.groups:
            for signals, ids in ((layout.polynomial, group.controls),
                                 (layout.algebraics, group.algebraics)):  # fmt: skip
                for j, s in enumerate(signals):
                    put(ids[:, :, j], s.lower, s.upper, scales.signals[s.name])
        for j, f in enumerate(layout.integrals):
            put(layout.totals[1:, j], -np.inf, np.inf, scales.functionals[f])
            put(layout.totals[0, j], 0.0, 0.0, scales.functionals[f])
        if layout.ends is not None:
            for column, value in zip(layout.ends, (phase.start, phase.end), strict=True):
                free = isinstance(value, Between)
                low, high = (value.lower, value.upper) if free else (value, value)  # type: ignore[union-attr]
                put(column, low, high, scales.time)
        for i in np.flatnonzero(layout.moved >= 0):
            at = float(layout.mesh.breakpoints[i])
            put(layout.moved[i], *((0.0, 1.0) if i in layout.mesh.movable else (at, at)), 1.0)
    for unknown, column in zip(problem.unknowns, unknown_ids, strict=True):
        put(column, unknown.lower, unknown.upper, scales.unknowns[unknown.name])
    for f, column in peak_ids.items():
        lower = 0.0 if f.absolute else -np.inf
        put(column, lower, np.inf, scales.functionals[f])
    return columns, sizes


def _phase_blocks(
    context: Context, layout: PhaseLayout, found: Sequence[Continuous], scales: Scales,
    weights: Mapping[Functional, ca.SX], peak_ids: Mapping[Functional, int], rows: Limits,
    extra: Sequence[Extra],
) -> list[Block]:  # fmt: skip
    totals = rows.take(layout.intervals, [(0.0, 0.0, 1.0)] * len(layout.integrals))
    blocks = [
        _collocation_block(context, layout, group, found, scales, weights, peak_ids, rows, totals)
        for group in layout.groups
    ]
    blocks += _connection_blocks(context, layout, scales, rows, totals)
    for points in (*boundary_points(layout, found), *extra):
        for group in layout.groups:
            here = np.isin(points.intervals, group.intervals)
            if here.any():
                blocks.append(_sample_block(
                    context, layout, group, found[points.constraint], peak_ids, rows,
                    points.intervals[here], points.tau[here]))  # fmt: skip
    return blocks


def boundary_points(layout: PhaseLayout, found: Sequence[Continuous]) -> list[Extra]:
    """The ends of the phase, where the scheme has no collocation point there."""
    points = []
    first, last = layout.groups[0].scheme.points[0], layout.groups[0].scheme.points[-1]
    for i, constraint in enumerate(found):
        if constraint.sampled and not constraint.is_equation:
            if first != 0.0:
                points.append(Extra(i, np.array([0]), np.array([0.0])))
            if last != 1.0:
                points.append(Extra(i, np.array([layout.intervals - 1]), np.array([1.0])))
    return points


def _collocation_block(
    context: Context, layout: PhaseLayout, group: Any, found: Sequence[Continuous],
    scales: Scales, weights: Mapping[Functional, ca.SX], peak_ids: Mapping[Functional, int],
    rows: Limits, totals: Integers,
) -> Block:  # fmt: skip
    phase, method = layout.phase, group.scheme
    local, point, quadrature = collocation_point(context, layout, group)
    inlined = [f for f in weights if f.pieces[0][0] == phase.name]
    sampled = [c for c in found if c.sampled]
    values = context.expressions(layout, point, [
        *phase.dynamics.values(), *[f.pieces[0][1] for f in inlined],
        *[f.pieces[0][1] for f in layout.integrals], *[c.expression for c in sampled]])  # fmt: skip
    n_x, n_w, n_q = len(layout.states), len(inlined), len(layout.integrals)
    rates, costs = values[:n_x], values[n_x : n_x + n_w]
    chains, paths = values[n_x + n_w : n_x + n_w + n_q], values[n_x + n_w + n_q :]
    measure = quadrature * point.length
    objective = sum((weights[f] * measure * v for f, v in zip(inlined, costs, strict=True)),
                    ca.SX(0)) / scales.objective  # fmt: skip
    sizes = context.scales(layout.states)
    expressions = [
        (point.rate_rows[j] - point.length * rates[j]) / sizes[j] for j in range(n_x)
    ] + [path_row(c, v, local, peak_ids) for c, v in zip(sampled, paths, strict=True)]
    ids = rows.take(local.instances, [(0.0, 0.0, 1.0)] * n_x
                    + [(c.lower, c.upper, c.scale) for c in sampled])  # fmt: skip
    expressions += [
        -measure * v / scales.functionals[f]
        for f, v in zip(layout.integrals, chains, strict=True)
    ]
    ids = np.hstack([ids, np.repeat(totals[group.intervals], method.degree, axis=0)])
    label = _collocation_label(layout, group, sampled)
    return local.block(f"{phase.name}: collocation", context.constants, objective, expressions,
                       ids, label)  # fmt: skip


def path_row(
    constraint: Continuous, value: ca.SX, local: Local, peak_ids: Mapping[Functional, int]
) -> ca.SX:
    """The scaled row of a continuous constraint."""
    row = constraint.sign * value / constraint.scale
    if constraint.peak is not None:
        ids = np.array([[peak_ids[constraint.peak]]])
        row = row - local.variables(ids, [constraint.scale]) / constraint.scale
    return row


def _collocation_label(
    layout: PhaseLayout, group: Any, sampled: Sequence[Continuous]
) -> Any:
    degree, points, mesh = group.scheme.degree, group.scheme.points, layout.mesh
    names = [f"dynamics of '{s.name}'" for s in layout.states]
    names += [f"'{c.name}'" for c in sampled] + [f"integral '{f.name}'" for f in layout.integrals]

    def label(instance: int, row: int) -> str:
        k, j = group.intervals[instance // degree], instance % degree
        left, right = mesh.breakpoints[k : k + 2]
        at = left + points[j] * (right - left)
        return f"{names[row]} in phase '{layout.phase.name}' at {100 * at:.3g} % of its duration"

    return label


def _connection_blocks(
    context: Context, layout: PhaseLayout, scales: Scales, rows: Limits, totals: Integers
) -> list[Block]:
    """Ends of intervals, running integrals and the order of the arc ends."""
    blocks, phase = [], layout.phase
    for group in layout.groups:
        if not group.scheme.ends_on_support:
            local = Local(group.intervals.size)
            n_x, s = len(layout.states), group.scheme.support.size
            values = local.variables(group.support.reshape(local.instances, -1), [1.0] * n_x * s)
            end = local.variables(layout.nodes[group.intervals + 1], [1.0] * n_x)
            row = end - ca.mtimes(ca.reshape(values, n_x, s), ca.DM(group.scheme.end))
            ids = rows.take(local.instances, [(0.0, 0.0, 1.0)] * n_x)
            blocks.append(local.block(
                f"{phase.name}: ends", context.constants, 0, [row], ids,
                _simple_label(f"continuity in phase '{phase.name}'")))  # fmt: skip
    if layout.integrals:
        local, n_q = Local(layout.intervals), len(layout.integrals)
        left = local.variables(layout.totals[:-1], [1.0] * n_q)
        right = local.variables(layout.totals[1:], [1.0] * n_q)
        blocks.append(local.block(
            f"{phase.name}: integrals", context.constants, 0, [right - left], totals,
            _simple_label(f"an integral in phase '{phase.name}'")))  # fmt: skip
    if layout.ends is not None:
        local = Local(1)
        ends = local.variables(layout.ends[None, :], [1.0, 1.0])
        blocks.append(local.block(
            f"{phase.name}: duration", context.constants, 0, [ends[1] - ends[0]],
            rows.take(1, [(0.0, np.inf, 1.0)]),
            _simple_label(f"duration of phase '{phase.name}'")))  # fmt: skip
    moving = np.flatnonzero(layout.mesh.moving)
    if moving.size:
        local = Local(moving.size)
        sides = local.variables(
            np.stack([layout.moved[moving], layout.moved[moving + 1]], axis=1), [1.0, 1.0])  # fmt: skip
        width = local.data(np.diff(layout.mesh.breakpoints)[moving][:, None])
        blocks.append(local.block(
            f"{phase.name}: breakpoints", context.constants, 0,
            [(sides[1] - sides[0]) / width], rows.take(moving.size, [(_SHORTEST, np.inf, 1.0)]),
            _simple_label(f"order of the breakpoints in phase '{phase.name}'")))  # fmt: skip
    return blocks


def _simple_label(text: str) -> Any:
    return lambda instance, row: text


def _sample_block(
    context: Context, layout: PhaseLayout, group: Any, constraint: Continuous,
    peak_ids: Mapping[Functional, int], rows: Limits, intervals: Integers, tau: Array,
) -> Block:  # fmt: skip
    local, point = sample_point(context, layout, group, intervals, tau)
    (value,) = context.expressions(layout, point, [constraint.expression])
    row = path_row(constraint, value, local, peak_ids)
    ids = rows.take(local.instances, [(constraint.lower, constraint.upper, constraint.scale)])
    points = layout.mesh.breakpoints

    def label(instance: int, row: int) -> str:
        k = intervals[instance]
        at = points[k] + tau[instance] * (points[k + 1] - points[k])
        return (f"'{constraint.name}' in phase '{layout.phase.name}' at {100 * at:.3g} % of "
                "its duration")  # fmt: skip

    return local.block(f"{layout.phase.name}: {constraint.name}", context.constants, 0, [row],
                       ids, label)  # fmt: skip


def check_bound_of_peak(bound: Bound) -> None:
    """A peak can be bounded from above only."""
    for symbol in resolve(bound.expression, bound.name):
        if isinstance(symbol, Functional) and symbol.kind == "peak":
            slope = ca.jacobian(bound.expression, symbol.symbol)
            if slope.is_constant() and float(slope) > 0 and np.isfinite(float(bound.lower)):
                raise StatementError(
                    f"the bound '{bound.name}' limits the peak '{symbol.name}' from below; a "
                    "peak can be limited from above only"
                )
