"""The first mesh where the stated guess leads nowhere: another barrier, then simulated guesses.

A guess without any motion in it, as a straight line from start to end, may lead a solver to a point
where the violation of the constraints cannot be made smaller by small changes. That says nothing of
the problem. Here the solver starts anew: with the barrier that strays less, and from motions that
are simulated under controls drawn at random (`ocp.mesh.simulated_guess`). The best of the first few
that it finds is the answer of the round. The draws are the same in every run.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import cycle
from math import inf

import numpy as np

from ocp.mesh.initial_guess import initial_guess
from ocp.mesh.simulated_guess import simulated_guesses
from ocp.nlp.failures import counted
from ocp.nlp.result import NlpResult
from ocp.nlp.solver import NlpSolver, StartingPoint
from ocp.refinement.mesh_iteration import MeshIteration, MeshSolver, iterations_of
from ocp.transcription.packing import decision_vector
from ocp.transcription.transcribe import ProgramLimits, Transcription

# Iterations of an attempt, guesses that are simulated at most, and answers that are compared.
_PATIENCE = 300
_GUESSES = 8
_ANSWERS = 3

# outcomes after which another start may do better, the last one if the run was long
_HOPEFUL = {"infeasible", "failed", "budget"}


def sought(
    meshes: MeshSolver,
    program: Transcription,
    solver: NlpSolver,
    failed: NlpResult,
    rounds: Sequence[MeshIteration],
) -> NlpResult:
    """The first mesh from other starts; the failed result where none of them leads to an answer.

    Parameters
    ----------
    solver : NlpSolver
        As it was used from the stated guess.
    failed : NlpResult
        What came of that; its iterations are counted on.
    rounds : sequence of MeshIteration
        Before this one.
    """
    limits, answers = program.limits(meshes.parameters), list[NlpResult]()
    free, equations = counted(limits)
    short = failed.outcome == "budget" and failed.iterations < _PATIENCE
    if failed.outcome not in _HOPEFUL or short or equations > free:
        return failed

    before, iterations, seconds = iterations_of(rounds), failed.iterations, failed.seconds
    for choice, point in _attempts(meshes, program, solver, limits):
        if meshes.budget.spent(before + iterations):
            break
        patient = meshes.budget.within(choice.within(_PATIENCE, inf), before + iterations)
        result = meshes.run(program, patient, point, limits, len(rounds) + 1)
        iterations, seconds = iterations + result.iterations, seconds + result.seconds
        if result.outcome == "interrupted":
            return replace(result, iterations=iterations, seconds=seconds)
        if result.outcome == "solved":
            answers.append(result)
        if len(answers) == _ANSWERS:
            break

    best = min(answers, key=lambda answer: answer.objective, default=failed)
    return replace(best, iterations=iterations, seconds=seconds)


def _attempts(
    meshes: MeshSolver, program: Transcription, solver: NlpSolver, limits: ProgramLimits
) -> Iterator[tuple[NlpSolver, StartingPoint]]:
    """Solvers and starting points in order."""
    others = solver.alternatives(warm=False)
    for other in others:
        yield other, meshes.starting_point(program, None, limits)

    stated = initial_guess(meshes.problem, meshes.parameters)
    guesses = simulated_guesses(
        meshes.problem,
        meshes.parameters,
        stated,
        program.scales.signals,
        _GUESSES,
        np.random.default_rng(0),
    )
    for guess, choice in zip(guesses, cycle([solver, *others]), strict=False):
        yield (
            choice,
            StartingPoint(decision_vector(program, guess, limits, meshes.parameters.vector)),
        )
