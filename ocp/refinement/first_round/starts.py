"""Starts of a mesh beside the stated guess or the motion before, and what comes of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from ocp.arrays import Array
from ocp.estimates.other_controls.promise import OtherControls, other_controls, promised_by
from ocp.mesh.initial_guess import InitialGuess, PhaseGuess, guess_by_lines, initial_guess
from ocp.mesh.mesh import Mesh, uniform
from ocp.nlp.result import NlpResult
from ocp.nlp.solver import NlpSolver, StartingPoint
from ocp.optimality.iterate import iterate_of
from ocp.refinement.mesh_iteration import MeshIteration, iterations_of
from ocp.refinement.mesh_solver import MeshSolver
from ocp.transcription.packing import decision_vector, trajectory_of
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

# Part of the objective that other controls have to promise on a first, coarse mesh
_PROMISED = 1e-4

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


def shifted(meshes: MeshSolver, program: Transcription, x: Array) -> Iterator[StartingPoint]:
    """Starting points from a motion whose phases meet earlier or later.

    An answer may be no minimum by such a time: on one side the objective falls, on the other side
    it leads back. None where no such time is free.
    """
    from ocp.mesh.phase_times import shifted_times

    found = trajectory_of(program, x, meshes.parameters)
    times = {motion.name: (motion.start, motion.end) for motion in found.phases}
    guess = initial_guess(meshes.problem, meshes.parameters, found)
    for other in shifted_times(meshes.problem.phases, times):
        phases = {name: Retimed(phase, *other[name]) for name, phase in guess.phases.items()}
        yield _point(meshes, program, InitialGuess(phases, guess.unknowns))


def with_other_controls(
    meshes: MeshSolver, program: Transcription, result: NlpResult
) -> Iterator[StartingPoint]:
    """A starting point from a motion with the best of the controls that were tried in its place.

    None where no others are better. See `ocp.estimates.other_controls.promise`.
    """
    found = trajectory_of(program, result.x, meshes.parameters)
    iterate = iterate_of(program, result, found)
    # in the valley of the motion itself a start leads nowhere else
    others = list(other_controls(iterate, meshes.evaluator, valleys_only=True))
    if promised_by(others, iterate) > _PROMISED:
        guess = initial_guess(meshes.problem, meshes.parameters, found)
        phases = dict(guess.phases)
        for other in others:
            phases[other.phase] = _WithOthers(phases[other.phase], other)
        yield _point(meshes, program, InitialGuess(phases, guess.unknowns))


@dataclass(frozen=True, eq=False, repr=False)
class Retimed:
    """A guess of a phase at other times [s]."""

    guess: PhaseGuess
    start: float
    end: float

    def at_fractions(self, fractions: Array) -> Mapping[str, Array]:
        """Signals by name at fractions of the phase."""
        return self.guess.at_fractions(fractions)


@dataclass(frozen=True, eq=False, repr=False)
class _WithOthers:
    """A guess of a phase with other controls near the points at which they are better."""

    guess: PhaseGuess
    others: OtherControls

    @property
    def start(self) -> float:
        """Initial time [s]."""
        return self.guess.start

    @property
    def end(self) -> float:
        """Final time [s]."""
        return self.guess.end

    def at_fractions(self, fractions: Array) -> Mapping[str, Array]:
        """Signals by name at fractions of the phase."""
        known, values = self.others.fractions, dict(self.guess.at_fractions(fractions))
        nearest = np.searchsorted(0.5 * (known[1:] + known[:-1]), fractions)
        better = self.others.less[nearest] > 0.0
        for name, best in zip(self.others.names, self.others.best[nearest].T, strict=True):
            values[name] = np.where(better, best, values[name])
        return values


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
