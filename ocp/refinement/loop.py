"""The loop of mesh rounds: solve, estimate the errors, choose the next mesh, until it is good."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ocp.arrays import Array
from ocp.errors import BudgetSpent, Interrupted, OcpError
from ocp.mesh.evaluation import Evaluator
from ocp.mesh.initial_guess import initial_guess
from ocp.mesh.mesh import Mesh
from ocp.mesh.trajectory import Trajectory
from ocp.nlp.failures import failure
from ocp.nlp.result import NlpResult
from ocp.nlp.retries import Budget, with_retries
from ocp.nlp.solver import Listener, NlpSolver, StartingPoint
from ocp.optimality.iterate import Iterate, iterate_of
from ocp.optimality.warm_start import carried_multipliers
from ocp.problem.parameters import Parameters
from ocp.problem.problem import Problem
from ocp.progress import Progress
from ocp.refinement.accuracy import Accuracy
from ocp.refinement.error_estimate import MeshErrors, estimate_errors
from ocp.refinement.mesh_iteration import MeshIteration, SolvedMesh, best_of, record_of
from ocp.settings import Settings
from ocp.transcription.packing import decision_vector, trajectory_of
from ocp.transcription.scaling import resized, scales_of
from ocp.transcription.transcribe import Transcription, transcribe

Start = Iterate | Trajectory | None
Ending = Literal["tolerances", "rounds", "failure", "budget"]

# While the last mesh was off by `_FAR` or more, the solver stops at `_LOOSE`: the digits beyond are
# lost with the next mesh. The mesh that meets all tolerances is solved to the tolerance asked for.
_FAR = 1e-3
_LOOSE = 1e-7

log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class MeshSolver:
    """Solves a problem on one mesh after another; what stays the same in all mesh rounds.

    Attributes
    ----------
    problem : Problem
    settings : Settings
    parameters : Parameters
        Values of the problem's constants.
    evaluator : Evaluator
        Of the problem.
    budget : Budget
        Of all mesh rounds together.
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

    @classmethod
    def of(
        cls,
        problem: Problem,
        settings: Settings,
        parameters: Parameters,
        progress: Progress | None = None,
        prepared: Transcription | None = None,
    ) -> MeshSolver:
        """With the budget of the settings, whose clock begins to run."""
        budget = Budget(settings.iterations or float("inf"), settings.seconds or float("inf"))
        evaluator = Evaluator(problem)
        return cls(problem, settings, parameters, evaluator, budget, progress, prepared)

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

    def next_program(self, last: Iterate, mesh: Mesh) -> Transcription:
        """The program of a mesh after a solved one, its objective sized by what was found."""
        if mesh is last.mesh:
            return last.transcription
        scales = resized(last.scales, last.objective)
        return transcribe(
            self.problem, mesh, last.scheme, last.controls, scales, last.transcription
        )

    def starting_point(self, program: Transcription, start: Start) -> StartingPoint:
        """A start of the program: unknowns, and multipliers where an iterate brings them."""
        if not isinstance(start, Iterate):
            return StartingPoint(self._packed(program, start))
        if start.transcription is program:
            # to the last digit, which its multipliers belong to
            return StartingPoint(start.x, (start.bound_multipliers, start.row_multipliers))
        multipliers = carried_multipliers(start, program)
        return StartingPoint(self._packed(program, start.trajectory), multipliers)

    def solve(
        self,
        program: Transcription,
        start: Start,
        solver: NlpSolver,
        before: Sequence[MeshIteration] = (),
    ) -> NlpResult:
        """Solve one program from a start; `before` are the mesh rounds until then."""
        limits = program.limits(self.parameters)
        listener = self._listener(program, len(before) + 1)

        def run(solver: NlpSolver, point: StartingPoint) -> NlpResult:
            return solver.solve(program.program, point, limits, self.parameters.vector, listener)

        point = self.starting_point(program, start)
        return with_retries(run, solver, point, self.budget, _iterations(before))

    def examined(
        self, program: Transcription, result: NlpResult, *, tight: bool, finer: bool
    ) -> SolvedMesh:
        """A solved program with its errors between the points."""
        iterate = iterate_of(program, result, self.parameters)
        errors = estimate_errors(iterate, self.evaluator, self.settings.accuracy)
        lower, upper = program.limits(self.parameters).rows
        excess = np.maximum(lower - result.rows, result.rows - upper)
        return SolvedMesh(iterate, errors, float(excess.max(initial=0.0)), tight, finer)

    def spent(self, rounds: Sequence[MeshIteration]) -> bool:
        """Whether the budget is used up after some mesh rounds."""
        return self.budget.spent(_iterations(rounds))

    def _packed(self, program: Transcription, motion: Trajectory | None) -> Array:
        guess = initial_guess(self.problem, self.parameters, motion)
        return decision_vector(program, guess, self.parameters)

    def _listener(self, program: Transcription, number: int) -> Listener | None:
        """What passes the solver's progress on, if anybody wants to know."""
        progress = self.progress
        if progress is None:
            return None
        unit = program.scales.objective * self.problem.sense
        begin = f"{self.problem.name}: mesh round {number} ({program.mesh.intervals} intervals)"

        def listen(iteration: int, objective: float, x: Array, rows: Array) -> bool:
            progress(f"{begin}, iteration {iteration}, objective {objective * unit:.6g}")
            return False

        return listen


@dataclass(frozen=True, eq=False)
class Refinement:
    """The end of a refinement.

    Attributes
    ----------
    best : SolvedMesh
        The best mesh round that holds between its points; the last one if none does.
    rounds : tuple of MeshIteration
        Records of all, those before this refinement included.
    ending : str
        What ended it.
    """

    best: SolvedMesh
    rounds: tuple[MeshIteration, ...]
    ending: Ending


