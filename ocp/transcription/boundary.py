"""The objective, the bounds and the links of a problem: one kernel over end values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import casadi as ca
import numpy as np

from ocp.problem.terms import Functional
from ocp.transcription.kernel_builder import Context, Local, Point, sample_point
from ocp.transcription.kernels import Block, RowName
from ocp.transcription.limits import Limits
from ocp.transcription.scaling import Scales
from ocp.transcription.variables import PhaseLayout


def terminal_block(
    context: Context,
    layouts: Sequence[PhaseLayout],
    scales: Scales,
    weights: Mapping[Functional, ca.SX],
    peak_ids: Mapping[Functional, int],
    rows: Limits,
) -> Block:
    """Objective (without inlined integrals), bounds and links."""
    problem = context.problem
    local = Local(1)
    unknowns = context.unknowns(local)
    named = {layout.phase.name: layout for layout in layouts}
    values = [
        ca.SX(0) if f in weights else _value(context, local, named, f, unknowns, scales, peak_ids)
        for f in problem.functionals
    ]
    bounds = (*problem.bounds, *problem.links)
    sizes = [scales.bounds["", b.name] for b in bounds]

    def build() -> tuple[Any, list[Any]]:
        expressions = [problem.objective / scales.objective]
        expressions += [b.expression / size for b, size in zip(bounds, sizes, strict=True)]
        inputs = [f.symbol for f in problem.functionals]
        f = ca.Function(
            "terminal",
            [ca.vertcat(*inputs, ca.SX(0, 1)),
             ca.vertcat(*[u.symbol for u in problem.unknowns], ca.SX(0, 1)), context.constants],
            [ca.vertcat(*expressions)],
        )  # fmt: skip
        out = f(ca.vertcat(*values, ca.SX(0, 1)), unknowns, context.constants)
        return out[0], [out[1:]] if bounds else []

    ids = rows.take(1, [(b.lower, b.upper, s) for b, s in zip(bounds, sizes, strict=True)])
    key = tuple(_groups(layout, problem.functionals) for layout in layouts)
    return local.block(
        "terminal", context, key, build, ids,
        lambda _, n: RowName(f"'{bounds[n].name}'", unit=bounds[n].unit, size=sizes[n]),
    )  # fmt: skip


def _groups(layout: PhaseLayout, functionals: Sequence[Functional]) -> tuple[Any, ...]:
    """Degree and mobility of the intervals at whose ends a value may be taken."""
    nodes = [_node(layout, f) for f in functionals if f.pieces[0][0] == layout.phase.name]
    mesh = layout.mesh
    return tuple((int(mesh.degrees[k]), bool(mesh.moving[k])) for k in map(_before, nodes))


def _before(node: int) -> int:
    """The interval on the left of a breakpoint, the first one at the start."""
    return max(node - 1, 0)


def _node(layout: PhaseLayout, f: Functional) -> int:
    """The breakpoint at which a value is taken."""
    if f.kind == "value" and f.at is not None:
        start, end = layout.fixed_times
        at = (f.at - start) / (end - start)
        return int(np.argmin(np.abs(layout.mesh.breakpoints - at)))
    return 0 if f.kind == "start" else layout.intervals


def _value(
    context: Context,
    local: Local,
    layouts: Mapping[str, PhaseLayout],
    f: Functional,
    unknowns: ca.SX,
    scales: Scales,
    peak_ids: Mapping[Functional, int],
) -> Any:
    """A functional as an expression of local variables."""
    if f.kind == "peak":
        return local.variables(np.array([[peak_ids[f]]]), [scales.functionals[f]])
    name, expression = f.pieces[0]
    layout = layouts[name]
    if f.kind == "integral":
        column = layout.totals[-1:, [layout.integrals.index(f)]]
        return local.variables(column, [scales.functionals[f]])
    if f.kind in ("start time", "end time"):
        return _instant(local, layout, 0 if f.kind == "start time" else -1, scales)
    node = _node(layout, f)
    point = _at_node(context, local, layout, node, unknowns, scales, f)
    return context.expressions(layout, point, [expression])[0]


def _instant(local: Local, layout: PhaseLayout, end: int, scales: Scales) -> Any:
    if layout.ends is None:
        return ca.SX(layout.fixed_times[end])
    return local.variables(layout.ends[[end]][None, :], [scales.time])


def _at_node(
    context: Context, local: Local, layout: PhaseLayout, node: int, unknowns: ca.SX,
    scales: Scales, f: Functional,
) -> Point:  # fmt: skip
    """Signals at a breakpoint; controls as in the interval on its left (right at the start)."""
    if {s.name for s in f.symbols} & {c.name for c in layout.signals[len(layout.states) :]}:
        interval, tau = _before(node), 0.0 if node == 0 else 1.0
        group = next(g for g in layout.groups if interval in g.intervals)
        sub, point = sample_point(context, layout, group, np.array([interval]), np.array([tau]))
        local.absorb(sub)
        return Point(point.signals, point.time, point.length, unknowns)
    x = local.variables(layout.nodes[[node]], context.scales(layout.states))
    rest = ca.SX.zeros(len(layout.signals) - len(layout.states))
    t = f.at if f.kind == "value" else _instant(local, layout, 0 if node == 0 else -1, scales)
    return Point(ca.vertcat(x, rest), t, ca.SX(0), unknowns)
