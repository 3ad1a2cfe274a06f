"""The first mesh on other sides of the known times, where the guess says little of the motion.

Where a phase with a free time begins or ends between known times is a choice among a few, and each
of them may have an optimum of its own. So each is solved once, from the stated guess at times of
that choice, as long as there are few of them and the work is little.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ocp.arrays import Array
from ocp.mesh.initial_guess import InitialGuess, initial_guess
from ocp.mesh.mesh import Mesh, uniform
from ocp.mesh.phase_times import Ends, Time, drawn_times
from ocp.nlp.result import NlpResult
from ocp.nlp.solver import StartingPoint
from ocp.problem.phase import Phase
from ocp.problem.symbols import Between
from ocp.refinement.better_motions.across_known_times import sides_of
from ocp.refinement.first_round.starts import MeshAnswer, MeshRound, Retimed
from ocp.refinement.mesh_iteration import iterations_of
from ocp.refinement.mesh_solver import MeshSolver
from ocp.transcription.packing import decision_vector
from ocp.transcription.transcribe import Transcription, transcribe

# Choices that are solved at most, and draws of the times of several phases among which they are
# looked for. The work is iterations times unknowns: this much takes some seconds.
_CHOICES = 40
_DRAWS = 400
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
    best, last, starts, meshes = MeshAnswer(program, first), first, 1, first_round.meshes
    before, budget = iterations_of(first_round.before), meshes.budget
    for other, point in _others(meshes, program):
        late = budget.elapsed >= _SHARE * budget.seconds
        late |= before + last.iterations >= _SHARE * budget.iterations
        if late or (last.iterations - first.iterations) * other.columns.count >= _WORK:
            break
        for result in first_round.runs(other, [(first_round.solver, point)], last, _PATIENCE):
            last, starts = result, starts + 1
            if result.outcome == "interrupted":
                return MeshAnswer(other, result, starts)
            if result.outcome == "solved" and _beats(result, best.result):
                best = MeshAnswer(other, result)
    result = best.result
    if last is not first:
        result = _counted(best.result, last)
    return MeshAnswer(best.program, result, starts)


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
    seen = {sides_of(program)}
    for times in _choices(problem.phases, problem.instants, guessed):
        if len(seen) > _CHOICES:
            return
        other = transcribe(
            problem, mesh, program.scheme, program.controls, program.scales, program, times
        )
        if sides_of(other) in seen:
            continue
        seen.add(sides_of(other))
        phases = {name: Retimed(own, *times[name]) for name, own in stated.phases.items()}
        guess = InitialGuess(phases, stated.unknowns)
        x = decision_vector(other, guess, meshes.limits(other), meshes.parameters.vector)
        yield other, StartingPoint(np.nan_to_num(x))


def _choices(
    phases: Sequence[Phase],
    instants: Mapping[str, tuple[float, ...]],
    guessed: Mapping[str, Ends],
) -> Iterator[dict[str, Ends]]:
    """Times of phases on this and other sides of the known times."""
    if len(phases) == 1:
        (phase,), (ends,) = phases, guessed.values()
        known = np.array(instants[phase.name])
        pairs = list(_pairs(phase, known, ends))
        spread = np.linspace(0, len(pairs) - 1, min(len(pairs), _CHOICES)).round()
        yield from ({phase.name: pairs[int(k)]} for k in spread)
        return
    random = np.random.default_rng(0)
    for _ in range(_DRAWS):
        yield drawn_times(phases, guessed, random)


def _pairs(phase: Phase, known: Array, guessed: Ends) -> Iterator[Ends]:
    """Initial and final times of a phase, one in the middle of each pair of stretches."""
    duration = guessed[1] - guessed[0]
    first = _stretches(phase.start, known, duration)
    last = _stretches(phase.end, known, duration)
    for before, behind in first:
        for low, high in last:
            start, end = 0.5 * (before + behind), 0.5 * (low + high)
            if start >= end:  # in the same stretch
                start, end = before + 0.25 * (behind - before), low + 0.75 * (high - low)
            if start < end:
                yield start, end


def _stretches(time: Time, known: Array, duration: float) -> list[Ends]:
    """The parts of the limits of a time between known ones [s]."""
    if not isinstance(time, Between):
        return [(float(time), float(time))]
    lower = time.lower if math.isfinite(time.lower) else min(known[0], time.upper) - 2 * duration
    upper = time.upper if math.isfinite(time.upper) else max(known[-1], time.lower) + 2 * duration
    inside = known[(known > lower) & (known < upper)]
    knots = [float(lower), *inside.tolist(), float(upper)]
    return list(itertools.pairwise(knots))