def refine(
    meshes: MeshSolver,
    start: Start,
    mesh: Mesh,
    accuracy: Accuracy,
    before: Sequence[MeshIteration] = (),
) -> Refinement:
    """Solve, estimate the errors and refine, until all tolerances are met or the budget ends.

    Parameters
    ----------
    meshes : MeshSolver
    start : Iterate, Trajectory or None
        Where the first mesh starts; None for the guess in the statement.
    mesh : Mesh
        The first one.
    accuracy : Accuracy
        May be stricter than that of the settings.
    before : sequence of MeshIteration
        Mesh rounds until then.

    Raises
    ------
    SolveFailed
        No mesh was solved, or the budget ended before one held between its points.
    Interrupted
        The user stopped it.
    """
    solved: list[SolvedMesh] = []
    rounds = list(before)
    try:
        ending = _refine(meshes, start, mesh, accuracy, solved, rounds)
    except KeyboardInterrupt as stop:
        raise _interrupted(meshes.problem, solved, accuracy, None) from stop

    best = best_of(solved, accuracy)
    if ending == "budget" and not best.holds(accuracy):
        raise _budget_spent(meshes, rounds, best.iterate.trajectory, best)
    return Refinement(best, tuple(rounds), ending)


def _refine(
    meshes: MeshSolver,
    start: Start,
    mesh: Mesh,
    accuracy: Accuracy,
    solved: list[SolvedMesh],
    rounds: list[MeshIteration],
) -> Ending:
    """The loop; appends to `solved` and `rounds`."""
    asked, policy = meshes.settings.solver, meshes.settings.refinement
    most = len(rounds) + policy.rounds
    program, finer = meshes.first_program(start, mesh), False

    # without multipliers the first mesh is a rough one, and its digits are lost with it
    loose = policy.adapts and not isinstance(start, Iterate)

    while True:
        solver = asked.loosened(_LOOSE) if loose else asked
        result = meshes.solve(program, start, solver, rounds)

        if result.outcome == "solved":
            last = meshes.examined(program, result, tight=solver is asked, finer=finer)
            solved.append(last)
            rounds.append(record_of(program.mesh, result, last))
            log.info("round %d: %s", len(rounds), rounds[-1])

            following = policy.next_mesh(solved, accuracy)
            loose = following is not None and _worst(last.errors) >= _FAR
            if not last.tight and (following is None or len(rounds) >= most):
                # once more, to the tolerance asked for
                following, loose = program.mesh, False
        else:
            rounds.append(record_of(program.mesh, result, None))
            if error := _fatal(meshes, program, result, solved, rounds):
                raise error
            if meshes.spent(rounds):
                return "budget"
            recovery = policy.after_failure(solved, program.mesh, accuracy)
            if recovery is None:
                return "failure"
            policy, following = recovery

        if following is None:
            return "tolerances"
        if len(rounds) >= most and following is not program.mesh:
            return "rounds"
        if meshes.spent(rounds):
            return "budget"

        finer = following.intervals > program.mesh.intervals
        start = solved[-1].iterate
        program = meshes.next_program(start, following)


def _worst(errors: MeshErrors) -> float:
    """What is wrong with a mesh, or what a better one gains, whichever is more."""
    return max(errors.gain, errors.excess, errors.dynamics)


def _fatal(
    meshes: MeshSolver,
    program: Transcription,
    result: NlpResult,
    solved: Sequence[SolvedMesh],
    rounds: Sequence[MeshIteration],
) -> OcpError | None:
    """The error of a failed round that leaves nothing to go on from."""
    accuracy = meshes.settings.accuracy
    last = trajectory_of(program, result.x, meshes.parameters)
    if result.outcome == "interrupted":
        return _interrupted(meshes.problem, solved, accuracy, last)
    if meshes.spent(rounds) and not any(s.holds(accuracy) for s in solved):
        return _budget_spent(meshes, rounds, last, solved[-1] if solved else None)
    if not solved:
        return failure(program, result, meshes.parameters, last)
    return None


def _budget_spent(
    meshes: MeshSolver,
    rounds: Sequence[MeshIteration],
    last: Trajectory,
    finished: SolvedMesh | None,
) -> BudgetSpent:
    """The error of a budget that ended before a round held between its points."""
    state = "no mesh round was solved"
    if finished is not None:
        state = (
            f"the errors between the points were still {finished.errors.dynamics:.1e} of the "
            f"dynamics and {max(finished.errors.excess, 0.0):.1e} of the constraints"
        )
    return BudgetSpent(
        f"the budget of {meshes.budget} for '{meshes.problem.name}' ended in mesh round "
        f"{len(rounds)} after {_iterations(rounds)} iterations: {state}; raise the budget, loosen "
        "the tolerances or give a better guess",
        last,
        None if finished is None else finished.iterate.trajectory,
    )


def _interrupted(
    problem: Problem,
    solved: Sequence[SolvedMesh],
    accuracy: Accuracy,
    last: Trajectory | None,
) -> Interrupted:
    """The error of a stopped solve, with the last iterate and the best round that holds."""
    finished, verified = None, None
    if solved:
        best = best_of(solved, accuracy)
        finished = best.iterate.trajectory
        verified = finished if best.holds(accuracy) else None
    kept = "the best round so far is kept" if verified else "no round had met its tolerances"
    return Interrupted(
        f"'{problem.name}' was stopped in mesh round {len(solved) + 1}; {kept}",
        last,
        finished,
        verified,
    )


def _iterations(rounds: Sequence[MeshIteration]) -> int:
    return sum(entry.iterations for entry in rounds)
