"""Dual starts: the multipliers of a solved program, seen from another mesh of the same problem.

What belongs to an instant carries over as a function of the fraction of the phase: costates as
they are, multipliers of path constraints and of bounds as densities (multiplier by quadrature
weight and step, or by the stretch of time that an unknown stands for).  Points that exist on both
meshes keep their multipliers but for rounding; what has no counterpart starts at zero.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ocp.mesh.initial_guess import start_of
from ocp.mesh.mesh import Mesh
from ocp.mesh.trajectory import PhaseTrajectory, Trajectory
from ocp.nlp.ipopt import Duals
from ocp.optimality.costates import PhaseCostates, costates
from ocp.optimality.multipliers import PathRows, SolvedProgram, path_rows
from ocp.problem.statement import Problem
from ocp.transcription.scaling import resized, scales_of
from ocp.transcription.transcribe import Method, Transcription, transcribe
from ocp.transcription.variables import PhaseLayout

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
_INSIDE = 1e-9
_SAME = 1e-9


@dataclass(frozen=True, eq=False)
class Origin:
    """Where a mesh round starts.

    Attributes
    ----------
    trajectory : None for the guess in the statement.
    program : the program that the trajectory solves, if its multipliers are to be used: one of
        the same problem, whose scales the round takes over.
    objective : of the program's solution [unit of the objective], if its size is to follow it.
    built : a transcription to use for its mesh.
    """

    trajectory: Trajectory | None = None
    program: SolvedProgram | None = None
    objective: float | None = None
    built: Transcription | None = None

    def transcription(
        self, problem: Problem, mesh: Mesh, method: Method, constants: Mapping[str, float],
        native: bool = False,
    ) -> Transcription:  # fmt: skip
        """The program to solve next; one that is there already where the mesh is the same."""
        if self.built is not None and mesh is self.built.mesh:
            return self.built
        if self.program is None:
            start = start_of(problem, constants, self.trajectory)
            scales = scales_of(problem, start, constants)
            return transcribe(problem, mesh, method, scales, native=native)
        if mesh is self.program.mesh and method == self.program.method:
            return self.program.transcription
        known = self.program.transcription
        scales = self.program.scales
        if self.objective is not None:
            scales = resized(scales, self.objective)
        return transcribe(problem, mesh, method, scales, known, native)

    def duals(self, target: Transcription) -> Duals | None:
        """Multipliers to start `target` from, if they are known."""
        if self.program is None or self.trajectory is None:
            return None
        if replace(self.program.scales, objective=1.0, reasons={}) != replace(
            target.scales, objective=1.0, reasons={}
        ):
            return None
        return duals(self.program, self.trajectory, target)


@dataclass(frozen=True, eq=False)
class _Entries:
    """Unknowns of one kind: where they sit and what stretch of the phase each stands for."""

    ids: Integers
    at: Array
    width: Array


def duals(solved: SolvedProgram, trajectory: Trajectory, target: Transcription) -> Duals:
    """Multipliers for `target`, whose problem and scales are those of the solved program.

    The size of the objective may differ: multipliers are relative to it.

    Parameters
    ----------
    trajectory : the solved one, for its constants and its breakpoints, which may have moved.
    """
    made = solved.transcription
    if made is target:
        return Duals(solved.bound_multipliers, solved.row_multipliers)
    points = [_fractions(trajectory.phase(lay.phase.name)) for lay in made.layouts]
    rows, columns = np.zeros(target.rows.count), np.zeros(target.columns.count)
    adjoints = costates(made, solved.row_multipliers)
    ratio = made.scales.objective / target.scales.objective
    solved = replace(solved, row_multipliers=ratio * solved.row_multipliers,
                     bound_multipliers=ratio * solved.bound_multipliers)  # fmt: skip
    solved.__dict__["transcription"] = made  # a copy would build it again
    for layout, adjoint, at in zip(target.layouts, adjoints, points, strict=True):
        _put_costates(rows, target, layout, adjoint, at)
    _put_paths(rows, solved, target, points)
    _put_direct(rows, solved, target)
    lower, upper = made.columns.evaluate(trajectory.constants)
    free = np.where(lower < upper, solved.bound_multipliers, 0.0)  # fixed: no density in time
    for old, new, at in zip(made.layouts, target.layouts, points, strict=True):
        known = dict(_entries(old, at))
        for name, entries in _entries(new, new.mesh.breakpoints):
            columns[entries.ids] = _as_density(known[name], entries, free)
    last = target.unknown_ids.size + len(target.peak_ids)
    if last:
        columns[-last:] = solved.bound_multipliers[-last:]
    return Duals(columns, rows)


def _fractions(own: PhaseTrajectory) -> Array:
    return (own.breakpoints - own.start) / (own.end - own.start)


def _put_costates(
    rows: Array, target: Transcription, layout: PhaseLayout, adjoint: PhaseCostates, points: Array
) -> None:
    """Rows of the dynamics and of the running integrals, see `ocp.optimality.costates`."""
    scales, n_x = target.scales, len(layout.states)
    sizes = np.array([scales.signals[s.name] for s in layout.states]
                     + [scales.functionals[f] for f in layout.integrals])  # fmt: skip
    blocks = [b for b in target.blocks if b.name == f"{layout.phase.name}: collocation"]
    mesh = layout.mesh.breakpoints
    for block, group in zip(blocks, layout.groups, strict=True):
        inner = 0.5 + (group.scheme.points - 0.5) * (1.0 - _INSIDE)
        at = (mesh[group.intervals, None] + inner * np.diff(mesh)[group.intervals, None]).ravel()
        k = np.clip(np.searchsorted(points, at, side="right") - 1, 0, points.size - 2)
        values = -adjoint.local(k, (at - points[k]) / np.diff(points)[k])
        values *= sizes / scales.objective
        values[:, :n_x] *= np.tile(group.scheme.weights, group.intervals.size)[:, None]
        own = [*range(n_x), *range(block.rows.shape[1] - len(layout.integrals),
                                   block.rows.shape[1])]  # fmt: skip
        rows[block.rows[:, own]] = values


def _put_paths(
    rows: Array, solved: SolvedProgram, target: Transcription, points: list[Array]
) -> None:
    """Path constraints: densities between collocation points, the very value at added points."""
    known: dict[tuple[int, int, bool], list[tuple[Array, Array]]] = {}
    for part in path_rows(solved.transcription):
        at, width = _places(part, points[part.phase])
        smooth = bool(np.isfinite(part.weights).all())
        values = solved.row_multipliers[part.rows] / (part.weights * width if smooth else 1.0)
        known.setdefault((part.phase, part.constraint, smooth), []).append((at, values))
    for part in path_rows(target):
        at, width = _places(part, target.mesh.phases[part.phase].breakpoints)
        smooth = bool(np.isfinite(part.weights).all())
        found = known.get((part.phase, part.constraint, smooth))
        if found is None:
            continue
        old, values = (np.concatenate(part) for part in zip(*found, strict=True))
        order = np.argsort(old, kind="stable")
        old, values = old[order], values[order]
        if smooth:
            rows[part.rows] = np.interp(at, old, values) * part.weights * width
        else:
            near = np.abs(at[:, None] - old[None, :])
            best = near.argmin(axis=1)
            rows[part.rows] = np.where(near.min(axis=1) < _SAME, values[best], 0.0)


def _places(part: PathRows, points: Array) -> tuple[Array, Array]:
    """Fractions of the rows of a constraint, and the widths of their intervals."""
    width = np.diff(points)[part.intervals]
    inner = 0.5 + (part.tau - 0.5) * (1.0 - _INSIDE)
    return points[part.intervals] + inner * width, width


def _put_direct(rows: Array, solved: SolvedProgram, target: Transcription) -> None:
    """Bounds and links of the problem, and the order of a phase's times: one row each."""
    known = {b.name: b for b in solved.transcription.blocks}
    for block in target.blocks:
        if block.name == "terminal" or block.name.endswith(": duration"):
            rows[block.rows] = solved.row_multipliers[known[block.name].rows]


