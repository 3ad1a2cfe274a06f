"""One mesh iteration: a program solved in as many attempts as it takes, its errors, its record.

`MeshSolver` holds what stays the same in all of them, the budget included.
"""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ocp.arrays import Array
from ocp.mesh.initial_guess import initial_guess
from ocp.mesh.mesh import Mesh
from ocp.mesh.trajectory import Evaluator, Trajectory
from ocp.nlp.result import NlpResult
from ocp.nlp.solver import Listener, NlpSolver, StartingPoint
from ocp.optimality.iterate import Iterate, iterate_of
from ocp.optimality.warm_start import carried_multipliers
from ocp.problem.parameters import Parameters
from ocp.problem.problem import Problem
from ocp.progress import Progress
from ocp.refinement.accuracy import Accuracy
from ocp.refinement.estimates.error_estimate import MeshErrors, estimate_errors
from ocp.refinement.estimates.promised_gain import CERTIFIED_GAIN
from ocp.refinement.unwrapping import unwrapped
from ocp.settings import Settings
from ocp.transcription.packing import decision_vector, trajectory_of
from ocp.transcription.scaling import Scales, oversized, resized, scales_of
from ocp.transcription.transcribe import ProgramLimits, Transcription, transcribe

Start = Iterate | Trajectory | None
Run = Callable[[NlpSolver, StartingPoint], NlpResult]

# Factor by which constraints may miss their tolerance in a round that is good enough to be verified
# where no better one was found: the slack that the verification has, too.
LOOSER = 10.0

# A mesh that is about to be replaced is solved to this tolerance: the digits beyond are lost with
# the next mesh. The mesh that meets all tolerances is solved to the tolerance asked for.
LOOSE = 1e-7

# A warm start from the mesh iteration before takes some dozens of iterations. Near a degenerate
# optimum it can wander from there for a thousand, where another line search or a start without
# multipliers ends soon. Where that happened on the mesh before, it is not waited for again.
_PATIENCE = 300
_PATIENCE_AFTER_RETRIES = 60


@dataclass(frozen=True, repr=False)
class MeshIteration:
    """One mesh iteration: its mesh, what the solver took, and what was wrong between the points.

    Attributes
    ----------
    intervals : int
        Of all phases.
    extra_points : int
        Points between the collocation points at which constraints are imposed too.
    movable : int
        Breakpoints that the optimiser may move.
    iterations : int
        Of the solver.
    seconds : float
        That the solver took [s].
    objective : float
        In the user's sense and unit; nan where the solver failed, as are the next three.
    dynamics_error : float
        Largest error of the dynamics in an interval, relative.
    excess : float
        Largest excess of a path constraint, bound or peak, relative.
    gain : float
        What finer controls could gain, relative to the objective, to first order.
    status : str
        The solver's own word for how it ended.
    solver : str
        The name of the one that ran.
    attempts : int
        Runs of the solver that it took.
    starts : int
        From which the solver ran, and the best of whose answers this is.
    """

    intervals: int
    extra_points: int
    movable: int
    iterations: int
    seconds: float
    objective: float
    dynamics_error: float
    excess: float
    gain: float
    status: str
    solver: str = "ipopt"
    attempts: int = 1
    starts: int = 1

    def __repr__(self) -> str:
        return (
            f"MeshIteration({self.intervals} intervals, {self.iterations} iterations in "
            f"{self.seconds:.2g} s, objective {self.objective:.8g}, dynamics off by "
            f"{self.dynamics_error:.1e}, constraints by {self.excess:.1e}, gain {self.gain:.1e}, "
            f"{self.status})"
        )


@dataclass(frozen=True, eq=False)
class SolvedMesh:
    """A mesh iteration that the solver finished, as the next one and the refinement policy see it.

    Attributes
    ----------
    iterate : Iterate
        The motion found, with its multipliers.
    errors : MeshErrors
        What is wrong with it between its points.
    violation : float
        Largest violation of the program's rows, scaled.
    tight : bool
        Whether it was solved to the tolerance asked for.
    finer : bool
        Whether its mesh has more intervals than the one before.
    iterations : int
        Of the solver.
    """

    iterate: Iterate
    errors: MeshErrors
    violation: float
    tight: bool
    finer: bool
    iterations: int = 0

    def holds(self, accuracy: Accuracy, slack: float = 1.0) -> bool:
        """Whether the motion meets the dynamics and all constraints, between its points too.

        Parameters
        ----------
        slack : float
            Factor by which the constraints may miss their tolerance.
        """
        dynamics = self.errors.dynamics <= accuracy.dynamics
        return dynamics and self.leak <= slack * accuracy.path

    def open(self, accuracy: Accuracy) -> float:
        """The worst of dynamics, constraints and promised gain, in tolerances; one is enough."""
        return max(
            self.errors.dynamics / accuracy.dynamics,
            self.leak / accuracy.path,
            self.errors.gain / accuracy.objective,
        )

    @property
    def leak(self) -> float:
        """Largest excess of a constraint at the points or between them, relative."""
        return max(self.errors.excess, self.violation)


