"""Dual warm starts: the multipliers of an iterate, seen from another mesh of the same problem.

What belongs to an instant carries over as a function of the fraction of the phase. Costates do so
as they are. Multipliers of path constraints and of bounds do so as densities: multiplier by
quadrature weight and step, or by the stretch of time that an unknown stands for. Points that exist
on both meshes keep their multipliers but for rounding. What has no counterpart starts at zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ocp.arrays import Array, Integers
from ocp.mesh.mesh import SAME_POINT, inside_intervals
from ocp.optimality.iterate import Iterate
from ocp.optimality.multipliers import PhaseCostates, costates, put_costates
from ocp.scaling.scales import Scales
from ocp.transcription.columns import PhaseColumns
from ocp.transcription.rows import PathRows
from ocp.transcription.transcribe import Transcription


def carried_multipliers(iterate: Iterate, target: Transcription) -> tuple[Array, Array] | None:
    """Multipliers to start another program of the same problem from.

    Parameters
    ----------
    target : Transcription
        On any mesh. The size of its objective may differ, as multipliers are relative to it.

    Returns
    -------
    tuple of (n,) and (rows,), or None
        Multipliers of the bounds and of the rows, scaled as `target` is. None if other sizes than
        that of the objective differ.
    """
    source = iterate.transcription
    if source is target:
        return iterate.bound_multipliers, iterate.row_multipliers
    if _without_objective(source.scales) != _without_objective(target.scales):
        return None

    rows, columns = np.zeros(target.program.rows), np.zeros(target.columns.count)

    # by fractions of the phase; breakpoints that moved are where the iterate has them
    fractions = [phase.fractions for phase in iterate.trajectory.phases]
    for index, phase_costates in enumerate(costates(iterate)):
        _carry_costates(rows, target, index, phase_costates, fractions[index])

    # costates have a unit, all others are relative to the size of the objective
    ratio = source.scales.objective / target.scales.objective
    of_rows, of_bounds = ratio * iterate.row_multipliers, ratio * iterate.bound_multipliers
    _carry_paths(rows, of_rows, source, target, fractions)

    # multipliers of fixed unknowns are no densities in time
    lower, upper = iterate.limits.columns
    _carry_bounds(columns, np.where(lower < upper, of_bounds, 0.0), source, target, fractions)

    # one each: bounds and links of the problem, the order of a phase's times, unknowns and peaks
    rows[target.rows.boundary] = of_rows[source.rows.boundary]
    for old_rows, new_rows in zip(source.rows.phases, target.rows.phases, strict=True):
        rows[new_rows.duration] = of_rows[old_rows.duration]
    columns[target.columns.numbers] = of_bounds[source.columns.numbers]
    return columns, rows


def _without_objective(scales: Scales) -> Scales:
    return replace(scales, objective=1.0, reasons={})


def _carry_costates(
    rows: Array, target: Transcription, index: int, costates: PhaseCostates, fractions: Array
) -> None:
    """Rows of the dynamics and of the running totals of a phase."""
    phase = target.columns.phases[index]
    for number, group in enumerate(phase.groups):
        points = inside_intervals(
            phase.mesh.breakpoints, group.intervals[:, None], group.collocation.points
        )
        at = points.ravel()
        interval = np.clip(np.searchsorted(fractions, at, side="right") - 1, 0, fractions.size - 2)
        tau = (at - fractions[interval]) / np.diff(fractions)[interval]
        values = costates.local(interval, tau).reshape(*points.shape, -1)
        put_costates(rows, target, index, number, values)


def _carry_paths(
    rows: Array,
    multipliers: Array,
    source: Transcription,
    target: Transcription,
    fractions: Sequence[Array],
) -> None:
    """Path constraints: densities between collocation points, the very value at added points."""
    known: dict[tuple[int, int, bool], list[tuple[Array, Array]]] = {}
    for path in source.rows.path:
        at, measure = _measure(path, fractions[path.phase])
        values = multipliers[path.rows] / measure
        known.setdefault(_kind(path), []).append((at, values))

    for path in target.rows.path:
        if _kind(path) not in known:
            continue
        at, measure = _measure(path, target.columns.phases[path.phase].mesh.breakpoints)
        old, values = (np.concatenate(part) for part in zip(*known[_kind(path)], strict=True))
        order = np.argsort(old, kind="stable")
        old, values = old[order], values[order]
        if path.at_collocation_points:
            rows[path.rows] = np.interp(at, old, values) * measure
        else:
            distances = np.abs(at[:, None] - old[None, :])
            same = distances.min(axis=1) < SAME_POINT
            rows[path.rows] = np.where(same, values[distances.argmin(axis=1)], 0.0)


def _kind(path: PathRows) -> tuple[int, int, bool]:
    """What the rows of a path constraint have in common with those on another mesh."""
    return path.phase, path.constraint, path.at_collocation_points


def _measure(path: PathRows, fractions: Array) -> tuple[Array, Array]:
    """Fractions of the phase of a constraint's rows, and what a density is multiplied by there."""
    at = inside_intervals(fractions, path.intervals, path.tau)
    if not path.at_collocation_points:
        return at, np.ones(at.size)
    return at, path.weights * np.diff(fractions)[path.intervals]


