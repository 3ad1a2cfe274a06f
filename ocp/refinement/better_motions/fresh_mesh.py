"""A motion on a mesh made anew, where a switch seems to be held at a wrong time.

A refinement puts breakpoints where its motion switches, and they move between their neighbours. The
motion may switch elsewhere later on, beyond fine intervals that were made for what is gone. There
each mesh moves a switch by an interval at best, and the finer the mesh, the less. On a mesh of as
few intervals as the motion needs, all of whose breakpoints move, nothing holds it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ocp.estimates.missed_switches import displaced_switches, held_far_away
from ocp.estimates.other_controls.promise import promise_of_other_valleys
from ocp.estimates.promised_gain import CERTIFIED_GAIN
from ocp.mesh.mesh import Mesh
from ocp.mesh.trajectory import Evaluator
from ocp.optimality.iterate import Iterate, iterate_of
from ocp.optimality.steps import steps_along
from ocp.refinement.better_motions.held_crossings import held_crossing
from ocp.refinement.mesh_iteration import MeshIteration, record_of
from ocp.refinement.mesh_solver import MeshSolver
from ocp.transcription.packing import trajectory_of

# Of the range of a signal: what merging intervals may change, at first, and where the solver does
# not come to an end on that mesh. It is the start of a solve only.
_MERGED = (1e-4, 1e-2)

# Of the objective: what moving a crossing of a kink by 1 % of the phase has to promise. Of answers
# to nine problems with such kinks, from several meshes each, nine promised more. One of these lost
# nothing, and the others up to 7e-5. Answers that promised less are not known to lose over 1e-6.
_HELD = 3e-5

# Iterations that are spent on each. Of eight meshes that freed a switch, none took more than 230.
_PATIENCE = 500


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
    phases = range(len(answer.mesh.phases))
    wrong = [_seems_wrong(answer, meshes.evaluator, index) for index in phases]
    # controls far away would bring more than switches at other times
    if not any(wrong) or promise_of_other_valleys(answer, meshes.evaluator):
        return None
    tried = (
        _solved(meshes, answer, _fresh(answer, meshes.evaluator, wrong, merged), rounds)
        for merged in _MERGED
    )
    found = next((iterate for iterate in tried if iterate is not None), None)
    if found is None:
        return None
    gained = meshes.problem.sense * (answer.objective - found.objective) / answer.objective_size
    better = found if gained > meshes.settings.accuracy.objective else None
    return FreshMotion(better, refutes=better is None and gained > -CERTIFIED_GAIN)


def _seems_wrong(answer: Iterate, evaluator: Evaluator, index: int) -> bool:
    """Whether a phase has a switch at a wrong time, as it seems, and its breakpoints may all move.

    They may not where some are at known times, or where an expression steps: between the points of
    a coarse mesh a step would be hidden.
    """
    name = answer.trajectory.phases[index].name
    displaced = displaced_switches(answer, evaluator, index)
    seems = bool(displaced.any()) or held_far_away(answer, evaluator, index)
    seems = seems or held_crossing(answer, evaluator, index) >= _HELD
    if not seems or answer.problem.instants[name]:
        return False
    steps = steps_along(answer.problem, answer.trajectory, evaluator)
    return not any(step.phase == name for step in steps)


def _solved(
    meshes: MeshSolver, answer: Iterate, mesh: Mesh, rounds: list[MeshIteration]
) -> Iterate | None:
    """The motion of a mesh, from an answer; None if the solver does not come to an end."""
    if meshes.spent(rounds):
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
    return iterate_of(program, result, trajectory_of(program, result.x, meshes.parameters))


def _fresh(answer: Iterate, evaluator: Evaluator, wrong: Sequence[bool], merged: float) -> Mesh:
    """A mesh made anew in the phases where a switch seems wrong, and held still in the others."""
    # loaded where it is needed: most solves end without
    from ocp.refinement.policies.moving_mesh import movable_mesh

    anew, still = movable_mesh(answer, evaluator, merged), answer.fixed_mesh
    places = range(len(wrong))
    return Mesh(
        tuple((anew if wrong[i] else still).phases[i] for i in places),
        tuple((anew if wrong[i] else still).extra[i] for i in places),
        tuple((anew if wrong[i] else still).back_off[i] for i in places),
    )
