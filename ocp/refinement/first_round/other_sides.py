"""The first mesh on other sides of the known times, where the guess says little of the motion.

Where a phase with a free time begins or ends between known times is a choice among a few, and each
of them may have an optimum of its own. So each is solved from the stated guess at times of that
choice, as long as there are few of them and the work is little.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ocp.mesh.initial_guess import InitialGuess, initial_guess
from ocp.mesh.known_times import with_known_times
from ocp.mesh.mesh import Mesh, uniform
from ocp.nlp.result import NlpResult
from ocp.nlp.solver import StartingPoint
from ocp.refinement.better_motions.across_known_times import sides_of
from ocp.refinement.first_round.side_choices import side_choices
from ocp.refinement.first_round.starts import MeshAnswer, MeshRound, Retimed
from ocp.refinement.mesh_iteration import iterations_of
from ocp.refinement.mesh_solver import MeshSolver
from ocp.transcription.packing import decision_vector
from ocp.transcription.transcribe import Transcription, transcribe

# Choices that are solved at most. The work is iterations times unknowns: this much takes some
# seconds.
_CHOICES = 40
_WORK = 2e6

# Iterations of each, and the parts of a budget that may go into all.
_PATIENCE = 150
_SHARE = 0.3


def best_side(first_round: MeshRound, program: Transcription, first: NlpResult) -> MeshAnswer:
    """The best answer of the first mesh on this and the other sides of the known times.

    Parameters
    ----------
    program : Transcription
        Of the first mesh, where the guess is.
    first : NlpResult
        What came of it. The answer counts what all took.
    """
    best, last, meshes = MeshAnswer(program, first), first, first_round.meshes
    starts, lost = 1, int(first.outcome != "solved")
    before, budget = iterations_of(first_round.before), meshes.budget
    for other, point in _others(meshes, program):
        late = budget.elapsed >= _SHARE * budget.seconds
        late |= before + last.iterations >= _SHARE * budget.iterations
        if late or (last.iterations - first.iterations) * other.columns.count >= _WORK:
            break
        for result in first_round.runs(other, [(first_round.solver, point)], last, _PATIENCE):
            last, starts = result, starts + 1
            lost += result.outcome != "solved"
            if result.outcome == "interrupted":
                return MeshAnswer(other, result, starts, lost)
            if result.outcome == "solved" and _beats(result, best.result):
                best = MeshAnswer(other, result)
    result = best.result
    if last is not first:
        result = _counted(best.result, last)
    return MeshAnswer(best.program, result, starts, lost)


def _beats(found: NlpResult, best: NlpResult) -> bool:
    return best.outcome != "solved" or found.objective < best.objective


def _counted(result: NlpResult, last: NlpResult) -> NlpResult:
    return replace(result, iterations=last.iterations, seconds=last.seconds)


def _others(
    meshes: MeshSolver, program: Transcription
) -> Iterator[tuple[Transcription, StartingPoint]]:
    """Programs on other sides of the known times, and where they start."""
    problem = meshes.problem
    stated = initial_guess(problem, meshes.parameters)
    guessed = {name: (phase.start, phase.end) for name, phase in stated.phases.items()}
    mesh = Mesh(tuple(uniform(p.intervals, int(p.degrees.max())) for p in program.mesh.phases))
    programs = {sides_of(program.mesh): program}
    for times in side_choices(problem.phases, problem.instants, guessed, _CHOICES):
        placed = with_known_times(problem, mesh, times, program.mesh)
        if sides_of(placed) not in programs:
            programs[sides_of(placed)] = transcribe(
                problem, placed, program.scheme, program.controls, program.scales, program
            )
        other = programs[sides_of(placed)]
        phases = {name: Retimed(own, *times[name]) for name, own in stated.phases.items()}
        guess = InitialGuess(phases, stated.unknowns)
        x = decision_vector(other, guess, meshes.limits(other), meshes.parameters.vector)
        yield other, StartingPoint(np.nan_to_num(x))
