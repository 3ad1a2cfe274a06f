"""The record of a mesh iteration: its mesh, what the solver took, what was wrong between points."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from operator import attrgetter

from ocp.later import lazy_fields, read_later
from ocp.mesh.mesh import Mesh
from ocp.nlp.solver import NlpResult
from ocp.refinement.solved_mesh import SolvedMesh


@lazy_fields("dynamics_error", "excess", "gain")
@dataclass(frozen=True, repr=False)
class MeshIteration:
    """One mesh iteration: its mesh, what the solver took, and what was wrong between the points.

    Attributes
    ----------
    intervals : int
        Of all phases.
    extra_points : int
        Points between the collocation points at which constraints are imposed too.
    movable : int
        Breakpoints that the optimiser may move.
    iterations : int
        Of the solver.
    seconds : float
        That the solver took [s].
    objective : float
        In the user's sense and unit; nan where the solver failed, as are the next three. These are
        estimated when they are first read.
    dynamics_error : float
        Largest error of the dynamics in an interval, relative.
    excess : float
        Largest excess of a path constraint, bound or peak, relative.
    gain : float
        What finer controls could gain, relative to the objective, to first order.
    status : str
        The solver's own word for how it ended.
    solver : str
        The name of the one that ran.
    attempts : int
        Runs of the solver that it took.
    starts : int
        From which the solver ran, and the best of whose answers this is.
    lost : int
        Those of them that led to no answer.
    unknowns : int
        Of the nonlinear program.
    """

    intervals: int
    extra_points: int
    movable: int
    iterations: int
    seconds: float
    objective: float
    dynamics_error: float
    excess: float
    gain: float
    status: str
    solver: str = "ipopt"
    attempts: int = 1
    starts: int = 1
    lost: int = 0
    unknowns: int = 0

    def __repr__(self) -> str:
        return (
            f"MeshIteration({self.intervals} intervals, {self.iterations} iterations in "
            f"{self.seconds:.2g} s, objective {self.objective:.8g}, dynamics off by "
            f"{self.dynamics_error:.1e}, constraints by {self.excess:.1e}, gain {self.gain:.1e}, "
            f"{self.status})"
        )


def record_of(
    mesh: Mesh, result: NlpResult, solved: SolvedMesh | None, starts: int = 1, lost: int = 0
) -> MeshIteration:
    """The record of a mesh iteration; `solved` is None where the solver failed."""

    def error(name: str) -> float:
        return read_later(solved, "errors", attrgetter(name)) if solved else math.nan

    return MeshIteration(
        intervals=mesh.intervals,
        extra_points=sum(points.tau.size for phase in mesh.extra for points in phase),
        movable=sum(len(phase.movable) for phase in mesh.phases),
        iterations=result.iterations,
        seconds=result.seconds,
        objective=solved.iterate.objective if solved else math.nan,
        dynamics_error=error("dynamics"),
        excess=error("excess"),
        gain=error("gain"),
        status=result.status,
        solver=result.solver,
        attempts=result.attempts,
        starts=starts,
        lost=lost,
        unknowns=result.x.size,
    )


def iterations_of(rounds: Sequence[MeshIteration]) -> int:
    """Iterations of the solver over some mesh iterations."""
    return sum(entry.iterations for entry in rounds)
