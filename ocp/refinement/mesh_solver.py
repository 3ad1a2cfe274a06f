"""Solves a problem on one mesh after another, within one budget.

It makes as many attempts at one program as it takes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import astuple, dataclass, field, replace
from functools import cached_property

from ocp.arrays import Array
from ocp.estimates.error_estimate import estimate_errors
from ocp.later import later
from ocp.mesh.initial_guess import initial_guess
from ocp.mesh.mesh import Mesh
from ocp.mesh.trajectory import Evaluator, Trajectory
from ocp.nlp.solver import Listener, NlpResult, NlpSolver, StartingPoint
from ocp.optimality.iterate import Iterate, iterate_of
from ocp.optimality.unwrapping import unwrapped
from ocp.optimality.warm_start import carried_multipliers
from ocp.problem.parameters import Parameters
from ocp.problem.problem import Problem
from ocp.progress import Progress
from ocp.refinement.budget import Budget
from ocp.refinement.sizes_after import is_zero, scales_after
from ocp.refinement.solved_mesh import MeshIteration, SolvedMesh, iterations_of
from ocp.scaling.automatic import scales_of
from ocp.scaling.scales import Scales
from ocp.settings import Settings
from ocp.transcription.packing import decision_vector, trajectory_of
from ocp.transcription.transcribe import ProgramLimits, Transcription, transcribe

Run = Callable[[NlpSolver, StartingPoint], NlpResult]

# A warm start from the mesh iteration before takes some dozens of iterations. Near a degenerate
# optimum it can wander from there for a thousand, where another line search or a start without
# multipliers ends soon. So an attempt ends after these iterations. What has mostly lost its way, as
# where that happened on the mesh before, ends after the second number.
PATIENCE, LEAST_PATIENCE = 300, 60

# status of an attempt that ended in a worse optimum than an earlier mesh
WORSE = "Worse_Optimum"


def with_retries(
    run: Run,
    solver: NlpSolver,
    start: StartingPoint,
    budget: Budget,
    before: Sequence[MeshIteration],
    *,
    most: float = math.inf,
    worst: float = math.inf,
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
    worst : float
        Scaled objective above which an attempt counts as failed: it has led to another optimum.
    """
    already = iterations_of(before)
    iterations, seconds, attempts = 0, 0.0, 0
    for choice, point in _attempts(solver, start, before):
        left = choice if math.isinf(most) else choice.within(most - iterations, math.inf)
        result = run(budget.within(left, already + iterations), point)
        iterations, seconds = iterations + result.iterations, seconds + result.seconds
        attempts += 1
        if result.outcome == "solved" and result.objective > worst:
            result = replace(result, outcome="failed", status=WORSE)
        if result.outcome in ("solved", "interrupted") or budget.spent(already + iterations):
            break
        if iterations >= most:
            break

    if attempts == 1:
        return result
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
        patience = LEAST_PATIENCE if retried else PATIENCE
        yield solver.within(patience, float("inf")), start
        patient = solver.within(PATIENCE, float("inf"))
        for other in patient.alternatives(warm=True):
            yield other, start

    if before:
        for other in solver.alternatives(warm=False):
            yield other, bare
    yield solver, bare


Start = Iterate | Trajectory | None

# A mesh that is about to be replaced is solved to this tolerance: the digits beyond are lost with
# the next mesh. The mesh that meets all tolerances is solved to this part of the least of them, if
# no solver is stated: where the objective is flat, controls are off by its root.
LOOSE = 1e-7
_DIGITS = 1e-4


