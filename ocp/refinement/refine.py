"""A refinement: one mesh is solved after the other, until all tolerances are met.

`refine` is the loop of a solve. Each of its turns solves a mesh, looks at what was found between
the points, and asks whether that is good enough, and else for the next mesh (`planning`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ocp.accuracy import Accuracy
from ocp.mesh.mesh import Mesh
from ocp.nlp.interrupts import SecondInterrupt
from ocp.refinement.endings import ending_of
from ocp.refinement.first_start import first_answer
from ocp.refinement.mesh_solver import MeshSolver, Start
from ocp.refinement.planning import (
    History,
    PlannedMesh,
    first_plan,
    gap,
    look_at,
    next_plan,
    tight_plan,
)
from ocp.refinement.policies.brackets import most_iterations
from ocp.refinement.raised_peaks import with_raised_peaks
from ocp.refinement.search import FirstMesh, MeshAnswer
from ocp.refinement.solved_mesh import (
    Ending,
    MeshIteration,
    SolvedMesh,
    best_of,
    objective_error,
    worst_objective,
)
from ocp.refinement.stopped import budget_spent, interrupted
from ocp.transcription.packing import trajectory_of


@dataclass(frozen=True, eq=False, repr=False)
class Refinement:
    """The end of a refinement.

    Attributes
    ----------
    best : SolvedMesh
        The best mesh iteration that holds between its points, if need be to a looser tolerance; the
        last one if none does.
    mesh_iterations : tuple of MeshIteration
        Records of all, those before this refinement included.
    ending : str
        What ended it.
    solved : tuple of SolvedMesh
        Those of this refinement.
    """

    best: SolvedMesh
    mesh_iterations: tuple[MeshIteration, ...]
    ending: Ending
    solved: tuple[SolvedMesh, ...]

    @property
    def objective_error(self) -> float:
        """What the objective of the best one may be off by, as far as the meshes tell, relative."""
        last = self.best
        if self.ending == "tolerances" and last.iterate.scheme.informative_multipliers:
            return last.errors.gain
        return objective_error(self.solved, last)


def refine(
    meshes: MeshSolver,
    start: Start,
    mesh: Mesh,
    accuracy: Accuracy,
    before: Sequence[MeshIteration] = (),
) -> Refinement:
    """Solve, estimate the errors and refine, until all tolerances are met or the budget ends.

    Parameters
    ----------
    meshes : MeshSolver
    start : Iterate, Trajectory or None
        Where the first mesh starts; None for the guess in the statement.
    mesh : Mesh
        The first one.
    accuracy : Accuracy
        May be stricter than that of the settings.
    before : sequence of MeshIteration
        Mesh iterations until then.

    Raises
    ------
    SolveFailed
        No mesh was solved, the budget ended before one held between its points, an angle without
        bounds turns to and fro, a control has become an impulse, a state grows without bound, or
        the motion shrinks to next to no time.
    Interrupted
        The user stopped it.
    """
    history, planned, last = History(list(before)), first_plan(meshes, start, mesh), None
    ending: Ending | None = None
    try:
        while ending is None:
            answer = _solved(meshes, planned, accuracy, history)
            last = trajectory_of(answer.program, answer.result.x, meshes.parameters)
            step = look_at(meshes, planned, answer, accuracy, history)
            ending = step.ending or ending_of(meshes, history, step, accuracy)
            if ending is None:
                planned = next_plan(meshes, planned, step, history)
            elif tightly := tight_plan(meshes, planned, ending, history, accuracy):
                planned, ending = tightly, None
    except SecondInterrupt:
        raise
    except KeyboardInterrupt:
        ending = "interrupted"

    best, found = None, None
    if history.solved:
        best = _verifiable(meshes, history.solved, accuracy)
        found = Refinement(best, tuple(history.mesh_iterations), ending, tuple(history.solved))
    if ending == "interrupted":
        raise interrupted(meshes, history, last, best, found)
    if found is None or (ending == "budget" and not found.best.is_verifiable(accuracy)):
        raise budget_spent(meshes, history, last, best, found)
    return found


def _solved(
    meshes: MeshSolver, planned: PlannedMesh, accuracy: Accuracy, history: History
) -> MeshAnswer:
    """A mesh solved, the first one from several starts if need be; or what failed."""
    loose, before = planned.loose, tuple(history.mesh_iterations)
    solver = meshes.loose_solver if loose else meshes.solver
    solver = solver.within_gap(gap(history.solved, accuracy, loose=loose))
    # breakpoints that move are given up after a while, where there is a mesh to go back to
    most = most_iterations(history.solved, planned.program.mesh)
    # to what the settings ask for: a second refinement to stricter dynamics changes no objective
    sizes, asked = planned.program.scales, meshes.settings.accuracy
    worst = worst_objective(history.solved, sizes, asked)
    result = meshes.solve(planned.program, planned.start, solver, before, most=most, worst=worst)
    if planned.start is None:
        return first_answer(FirstMesh(meshes, solver, before), planned.program, result)
    return MeshAnswer(planned.program, result)


def _verifiable(meshes: MeshSolver, solved: Sequence[SolvedMesh], accuracy: Accuracy) -> SolvedMesh:
    """The best mesh iteration, with its peaks raised where no other one holds between its points.

    Without any that holds it is the best one as it is, and so it is on a fixed mesh.
    """
    best = best_of(solved, accuracy)
    if not meshes.settings.refinement.adapts or best.is_verifiable(accuracy):
        return best
    for each in reversed(solved):
        raised = with_raised_peaks(meshes, each, accuracy)
        if raised is not None and raised.is_verifiable(accuracy):
            return raised
    return best
