"""From one side of a known time to the other one, where a phase would begin or end beyond it.

While a program is solved, a free end of a phase stays between two known times at which expressions
step or bend (`ocp.mesh.known_times`). An answer that has it at one of them may be no optimum: the
program says nothing of the other side. So that is solved too, and the better answer counts, until
none is better. What a solver cannot meet on one side may also be met on the other one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ocp.arrays import Array
from ocp.mesh.initial_guess import InitialGuess, PhaseGuess, initial_guess
from ocp.mesh.known_times import AT_KNOWN_TIME, known_limits, placed
from ocp.mesh.mesh import Mesh, PhaseMesh, distinct
from ocp.mesh.phase_times import Ends
from ocp.mesh.trajectory import PhaseTrajectory, Trajectory
from ocp.nlp.result import NlpResult
from ocp.nlp.solver import NlpSolver, StartingPoint
from ocp.problem.phase import Phase
from ocp.problem.symbols import Between
from ocp.refinement.first_round.starts import MeshAnswer
from ocp.refinement.mesh_iteration import MeshIteration, iterations_of
from ocp.refinement.mesh_solver import MeshSolver
from ocp.transcription.packing import decision_vector, trajectory_of
from ocp.transcription.transcribe import Transcription, transcribe

# Of the room on the other side of a known time: how far a phase begins or ends there at first.
_BEYOND = 0.05

# Part of the objective's size by which another side has to be better, and by which one without a
# stretch of next to no length may be worse than one with it.
_BETTER = 1e-8
_AS_GOOD = 1e-6

# Known times that an answer of one mesh may pass.
_MOST = 200

Sides = tuple[tuple[tuple[float, ...], Ends | None], ...]
"""Of each phase: the known times inside it, and those next to them."""


@dataclass(frozen=True)
class EndAtKnownTime:
    """A free end of a phase that lies at a known time.

    Attributes
    ----------
    index : int
        Number of the phase.
    node : int
        0 for its start, 1 for its end.
    time : float
        The known time [s].
    before : bool
        Whether the end is before the known time, and behind it if not.
    """

    index: int
    node: int
    time: float
    before: bool

    @property
    def shortens(self) -> bool:
        """Whether the phase is shorter on the other side."""
        return self.before == (self.node == 0)


def ends_at_known_times(program: Transcription, motion: Trajectory) -> list[EndAtKnownTime]:
    """The free ends of phases that lie at a known time, beyond which they cannot go."""
    found, at = [], AT_KNOWN_TIME * program.scales.time
    for index, (columns, own) in enumerate(zip(program.columns.phases, motion.phases, strict=True)):
        limits = known_limits(columns.mesh, columns.phase)
        for node, (time, (low, high)) in enumerate(zip((own.start, own.end), limits, strict=True)):
            if time - low <= at:
                found.append(EndAtKnownTime(index, node, low, before=False))
            if high - time <= at:
                found.append(EndAtKnownTime(index, node, high, before=True))
    return found


def sides_of(mesh: Mesh) -> Sides:
    """On which side of the known times a mesh keeps the ends of its phases."""
    return tuple((phase.times, phase.between) for phase in mesh.phases)


def across_known_times(
    meshes: MeshSolver, solver: NlpSolver, before: Sequence[MeshIteration], answer: MeshAnswer
) -> MeshAnswer:
    """The best answer of a mesh on this and the other sides of the known times that it runs into.

    Parameters
    ----------
    before : sequence of MeshIteration
        Mesh iterations until this one.
    answer : MeshAnswer
        What came of the mesh, an answer or a failure.

    Returns
    -------
    MeshAnswer
        It counts what all took.
    """
    if not answer.program.mesh.keeps_sides:
        return answer
    best, seen, spent = answer, {sides_of(answer.program.mesh)}, answer.result
    for _ in range(_MOST):
        better = None
        motion = trajectory_of(best.program, best.result.x, meshes.parameters)
        for _, program, point, drops in other_sides(meshes, best.program, motion, seen):
            if meshes.budget.spent(iterations_of(before) + spent.iterations):
                return _counted(best, spent)
            seen.add(sides_of(program.mesh))
            result = meshes.solve(program, point, solver, before)
            spent = replace(
                result,
                iterations=spent.iterations + result.iterations,
                seconds=spent.seconds + result.seconds,
            )
            if result.outcome == "interrupted":
                return replace(answer, program=program, result=spent)
            if _is_better(result, best.result, drops=drops):
                better = replace(answer, program=program, result=result)
                break
        if better is None:
            break
        best = better
    # what failed on the way says less than the failure where the solver was
    if best.result.outcome != "solved":
        best = answer
    return _counted(best, spent)


def _counted(answer: MeshAnswer, spent: NlpResult) -> MeshAnswer:
    """An answer that counts what all took."""
    result = replace(answer.result, iterations=spent.iterations, seconds=spent.seconds)
    return replace(answer, result=result)


def _is_better(found: NlpResult, best: NlpResult, *, drops: bool) -> bool:
    """Whether what came of another side is better.

    Parameters
    ----------
    drops : bool
        Whether it lacks a stretch that has next to no length on this side.
    """
    if best.outcome != "solved":
        return found.outcome == "solved" or found.outcome == best.outcome
    if found.outcome != "solved":
        return False
    size = max(abs(best.objective), 1.0)
    return found.objective < best.objective + size * (_AS_GOOD if drops else -_BETTER)


def other_sides(
    meshes: MeshSolver, here: Transcription, motion: Trajectory, seen: set[Sides]
) -> Iterator[tuple[float, Transcription, StartingPoint, bool]]:
    """Programs and starts beyond the known times that a motion runs into, one after another.

    Parameters
    ----------
    here : Transcription
        The program of the motion.
    seen : set of Sides
        What is left out.

    Yields
    ------
    time : float
        [s]
    program, point
        On the other side.
    drops : bool
        Whether a stretch of next to no length is left out there.
    """
    if any(phase.end <= phase.start for phase in motion.phases):
        return
    ends = ends_at_known_times(here, motion)
    for time in dict.fromkeys(end.time for end in ends):
        there = [end for end in ends if end.time == time]
        times = _beyond(meshes, motion, there)
        if times is None:
            continue
        program = beside(here, motion, times)
        if sides_of(program.mesh) not in seen:
            drops = any(end.shortens for end in there)
            yield time, program, start_of(meshes, program, motion, times), drops


def _beyond(
    meshes: MeshSolver, motion: Trajectory, ends: Sequence[EndAtKnownTime]
) -> dict[str, Ends] | None:
    """Times of phases some of whose ends are a little beyond a known time; None without room.

    Where all of them become shorter they end at it.
    """
    problem = meshes.problem
    times = {phase.name: [phase.start, phase.end] for phase in motion.phases}
    if all(end.shortens for end in ends):
        # nothing but a stretch of next to no length is left out
        for end in ends:
            times[problem.phases[end.index].name][end.node] = end.time
        return {name: (first, last) for name, (first, last) in times.items()}

    steps = []
    for end in ends:
        phase, own = problem.phases[end.index], motion.phases[end.index]
        side = 1.0 if end.before else -1.0
        free = phase.start if end.node == 0 else phase.end
        assert isinstance(free, Between)
        stops = [*problem.instants[phase.name], free.upper if end.before else free.lower]
        if end.shortens:
            stops.append(own.end if end.node == 0 else own.start)  # it becomes shorter
        rooms = [room for stop in stops if (room := side * (stop - end.time)) > 0.0]
        steps.append(_BEYOND * min([*rooms, own.end - own.start]))
        times[phase.name][end.node] = end.time + side * steps[-1]
    step = min(steps)
    for end in ends:
        name = problem.phases[end.index].name
        times[name][end.node] = end.time + (step if end.before else -step)
    if step <= AT_KNOWN_TIME * max(phase.end - phase.start for phase in motion.phases):
        return None
    return {name: (start, end) for name, (start, end) in times.items()}


def beside(program: Transcription, motion: Trajectory, times: Mapping[str, Ends]) -> Transcription:
    """The program of a mesh like that of a motion, for phases that begin and end elsewhere.

    Parameters
    ----------
    times : mapping of str to (float, float)
        Where each phase begins and ends, which says on which side of the known times it is [s].
    """
    problem, phases = program.problem, []
    for phase, mesh, own in zip(problem.phases, program.mesh.phases, motion.phases, strict=True):
        ends = times[phase.name]
        if mesh.between is not None and ends != (own.start, own.end):
            mesh = _mesh_beside(problem.instants[phase.name], phase, mesh, own, ends)
        phases.append(mesh)
    return transcribe(
        problem, Mesh(tuple(phases)), program.scheme, program.controls, program.scales, program
    )


def _mesh_beside(
    instants: Sequence[float], phase: Phase, mesh: PhaseMesh, motion: PhaseTrajectory, ends: Ends
) -> PhaseMesh:
    """The mesh of a motion, cut off or made longer so that it is that of a phase of other times."""
    (start, end), at = ends, AT_KNOWN_TIME * (ends[1] - ends[0])
    inside = tuple(time for time in instants if start < time < end)
    points = motion.breakpoints
    kept = (points > start + at) & (points < end - at)
    kept &= np.abs(points[:, None] - np.array(inside)).min(axis=1, initial=np.inf) > at
    times = distinct(np.concatenate([[start, end], points[kept], inside]))
    middle = 0.5 * (times[1:] + times[:-1])
    parents = np.clip(np.searchsorted(points, middle) - 1, 0, mesh.intervals - 1)
    fractions = (times - start) / (end - start)
    fractions[[0, -1]] = 0.0, 1.0
    return placed(PhaseMesh(fractions, mesh.degrees[parents]), phase, instants, ends, inside)


def start_of(
    meshes: MeshSolver, program: Transcription, motion: Trajectory, times: Mapping[str, Ends]
) -> StartingPoint:
    """Where a program starts from a motion whose phases begin or end elsewhere."""
    guess = initial_guess(meshes.problem, meshes.parameters, motion)
    phases = {name: _Held(own, *times[name]) for name, own in guess.phases.items()}
    held = InitialGuess(phases, guess.unknowns)
    x = decision_vector(program, held, meshes.limits(program), meshes.parameters.vector)
    return StartingPoint(np.nan_to_num(x))


@dataclass(frozen=True, eq=False, repr=False)
class _Held:
    """A guess of a phase of other times [s]; beyond its own ones it stays as it is there."""

    guess: PhaseGuess
    start: float
    end: float

    def at_fractions(self, fractions: Array) -> Mapping[str, Array]:
        """Signals by name at fractions of the phase."""
        times = self.start + fractions * (self.end - self.start)
        own = (times - self.guess.start) / (self.guess.end - self.guess.start)
        return self.guess.at_fractions(np.clip(own, 0.0, 1.0))