def best_of(solved: Sequence[SolvedMesh], accuracy: Accuracy) -> SolvedMesh:
    """The best round that holds between the points, if need be to the slack of a verification.

    Of rounds whose objectives are as good, those come first whose controls promise no more than a
    certificate allows, then those that meet their tolerances. One that leaks less is no answer if
    it lies on a mesh that was too coarse. Without any that holds it is the last round.
    """
    good = [s for s in solved if s.holds(accuracy, LOOSER)]
    # values of those that are not solved to the tolerance asked for err by theirs
    good = [s for s in good if s.tight] or good
    sense = solved[-1].iterate.problem.sense
    best = min(good, key=lambda s: sense * s.iterate.objective, default=solved[-1])

    slack = accuracy.objective * best.iterate.objective_size
    as_good = [s for s in good if abs(s.iterate.objective - best.iterate.objective) <= slack]
    as_good = [s for s in as_good if s.errors.gain <= CERTIFIED_GAIN] or as_good
    strict = [s for s in as_good if s.holds(accuracy)]
    # of answers that are as good, one whose controls promise nothing more is proven better
    strict = [s for s in strict if s.errors.gain <= accuracy.objective] or strict
    if strict:
        return min(strict, key=lambda s: sense * s.iterate.objective)
    return min(as_good, key=lambda s: s.leak, default=best)


def record_of(
    mesh: Mesh, result: NlpResult, solved: SolvedMesh | None, starts: int = 1
) -> MeshIteration:
    """The record of a mesh iteration; `solved` is None where the solver failed."""
    errors = solved.errors if solved else None
    return MeshIteration(
        intervals=mesh.intervals,
        extra_points=sum(points.tau.size for phase in mesh.extra for points in phase),
        movable=sum(len(phase.movable) for phase in mesh.phases),
        iterations=result.iterations,
        seconds=result.seconds,
        objective=solved.iterate.objective if solved else math.nan,
        dynamics_error=errors.dynamics if errors else math.nan,
        excess=errors.excess if errors else math.nan,
        gain=errors.gain if errors else math.nan,
        status=result.status,
        solver=result.solver,
        attempts=result.attempts,
        starts=starts,
    )


@dataclass(frozen=True)
class Budget:
    """Iterations and seconds of a whole solve; infinite where none were stated.

    The clock runs from the making of the budget. It counts everything but the closing
    verification, which is never cut short.

    Attributes
    ----------
    iterations : float
        Of all mesh iterations together.
    seconds : float
        Of all mesh iterations together [s].
    begin : float
        Reading of the clock when it was made [s].
    """

    iterations: float = math.inf
    seconds: float = math.inf
    begin: float = field(default_factory=clock.perf_counter)

    @property
    def elapsed(self) -> float:
        """Time since the budget was made [s]."""
        return clock.perf_counter() - self.begin

    def spent(self, iterations: int) -> bool:
        """Whether nothing is left after that many iterations."""
        return iterations >= self.iterations or self.elapsed >= self.seconds

    def within(self, solver: NlpSolver, iterations: int) -> NlpSolver:
        """A solver that begins after that many iterations, cut to what is left."""
        if math.isinf(self.iterations) and math.isinf(self.seconds):
            return solver
        # a solver may take no seconds at all for no limit
        seconds = max(self.seconds - self.elapsed, 1e-3)
        return solver.within(max(self.iterations - iterations, 0), seconds)

    def __str__(self) -> str:
        parts = []
        if math.isfinite(self.iterations):
            parts.append(f"{self.iterations} iterations")
        if math.isfinite(self.seconds):
            parts.append(f"{self.seconds:g} s")
        return " or ".join(parts)