def _entries(layout: PhaseLayout, points: Array) -> Iterator[tuple[tuple[str, int], _Entries]]:
    """The unknowns of each signal of a phase whose breakpoints are `points`."""
    width = np.diff(points)
    ids, at = [layout.nodes], [points]
    for group in layout.groups:
        inner = slice(1, 1 + group.scheme.inner)
        ids.append(group.support[:, inner].reshape(-1, len(layout.states)))
        left, h = points[group.intervals, None], width[group.intervals, None]
        at.append((left + group.scheme.support[inner] * h).ravel())
    fractions = np.concatenate(at)
    order = np.argsort(fractions)
    columns, fractions = np.concatenate(ids)[order], fractions[order]
    for j in range(len(layout.states)):
        yield ("state", j), _Entries(columns[:, j], fractions, np.gradient(fractions))
    for kind in ("controls", "algebraics"):
        yield from _held(layout, kind, points)
    sides = np.stack([points[:-1] + _INSIDE * width, points[1:] - _INSIDE * width], axis=1)
    for j in range(len(layout.linear)):
        yield ("linear", j), _Entries(
            layout.ramps[:, :, j].ravel(), sides.ravel(), np.repeat(0.5 * width, 2))  # fmt: skip
    for j in range(len(layout.constant)):
        yield ("constant", j), _Entries(layout.steps[:, j], points[:-1] + 0.5 * width, width)


def _held(
    layout: PhaseLayout, kind: str, points: Array
) -> Iterator[tuple[tuple[str, int], _Entries]]:
    """Coefficients of polynomial controls, or algebraic signals, spread over their intervals."""
    width = np.diff(points)
    tables = [getattr(group, kind) for group in layout.groups]
    for j in range(tables[0].shape[2]):
        ids, at, cell = [], [], []
        for group, table in zip(layout.groups, tables, strict=True):
            s, h = table.shape[1], width[group.intervals, None]
            ids.append(table[:, :, j].ravel())
            at.append((points[group.intervals, None] + (np.arange(s) + 0.5) / s * h).ravel())
            cell.append(np.repeat(h / s, s))
        places = np.concatenate(at)
        order = np.argsort(places)
        yield (kind, j), _Entries(
            np.concatenate(ids)[order], places[order], np.concatenate(cell)[order])  # fmt: skip


def _as_density(old: _Entries, new: _Entries, multipliers: Array) -> Array:
    """Multipliers of the new entries from those of the old ones: as much at each side in all."""
    found = np.zeros(new.at.size)
    for side in (np.minimum(multipliers[old.ids], 0.0), np.maximum(multipliers[old.ids], 0.0)):
        spread = np.interp(new.at, old.at, side / old.width) * new.width
        if spread.any():
            found += spread * (side.sum() / spread.sum())
    return found
