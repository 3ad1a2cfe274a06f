"""Between decision vectors and trajectories."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ocp.mesh.initial_guess import Start
from ocp.mesh.trajectory import PhaseTrajectory, Piece, Trajectory
from ocp.numerics.schemes import bernstein
from ocp.transcription.kernels import Block, evaluated
from ocp.transcription.transcribe import Transcription
from ocp.transcription.variables import Group, PhaseLayout

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
_INSIDE = 1e-9


def decision_vector(
    transcription: Transcription, start: Start, constants: Mapping[str, float]
) -> Array:
    """Scaled decision vector that represents a start as well as the mesh allows."""
    x = np.zeros(transcription.columns.count)
    for layout in transcription.layouts:
        _fill_phase(x, layout, start)
    for unknown, column in zip(
        transcription.problem.unknowns, transcription.unknown_ids, strict=True
    ):
        x[column] = start.unknowns[unknown.name]
    x /= transcription.sizes
    lower, upper = transcription.columns.evaluate(constants)
    x = np.clip(x, lower, upper)
    _fill_totals(x, transcription, constants)
    for column in transcription.peak_ids.values():
        x[column] = _peak(transcription, x, column, constants)
    return np.asarray(np.clip(x, lower, upper))


def _fill_totals(x: Array, transcription: Transcription, constants: Mapping[str, float]) -> None:
    """Running totals that fit the start: with all totals zero their rows hold the increments."""
    blocks = {block.name: block for block in transcription.blocks}
    if not any(layout.integrals for layout in transcription.layouts):
        return
    rows = _rows(transcription, transcription.blocks, x, constants)
    for layout in transcription.layouts:
        if layout.integrals:
            increments = -rows[blocks[f"{layout.phase.name}: integrals"].rows]
            x[layout.totals[1:]] = np.cumsum(np.nan_to_num(increments), axis=0)


def _fill_phase(x: Array, layout: PhaseLayout, start: Start) -> None:
    own, points = start.phases[layout.phase.name], layout.mesh.breakpoints
    for group in layout.groups:
        left, width = points[group.intervals], np.diff(points)[group.intervals]
        support = left[:, None] + np.clip(group.scheme.support, 0.0, 1.0) * width[:, None]
        inner = left[:, None] + (0.5 + (group.scheme.points - 0.5) * (1 - _INSIDE)) * width[:, None]
        values = own.at_fractions(support.ravel())
        for j, state in enumerate(layout.states):
            x[group.support[:, :, j]] = values[state.name].reshape(support.shape)
        values = own.at_fractions(inner.ravel())
        basis = np.linalg.pinv(bernstein(group.controls.shape[1], group.scheme.points))
        for j, control in enumerate(layout.polynomial):
            x[group.controls[:, :, j]] = values[control.name].reshape(inner.shape) @ basis.T
        for j, signal in enumerate(layout.algebraics):
            x[group.algebraics[:, :, j]] = values[signal.name].reshape(inner.shape)
    values = own.at_fractions(points)
    for j, state in enumerate(layout.states):
        x[layout.nodes[:, j]] = values[state.name]
    inside = np.array([_INSIDE, 1.0 - _INSIDE])
    ends = own.at_fractions((points[:-1, None] + inside * np.diff(points)[:, None]).ravel())
    for j, control in enumerate(layout.linear):
        x[layout.ramps[:, :, j]] = ends[control.name].reshape(-1, 2)
    middle = own.at_fractions(0.5 * (points[:-1] + points[1:]))
    for j, control in enumerate(layout.constant):
        x[layout.steps[:, j]] = middle[control.name]
    if layout.ends is not None:
        x[layout.ends] = own.start, own.end
    here = layout.moved >= 0
    x[layout.moved[here]] = points[here]


def _peak(
    transcription: Transcription, x: Array, column: int, constants: Mapping[str, float]
) -> float:
    """Largest value over the rows of a peak, a little above it: a feasible epigraph value."""
    touching = [b for b in transcription.blocks if np.any(b.columns == column)]
    trial = x.copy()
    trial[column] = 0.0
    g = _rows(transcription, touching, trial, constants)
    upper = transcription.rows.evaluate(constants)[1]
    rows = _rows_of(touching, column)
    tight = g[rows[upper[rows] == 0.0]]
    return float(max(tight[np.isfinite(tight)], default=1.0))


def _rows(
    transcription: Transcription, blocks: Sequence[Block], x: Array,
    constants: Mapping[str, float],
) -> Array:  # fmt: skip
    """The constraint vector as far as some blocks make it up."""
    values = np.array([constants[c.name] for c in transcription.problem.constants])
    return evaluated(blocks, x, values, transcription.rows.count)[1]


def _rows_of(blocks: Sequence[Block], column: int) -> Integers:
    """The rows of some blocks that depend on an unknown."""
    found = [np.empty(0, dtype=np.int64)]
    for block in blocks:
        own, local = block.kernel.pattern
        found.append(block.rows[:, own][block.columns[:, local] == column])
    return np.concatenate(found)


def trajectory_of(
    transcription: Transcription, x: Array, constants: Mapping[str, float]
) -> Trajectory:
    """The trajectory that a decision vector stands for."""
    values = x * transcription.sizes
    phases = tuple(_phase_trajectory(layout, values) for layout in transcription.layouts)
    unknowns = {
        u.name: float(values[column])
        for u, column in zip(transcription.problem.unknowns, transcription.unknown_ids, strict=True)
    }
    peaks = tuple(float(values[column]) for column in transcription.peak_ids.values())
    return Trajectory(phases, unknowns, dict(constants), peaks)


def _phase_trajectory(layout: PhaseLayout, values: Array) -> PhaseTrajectory:
    mesh = layout.mesh
    fractions, here = mesh.breakpoints.copy(), layout.moved >= 0
    fractions[here] = values[layout.moved[here]]
    if layout.ends is None:
        begin, end = layout.fixed_times
    else:
        begin, end = values[layout.ends]
    breakpoints = begin + fractions * (end - begin)

    def piece(groups: Sequence[Group]) -> Piece:
        order = np.argsort(np.concatenate([g.intervals for g in groups]))

        def together(what: str) -> Any:
            return np.concatenate([getattr(g, what) for g in groups])[order]

        controls = values[together("controls")]
        basis = bernstein(controls.shape[1], groups[0].scheme.points)
        return Piece(
            groups[0].scheme.degree, together("intervals"), values[together("support")],
            np.einsum("qs,ksn->kqn", basis, controls), values[together("algebraics")],
        )  # fmt: skip

    by_degree: dict[int, list[Group]] = {}
    for group in layout.groups:
        by_degree.setdefault(group.scheme.degree, []).append(group)

    def names(signals: Sequence[Any]) -> tuple[str, ...]:
        return tuple(s.name for s in signals)

    return PhaseTrajectory(
        name=layout.phase.name, scheme=layout.groups[0].scheme.name, breakpoints=breakpoints,
        states=names(layout.states), constant=names(layout.constant),
        linear=names(layout.linear), polynomial=names(layout.polynomial),
        algebraics=names(layout.algebraics),
        steps=values[layout.steps], ramps=values[layout.ramps],
        pieces=tuple(piece(groups) for groups in by_degree.values()),
    )  # fmt: skip
