"""The best of several starts, where the stated guess may be far from the best optimum.

Starts of two kinds take turns: motions that are simulated under random controls, and random waves
around straight lines. The search ends soon where the first answers agree. Where they differ it goes
on until the best one was found more often, or a stated amount of work is done.

The least value of a mesh that is too coarse for its motion is often a motion that does not exist.
So if the best of the first answers leaves its dynamics by more than the states' sizes, the search
begins anew on a finer mesh. And where values cannot be compared yet, the best few answers are
refined until they can.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain, islice, zip_longest
from math import inf

import numpy as np

from ocp.estimates.motion_errors import MotionErrors
from ocp.mesh.initial_guess import InitialGuess, guess_by_lines, initial_guess, meet_freely
from ocp.mesh.mesh import Mesh, uniform
from ocp.nlp.solver import NlpResult, NlpSolver, StartingPoint
from ocp.refinement.mesh_solver import LEAST_PATIENCE, PATIENCE, MeshSolver
from ocp.refinement.solved_mesh import MeshIteration, SolvedMesh, iterations_of, record_of
from ocp.transcription.packing import decision_vector, trajectory_of
from ocp.transcription.transcribe import Transcription

Attempts = Iterable[tuple[NlpSolver, StartingPoint]]

# An attempt also ends after this many times the iterations that answers from other starts took, but
# not before `LEAST_PATIENCE`: what takes longer has mostly lost its way.
_TIMES_THE_USUAL = 5
# The same where answers agree already, and further starts only confirm them. In 77 searches of 27
# problems none of these found a better answer.
_TIMES_TO_CONFIRM = 2
_LEAST_TO_CONFIRM = 30

# Times as many intervals where a mesh has led to nothing, and the most that such a mesh may have.
# Controls of so many pieces are within a percent of any that switches now and then.
_FINER = 4
_FINEST = 400


@dataclass(frozen=True, eq=False, repr=False)
class FirstMesh:
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
        (_TIMES_TO_CONFIRM, _LEAST_TO_CONFIRM) if confirms else (_TIMES_THE_USUAL, LEAST_PATIENCE)
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


# outcomes after which another start may do better, the last one if the run was long
HOPEFUL = {"infeasible", "failed", "budget"}

# Starts without an answer, beside a guess that states a motion and on a finer mesh, after which a
# mesh counts as one that has none. Each costs more on a finer mesh.
_LOST = 10
_LOST_IF_FINER = 4

# Other starts on one mesh at most. The work is iterations times unknowns: this much takes about
# half a minute, and a large program gets fewer starts. But a few cheap ones tell nothing.
_STARTS = 24
_WORK = 8e6
_LEAST_STARTS = 4
# Starts that are made at least while they are cheap: this much work takes about half a second.
_CHEAP_STARTS = 6
_CHEAP_WORK = 1.25e5
# parts of a budget that may go into the search, and into the search and the comparison of its
# answers: refinement needs the rest
_SHARE = 0.4
_SHARE_OF_ALL = 0.6

# Sizes by which a simulated motion may miss its end and its limits. One that is further off has
# less in common with the motions that are sought than a wave around a straight line. In the swings
# of `benchmarks.shows` many that missed by up to 3 led to answers. Of 13 that missed by 6 to 30 one
# did, which was no motion.
_FAR_OFF = 10.0

# Relative difference of two answers of one mesh that are the same, in terms of the objective's
# size at least, unless a larger tolerance on the objective is asked for. Answers that have to agree
# where none differs, and where some do or where phases meet at a free time, by which answers may be
# stationary that are no optima.
_SAME = 1e-5
_SMALLEST = 1e-2
_AGREE = 2
_AGREE_IF_OTHERS = 3

# Largest error of the dynamics in an interval, in sizes of the states: below the first one, values
# differ from those of exact motions by less than optima do from each other. Above the second one
# an answer may be of another kind than any motion.
_COMPARABLE = 1e-2
_NO_MOTION = 1.0
# Answers after which a mesh is judged by that. It is also the number of starts after which an
# objective counts as running away, or an expression as having no value anywhere.
_ENOUGH = 3

# Answers that are refined where values cannot be compared, those among them that come from a mesh
# that was too coarse, and the mesh iterations that each may take.
_CANDIDATES = 5
_COARSE = 2
_MESH_ITERATIONS = 4


@dataclass(frozen=True, eq=False, repr=False)
class _Answer:
    """An answer of a mesh.

    Attributes
    ----------
    value : in the size of the first mesh's objective, least is best.
    dynamics : largest error of the dynamics in an interval, relative.
    """

    program: Transcription
    result: NlpResult
    value: float
    dynamics: float


def best_of_several(
    first_mesh: FirstMesh, program: Transcription, first: NlpResult, *, far: bool
) -> MeshAnswer:
    """The best answer from where the guess is and from other starts.

    Parameters
    ----------
    first : NlpResult
        What came of the stated guess, an answer or not.
    far : bool
        Whether that guess says nothing of where the best answer is.
    """
    meshes = first_mesh.meshes
    answers = (_examined(meshes, program, first),) if first.outcome == "solved" else ()
    undefined = int(first.outcome == "invalid number")
    search = _FirstMeshSearch(program, answers, first, 1, undefined=undefined)
    mesh, coarse = finer_mesh(meshes, program.mesh), tuple[_Answer, ...]()
    # beside a guess that states a motion other options of the solver come first
    others = [] if far else _other_options(first_mesh, program)
    most = _STARTS if far else _LOST
    search = _searched(first_mesh, search, others, most, may_refine=mesh is not None)
    while mesh is not None and search.asks_for_finer:
        again = meshes.first_program(None, mesh)
        mesh, coarse = finer_mesh(meshes, mesh), coarse + search.answers
        others, most = _other_options(first_mesh, again), _LOST_IF_FINER
        if coarse:
            others, most = [], _STARTS
        search = _FirstMeshSearch(again, (), search.last, search.starts)
        search = _searched(first_mesh, search, others, most, may_refine=not coarse)

    last, starts = search.last, search.starts
    if last.outcome == "interrupted" or search.seems_unbounded:
        return MeshAnswer(search.program, last, starts)
    if not (search.answers or coarse):
        failed = replace(first, iterations=last.iterations, seconds=last.seconds)
        return MeshAnswer(program, failed, starts, starts)
    lost = starts - len(search.answers) - len(coarse)
    best, last = _compared(first_mesh, (search.answers, coarse), last)
    if last.outcome == "interrupted":
        interrupted = replace(best.result, outcome="interrupted")
        return MeshAnswer(best.program, interrupted, starts, lost)
    result = replace(best.result, iterations=last.iterations, seconds=last.seconds)
    return MeshAnswer(best.program, result, starts, lost)


@dataclass(frozen=True, eq=False, repr=False)
class _FirstMeshSearch:
    """A search on one mesh.

    Attributes
    ----------
    program : Transcription
    answers : tuple of _Answer
    last : NlpResult
        The last run; it counts what all took.
    starts : int
        Until now, those on other meshes included.
    no_motion : bool
        Whether the best of several answers misses its dynamics by so much that it may be of another
        kind than any motion.
    unbounded, undefined : int
        Starts from which the objective ran away, and those that ended where an expression has no
        value.
    """

    program: Transcription
    answers: tuple[_Answer, ...]
    last: NlpResult
    starts: int
    no_motion: bool = False
    unbounded: int = 0
    undefined: int = 0

    def with_run(self, meshes: MeshSolver, last: NlpResult) -> _FirstMeshSearch:
        """The search with one more start, from which the solver was run."""
        answers = self.answers
        if last.outcome == "solved":
            answers = (*answers, _examined(meshes, self.program, last))
        return replace(self, answers=answers, last=last, starts=self.starts + 1)

    @property
    def asks_for_finer(self) -> bool:
        """Whether a finer mesh may lead to a motion where this one has led to none."""
        return self.no_motion or (not self.answers and self.last.outcome in HOPEFUL)

    @property
    def seems_undefined(self) -> bool:
        """Whether an expression has had no value from any start, and there were several."""
        return self.undefined == self.starts > _ENOUGH

    @property
    def seems_unbounded(self) -> bool:
        """Whether the objective runs away from most starts, the last one among them."""
        ran_away = self.last.outcome == "unbounded" and self.unbounded >= _ENOUGH
        return ran_away and self.unbounded > len(self.answers)


def _other_options(
    first_mesh: FirstMesh, program: Transcription
) -> list[tuple[NlpSolver, StartingPoint]]:
    """Other options of the solver, from the stated guess."""
    # where a filter takes no step any more, a penalty function often does
    solver, meshes = first_mesh.solver, first_mesh.meshes
    point = meshes.starting_point(program, None, meshes.limits(program))
    others = (*solver.alternatives(warm=True), *solver.alternatives(warm=False))
    return [(other, point) for other in others]


def _searched(
    first_mesh: FirstMesh,
    before: _FirstMeshSearch,
    others: Attempts,
    most: int,
    *,
    may_refine: bool,
) -> _FirstMeshSearch:
    """The search gone on with, until it has found or done enough.

    Parameters
    ----------
    others : iterable of solver and starting point
        That come before the motions and waves.
    most : int
        Starts without an answer.
    may_refine : bool
        Whether a finer mesh may follow. Then it ends, too, where the best answer is no motion yet.
    """
    program, search = before.program, before
    limit = _Limit.of(first_mesh, program, before.last)
    agree = _AGREE_IF_OTHERS if meet_freely(first_mesh.meshes.problem.phases) else _AGREE
    points = _alternating(first_mesh.meshes, program)
    attempts = chain(others, ((first_mesh.solver, point) for point in points))
    known = [answer.value for answer in before.answers]
    same = _same_within(first_mesh.meshes)

    def agreed(found: Sequence[NlpResult]) -> bool:
        return _settled([*known, *(result.objective for result in found)], agree, same)

    for last in first_mesh.runs(program, attempts, before.last, agreed=agreed):
        search = search.with_run(first_mesh.meshes, last)
        answers = search.answers
        no_motion = len(answers) >= _ENOUGH and min(answers, key=_value).dynamics > _NO_MOTION
        search = replace(
            search,
            no_motion=no_motion,
            unbounded=search.unbounded + (last.outcome == "unbounded"),
            undefined=search.undefined + (last.outcome == "invalid number"),
        )

        enough = search.starts >= _CHEAP_STARTS or last.iterations >= limit.cheap
        # on a mesh too coarse to compare values, further ones would only differ
        enough |= min((a.dynamics for a in answers), default=inf) > _COMPARABLE
        settled = enough and _settled([answer.value for answer in answers], agree, same)
        if last.outcome == "interrupted" or settled or (may_refine and no_motion):
            break
        if search.seems_unbounded or search.seems_undefined:
            break
        if not answers and search.starts - before.starts >= most:
            break
        if limit.reached(last.iterations, search.starts):
            break
    return search


@dataclass(frozen=True)
class _Limit:
    """When a search on a mesh has done its share.

    Attributes
    ----------
    iterations, cheap, budget : of this mesh iteration, by its work, by work that is little, and by
        the budget of the whole solve.
    seconds : of the clock, since the budget was made.
    """

    meshes: MeshSolver
    iterations: float
    cheap: float
    budget: float
    seconds: float

    @classmethod
    def of(cls, first_mesh: FirstMesh, program: Transcription, done: NlpResult) -> _Limit:
        """The limits of a search that begins after what was done."""
        budget = first_mesh.meshes.budget
        return cls(
            meshes=first_mesh.meshes,
            iterations=done.iterations + _WORK / program.columns.count,
            cheap=done.iterations + _CHEAP_WORK / program.columns.count,
            budget=_SHARE * budget.iterations - iterations_of(first_mesh.before),
            seconds=_SHARE * budget.seconds,
        )

    def reached(self, iterations: int, starts: int) -> bool:
        """Whether no further start is to be made."""
        if iterations >= self.budget or self.meshes.budget.elapsed >= self.seconds:
            return True
        return iterations >= self.iterations and starts > _LEAST_STARTS


def _alternating(meshes: MeshSolver, program: Transcription) -> Iterator[StartingPoint]:
    """Starting points of both kinds in turn; the second kind alone where none is simulated."""
    kinds = simulated(meshes, program, _STARTS // 2, _FAR_OFF), wavy(meshes, program, _STARTS)
    pairs = chain.from_iterable(zip_longest(*kinds))
    return islice((point for point in pairs if point is not None), _STARTS)


def _examined(meshes: MeshSolver, program: Transcription, result: NlpResult) -> _Answer:
    trajectory = trajectory_of(program, result.x, meshes.parameters)
    errors = MotionErrors(program, trajectory, meshes.evaluator, meshes.parameters)
    return _Answer(program, result, result.objective, errors.worst_dynamics)


def _value(answer: _Answer) -> float:
    return answer.value


def _same_within(meshes: MeshSolver) -> float:
    """Relative difference of two values that are the same, to the user as well."""
    return max(_SAME, meshes.settings.accuracy.objective)


def _same(one: float, other: float, within: float) -> bool:
    size = max(abs(one), abs(other), _SMALLEST)
    return abs(one - other) <= within * size


def _settled(values: Sequence[float], enough: int, same: float) -> bool:
    """Whether the best value was found often enough, where `enough` is if none differs."""
    if not values:
        return False
    agree = sum(_same(min(values), value, same) for value in values)
    return agree >= (enough if agree == len(values) else _AGREE_IF_OTHERS)


def _distinct(answers: Sequence[_Answer], same: float) -> list[_Answer]:
    """Different answers, the best one first."""
    ranked: list[_Answer] = []
    for answer in sorted(answers, key=_value):
        if not any(_same(answer.value, better.value, same) for better in ranked):
            ranked.append(answer)
    return ranked


def _compared(
    first_mesh: FirstMesh, answers: Sequence[Sequence[_Answer]], last: NlpResult
) -> tuple[_Answer, NlpResult]:
    """The best answer once values can be compared, and the count of all that it took.

    Parameters
    ----------
    answers : those of the last mesh, then those of one that was too coarse. What the latter lead
        to may be better, and is what no search would have found.
    """
    same = _same_within(first_mesh.meshes)
    ranked, coarse = (_distinct(part, same) for part in answers)
    if ranked and (len(ranked) + len(coarse) == 1 or ranked[0].dynamics <= _COMPARABLE):
        return ranked[0], last

    few = _CANDIDATES - _COARSE
    candidates = [*ranked[:few], *coarse[:_COARSE], *ranked[few:], *coarse[_COARSE:]]
    refined: list[_Answer] = []
    budget = first_mesh.meshes.budget
    for candidate in candidates[:_CANDIDATES]:
        done = iterations_of(first_mesh.before) + last.iterations
        late = budget.elapsed >= _SHARE_OF_ALL * budget.seconds
        if late or done >= _SHARE_OF_ALL * budget.iterations:
            break
        # what is refined may fall by as much as its dynamics are off
        least = candidate.value - candidate.dynamics * abs(candidate.value)
        if any(least > better.value for better in refined):
            continue
        better, last = _refined(first_mesh, candidate, last)
        if better is not None:
            refined.append(better)
        settled = _settled([answer.value for answer in refined], _AGREE, same)
        if last.outcome == "interrupted" or settled:
            break
    return min(refined, key=_value, default=candidates[0]), last


def _refined(
    first_mesh: FirstMesh, candidate: _Answer, last: NlpResult
) -> tuple[_Answer | None, NlpResult]:
    """An answer on meshes that are refined until its value can be compared; None if one fails."""
    meshes, solver = first_mesh.meshes, first_mesh.solver.within(PATIENCE, inf)
    policy, accuracy = meshes.settings.refinement, meshes.settings.accuracy
    size, sense = candidate.program.scales.objective, meshes.problem.sense
    program, result = candidate.program, candidate.result
    solved: list[SolvedMesh] = []
    while True:
        solved.append(meshes.examined(program, result, tight=False, finer=bool(solved)))
        if solved[-1].errors.dynamics <= _COMPARABLE:
            value = sense * solved[-1].iterate.objective / size
            return _Answer(program, result, value, solved[-1].errors.dynamics), last
        mesh = policy.next_mesh(solved, accuracy)
        spent = [*first_mesh.before, record_of(program.mesh, last, None)]
        if mesh is None or len(solved) > _MESH_ITERATIONS or meshes.spent(spent):
            return None, last

        program = meshes.next_program(solved[-1].iterate, mesh)
        result = meshes.solve(program, solved[-1].iterate, solver, spent)
        last = replace(
            result,
            iterations=last.iterations + result.iterations,
            seconds=last.seconds + result.seconds,
        )
        if result.outcome != "solved":
            return None, last
