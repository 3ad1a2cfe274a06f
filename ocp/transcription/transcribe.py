"""From a problem and a mesh to a nonlinear program."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ocp.arrays import Array
from ocp.mesh.mesh import Mesh, with_points
from ocp.numerics.schemes import Scheme
from ocp.problem.parameters import Parameters
from ocp.problem.problem import Problem
from ocp.problem.symbols import Between, Piecewise
from ocp.scaling.scales import Scales
from ocp.transcription.blocks import blocks_of
from ocp.transcription.columns import Columns, columns_of
from ocp.transcription.kernel_builder import KernelContext
from ocp.transcription.kernels import Program
from ocp.transcription.path_constraints import PathConstraint, path_constraints
from ocp.transcription.rows import Rows


def with_known_times(problem: Problem, mesh: Mesh) -> Mesh:
    """The mesh with a breakpoint at every known time; the very same one where it has them already.

    Points and back-offs between the collocation points count by interval, and are left out where
    intervals were added.
    """
    phases = []
    for phase, own in zip(problem.phases, mesh.phases, strict=True):
        if instants := problem.instants[phase.name]:
            # no phase of a free time has such instants
            assert not isinstance(phase.start, Between)
            assert not isinstance(phase.end, Between)
            start, end = float(phase.start), float(phase.end)
            own = with_points(own, (np.array(instants) - start) / (end - start))
        phases.append(own)
    same = all(a.intervals == b.intervals for a, b in zip(phases, mesh.phases, strict=True))
    return mesh if same else Mesh(tuple(phases))


@dataclass(frozen=True, eq=False, repr=False)
class ProgramLimits:
    """Scaled lower and upper limits of a program, at values of the constants.

    Attributes
    ----------
    columns, rows : (lower, upper)
        Of the unknowns (n,) and of the rows (m,).
    """

    columns: tuple[Array, Array]
    rows: tuple[Array, Array]

    @cached_property
    def sides(self) -> int:
        """How many limits there are, both sides counted; an equation has none."""
        return sum(
            int(np.count_nonzero(np.isfinite(side) & (lower < upper)))
            for lower, upper in (self.columns, self.rows)
            for side in (lower, upper)
        )

    def violation(self, rows: Array) -> float:
        """How far a row is beyond its limits at most, none where it is negative; may be nan."""
        lower, upper = self.rows
        return float(np.maximum(lower - rows, rows - upper).max(initial=-np.inf))

    def excess(self, rows: Array) -> Array:
        """How far each row is beyond its limits, infinite where it is no number, (m,)."""
        lower, upper = self.rows
        beyond = np.maximum(np.maximum(rows - upper, lower - rows), 0.0)
        return np.where(np.isfinite(beyond), beyond, np.inf)


@dataclass(frozen=True, eq=False, repr=False)
class Transcription:
    """A nonlinear program and the way back to the problem.

    Attributes
    ----------
    problem, mesh, scheme, controls, scales
        What it was made of; `controls` is the shape of controls that do not state their own.
    columns, rows
        Where each unknown and each row is, see `Columns` and `Rows`.
    constraints : one tuple of PathConstraint a phase
    program : Program
    kernels : dict
        The kernels, by what tells them apart. They serve on other meshes, too.
    """

    problem: Problem
    mesh: Mesh
    scheme: Scheme
    controls: Piecewise
    scales: Scales
    columns: Columns
    rows: Rows
    constraints: tuple[tuple[PathConstraint, ...], ...]
    program: Program
    kernels: dict[tuple[Any, ...], Any] = field(default_factory=dict, repr=False)

    def __repr__(self) -> str:
        return (
            f"Transcription('{self.problem.name}': {self.columns.count} unknowns, "
            f"{self.program.rows} rows)"
        )

    def limits(self, parameters: Parameters) -> ProgramLimits:
        """Limits of unknowns and rows."""
        return ProgramLimits(self.columns.limits.at(parameters), self.rows.limits.at(parameters))


def transcribe(
    problem: Problem,
    mesh: Mesh,
    scheme: Scheme,
    controls: Piecewise,
    scales: Scales,
    known: Transcription | None = None,
) -> Transcription:
    """Build the nonlinear program of a problem on a mesh.

    Parameters
    ----------
    controls : shape of controls that do not state their own.
    known : a transcription on another mesh, whose kernels are used again where problem, scheme,
        controls and scales are the same.

    Raises
    ------
    StatementError
        When the statement cannot be transcribed.
    """
    mesh = with_known_times(problem, mesh)
    columns = columns_of(problem, mesh, scheme, controls, scales)

    kernels = {} if known is None else _usable_kernels(known, problem, scheme, controls, scales)
    context = KernelContext(problem, scales, columns, kernels)
    constraints = tuple(path_constraints(problem, phase, scales) for phase in columns.phases)

    blocks, rows = blocks_of(context, mesh.extra, constraints)
    for index, back_off in enumerate(mesh.back_off):
        for number, distances in back_off.items():
            _keep_inside(columns, rows, index, constraints[index][number], number, distances)
    program = Program(blocks, columns.count, rows.limits.count, len(problem.constants))
    return Transcription(
        problem=problem,
        mesh=mesh,
        scheme=scheme,
        controls=controls,
        scales=scales,
        columns=columns,
        rows=rows,
        constraints=constraints,
        program=program,
        kernels=kernels,
    )


def _keep_inside(
    columns: Columns,
    rows: Rows,
    index: int,
    constraint: PathConstraint,
    number: int,
    back_off: Array,
) -> None:
    """Keep the points of one path constraint inside its limits, by a back-off (N,) each."""
    scaled = back_off / constraint.scale
    for path in rows.of_constraint(index, number):
        rows.limits.keep_inside(path.rows, scaled[path.intervals])
    if constraint.sampled:
        return

    # a breakpoint keeps the larger distance of the two intervals that meet there
    phase = columns.phases[index]
    distances = np.zeros(columns.count)
    for intervals, points in phase.at_points(constraint.name):
        np.maximum.at(distances, points, scaled[intervals][:, None])
    # a boundary value may lie on the limit
    distances[phase.nodes[[0, -1]]] = 0.0
    held = np.flatnonzero(distances)
    columns.limits.keep_inside(held, distances[held])


def _usable_kernels(
    known: Transcription,
    problem: Problem,
    scheme: Scheme,
    controls: Piecewise,
    scales: Scales,
) -> dict[tuple[Any, ...], Any]:
    """The kernels of a transcription of the same problem, none where it is another one."""
    same = known.problem is problem and known.scales is scales
    return known.kernels if same and (known.scheme, known.controls) == (scheme, controls) else {}
