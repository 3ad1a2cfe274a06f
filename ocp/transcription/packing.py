"""Between decision vectors and trajectories."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ocp.arrays import Array, Integers
from ocp.mesh.initial_guess import InitialGuess
from ocp.mesh.mesh import inside_intervals
from ocp.mesh.trajectory import PhaseTrajectory, SignalGroup, Trajectory
from ocp.numerics.piecewise_polynomial import (
    Basis,
    Bernstein,
    Lagrange,
    Piece,
    PiecewisePolynomial,
    bernstein,
)
from ocp.problem.functionals import Peak
from ocp.problem.parameters import Parameters
from ocp.problem.symbols import Signal
from ocp.transcription.columns import PhaseColumns
from ocp.transcription.kernels import evaluated
from ocp.transcription.transcribe import ProgramLimits, Transcription


def decision_vector(
    transcription: Transcription, guess: InitialGuess, limits: ProgramLimits, constants: Array
) -> Array:
    """Scaled decision vector (n,) that represents a guess as well as the mesh allows.

    Parameters
    ----------
    limits : ProgramLimits
        Within which it is.
    constants : (n_k,)
        Values of the problem's constants.
    """
    columns = transcription.columns
    x = np.zeros(columns.count)
    for phase in columns.phases:
        _fill_phase(x, phase, guess)
    for unknown, column in zip(transcription.problem.unknowns, columns.unknowns, strict=True):
        x[column] = guess.unknowns[unknown.name]
    x /= columns.sizes

    lower, upper = limits.columns
    x = np.clip(x, lower, upper)
    _fill_totals(x, transcription, constants)
    for peak, column in columns.peaks.items():
        x[column] = _peak_value(transcription, x, peak, column, constants)
    return np.asarray(np.clip(x, lower, upper))


def _fill_phase(x: Array, columns: PhaseColumns, guess: InitialGuess) -> None:
    """Unscaled values of the unknowns of a phase."""
    own, mesh = guess.phases[columns.phase.name], columns.mesh
    start, end, points = own.start, own.end, mesh.breakpoints
    for group in columns.groups:
        rule = group.collocation
        left = points[group.intervals, None]
        width = np.diff(points)[group.intervals, None]

        support = left + np.clip(rule.support, 0.0, 1.0) * width
        values = own.at_fractions(support.ravel())
        for j, state in enumerate(columns.states):
            x[group.support[:, :, j]] = values[state.name].reshape(support.shape)

        # a control may jump at breakpoints: look at it a little inside the interval
        for members, table in zip(columns.control_sets, group.controls, strict=True):
            tau = _fitted_at(members.order, rule.points)
            inner = inside_intervals(points, group.intervals[:, None], tau)
            values = own.at_fractions(inner.ravel())
            fit = np.linalg.pinv(bernstein(table.shape[1], tau))
            for j, control in enumerate(members.controls):
                x[table[:, :, j]] = values[control.name].reshape(inner.shape) @ fit.T

        inner = inside_intervals(points, group.intervals[:, None], rule.points)
        values = own.at_fractions(inner.ravel())
        for j, signal in enumerate(columns.algebraics):
            x[group.algebraics[:, :, j]] = values[signal.name].reshape(inner.shape)

    values = own.at_fractions(points)
    for j, state in enumerate(columns.states):
        x[columns.nodes[:, j]] = values[state.name]
    if columns.ends is not None:
        x[columns.ends] = start, end
    here = columns.moved >= 0
    x[columns.moved[here]] = mesh.breakpoints[here]


def _fitted_at(order: int | None, points: Array) -> Array:
    """Local times at which a guess determines the coefficients of a control, see `ControlSet`."""
    if order is None:
        return points
    return np.array([0.5]) if order == 0 else np.array([0.0, 1.0])


def _fill_totals(x: Array, transcription: Transcription, constants: Array) -> None:
    """Running totals that fit the guess: with all totals zero their rows hold the increments."""
    phases = transcription.columns.phases
    if not any(columns.integrals for columns in phases):
        return
    program = transcription.program
    rows = evaluated(program.blocks, x, constants, program.rows)[1]
    for columns, own in zip(phases, transcription.rows.phases, strict=True):
        if columns.integrals:
            increments = -rows[own.totals]
            x[columns.totals[1:]] = np.cumsum(np.nan_to_num(increments), axis=0)


def _peak_value(
    transcription: Transcription, x: Array, peak: Peak, column: int, constants: Array
) -> float:
    """Largest value over the rows of a peak: the least value of its unknown that is feasible."""
    program = transcription.program
    touching = [block for block in program.blocks if np.any(block.columns == column)]
    trial = x.copy()
    trial[column] = 0.0
    values = evaluated(touching, trial, constants, program.rows)[1]
    rows = [
        part.rows
        for part in transcription.rows.path
        if transcription.constraints[part.phase][part.constraint].peak is peak
    ]
    heights = values[np.concatenate(rows)]
    return float(max(heights[np.isfinite(heights)], default=1.0))


def trajectory_of(transcription: Transcription, x: Array, parameters: Parameters) -> Trajectory:
    """The trajectory that a decision vector stands for."""
    columns = transcription.columns
    values = x * columns.sizes
    phases = tuple(_phase_trajectory(phase, values, transcription) for phase in columns.phases)
    unknowns = {
        unknown.name: float(values[column])
        for unknown, column in zip(transcription.problem.unknowns, columns.unknowns, strict=True)
    }
    peaks = tuple(float(values[column]) for column in columns.peaks.values())
    return Trajectory(phases, unknowns, dict(parameters.values), peaks)


def _phase_trajectory(
    columns: PhaseColumns, values: Array, transcription: Transcription
) -> PhaseTrajectory:
    mesh = columns.mesh
    fractions, here = mesh.breakpoints.copy(), columns.moved >= 0
    fractions[here] = values[columns.moved[here]]
    begin, end = columns.fixed_times if columns.ends is None else values[columns.ends]
    breakpoints = begin + fractions * (end - begin)

    def polynomial(tables: Sequence[tuple[Integers, Basis, Integers]]) -> PiecewisePolynomial:
        pieces = _pieces([(k, basis, values[ids]) for k, basis, ids in tables])
        return PiecewisePolynomial(breakpoints, pieces)

    states = [(g.intervals, _lagrange(g.collocation.support), g.support) for g in columns.groups]
    groups = [SignalGroup("state", _names(columns.states), polynomial(states))]
    for i, members in enumerate(columns.control_sets):
        controls = [
            (g.intervals, Bernstein(g.controls[i].shape[1]), g.controls[i]) for g in columns.groups
        ]
        groups.append(SignalGroup("control", _names(members.controls), polynomial(controls)))
    if columns.algebraics:
        algebraics = [
            (g.intervals, _lagrange(g.collocation.points), g.algebraics) for g in columns.groups
        ]
        groups.append(SignalGroup("algebraic", _names(columns.algebraics), polynomial(algebraics)))
    return PhaseTrajectory(
        name=columns.phase.name,
        scheme=transcription.scheme,
        breakpoints=breakpoints,
        degrees=mesh.degrees,
        groups=tuple(groups),
    )


def _names(signals: Sequence[Signal]) -> tuple[str, ...]:
    return tuple(signal.name for signal in signals)


def _lagrange(support: Array) -> Lagrange:
    return Lagrange(tuple(support.tolist()))


def _pieces(tables: list[tuple[Integers, Basis, Array]]) -> tuple[Piece, ...]:
    """One piece for each basis, whatever group its intervals belong to."""
    by_basis: dict[Basis, list[tuple[Integers, Array]]] = {}
    for intervals, basis, coefficients in tables:
        by_basis.setdefault(basis, []).append((intervals, coefficients))
    pieces = []
    for basis, parts in by_basis.items():
        intervals = np.concatenate([k for k, _ in parts])
        coefficients = np.concatenate([c for _, c in parts])
        order = np.argsort(intervals)
        pieces.append(Piece(intervals[order], basis, coefficients[order]))
    return tuple(pieces)
