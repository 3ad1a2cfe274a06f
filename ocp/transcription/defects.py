"""The blocks of one phase: collocation, connections, extra points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.mesh.mesh import Extra
from ocp.problem.terms import Functional
from ocp.transcription.kernel_builder import Context, Local, collocation_point, sample_point
from ocp.transcription.kernels import Block, RowName
from ocp.transcription.limits import Limits
from ocp.transcription.path_constraints import Continuous
from ocp.transcription.scaling import Scales
from ocp.transcription.variables import PhaseLayout

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
_SHORTEST = 0.02


def phase_blocks(
    context: Context, layout: PhaseLayout, found: Sequence[Continuous], scales: Scales,
    weights: Mapping[Functional, ca.SX], peak_ids: Mapping[Functional, int], rows: Limits,
    extra: Sequence[Extra],
) -> list[Block]:  # fmt: skip
    """All blocks of a phase; takes their rows."""
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
                    context, layout, group, found, points.constraint, peak_ids, rows,
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
    n_x, n_w, n_q = len(layout.states), len(inlined), len(layout.integrals)
    peaks = [_peak(c, local, peak_ids) for c in sampled]
    sizes = context.scales(layout.states)

    def build() -> tuple[Any, list[Any]]:
        values = context.expressions(layout, point, [
            *phase.dynamics.values(), *[f.pieces[0][1] for f in inlined],
            *[f.pieces[0][1] for f in layout.integrals],
            *[c.expression for c in sampled]])  # fmt: skip
        rates, costs = values[:n_x], values[n_x : n_x + n_w]
        chains, paths = values[n_x + n_w : n_x + n_w + n_q], values[n_x + n_w + n_q :]
        measure = quadrature * point.length
        objective = sum((weights[f] * measure * v for f, v in zip(inlined, costs, strict=True)),
                        ca.SX(0)) / scales.objective  # fmt: skip
        expressions = [
            (point.rate_rows[j] - point.length * rates[j]) / sizes[j] for j in range(n_x)
        ]
        expressions += [_path_row(c, v, p) for c, v, p in zip(sampled, paths, peaks, strict=True)]
        expressions += [
            -measure * v / scales.functionals[f]
            for f, v in zip(layout.integrals, chains, strict=True)
        ]
        return objective, expressions

    ids = rows.take(local.instances, [(0.0, 0.0, 1.0)] * n_x
                    + [(c.lower, c.upper, c.scale) for c in sampled])  # fmt: skip
    ids = np.hstack([ids, np.repeat(totals[group.intervals], method.degree, axis=0)])
    label = _collocation_label(layout, group, sampled, scales)
    return local.block(f"{phase.name}: collocation", context, (method.degree, group.moving), build,
                       ids, label)  # fmt: skip


def _peak(constraint: Continuous, local: Local, peak_ids: Mapping[Functional, int]) -> Any:
    """The peak that bounds a constraint from above, 0 where there is none."""
    if constraint.peak is None:
        return 0
    return local.variables(np.array([[peak_ids[constraint.peak]]]), [constraint.scale])


def _path_row(constraint: Continuous, value: ca.SX, peak: Any) -> ca.SX:
    """The scaled row of a continuous constraint."""
    return (constraint.sign * value - peak) / constraint.scale


def _collocation_label(
    layout: PhaseLayout, group: Any, sampled: Sequence[Continuous], scales: Scales
) -> Any:
    degree, points, mesh = group.scheme.degree, group.scheme.points, layout.mesh
    names = [(f"dynamics of '{s.name}'", s.unit, scales.signals[s.name]) for s in layout.states]
    names += [(f"'{c.name}'", c.unit, c.scale) for c in sampled]
    names += [(f"integral '{f.name}'", f.unit, scales.functionals[f]) for f in layout.integrals]

    def label(instance: int, row: int) -> RowName:
        k, j = group.intervals[instance // degree], instance % degree
        left, right = mesh.breakpoints[k : k + 2]
        what, unit, size = names[row]
        return RowName(what, layout.phase.name, left + points[j] * (right - left), unit, size)

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
            gap = end - ca.mtimes(ca.reshape(values, n_x, s), ca.DM(group.scheme.end))
            ids = rows.take(local.instances, [(0.0, 0.0, 1.0)] * n_x)
            blocks.append(local.block(
                f"{phase.name}: ends", context, (s,), partial(_rows_alone, gap), ids,
                _simple_label("continuity", phase.name)))  # fmt: skip
    if layout.integrals:
        local, n_q = Local(layout.intervals), len(layout.integrals)
        left = local.variables(layout.totals[:-1], [1.0] * n_q)
        right = local.variables(layout.totals[1:], [1.0] * n_q)
        blocks.append(local.block(
            f"{phase.name}: integrals", context, (), partial(_rows_alone, right - left), totals,
            _simple_label("an integral", phase.name)))  # fmt: skip
    if layout.ends is not None:
        local = Local(1)
        ends = local.variables(layout.ends[None, :], [1.0, 1.0])
        blocks.append(local.block(
            f"{phase.name}: duration", context, (), partial(_rows_alone, ends[1] - ends[0]),
            rows.take(1, [(0.0, np.inf, 1.0)]),
            _simple_label("duration", phase.name, "s", scales.time)))  # fmt: skip
    moving = np.flatnonzero(layout.mesh.moving)
    if moving.size:
        local = Local(moving.size)
        sides = local.variables(
            np.stack([layout.moved[moving], layout.moved[moving + 1]], axis=1), [1.0, 1.0]
        )
        width = local.data(np.diff(layout.mesh.breakpoints)[moving][:, None])
        blocks.append(local.block(
            f"{phase.name}: breakpoints", context, (),
            partial(_rows_alone, (sides[1] - sides[0]) / width),
            rows.take(moving.size, [(_SHORTEST, np.inf, 1.0)]),
            _simple_label("order of the breakpoints", phase.name)))  # fmt: skip
    return blocks


def _rows_alone(rows: Any) -> tuple[Any, list[Any]]:
    return 0, [rows]


def _simple_label(what: str, phase: str, unit: str = "", size: float = 1.0) -> Any:
    return lambda instance, row: RowName(what, phase, None, unit, size)


def _sample_block(
    context: Context, layout: PhaseLayout, group: Any, found: Sequence[Continuous],
    index: int, peak_ids: Mapping[Functional, int], rows: Limits, intervals: Integers, tau: Array,
) -> Block:  # fmt: skip
    local, point = sample_point(context, layout, group, intervals, tau)
    constraint = found[index]
    peak = _peak(constraint, local, peak_ids)

    def build() -> tuple[Any, list[Any]]:
        (value,) = context.expressions(layout, point, [constraint.expression])
        return 0, [_path_row(constraint, value, peak)]

    ids = rows.take(local.instances, [(constraint.lower, constraint.upper, constraint.scale)])
    points = layout.mesh.breakpoints

    def label(instance: int, row: int) -> RowName:
        k = intervals[instance]
        at = points[k] + tau[instance] * (points[k + 1] - points[k])
        return RowName(f"'{constraint.name}'", layout.phase.name, at, constraint.unit,
                       constraint.scale)  # fmt: skip

    key = (index, group.scheme.degree, group.moving)
    name = f"{layout.phase.name}: {constraint.name}"
    return local.block(name, context, key, build, ids, label)