@dataclass(frozen=True, eq=False, repr=False)
class _Entries:
    """Unknowns of one signal in the order of time.

    Attributes
    ----------
    columns : (m,)
    at, width : (m,)
        Where each sits, and the stretch of the phase that it stands for, both as fractions.
    """

    columns: Integers
    at: Array
    width: Array


def _carry_bounds(
    columns: Array,
    multipliers: Array,
    source: Transcription,
    target: Transcription,
    fractions: Sequence[Array],
) -> None:
    """Bounds of states, controls and algebraic signals, as densities."""
    phases = zip(source.columns.phases, target.columns.phases, fractions, strict=True)
    for old_phase, new_phase, old_fractions in phases:
        known = _entries(old_phase, old_fractions)
        for name, entries in _entries(new_phase, new_phase.mesh.breakpoints).items():
            columns[entries.columns] = _as_density(known[name], entries, multipliers)


def _entries(phase: PhaseColumns, fractions: Array) -> dict[str, _Entries]:
    """The unknowns of each signal, by name, of a phase with breakpoints at given fractions."""
    entries: dict[str, _Entries] = {}
    width = np.diff(fractions)

    # states: at the breakpoints and at the support points inside the intervals
    ids, places = [phase.nodes], [fractions]
    for group in phase.groups:
        inner = slice(1, 1 + group.collocation.inner)
        left, steps = fractions[group.intervals, None], width[group.intervals, None]
        ids.append(group.support[:, inner].reshape(-1, len(phase.states)))
        places.append((left + group.collocation.support[inner] * steps).ravel())
    at = np.concatenate(places)
    order = np.argsort(at)
    at, table = at[order], np.concatenate(ids)[order]
    for j, state in enumerate(phase.states):
        entries[state.name] = _Entries(table[:, j], at, np.gradient(at))

    # controls and algebraic signals: coefficients share their interval
    pieces: dict[str, list[tuple[Integers, Integers]]] = {}
    for signal, intervals, ids_of_signal in phase.coefficients:
        pieces.setdefault(signal.name, []).append((intervals, ids_of_signal))
    for name, parts in pieces.items():
        entries[name] = _coefficient_entries(parts, fractions)
    return entries


def _coefficient_entries(parts: Sequence[tuple[Integers, Integers]], fractions: Array) -> _Entries:
    """Entries of coefficients, given as intervals (m,) and their columns (m, count)."""
    ids, places, widths = [], [], []
    for intervals, table in parts:
        count = table.shape[1]
        # the coefficients of a linear control are its values at both ends
        tau = np.array([0.0, 1.0]) if count == 2 else (np.arange(count) + 0.5) / count
        ids.append(table.ravel())
        places.append(inside_intervals(fractions, intervals[:, None], tau).ravel())
        widths.append(np.repeat(np.diff(fractions)[intervals] / count, count))

    at = np.concatenate(places)
    order = np.argsort(at)
    return _Entries(np.concatenate(ids)[order], at[order], np.concatenate(widths)[order])


def _as_density(old: _Entries, new: _Entries, multipliers: Array) -> Array:
    """Multipliers of the new entries from those of the old ones: as much at each side in all."""
    carried = np.zeros(new.at.size)
    at_columns = multipliers[old.columns]
    for side in (np.minimum(at_columns, 0.0), np.maximum(at_columns, 0.0)):
        density = np.interp(new.at, old.at, side / old.width) * new.width
        if density.any():
            carried += density * (side.sum() / density.sum())
    return carried
