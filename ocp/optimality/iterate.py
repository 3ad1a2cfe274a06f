"""An iterate: a point of a transcribed problem, with the multipliers that a solver found there."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ocp.arrays import Array
from ocp.mesh.mesh import Mesh
from ocp.mesh.trajectory import Trajectory
from ocp.nlp.solver import NlpResult
from ocp.numerics.columnwise import called, nonzeros
from ocp.numerics.schemes import Scheme
from ocp.problem.parameters import Parameters, parameters_of
from ocp.problem.problem import Problem
from ocp.problem.symbols import Piecewise
from ocp.scaling.scales import VANISHED, Scales
from ocp.transcription.kernels import nonzero_places
from ocp.transcription.transcribe import ProgramLimits, Transcription, transcribe

# Scaled slope below which an unknown has no influence on a row
_NO_SLOPE = 1e-12

# Part of the scale of the objective or a peak below which its value is next to nothing, so that a
# difference is not relative to it.
LEAST_OF_A_SCALE = 1e-3

# Part of the objective's scale below which its value is zero, as far as a solver can tell
_ZERO = 1e-7

# Of the objective: terms of the Hamiltonian that make less of it over a whole phase are nothing.
_NOTHING = 1e-4


@dataclass(frozen=True, eq=False, repr=False)
class Iterate:
    """Unknowns and multipliers of a problem on a mesh.

    Attributes
    ----------
    problem, mesh, scheme, controls, scales
        What the program was made of.
    trajectory : Trajectory
        What the unknowns stand for.
    objective : float
        As it was stated, minimised or maximised [unit of the objective].
    x, bound_multipliers : (n,)
        Unknowns, and multipliers of their bounds; scaled, in CasADi's sign, ``L = f + lam^T g``.
    row_multipliers : (m,)
        Multipliers of the rows, likewise.
    built : Transcription or None
        The program, if it is there already. It is built on first use otherwise.
    """

    problem: Problem
    mesh: Mesh
    scheme: Scheme
    controls: Piecewise
    scales: Scales
    trajectory: Trajectory
    objective: float
    x: Array
    bound_multipliers: Array
    row_multipliers: Array
    built: Transcription | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        # a program that is there already is not built again
        if self.built is not None:
            object.__setattr__(self, "transcription", self.built)

    def __repr__(self) -> str:
        return (
            f"Iterate('{self.problem.name}': objective {self.objective:.10g}, {self.x.size} "
            f"unknowns, {self.row_multipliers.size} rows)"
        )

    @property
    def objective_size(self) -> float:
        """What changes of the objective are relative to: its modulus, which may vanish."""
        return max(abs(self.objective), LEAST_OF_A_SCALE * self.scales.objective)

    @property
    def costs_nothing(self) -> bool:
        """Whether the objective is zero, as far as a solver can tell."""
        return abs(self.objective) <= _ZERO * self.scales.objective

    def negligible_rate(self, index: int) -> float:
        """Terms of the Hamiltonian of a phase, by its number, are nothing if they are smaller.

        Over the whole phase they make little of the objective, or of its scale where the optimum is
        zero: there costates are the solver's rounding [unit of the objective / s].
        """
        motion = self.trajectory.phases[index]
        whole = self.scales.objective if self.costs_nothing else self.objective_size
        return float(_NOTHING * whole / (motion.end - motion.start))

    def takes_no_time(self, index: int) -> bool:
        """Whether a phase, by its number, has shrunk to the least duration."""
        motion = self.trajectory.phases[index]
        return bool(motion.end - motion.start <= VANISHED * self.scales.time)

    @property
    def has_collapsed(self) -> bool:
        """Whether the whole motion has shrunk to the least duration."""
        return not self.trajectory.duration / self.scales.time > VANISHED

    @property
    def fixed_mesh(self) -> Mesh:
        """The mesh with its breakpoints where the solver left them, none of which moves."""
        pairs = zip(self.mesh.phases, self.trajectory.phases, strict=True)
        phases = [replace(mesh, breakpoints=motion.fractions, movable=()) for mesh, motion in pairs]
        return replace(self.mesh, phases=tuple(phases))

    @cached_property
    def transcription(self) -> Transcription:
        """The program."""
        return transcribe(self.problem, self.mesh, self.scheme, self.controls, self.scales)

    @cached_property
    def parameters(self) -> Parameters:
        """The constants of the problem, and its limits at their values."""
        return parameters_of(self.problem, self.trajectory.constants)

    @cached_property
    def determined_row_multipliers(self) -> Array:
        """Multipliers of the rows, zero where stationarity does not determine them, (m,).

        It does not where only fixed unknowns have an influence on the row: a path constraint at the
        start of a phase may be met by the initial values alone. Where they lie on its limit the
        multiplier is any number, as large as the solver happens to leave it.
        """
        lower, upper = self.limits.columns
        jacobian = self.transcription.program.constraint_jacobian
        _, found = nonzeros(jacobian, self.x[None], self.parameters.vector[None])
        rows, columns = nonzero_places(jacobian.sparsity_out(1))

        # the others may have a place in the row, and a slope of nothing there
        free = np.zeros(self.row_multipliers.size, dtype=bool)
        free[rows[(lower < upper)[columns] & (np.abs(found) > _NO_SLOPE)]] = True
        return np.where(free, self.row_multipliers, 0.0)

    @cached_property
    def rows(self) -> Array:
        """Scaled values of the program's rows, (m,)."""
        numbers = (self.x[None], self.parameters.vector[None])
        return called(self.transcription.program.oracle, *numbers)[1].ravel()

    @cached_property
    def limits(self) -> ProgramLimits:
        """Limits of the program's unknowns and rows."""
        return self.transcription.limits(self.parameters)


def iterate_of(transcription: Transcription, result: NlpResult, trajectory: Trajectory) -> Iterate:
    """What a solver found for a transcribed problem, with the trajectory of its unknowns."""
    problem, scales = transcription.problem, transcription.scales
    return Iterate(
        problem=problem,
        mesh=transcription.mesh,
        scheme=transcription.scheme,
        controls=transcription.controls,
        scales=scales,
        trajectory=trajectory,
        objective=problem.sense * result.objective * scales.objective,
        x=result.x,
        bound_multipliers=result.bound_multipliers,
        row_multipliers=result.row_multipliers,
        built=transcription,
    )