@dataclass(frozen=True, eq=False, repr=False)
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
    progress: Progress | None = None
    prepared: Transcription | None = None
    _limits: dict[Transcription, ProgramLimits] = field(default_factory=dict, init=False)

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
        if evaluator is None or evaluator.problem is not problem:
            evaluator = Evaluator(problem)
        return cls(problem, settings, parameters, evaluator, budget, progress, prepared)

    @cached_property
    def solver(self) -> NlpSolver:
        """For meshes that are not replaced: as stated, or as tight as the accuracy needs."""
        own, least = self.settings.solver, min(astuple(self.settings.accuracy))
        return own if self.settings.states_solver else own.loosened(min(LOOSE, _DIGITS * least))

    @cached_property
    def loose_solver(self) -> NlpSolver:
        """For meshes that are about to be replaced."""
        return self.solver.loosened(LOOSE)

    def limits(self, program: Transcription) -> ProgramLimits:
        """Limits of a program at the values of the constants; those of the last one are kept."""
        if program not in self._limits:
            self._limits.clear()
            self._limits[program] = program.limits(self.parameters)
        return self._limits[program]

    def first_program(self, start: Start, mesh: Mesh) -> Transcription:
        """The program of the first mesh; one that is there already where it fits."""
        if self.prepared is not None and mesh is self.prepared.mesh:
            return self.prepared

        if not isinstance(start, Iterate):
            scales, settings = self._scales_of(start), self.settings
            return transcribe(self.problem, mesh, settings.scheme, settings.controls, scales)

        if mesh is start.mesh:
            return start.transcription
        return transcribe(
            self.problem,
            mesh,
            start.scheme,
            start.controls,
            start.scales,
            start.transcription,
        )

    def _scales_of(self, start: Trajectory | None) -> Scales:
        """Those of a motion, or of the statement's guess where there is none or it vanishes."""
        stated = self._stated_scales()
        if start is None:
            return stated
        guess = initial_guess(self.problem, self.parameters, start)
        if is_zero(self.problem, self.parameters, stated, guess):
            return stated
        return scales_of(self.problem, guess, self.parameters)

    def _stated_scales(self) -> Scales:
        """Those that the statement alone gives."""
        stated = initial_guess(self.problem, self.parameters)
        return scales_of(self.problem, stated, self.parameters)

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
            self.problem,
            mesh,
            last.scheme,
            last.controls,
            scales,
            last.transcription,
        )

    def scales_after(self, last: Iterate) -> Scales:
        """Sizes for the mesh after a solved one; the same object where they are near enough."""
        return scales_after(last, self._stated_scales)

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
            return StartingPoint.at(start)
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
        worst: float = math.inf,
    ) -> NlpResult:
        """Solve one program from a start, in at most so many iterations.

        Parameters
        ----------
        before : sequence of MeshIteration
            The mesh iterations until then.
        most : float
            Iterations of all attempts together.
        worst : float
            Objective, times the sense of the problem, above which an attempt has led to another
            optimum [unit of the objective].
        """
        limits = self.limits(program)

        def run(solver: NlpSolver, point: StartingPoint) -> NlpResult:
            return self.run(program, solver, point, limits, len(before) + 1)

        point = self.starting_point(program, start, limits)
        scaled = worst / program.scales.objective
        return with_retries(run, solver, point, self.budget, before, most=most, worst=scaled)

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
        errors = later(lambda: estimate_errors(iterate, self.evaluator, self.settings.accuracy))
        violation = float(self.limits(program).excess(result.rows).max(initial=0.0))
        return SolvedMesh(iterate, errors, violation, tight, finer, result.iterations)

    def spent(self, mesh_iterations: Sequence[MeshIteration], ahead: float = 0.0) -> bool:
        """Whether the budget is used up after some mesh iterations, so many seconds from now."""
        return self.budget.spent(iterations_of(mesh_iterations), ahead)

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
        limits = self.limits(program)
        begin = f"{self.problem.name}: mesh iteration {number} ({program.mesh.intervals} intervals)"

        def listen(iteration: int, objective: float, x: Array, rows: Array) -> bool:
            progress(f"{begin}, iteration {iteration}, violation {limits.violation(rows):.1e}")
            return False

        return listen
