"""What a refinement solves next: its first mesh, and the one after a mesh solved or failed.

The mesh policy chooses intervals. What is decided here is the rest: how tightly a mesh is
solved, and whether one is solved again.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ocp.accuracy import Accuracy
from ocp.arrays import Array
from ocp.mesh.mesh import Mesh, same_intervals
from ocp.nlp.failures import failure
from ocp.numerics.piecewise_polynomial import Extremes
from ocp.optimality.iterate import Iterate
from ocp.refinement.mesh_solver import MeshSolver, Start
from ocp.refinement.policies.policy import MeshPolicy
from ocp.refinement.search import MeshAnswer
from ocp.refinement.solved_mesh import (
    CUT_SHORT,
    OVERESTIMATE,
    Ending,
    MeshIteration,
    SolvedMesh,
    best_of,
    best_start,
    record_of,
)
from ocp.transcription.packing import trajectory_of
from ocp.transcription.transcribe import Transcription

# While the last mesh was off by this much, or by so many tolerances, the next one is about to be
# replaced, too.
_FAR, _FAR_IN_TOLERANCES = 1e-3, 1000.0

# Times that a mesh without errors is solved again because its objective was far from its size.
_SIZINGS = 4

# A mesh iteration may end above the least objective of its mesh by this part of the estimated gain
# of finer controls, or of the tolerance on the objective. A motion further from it is not the one
# to be refined.
_NEAR = 0.1

# Nor may one that is not replaced end further above it than by this part of the objective: controls
# are off by its root, and limits are exceeded by that.
_NEARER = 1e-6

log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False, repr=False)
class History:
    """The mesh iterations of a refinement until now.

    The lists grow with each mesh, so what was found is kept, whatever error ends the refinement.

    Attributes
    ----------
    mesh_iterations : list of MeshIteration
        Records of all mesh iterations of the solve, those before this refinement included.
    solved : list of SolvedMesh
        What the solver finished in this refinement.
    before : int
        Number of mesh iterations before this refinement.
    """

    mesh_iterations: list[MeshIteration]
    solved: list[SolvedMesh] = field(default_factory=list)
    before: int = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "before", len(self.mesh_iterations))


@dataclass(frozen=True, eq=False, repr=False)
class PlannedMesh:
    """The mesh that is solved next, and how.

    Attributes
    ----------
    program : Transcription
        Of the mesh.
    start : Iterate, Trajectory or None
        Where the solver starts; None for the guess in the statement.
    policy : MeshPolicy
        That chooses what follows.
    loose : bool
        Whether it is not solved to the tolerance asked for, as it will be replaced too.
    finer : bool
        Whether it has more intervals than the one before.
    violations_removed : int
        Meshes until now that only imposed limits at more points, each of which left less over them.
    """

    program: Transcription
    start: Start
    policy: MeshPolicy
    loose: bool
    finer: bool = False
    violations_removed: int = 0


@dataclass(frozen=True, eq=False, repr=False)
class NextStep:
    """What a policy and the last mesh ask for next.

    Attributes
    ----------
    mesh : Mesh or None
        The next one; None where the refinement ends here.
    policy : MeshPolicy
        That it goes on with.
    ending : str or None
        Why it ends here.
    over : bool
        Whether the policy allows no further mesh.
    loose : bool
        Whether the next mesh is not solved to the tolerance asked for, as it will be replaced too.
    again : bool
        Whether the next mesh is the last one, to be solved to the tolerance asked for.
    removes_violations : bool
        Whether the next mesh only imposes limits at more points, and each time less is left over
        them.
    examining : float
        What it took to look at the last mesh between its points [s].
    """

    mesh: Mesh | None
    policy: MeshPolicy
    ending: Ending | None = None
    over: bool = False
    loose: bool = False
    again: bool = False
    removes_violations: bool = False
    examining: float = 0.0


def first_plan(meshes: MeshSolver, start: Start, mesh: Mesh) -> PlannedMesh:
    """The first mesh of a refinement."""
    policy = meshes.settings.refinement
    # without multipliers the first mesh is solved loosely, and its digits are lost with it
    loose = policy.adapts and not isinstance(start, Iterate)
    program = meshes.first_program(start, mesh)
    return PlannedMesh(program, start, policy, loose=loose and _can_be_loose(meshes))


def look_at(
    meshes: MeshSolver,
    planned: PlannedMesh,
    found: MeshAnswer,
    accuracy: Accuracy,
    history: History,
) -> NextStep:
    """What follows on a mesh, by its errors between the points or by how it failed.

    Parameters
    ----------
    found : MeshAnswer
        What came of the planned mesh. It is appended to the history, with its errors.

    Raises
    ------
    SolveFailed
        Nothing was solved.
    """
    is_solved = found.result.outcome == "solved"
    after = _after_solved if is_solved else _after_failure
    step = after(meshes, planned, found, accuracy, history)
    if step.ending is not None:
        return step

    # points that remove a violation step by step cost little, and are no finer mesh
    most, closed = planned.policy.rounds, planned.violations_removed + step.removes_violations
    over = len(history.mesh_iterations) - history.before >= most + min(closed, most)
    step = replace(step, over=over)
    if is_solved and _once_more(meshes, history.solved, step.mesh, accuracy, over=over):
        return replace(step, mesh=history.solved[-1].iterate.mesh, loose=False, again=True)
    return replace(step, ending="tolerances") if step.mesh is None else step


def next_plan(
    meshes: MeshSolver, planned: PlannedMesh, step: NextStep, history: History
) -> PlannedMesh:
    """The mesh that a step asks for, from a motion that was found and its multipliers."""
    assert step.mesh is not None
    start = best_start(history.solved).iterate
    return PlannedMesh(
        program=meshes.next_program(start, step.mesh),
        start=start,
        policy=step.policy,
        loose=step.loose and _can_be_loose(meshes),
        finer=step.mesh.intervals > planned.program.mesh.intervals,
        violations_removed=planned.violations_removed + step.removes_violations,
    )


def tight_plan(
    meshes: MeshSolver, planned: PlannedMesh, ending: Ending, history: History, accuracy: Accuracy
) -> PlannedMesh | None:
    """The best mesh once more from its own motion, where the loop would end with a loose solve.

    None if it is cut short, if no motion holds, or if that mesh has just been solved so.
    """
    if ending in CUT_SHORT or not history.solved:
        return None
    best = best_of(history.solved, accuracy)
    again = planned.program.mesh is best.iterate.mesh and not planned.loose
    if best.tight or again or not best.is_verifiable(accuracy):
        return None
    program = meshes.next_program(best.iterate, best.iterate.mesh)
    return replace(planned, program=program, start=best.iterate, loose=False, finer=False)


def _can_be_loose(meshes: MeshSolver) -> bool:
    """Whether a looser tolerance than that asked for is another one."""
    return meshes.loose_solver is not meshes.solver


def _after_solved(
    meshes: MeshSolver,
    planned: PlannedMesh,
    found: MeshAnswer,
    accuracy: Accuracy,
    history: History,
) -> NextStep:
    """The step after a mesh that was solved, once that is in the history."""
    began, solved, mesh_iterations = meshes.budget.elapsed, history.solved, history.mesh_iterations
    program, result = found.program, found.result
    last = meshes.examined(program, result, tight=not planned.loose, finer=planned.finer)
    solved.append(last)

    # a policy that adapts reads the errors; the record of another one is not to wait for them
    following = planned.policy.next_mesh(solved, accuracy)
    mesh_iterations.append(record_of(program.mesh, result, last, found.starts, found.lost))
    log.info("mesh iteration %d: %s", len(mesh_iterations), mesh_iterations[-1])
    return NextStep(
        following,
        planned.policy,
        loose=following is not None and _is_far(last, accuracy),
        removes_violations=_removes_violations(solved, following),
        examining=meshes.budget.elapsed - began,
    )


def _after_failure(
    meshes: MeshSolver,
    planned: PlannedMesh,
    found: MeshAnswer,
    accuracy: Accuracy,
    history: History,
) -> NextStep:
    """The step after a mesh on which the solver failed, or what ends the refinement there."""
    solved, mesh_iterations, mesh = history.solved, history.mesh_iterations, found.program.mesh
    mesh_iterations.append(record_of(mesh, found.result, None))
    if found.result.outcome == "interrupted":
        return NextStep(None, planned.policy, "interrupted")
    if meshes.spent(mesh_iterations):
        return NextStep(None, planned.policy, "budget")
    if not solved:
        last = trajectory_of(found.program, found.result.x, meshes.parameters)
        raise failure(found.program, found.result, meshes.parameters, last)

    recovery = planned.policy.after_failure(solved, mesh, accuracy)
    if recovery is None:
        return NextStep(None, planned.policy, "failure")
    other, following = recovery
    return NextStep(following, other, loose=planned.loose)


def gap(solved: Sequence[SolvedMesh], accuracy: Accuracy, *, loose: bool) -> float:
    """How far above the least objective of its mesh the solver may end, relative."""
    if not loose:
        return min(_NEAR * accuracy.objective, _NEARER)
    if not solved:
        return math.inf
    return _NEAR * max(accuracy.objective, solved[-1].errors.gain)


def _removes_violations(solved: Sequence[SolvedMesh], following: Mesh | None) -> bool:
    """Whether the next mesh has the same intervals, and the last one left less over its limits."""
    if following is None or len(solved) < 2:
        return False
    before, last = solved[-2:]
    if following is last.iterate.mesh or last.excess >= before.excess:
        return False
    pairs = zip(following.phases, last.iterate.mesh.phases, strict=True)
    return all(same_intervals(new, old) for new, old in pairs)


def _once_more(
    meshes: MeshSolver,
    solved: Sequence[SolvedMesh],
    following: Mesh | None,
    accuracy: Accuracy,
    *,
    over: bool,
) -> bool:
    """Whether the last mesh is solved again before the loop ends.

    It is where it was not yet solved to the tolerance asked for, or where the objective turned out
    to be far from the size that this tolerance is relative to.
    """
    last = solved[-1]
    if not last.tight:
        # those digits are not worth a large program that is left with peaks exceeded between the
        # points
        return over or (following is None and not _leaves_more_open(last, accuracy))
    again = sum(s.iterate.mesh is last.iterate.mesh for s in solved if s.tight)
    if following is not None or over or again > _SIZINGS:
        return False
    return meshes.scales_after(last.iterate) is not last.iterate.scales


def _leaves_more_open(last: SolvedMesh, accuracy: Accuracy) -> bool:
    """Whether what a mesh leaves open is far more than the digits of a loose solve."""
    much = last.errors.gain > OVERESTIMATE * accuracy.objective
    return much and not last.is_verifiable(accuracy)


def _is_far(last: SolvedMesh, accuracy: Accuracy) -> bool:
    """Whether digits of the next mesh are lost, because that one will be replaced, too.

    Where little is left to gain, a violation counts by the time that it takes. One in a few narrow
    intervals is no reason for a loose solve: most of the next mesh is the same as the one after it,
    and controls that are a little off exceed limits at other places.
    """
    errors, excess = last.errors, last.errors.excess
    if errors.gain <= OVERESTIMATE * accuracy.objective:
        phases = zip(last.iterate.trajectory.phases, errors.phases, strict=True)
        excess = max(mean_excess(motion.fractions, of_phase.excess) for motion, of_phase in phases)
    off = (
        (errors.gain / OVERESTIMATE, accuracy.objective / OVERESTIMATE),
        (errors.dynamics, accuracy.dynamics),
        (excess, accuracy.path),
    )
    return any(value >= min(_FAR, _FAR_IN_TOLERANCES * allowed) for value, allowed in off)


def mean_excess(fractions: Array, excess: Sequence[Extremes]) -> float:
    """The worst excess in each interval of a phase, averaged over its time; 0 without any.

    Parameters
    ----------
    fractions : (N + 1,)
        Breakpoints as fractions of the phase.
    excess : sequence of Extremes
        Of each path constraint, relative.
    """
    widths = np.diff(fractions)
    worst = np.max([np.zeros_like(widths), *[e.values for e in excess]], axis=0)
    return float(widths @ worst)
