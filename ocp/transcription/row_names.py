"""What each row of a program is, in the words of the statement: which equation or limit, and where.

Failed solves name their worst rows by it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ocp.arrays import Array, Integers
from ocp.transcription.columns import PhaseColumns
from ocp.transcription.rows import PhaseRows
from ocp.transcription.transcribe import Transcription


@dataclass(frozen=True, eq=False)
class RowKind:
    """The rows of one equation or limit.

    Attributes
    ----------
    what : str
        The equation or limit.
    rows : (m,)
        Where they are in the constraint vector.
    phase : str
        The phase they belong to, "" if to none.
    fractions : (m,) or None
        Where each is in the phase, as a fraction of its duration; None if at no single instant.
    unit : str
        Of the unscaled rows.
    size : float
        A scaled residual of 1 is `size` in `unit`.
    is_stated : bool
        Whether it is a limit or an equation of the statement, and no rate.
    """

    what: str
    rows: Integers
    phase: str = ""
    fractions: Array | None = None
    unit: str = ""
    size: float = 1.0
    is_stated: bool = False


def row_kinds(transcription: Transcription) -> Iterator[RowKind]:
    """All rows of a program by kind; every row belongs to one of them."""
    rows, scales = transcription.rows, transcription.scales
    for index, columns in enumerate(transcription.columns.phases):
        yield from _dynamics(transcription, columns, rows.phases[index])
        yield from _path_constraints(transcription, index)
        yield from _joints(transcription, columns, rows.phases[index])

    bounds = transcription.problem.boundary_constraints
    for bound, row in zip(bounds, rows.boundary, strict=True):
        size = scales.bounds["", bound.name]
        row_of_bound = np.array([row])
        yield RowKind(f"'{bound.name}'", row_of_bound, unit=bound.unit, size=size, is_stated=True)


def _dynamics(
    transcription: Transcription, columns: PhaseColumns, rows: PhaseRows
) -> Iterator[RowKind]:
    """Dynamics of each state, and the right ends of intervals without a support point there."""
    sizes, name = transcription.scales.signals, columns.phase.name
    points = columns.mesh.breakpoints
    by_group = [
        _fractions(points, group.intervals[:, None], group.collocation.points).ravel()
        for group in columns.groups
    ]
    ends = [points[g.intervals + 1] for g in columns.groups if not g.collocation.ends_on_support]

    for j, state in enumerate(columns.states):
        defects = [table[:, :, j].ravel() for table in rows.defects]
        yield RowKind(
            f"dynamics of '{state.name}'",
            np.concatenate(defects),
            name,
            np.concatenate(by_group),
            state.unit,
            sizes[state.name],
        )
        if rows.continuity:
            yield RowKind(
                f"continuity of '{state.name}'",
                np.concatenate([table[:, j] for table in rows.continuity]),
                name,
                np.concatenate(ends),
                state.unit,
                sizes[state.name],
            )


def _path_constraints(transcription: Transcription, index: int) -> Iterator[RowKind]:
    """Path constraints at collocation points and at points added between them."""
    columns = transcription.columns.phases[index]
    for number, constraint in enumerate(transcription.constraints[index]):
        parts = transcription.rows.of_constraint(index, number)
        if not parts:
            continue
        fractions = [
            _fractions(columns.mesh.breakpoints, part.intervals, part.tau) for part in parts
        ]
        yield RowKind(
            f"'{constraint.name}'",
            np.concatenate([part.rows for part in parts]),
            columns.phase.name,
            np.concatenate(fractions),
            constraint.unit,
            constraint.scale,
            is_stated=True,
        )


def _joints(
    transcription: Transcription, columns: PhaseColumns, rows: PhaseRows
) -> Iterator[RowKind]:
    """Running totals of integrals, and the order of times and breakpoints."""
    scales, name = transcription.scales, columns.phase.name
    for j, integral in enumerate(columns.integrals):
        size = scales.functionals[integral]
        ends = columns.mesh.breakpoints[1:]
        what = f"integral '{integral.name}'"
        yield RowKind(what, rows.totals[:, j], name, ends, integral.unit, size)
    if rows.duration.size:
        yield RowKind("duration", rows.duration, name, unit="s", size=scales.time)
    if rows.breakpoints.size:
        yield RowKind("order of the breakpoints", rows.breakpoints, name)


def _fractions(breakpoints: Array, intervals: Integers, tau: Array) -> Array:
    """Fractions of the phase of local times of intervals."""
    return np.asarray(breakpoints[intervals] + tau * np.diff(breakpoints)[intervals])