@dataclass(frozen=True, eq=False)
class MeshSolver:
    """Solves a problem on one mesh after another; what stays the same in all mesh iterations.

    Attributes
    ----------
    problem : Problem
    settings : Settings
    parameters : Parameters
        Values of the problem's constants.
    evaluator : Evaluator
        Of the problem.
    budget : Budget
        Of all mesh iterations together.
    rough_solver : NlpSolver
        For meshes that are about to be replaced.
    progress : callable or None
        Receives a line of text per iteration.
    prepared : Transcription or None
        A program to use for its own mesh.
    """

    problem: Problem
    settings: Settings
    parameters: Parameters
    evaluator: Evaluator
    budget: Budget
    rough_solver: NlpSolver
    progress: Progress | None = None
    prepared: Transcription | None = None

    @classmethod
    def of(
        cls,
        problem: Problem,
        settings: Settings,
        parameters: Parameters,
        progress: Progress | None = None,
        prepared: Transcription | None = None,
        evaluator: Evaluator | None = None,
    ) -> MeshSolver:
        """With the budget of the settings, whose clock begins to run.

        An evaluator of the same problem lends what it has compiled.
        """
        budget = Budget(settings.iterations or float("inf"), settings.seconds or float("inf"))
        rough = settings.solver.loosened(LOOSE)
        if evaluator is None or evaluator.problem is not problem:
            evaluator = Evaluator(problem)
        return cls(problem, settings, parameters, evaluator, budget, rough, progress, prepared)

    def first_program(self, start: Start, mesh: Mesh) -> Transcription:
        """The program of the first mesh; one that is there already where it fits."""
        if self.prepared is not None and mesh is self.prepared.mesh:
            return self.prepared

        if not isinstance(start, Iterate):
            guess = initial_guess(self.problem, self.parameters, start)
            scales = scales_of(self.problem, guess, self.parameters)
            settings = self.settings
            return transcribe(self.problem, mesh, settings.scheme, settings.controls, scales)

        if mesh is start.mesh:
            return start.transcription
        return transcribe(
            self.problem, mesh, start.scheme, start.controls, start.scales, start.transcription
        )

    def at(self, parameters: Parameters) -> MeshSolver:
        """The same for other values of the constants, with a budget of its own."""
        budget = Budget(self.budget.iterations, self.budget.seconds)
        return replace(self, parameters=parameters, budget=budget)

    def next_program(self, last: Iterate, mesh: Mesh) -> Transcription:
        """The program of a mesh after a solved one, its objective sized by what was found."""
        scales = self.scales_after(last)
        if mesh is last.mesh and scales is last.scales:
            return last.transcription
        return transcribe(
            self.problem, mesh, last.scheme, last.controls, scales, last.transcription
        )

    def scales_after(self, last: Iterate) -> Scales:
        """Those of a solved mesh, its objective sized by its value; the same if it is near."""
        least = 0.0
        if oversized(last.scales, last.objective):
            guess = initial_guess(self.problem, self.parameters, last.trajectory)
            least = scales_of(self.problem, guess, self.parameters).objective
        return resized(last.scales, last.objective, least)

    def starting_point(
        self, program: Transcription, start: Start | StartingPoint, limits: ProgramLimits
    ) -> StartingPoint:
        """A start of the program: unknowns, and multipliers where an iterate brings them."""
        if isinstance(start, StartingPoint):
            return start
        if not isinstance(start, Iterate):
            return StartingPoint(self._packed(program, start, limits))
        if start.transcription is program:
            # to the last digit, which its multipliers belong to
            return StartingPoint(start.x, (start.bound_multipliers, start.row_multipliers))
        multipliers = carried_multipliers(start, program)
        return StartingPoint(self._packed(program, start.trajectory, limits), multipliers)

    def solve(
        self,
        program: Transcription,
        start: Start | StartingPoint,
        solver: NlpSolver,
        before: Sequence[MeshIteration] = (),
        *,
        most: float = math.inf,
    ) -> NlpResult:
        """Solve one program from a start, in at most so many iterations.

        Parameters
        ----------
        before : sequence of MeshIteration
            The mesh iterations until then.
        most : float
            Iterations of all attempts together.
        """
        limits = program.limits(self.parameters)

        def run(solver: NlpSolver, point: StartingPoint) -> NlpResult:
            return self.run(program, solver, point, limits, len(before) + 1)

        point = self.starting_point(program, start, limits)
        return with_retries(run, solver, point, self.budget, before, most=most)

    def run(
        self,
        program: Transcription,
        solver: NlpSolver,
        point: StartingPoint,
        limits: ProgramLimits,
        number: int,
    ) -> NlpResult:
        """One run of a solver in mesh iteration `number`."""
        listener = self._listener(program, number)
        return solver.solve(program.program, point, limits, self.parameters.vector, listener)

    def examined(
        self, program: Transcription, result: NlpResult, *, tight: bool, finer: bool
    ) -> SolvedMesh:
        """A solved program with its errors between the points."""
        trajectory = trajectory_of(program, result.x, self.parameters)
        iterate = unwrapped(iterate_of(program, result, trajectory), self.evaluator)
        errors = estimate_errors(iterate, self.evaluator, self.settings.accuracy)
        lower, upper = iterate.limits.rows
        excess = np.maximum(lower - result.rows, result.rows - upper)
        violation = float(excess.max(initial=0.0))
        return SolvedMesh(iterate, errors, violation, tight, finer, result.iterations)

    def spent(self, rounds: Sequence[MeshIteration]) -> bool:
        """Whether the budget is used up after some mesh iterations."""
        return self.budget.spent(iterations_of(rounds))

    def _packed(
        self, program: Transcription, motion: Trajectory | None, limits: ProgramLimits
    ) -> Array:
        guess = initial_guess(self.problem, self.parameters, motion)
        return decision_vector(program, guess, limits, self.parameters.vector)

    def _listener(self, program: Transcription, number: int) -> Listener | None:
        """What passes the solver's progress on, if anybody wants to know."""
        progress = self.progress
        if progress is None:
            return None
        unit = program.scales.objective * self.problem.sense
        begin = f"{self.problem.name}: mesh iteration {number} ({program.mesh.intervals} intervals)"

        def listen(iteration: int, objective: float, x: Array, rows: Array) -> bool:
            progress(f"{begin}, iteration {iteration}, objective {objective * unit:.6g}")
            return False

        return listen


