"""The first mesh from more than one start, where the statement leads nowhere or states no guess.

A guess without any motion in it, as a straight line from start to end, may lead a solver to a point
where the violation of the constraints cannot be made smaller by small changes. That says nothing of
the problem. Here the solver starts anew: with another line search, with the barrier that strays
less, and from motions that are simulated under controls drawn at random
(`ocp.mesh.simulated_guess`). The best of the first few that it finds is the answer of the round.
The draws are the same in every run.

Controls of a few intervals may also be too coarse for any motion, where the limits leave little
room. So the same is tried on a finer mesh.

Who states no guess, or one in which a state that must move stays, says nothing of which optimum is
near. So an answer from there is held
against those from simulated motions, until the best of them was found twice. Where all rates are
linear in the signals it is not: such problems hardly ever have several optima.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import cycle
from math import inf

import casadi as ca
import numpy as np

from ocp.mesh.initial_guess import initial_guess, states_a_motion
from ocp.mesh.mesh import Mesh, uniform
from ocp.mesh.simulated_guess import simulated_guesses
from ocp.nlp.failures import counted
from ocp.nlp.result import NlpResult
from ocp.nlp.solver import NlpSolver, StartingPoint
from ocp.problem.problem import Problem
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

# Guesses that the answer of a problem without a guess is held against at most, and the relative
# difference of two answers of one mesh that are the same.
_OTHERS = 4
_SAME = 1e-5

# outcomes after which another start may do better, the last one if the run was long
_HOPEFUL = {"infeasible", "failed", "budget"}


def first_answer(
    meshes: MeshSolver,
    program: Transcription,
    solver: NlpSolver,
    result: NlpResult,
    rounds: Sequence[MeshIteration],
) -> tuple[Transcription, NlpResult]:
    """What came of the first mesh from the stated guess, or something better from other starts.

    Parameters
    ----------
    solver : NlpSolver
        As it was used from the stated guess.
    result : NlpResult
        What came of that; its iterations are counted on.
    rounds : sequence of MeshIteration
        Before this one.
    """
    if result.outcome != "solved":
        return _sought(meshes, program, solver, result, rounds)
    stated = states_a_motion(meshes.problem, meshes.parameters)
    if stated or _has_linear_rates(meshes.problem):
        return program, result
    return program, _best_of_several(meshes, program, solver, result, rounds)


def _has_linear_rates(problem: Problem) -> bool:
    """Whether the rates of all states are linear in the signals."""
    return all(
        ca.is_linear(
            ca.vertcat(*phase.dynamics.values()),
            ca.vertcat(*(signal.symbol for signal in problem.signals[phase.name])),
        )
        for phase in problem.phases
    )


def _best_of_several(
    meshes: MeshSolver,
    program: Transcription,
    solver: NlpSolver,
    first: NlpResult,
    rounds: Sequence[MeshIteration],
) -> NlpResult:
    """The best answer from where the guess is, which states no motion, and from simulated ones."""
    limits, best, last = program.limits(meshes.parameters), first, first
    attempts = ((solver, point) for point in _simulated(meshes, program, limits, _OTHERS))
    for last in _runs(meshes, program, attempts, limits, first, rounds):
        if last.outcome == "interrupted":
            return last
        if last.outcome != "solved":
            continue
        if abs(last.objective - best.objective) <= _SAME * abs(best.objective):
            break
        best = min(best, last, key=lambda answer: answer.objective)
    return replace(best, iterations=last.iterations, seconds=last.seconds)


def _sought(
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
    limits, answers, last = program.limits(meshes.parameters), list[NlpResult](), failed
    attempts = _attempts(meshes, program, solver, limits, guesses)
    for last in _runs(meshes, program, attempts, limits, failed, rounds):
        if last.outcome == "interrupted":
            return last
        if last.outcome == "solved":
            answers.append(last)
        if len(answers) == _ANSWERS:
            break

    best = min(answers, key=lambda answer: answer.objective, default=failed)
    return replace(best, iterations=last.iterations, seconds=last.seconds)


def _runs(
    meshes: MeshSolver,
    program: Transcription,
    attempts: Iterable[tuple[NlpSolver, StartingPoint]],
    limits: ProgramLimits,
    first: NlpResult,
    rounds: Sequence[MeshIteration],
) -> Iterator[NlpResult]:
    """What comes of attempts while the budget lasts; each counts what all took since the first."""
    before, iterations, seconds = iterations_of(rounds), first.iterations, first.seconds
    for solver, point in attempts:
        if meshes.budget.spent(before + iterations):
            return
        patient = meshes.budget.within(solver.within(_PATIENCE, inf), before + iterations)
        result = meshes.run(program, patient, point, limits, len(rounds) + 1)
        iterations, seconds = iterations + result.iterations, seconds + result.seconds
        yield replace(result, iterations=iterations, seconds=seconds)


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

    points = _simulated(meshes, program, limits, count)
    yield from zip(cycle([solver, *others]), points, strict=False)


def _simulated(
    meshes: MeshSolver, program: Transcription, limits: ProgramLimits, count: int
) -> Iterator[StartingPoint]:
    """Starting points from simulated motions, the same in every run."""
    guesses = simulated_guesses(
        meshes.problem,
        meshes.parameters,
        initial_guess(meshes.problem, meshes.parameters),
        program.scales.signals,
        count,
        np.random.default_rng(0),
    )
    for guess in guesses:
        yield StartingPoint(decision_vector(program, guess, limits, meshes.parameters.vector))
