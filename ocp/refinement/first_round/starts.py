"""Starts of a mesh beside the stated guess or the motion before, and what comes of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from ocp.mesh.initial_guess import InitialGuess, guess_by_lines, initial_guess
from ocp.mesh.mesh import Mesh, uniform
from ocp.nlp.solver import NlpResult, NlpSolver, StartingPoint
from ocp.refinement.mesh_iteration import MeshIteration, iterations_of
from ocp.refinement.mesh_solver import MeshSolver
from ocp.transcription.packing import decision_vector
from ocp.transcription.transcribe import Transcription

Attempts = Iterable[tuple[NlpSolver, StartingPoint]]

# Iterations of an attempt at most
PATIENCE = 300

# An attempt also ends after this many times the iterations that answers from other starts took, but
# not before the second number: what takes longer has mostly lost its way.
_TIMES_THE_USUAL = 5
_LEAST_PATIENCE = 60
# The same where answers agree already, and further starts only confirm them. In 77 searches of 27
# problems none of these found a better answer.
_TIMES_TO_CONFIRM = 2
_LEAST_TO_CONFIRM = 30

# Times as many intervals where a mesh has led to nothing, and the most that such a mesh may have.
# Controls of so many pieces are within a percent of any that switches now and then.
_FINER = 4
_FINEST = 400


@dataclass(frozen=True, eq=False, repr=False)
class MeshRound:
    """A mesh iteration while it is solved: what all starts of it share.

    Attributes
    ----------
    meshes : MeshSolver
    solver : NlpSolver
        As it is used from the first start.
    before : tuple of MeshIteration
        Mesh iterations until this one.
    """

    meshes: MeshSolver
    solver: NlpSolver
    before: tuple[MeshIteration, ...]

    def runs(
        self,
        program: Transcription,
        attempts: Attempts,
        done: NlpResult,
        patience: float = PATIENCE,
        agreed: Callable[[Sequence[NlpResult]], bool] = lambda _: False,
    ) -> Iterator[NlpResult]:
        """What comes of attempts while the budget lasts; each counts what all took since `done`.

        Parameters
        ----------
        done : NlpResult
            The last run on this mesh.
        patience : float
            Iterations of each attempt at most.
        agreed : callable
            Whether the answers until now agree, so that the next attempt only confirms them.
        """
        limits, before = self.meshes.limits(program), iterations_of(self.before)
        iterations, seconds = done.iterations, done.seconds
        answers: list[NlpResult] = []
        for solver, point in attempts:
            if self.meshes.budget.spent(before + iterations):
                return
            usual = _usual_patience(answers, confirms=agreed(answers))
            patient = solver.within(min(patience, usual), inf)
            patient = self.meshes.budget.within(patient, before + iterations)
            result = self.meshes.run(program, patient, point, limits, len(self.before) + 1)
            if result.outcome == "solved":
                answers.append(result)
            iterations, seconds = iterations + result.iterations, seconds + result.seconds
            yield replace(result, iterations=iterations, seconds=seconds)


@dataclass(frozen=True, eq=False, repr=False)
class MeshAnswer:
    """What came of a mesh.

    Attributes
    ----------
    program : Transcription
        The mesh that the answer belongs to.
    result : NlpResult
        The best answer, or what failed; it counts what all starts took.
    starts : int
        From which the solver ran, the first one among them.
    lost : int
        Those of them that led to no answer.
    """

    program: Transcription
    result: NlpResult
    starts: int = 1
    lost: int = 0


def _usual_patience(answers: Sequence[NlpResult], *, confirms: bool) -> float:
    """Iterations after which an attempt counts as lost, by those that led to answers."""
    if not answers:
        return inf
    times, least = (
        (_TIMES_TO_CONFIRM, _LEAST_TO_CONFIRM) if confirms else (_TIMES_THE_USUAL, _LEAST_PATIENCE)
    )
    return max(least, times * float(np.median([answer.iterations for answer in answers])))


def simulated(
    meshes: MeshSolver, program: Transcription, count: int, most: float = inf
) -> Iterator[StartingPoint]:
    """Starting points from simulated motions, the same in every run.

    Parameters
    ----------
    most : float
        That one may miss its end and its limits by, in their sizes.
    """
    from ocp.mesh.simulated_guess import simulated_guesses  # most problems need no other start

    guesses = simulated_guesses(
        meshes.problem,
        meshes.parameters,
        initial_guess(meshes.problem, meshes.parameters),
        program.scales.signals,
        program.scales.bounds,
        count,
        np.random.default_rng(0),
        most,
    )
    for guess in guesses:
        yield _point(meshes, program, guess)


def wavy(meshes: MeshSolver, program: Transcription, count: int) -> Iterator[StartingPoint]:
    """Starting points of random waves around straight lines, the same in every run."""
    from ocp.mesh.wavy_guess import wavy_guess

    lines = guess_by_lines(meshes.problem, meshes.parameters)
    sizes, random = program.scales, np.random.default_rng(0)
    for _ in range(count):
        guess = wavy_guess(
            meshes.problem, meshes.parameters, lines, sizes.signals, sizes.unknowns, random
        )
        yield _point(meshes, program, guess)


def _point(meshes: MeshSolver, program: Transcription, guess: InitialGuess) -> StartingPoint:
    limits = meshes.limits(program)
    # a wave may leave where an expression has a value
    columns = np.nan_to_num(decision_vector(program, guess, limits, meshes.parameters.vector))
    return StartingPoint(columns)


def finer_mesh(meshes: MeshSolver, mesh: Mesh) -> Mesh | None:
    """A mesh of `_FINER` times as many intervals, if the mesh may change and be that fine."""
    policy = meshes.settings.refinement
    if not policy.adapts or _FINER * mesh.intervals > _FINEST:
        return None
    phases = tuple(uniform(_FINER * p.intervals, int(p.degrees.max())) for p in mesh.phases)
    return Mesh(phases)
