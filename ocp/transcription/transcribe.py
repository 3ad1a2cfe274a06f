"""From a problem and a mesh to a nonlinear program."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.mesh.mesh import Mesh, with_points
from ocp.numerics.schemes import SchemeName
from ocp.problem.statement import Problem
from ocp.problem.symbols import Between, Constant, ControlShape, resolve
from ocp.problem.terms import Functional
from ocp.transcription.boundary import terminal_block
from ocp.transcription.columns import columns_of
from ocp.transcription.condense import condense
from ocp.transcription.condensed import Condensed
from ocp.transcription.defects import phase_blocks
from ocp.transcription.kernel_builder import Context
from ocp.transcription.kernels import Block, Program
from ocp.transcription.limits import Limits
from ocp.transcription.path_constraints import Continuous, continuous_constraints
from ocp.transcription.scaling import Scales
from ocp.transcription.variables import PhaseLayout, lay_out

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class Method:
    """How signals are discretised."""

    scheme: SchemeName = "radau"
    control_shape: ControlShape = "automatic"


@dataclass(frozen=True, eq=False)
class Transcription:
    """A nonlinear program and the way back to the problem.

    Attributes
    ----------
    columns, rows : bounds of the unknowns and of the constraint rows.
    sizes : (n,) scale of each unknown.
    peak_ids : unknown of each peak.
    kernels : see `Context`.
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
    kernels: dict[tuple[Any, ...], Any] = field(default_factory=dict, repr=False)

    @cached_property
    def condensed(self) -> Condensed:
        """The program as a solver gets it."""
        symbols = ca.vertcat(*[c.symbol for c in self.problem.constants], ca.SX(0, 1))
        return condense(self.blocks, self.layouts, self.program, self.columns, self.sizes,
                        symbols, self.kernels)  # fmt: skip


def transcribe(
    problem: Problem, mesh: Mesh, method: Method, scales: Scales,
    known: Transcription | None = None, native: bool = False,
) -> Transcription:  # fmt: skip
    """Build the nonlinear program of a problem on a mesh.

    Parameters
    ----------
    known : a transcription on another mesh, whose kernels are used again where problem, method
        and scales are the same.
    native : whether the functions are compiled to machine code.

    Raises
    ------
    StatementError
        When the statement cannot be transcribed, or not be compiled.
    """
    mesh = with_instants(problem, mesh)
    weights = inline_weights(problem)
    layouts, first = [], 0
    for phase, phase_mesh in zip(problem.phases, mesh.phases, strict=True):
        chained = tuple(
            f for f in problem.functionals
            if f.kind == "integral" and f.pieces[0][0] == phase.name and f not in weights
        )  # fmt: skip
        layouts.append(
            lay_out(problem, phase, phase_mesh, method.scheme, method.control_shape, chained, first)
        )
        first = layouts[-1].stop
    unknown_ids = first + np.arange(len(problem.unknowns))
    first += unknown_ids.size
    peaks = [f for f in problem.functionals if f.kind == "peak"]
    peak_ids = {f: first + i for i, f in enumerate(peaks)}
    context = Context(
        problem, scales.signals, unknown_ids,
        tuple(scales.unknowns[u.name] for u in problem.unknowns), scales.time,
        _known_kernels(problem, method, scales, known), native,
    )  # fmt: skip
    constraints = tuple(continuous_constraints(problem, lay, scales) for lay in layouts)
    columns = columns_of(problem, layouts, unknown_ids, peak_ids, scales, first + len(peaks))
    rows, blocks = Limits(), []
    for layout, found, extra in zip(layouts, constraints, mesh.extra, strict=True):
        blocks += phase_blocks(context, layout, found, scales, weights, peak_ids, rows, extra)
    blocks.append(terminal_block(context, layouts, scales, weights, peak_ids, rows))
    program = Program(tuple(blocks), columns.limits.count, rows.count, len(problem.constants))
    return Transcription(
        problem, mesh, method, scales, tuple(layouts), constraints, tuple(blocks), program,
        columns.limits, rows, columns.sizes, unknown_ids, peak_ids,
        context.kernels,
    )  # fmt: skip


def _known_kernels(
    problem: Problem, method: Method, scales: Scales, known: Transcription | None
) -> dict[tuple[Any, ...], Any]:
    """The kernels of a transcription of the same problem, none where it is another one."""
    if known is None or known.problem is not problem or known.scales is not scales:
        return {}
    return known.kernels if known.method == method else {}


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
