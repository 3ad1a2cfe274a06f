"""Mesh rounds: the record that a solution keeps, and what the loop knows of a solved one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ocp.mesh.mesh import Mesh
from ocp.nlp.result import NlpResult
from ocp.optimality.iterate import Iterate
from ocp.refinement.accuracy import Accuracy
from ocp.refinement.error_estimate import MeshErrors


@dataclass(frozen=True)
class MeshIteration:
    """One mesh round: its mesh, what the solver took, and what was wrong between the points.

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
        In the user's sense and unit; nan where the solver failed, as are the next three.
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

    def __repr__(self) -> str:
        return (
            f"MeshIteration({self.intervals} intervals, {self.iterations} iterations in "
            f"{self.seconds:.2g} s, objective {self.objective:.8g}, dynamics off by "
            f"{self.dynamics_error:.1e}, constraints by {self.excess:.1e}, gain {self.gain:.1e}, "
            f"{self.status})"
        )


@dataclass(frozen=True, eq=False)
class SolvedMesh:
    """A mesh round that the solver finished, as the next one and the refinement policy see it.

    Attributes
    ----------
    iterate : Iterate
        The motion found, with its multipliers.
    errors : MeshErrors
        What is wrong with it between its points.
    violation : float
        Largest violation of the program's rows, scaled.
    tight : bool
        Whether it was solved to the tolerance asked for.
    finer : bool
        Whether its mesh has more intervals than the one before.
    """

    iterate: Iterate
    errors: MeshErrors
    violation: float
    tight: bool
    finer: bool

    def holds(self, accuracy: Accuracy) -> bool:
        """Whether the motion meets the dynamics and all constraints, between its points too."""
        excess = max(self.errors.excess, self.violation)
        return self.errors.dynamics <= accuracy.dynamics and excess <= accuracy.path


def best_of(solved: Sequence[SolvedMesh], accuracy: Accuracy) -> SolvedMesh:
    """The best round that holds between the points; the last one if none does.

    Those solved to the tolerance asked for come first: values of others err by theirs.
    """
    good = [s for s in solved if s.holds(accuracy)]
    good = [s for s in good if s.tight] or good
    sense = solved[-1].iterate.problem.sense
    return min(good, key=lambda s: sense * s.iterate.objective, default=solved[-1])


def record_of(mesh: Mesh, result: NlpResult, solved: SolvedMesh | None) -> MeshIteration:
    """The record of a mesh round; `solved` is None where the solver failed."""
    errors = solved.errors if solved else None
    return MeshIteration(
        intervals=mesh.intervals,
        extra_points=sum(points.tau.size for phase in mesh.extra for points in phase),
        movable=sum(len(phase.movable) for phase in mesh.phases),
        iterations=result.iterations,
        seconds=result.seconds,
        objective=solved.iterate.objective if solved else math.nan,
        dynamics_error=errors.dynamics if errors else math.nan,
        excess=errors.excess if errors else math.nan,
        gain=errors.gain if errors else math.nan,
        status=result.status,
        solver=result.solver,
    )
