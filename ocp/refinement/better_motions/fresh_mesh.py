"""A motion on a mesh made anew, where a switch seems to be held at a wrong time.

A refinement puts breakpoints where its motion switches, and they move between their neighbours. The
motion may switch elsewhere later on, beyond fine intervals that were made for what is gone. There
each mesh moves a switch by an interval at best, and the finer the mesh, the less. On a mesh of as
few intervals as the motion needs, all of whose breakpoints move, nothing holds it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from ocp.mesh.mesh import Mesh
from ocp.mesh.trajectory import Evaluator
from ocp.optimality.iterate import Iterate, iterate_of
from ocp.refinement.better_motions.saddles import held_still
from ocp.refinement.estimates.missed_switches import displaced_switches, held_far_away
from ocp.refinement.estimates.promised_gain import CERTIFIED_GAIN
from ocp.refinement.mesh_iteration import MeshIteration, record_of
from ocp.refinement.mesh_solver import MeshSolver
from ocp.refinement.policies.moving_mesh import movable_mesh
from ocp.transcription.packing import trajectory_of

# Of the range of a signal: what merging intervals may change. It is the start of a solve only.
_MERGED = 1e-4

# Iterations that are spent. From a motion nearby it takes fewer, if there is anything to find.
_PATIENCE = 300


@dataclass(frozen=True, eq=False, repr=False)
class FreshMotion:
    """What a mesh made anew brings.

    Attributes
    ----------
    better : Iterate or None
        A better motion, if there is one. It is not refined yet, so that its objective may seem less
        than it is.
    refutes : bool
        Whether the objective stays the same, so that no switch is at a wrong time.
    """

    better: Iterate | None
    refutes: bool


def on_fresh_mesh(
    meshes: MeshSolver, answer: Iterate, rounds: list[MeshIteration]
) -> FreshMotion | None:
    """An answer on a mesh made anew; None where no switch seems to be held at a wrong time.

    None too where the solver does not come to an end in time.

    Parameters
    ----------
    rounds : list of MeshIteration
        Until now. What is tried is appended.

    Raises
    ------
    KeyboardInterrupt
        The user stopped it.
    """
    mesh = _fresh(answer, meshes.evaluator)
    if mesh is None or meshes.spent(rounds):
        return None
    program = meshes.next_program(answer, mesh)
    result = meshes.solve(program, answer, meshes.settings.solver, rounds, most=_PATIENCE)
    if result.outcome == "interrupted":
        raise KeyboardInterrupt
    if result.outcome != "solved":
        rounds.append(record_of(program.mesh, result, None))
        return None
    solved = meshes.examined(program, result, tight=True, finer=False)
    rounds.append(record_of(program.mesh, result, solved))

    found = iterate_of(program, result, trajectory_of(program, result.x, meshes.parameters))
    gained = meshes.problem.sense * (answer.objective - found.objective) / answer.objective_size
    better = found if gained > meshes.settings.accuracy.objective else None
    return FreshMotion(better, refutes=better is None and gained > -CERTIFIED_GAIN)


def _fresh(answer: Iterate, evaluator: Evaluator) -> Mesh | None:
    """A mesh made anew where a switch seems to be held at a wrong time; None without any.

    Phases with instants at known times stay as they are, as breakpoints there have to.
    """
    far = [
        not answer.problem.instants[motion.name] and _seems_wrong(answer, evaluator, index)
        for index, motion in enumerate(answer.trajectory.phases)
    ]
    if not any(far):
        return None
    anew, still = movable_mesh(answer, evaluator, _MERGED), held_still(answer)
    pairs = list(zip(far, anew.phases, still.phases, strict=True))
    return replace(
        anew,
        phases=tuple(a if is_far else s for is_far, a, s in pairs),
        extra=tuple(
            a if is_far else s for is_far, a, s in zip(far, anew.extra, still.extra, strict=True)
        ),
        back_off=tuple({} if is_far else s for is_far, s in zip(far, still.back_off, strict=True)),
    )


def _seems_wrong(answer: Iterate, evaluator: Evaluator, index: int) -> bool:
    displaced = displaced_switches(answer, evaluator, index)
    return bool(displaced.any()) or held_far_away(answer, evaluator, index)