def with_retries(
    run: Run,
    solver: NlpSolver,
    start: StartingPoint,
    budget: Budget,
    before: Sequence[MeshIteration],
    *,
    most: float = math.inf,
) -> NlpResult:
    """Solve one program by as many attempts as it takes; what every attempt took is counted.

    Parameters
    ----------
    run : callable
        Runs a solver from a starting point.
    solver : NlpSolver
        As the user chose it.
    start : StartingPoint
        Where the first attempt starts.
    budget : Budget
        Of all attempts, those of earlier mesh iterations included.
    before : sequence of MeshIteration
        The mesh iterations before this one.
    most : float
        Iterations of all attempts together, beside the budget.
    """
    already = iterations_of(before)
    iterations, seconds, attempts = 0, 0.0, 0
    for choice, point in _attempts(solver, start, before):
        left = choice if math.isinf(most) else choice.within(most - iterations, math.inf)
        result = run(budget.within(left, already + iterations), point)
        iterations, seconds = iterations + result.iterations, seconds + result.seconds
        attempts += 1
        if result.outcome in ("solved", "interrupted") or budget.spent(already + iterations):
            break
        if iterations >= most:
            break

    return replace(result, iterations=iterations, seconds=seconds, attempts=attempts)


def _attempts(
    solver: NlpSolver, start: StartingPoint, before: Sequence[MeshIteration]
) -> Iterator[tuple[NlpSolver, StartingPoint]]:
    """Solvers and starting points of the attempts, in order.

    With known multipliers the first attempt is a warm start. In later mesh iterations one that
    takes long has lost its way, and is made once more with other options. Then follow starts
    without multipliers, in later mesh iterations first with the options that stray less from a good
    start.
    """
    bare = StartingPoint(start.x)

    if start.multipliers is not None and not before:
        yield solver, start
    elif start.multipliers is not None:
        retried = before[-1].attempts > 1
        patience = _PATIENCE_AFTER_RETRIES if retried else _PATIENCE
        yield solver.within(patience, float("inf")), start
        patient = solver.within(_PATIENCE, float("inf"))
        for other in patient.alternatives(warm=True):
            yield other, start

    if before:
        for other in solver.alternatives(warm=False):
            yield other, bare
    yield solver, bare


def iterations_of(rounds: Sequence[MeshIteration]) -> int:
    """Iterations of the solver over some mesh iterations."""
    return sum(entry.iterations for entry in rounds)
