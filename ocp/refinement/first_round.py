"""The first mesh where the stated guess leads nowhere: other solvers, then simulated guesses.

A guess without any motion in it, as a straight line from start to end, may lead a solver to a point
where the violation of the constraints cannot be made smaller by small changes. That says nothing of
the problem. Here the solver starts anew: with another line search, with the barrier that strays
less, and from motions that are simulated under controls drawn at random
(`ocp.mesh.simulated_guess`). The best of the first few that it finds is the answer of the round.
The draws are the same in every run.

Controls of a few intervals may also be too coarse for any motion, where the limits leave little
room. So the same is tried on a finer mesh.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import cycle
from math import inf

import numpy as np

from ocp.mesh.initial_guess import initial_guess
from ocp.mesh.mesh import Mesh, uniform
from ocp.mesh.simulated_guess import simulated_guesses
from ocp.nlp.failures import counted
from ocp.nlp.result import NlpResult
from ocp.nlp.solver import NlpSolver, StartingPoint
from ocp.refinement.mesh_iteration import MeshIteration, MeshSolver, iterations_of
from ocp.transcription.packing import decision_vector
from ocp.transcription.transcribe import ProgramLimits, Transcription

# Iterations of an attempt, guesses that are simulated at most, answers that are compared, and
# guesses on a finer mesh, where each costs more.
_PATIENCE = 300
_GUESSES = 8
_ANSWERS = 3
_GUESSES_IF_FINER = 2

# Times as many intervals where a mesh has led to nothing, and the most that such a mesh may have.
# Controls of so many pieces are within a percent of any that switches now and then.
_FINER = 4
_FINEST = 400

# outcomes after which another start may do better, the last one if the run was long
_HOPEFUL = {"infeasible", "failed", "budget"}


def sought(
    meshes: MeshSolver,
    program: Transcription,
    solver: NlpSolver,
    failed: NlpResult,
    rounds: Sequence[MeshIteration],
) -> tuple[Transcription, NlpResult]:
    """The first mesh from other starts, then a finer one; what failed where none leads anywhere.

    Parameters
    ----------
    solver : NlpSolver
        As it was used from the stated guess.
    failed : NlpResult
        What came of that; its iterations are counted on.
    rounds : sequence of MeshIteration
        Before this one.
    """
    free, equations = counted(program.limits(meshes.parameters))
    short = failed.outcome == "budget" and failed.iterations < _PATIENCE
    if failed.outcome not in _HOPEFUL or short or equations > free:
        return program, failed

    result = _from_other_starts(meshes, program, solver, failed, rounds, _GUESSES)
    finer = _finer(meshes, program.mesh)
    if result.outcome not in _HOPEFUL or finer is None:
        return program, result

    again = meshes.first_program(None, finer)
    second = _from_other_starts(meshes, again, solver, result, rounds, _GUESSES_IF_FINER)
    solved = second.outcome in ("solved", "interrupted")
    return again if solved else program, second


def _finer(meshes: MeshSolver, mesh: Mesh) -> Mesh | None:
    """A mesh of `_FINER` times as many intervals, if the mesh may change and be that fine."""
    policy = meshes.settings.refinement
    if not policy.adapts or _FINER * mesh.intervals > _FINEST:
        return None
    phases = tuple(uniform(_FINER * p.intervals, int(p.degrees.max())) for p in mesh.phases)
    return Mesh(phases)


def _from_other_starts(
    meshes: MeshSolver,
    program: Transcription,
    solver: NlpSolver,
    failed: NlpResult,
    rounds: Sequence[MeshIteration],
    guesses: int,
) -> NlpResult:
    """The best answer of one program from other starts, or what failed before."""
    limits, answers = program.limits(meshes.parameters), list[NlpResult]()
    before, iterations, seconds = iterations_of(rounds), failed.iterations, failed.seconds
    for choice, point in _attempts(meshes, program, solver, limits, guesses):
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
    meshes: MeshSolver,
    program: Transcription,
    solver: NlpSolver,
    limits: ProgramLimits,
    count: int,
) -> Iterator[tuple[NlpSolver, StartingPoint]]:
    """Solvers and starting points in order."""
    # where a filter takes no step any more, a penalty function often does
    others = [*solver.alternatives(warm=True), *solver.alternatives(warm=False)]
    for other in others:
        yield other, meshes.starting_point(program, None, limits)

    stated = initial_guess(meshes.problem, meshes.parameters)
    guesses = simulated_guesses(
        meshes.problem,
        meshes.parameters,
        stated,
        program.scales.signals,
        count,
        np.random.default_rng(0),
    )
    for guess, choice in zip(guesses, cycle([solver, *others]), strict=False):
        yield (
            choice,
            StartingPoint(decision_vector(program, guess, limits, meshes.parameters.vector)),
        )
