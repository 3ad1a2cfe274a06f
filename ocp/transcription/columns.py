"""Bounds and scales of the unknowns of a nonlinear program."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ocp.problem.statement import Problem
from ocp.problem.symbols import Between
from ocp.problem.terms import Functional
from ocp.transcription.limits import Limits
from ocp.transcription.scaling import Scales
from ocp.transcription.variables import PhaseLayout

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


class Columns:
    """Limits of all unknowns together with their sizes."""

    def __init__(self, count: int) -> None:
        self.limits = Limits(count)
        self.sizes: Array = np.ones(count)

    def put(self, ids: Any, lower: Any, upper: Any, size: float) -> None:
        """Bounds, in the user's unit, and size of some unknowns."""
        self.limits.bound(np.asarray(ids), lower, upper, size)
        self.sizes[np.asarray(ids).ravel()] = size


def columns_of(
    problem: Problem,
    layouts: Sequence[PhaseLayout],
    unknown_ids: Integers,
    peak_ids: Mapping[Functional, int],
    scales: Scales,
    count: int,
) -> Columns:
    """Bounds and sizes of all unknowns of a problem."""
    columns = Columns(count)
    for layout in layouts:
        _put_states(columns, layout, scales)
        _put_controls(columns, layout, scales)
        _put_clock(columns, layout, scales)
    for unknown, column in zip(problem.unknowns, unknown_ids, strict=True):
        columns.put(column, unknown.lower, unknown.upper, scales.unknowns[unknown.name])
    for f, column in peak_ids.items():
        columns.put(column, 0.0 if f.absolute else -np.inf, np.inf, scales.functionals[f])
    return columns


def _put_states(columns: Columns, layout: PhaseLayout, scales: Scales) -> None:
    phase = layout.phase
    for j, state in enumerate(layout.states):
        size = scales.signals[state.name]
        for group in layout.groups:
            columns.put(group.support[:, :, j], state.lower, state.upper, size)
        columns.put(layout.nodes[:, j], state.lower, state.upper, size)
        for node, values in ((0, phase.initial), (-1, phase.final)):
            value = values.get(state)
            if value is not None:
                low, high = value if isinstance(value, tuple) else (value, value)
                columns.limits.narrow(layout.nodes[node, j], low, high, size)
    for j, f in enumerate(layout.integrals):
        size = scales.functionals[f]
        columns.put(layout.totals[1:, j], -np.inf, np.inf, size)
        columns.put(layout.totals[0, j], 0.0, 0.0, size)


def _put_controls(columns: Columns, layout: PhaseLayout, scales: Scales) -> None:
    held: list[tuple[Sequence[Any], Integers]] = [
        (layout.constant, layout.steps),
        (layout.linear, layout.ramps),
    ]
    for group in layout.groups:
        held += [(layout.polynomial, group.controls), (layout.algebraics, group.algebraics)]
    for signals, ids in held:
        for j, signal in enumerate(signals):
            columns.put(ids[..., j], signal.lower, signal.upper, scales.signals[signal.name])


def _put_clock(columns: Columns, layout: PhaseLayout, scales: Scales) -> None:
    phase = layout.phase
    if layout.ends is not None:
        for column, value in zip(layout.ends, (phase.start, phase.end), strict=True):
            if isinstance(value, Between):
                columns.put(column, value.lower, value.upper, scales.time)
            else:
                columns.put(column, value, value, scales.time)
    for i in np.flatnonzero(layout.moved >= 0):
        at = float(layout.mesh.breakpoints[i])
        low, high = (0.0, 1.0) if i in layout.mesh.movable else (at, at)
        columns.put(layout.moved[i], low, high, 1.0)
