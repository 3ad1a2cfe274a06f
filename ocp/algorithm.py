"""The one verb: `solve` a problem, refine its mesh, verify the answer."""

from __future__ import annotations

import math
import time as clock
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

from ocp.errors import Interrupted, StatementError, StatementWarning, Unverified
from ocp.keywords import checked_keywords
from ocp.later import later
from ocp.mesh.first_mesh import following
from ocp.mesh.initial_guess import initial_guess
from ocp.mesh.mesh import Mesh, uniform
from ocp.mesh.simulated_fit import determined_motion
from ocp.mesh.trajectory import Trajectory
from ocp.nlp.collapse import collapsed
from ocp.nlp.failures import failure, remedy_for_bends
from ocp.optimality.iterate import Iterate
from ocp.optimality.multiplier_sets import fitted_to_switches
from ocp.optimality.multipliers import multipliers
from ocp.optimality.number_steps import number_remark, number_steps
from ocp.optimality.steps import step_remark, steps_along
from ocp.problem.checks_before_solve import check_before_solve
from ocp.problem.functionals import Peak
from ocp.problem.integrator_chains import first_degree
from ocp.problem.parameters import parameters_of
from ocp.problem.problem import Problem, check_is_problem
from ocp.problem.symbols import Constant, is_real
from ocp.progress import Progress, shown
from ocp.refinement.mesh_iteration import MeshIteration
from ocp.refinement.mesh_solver import MeshSolver, Start
from ocp.refinement.refine import Refinement, refine
from ocp.refinement.solved_mesh import SolvedMesh
from ocp.settings import Settings, first_intervals
from ocp.solution.solution import Solution
from ocp.transcription.packing import trajectory_of
from ocp.verdict import verdict_on
from ocp.verification.both_parts import check_parts
from ocp.verification.simulation import SimulatedMotion, replayed, simulate
from ocp.verification.verify import Verification, unverified, verify

_DEFAULTS = Settings()

# Every interval can meet its tolerance while their errors add up to a miss of the replayed end
# state, or of the objective. The tolerance is then made stricter by this factor, and so many
# refinements are made at most.
_STRICTER = 30.0
_STRICTER_GOES = 3

# words of other tools
_ELSEWHERE = {
    **dict.fromkeys(("verbose", "print_level", "display"), "write progress=True"),
    **dict.fromkeys(("initial_guess", "x0", "warm_start"), "write guess={value}"),
    **dict.fromkeys(("parameters", "p"), "write constants={value}"),
    **dict.fromkeys(
        ("intervals", "scheme", "accuracy", "solver", "refinement", "seconds", "iterations"),
        "write it in the settings: settings=Settings(...)",
    ),
}


@checked_keywords(elsewhere=_ELSEWHERE)
def solve(
    problem: Problem,
    *,
    settings: Settings | None = None,
    guess: Solution | Trajectory | None = None,
    mesh: Mesh | None = None,
    constants: Mapping[Constant, float] | None = None,
    bound: float | None = None,
    progress: Progress | bool | None = None,
) -> Solution:
    """Solve an optimal control problem and verify the answer.

    Parameters
    ----------
    problem : Problem
    settings : Settings, optional
        How to discretise, refine, solve and verify.
    guess : Solution or Trajectory, optional
        Where to start instead of the guess in the statement; its mesh may differ. A solution of
        the same problem (for other `constants`, say) gives its multipliers and its scales too,
        and on its own mesh its nonlinear program, which then is not built again.
    mesh : Mesh, optional
        First mesh; by default that of the guess if it is a `Solution`, else a uniform one.
    constants : mapping of Constant to number, optional
        Values that replace those of the statement.
    bound : float, optional
        A proven bound of the optimum: a lower one when minimising, an upper one when maximising.
    progress : bool or callable, optional
        True for one live line on the terminal; a callable receives one line of text per iteration.

    Returns
    -------
    Solution
        Refined, replayed by another integrator, and checked between its points.

    Raises
    ------
    StatementError
        The statement contradicts itself.
    SolveFailed
        No solution was found; the message names the worst constraint.
    Unverified
        The solver's answer did not pass its verification; ``error.iterate`` holds it.
    BudgetSpent
        The budget of the settings ended before any round held between its points.
    Interrupted
        The user stopped the solve.
    """
    settings = _DEFAULTS if settings is None else settings
    check_arguments(problem, settings, guess, mesh)
    if not (bound is None or (is_real(bound) and math.isfinite(bound))):
        raise StatementError(f"the argument 'bound' is {bound!r}; give a finite number")
    parameters = parameters_of(problem, constants)
    start, stays = start_from(problem, settings, guess), mesh is not None
    if mesh is None:
        mesh = guess.mesh if isinstance(guess, Solution) else first_mesh(problem, settings, guess)
    known = guess.evaluator if isinstance(guess, Solution) else None
    if guess is None and not stays and settings.refinement.adapts:
        stated = initial_guess(problem, parameters)
        if found := determined_motion(problem, parameters, stated, settings.scheme, mesh):
            start, mesh = found
    with shown(progress) as say:
        meshes = MeshSolver.of(problem, settings, parameters, say, evaluator=known)
        return solve_from(meshes, start, mesh, bound)


def solve_from(
    meshes: MeshSolver, start: Start, mesh: Mesh, bound: float | None = None
) -> Solution:
    """`solve` from a given start and mesh: refine, replay and check, until the replay agrees."""
    settings, accuracy = meshes.settings, meshes.settings.accuracy
    check_before_solve(meshes.problem, meshes.parameters)
    rounds: tuple[MeshIteration, ...] = ()
    seconds = 0.0

    for _ in range(_STRICTER_GOES):
        refinement = refine(meshes, start, mesh, accuracy, rounds)
        iterate, rounds = refinement.best.iterate, refinement.rounds
        check_parts(meshes.problem, iterate.trajectory)
        if not (settings.refinement.adapts and settings.verify):
            # no decision depends on what the replay finds
            check = cache(partial(_checked, meshes, refinement.best))
            return _solution(meshes, refinement, check, bound)
        checked = _checked(meshes, refinement.best)
        seconds += checked.verification.seconds

        if meshes.spent(rounds):
            break
        # what holds between the points and not in the replay is off by the dynamics' errors
        holds = refinement.best.is_verifiable(accuracy)
        exact = _costs_the_same(meshes, refinement, checked)
        passed = (checked.verification.passed and exact) or not holds
        if passed and checked.motion.miss <= settings.accuracy.replay:
            break
        accuracy = replace(accuracy, dynamics=accuracy.dynamics / _STRICTER)
        mesh, start = iterate.mesh, iterate

    verification = replace(checked.verification, seconds=seconds)
    checked = replace(checked, verification=verification)
    return _solution(meshes, refinement, lambda: checked, bound)


@checked_keywords()
def collocate(
    problem: Problem,
    *,
    settings: Settings | None = None,
    guess: Trajectory | None = None,
    mesh: Mesh | None = None,
    progress: Progress | bool | None = None,
) -> tuple[Trajectory, float]:
    """Solve on one mesh and return what the solver found, neither refined nor verified.

    For callers who replay the answer on models of their own; others want `solve`.

    Parameters
    ----------
    problem : Problem
    settings, guess, mesh, progress : optional
        As of `solve`.

    Returns
    -------
    trajectory : Trajectory
    objective : float
        Its value [unit of the objective].

    Raises
    ------
    StatementError
        An argument is of the wrong kind, or the guess is not finite or has a wrong shape.
    SolveFailed
        The solver found nothing; the message names the worst constraint.
    Interrupted
        The user stopped the solve.
    """
    settings = _DEFAULTS if settings is None else settings
    check_arguments(problem, settings, guess, mesh)
    parameters = parameters_of(problem)
    with shown(progress) as say:
        meshes = MeshSolver.of(problem, settings, parameters, say)
        program = meshes.first_program(guess, mesh or first_mesh(problem, settings, guess))
        result = meshes.solve(program, guess, settings.solver)

    trajectory = trajectory_of(program, result.x, parameters)
    if result.outcome == "interrupted":
        raise Interrupted(f"'{problem.name}' was stopped", trajectory, None, None)
    if result.outcome != "solved":
        raise failure(program, result, parameters, trajectory)
    return trajectory, problem.sense * result.objective * program.scales.objective


def check_arguments(problem: Any, settings: Any, guess: Any, mesh: Any) -> None:
    """StatementError unless the arguments of a verb are of the right kinds."""
    check_is_problem(problem)
    for what, value, kinds, remedy in (
        ("settings", settings, (Settings,), "write Settings(...)"),
        ("mesh", mesh, (Mesh, type(None)), "give a Mesh, such as solution.mesh"),
        (
            "guess",
            guess,
            (Solution, Trajectory, type(None)),
            "give a Solution or a Trajectory; guesses of single signals belong to Phase(guess=...)",
        ),
    ):
        if not isinstance(value, kinds):
            raise StatementError(
                f"the argument '{what}' is of type {type(value).__name__}; {remedy}"
            )


def start_from(problem: Problem, settings: Settings, guess: Solution | Trajectory | None) -> Start:
    """Where to start; with multipliers if the guess is a solution of the very problem."""
    if not isinstance(guess, Solution):
        return guess
    iterate = guess.iterate
    if iterate is None or iterate.problem is not problem:
        return guess.trajectory
    same_scheme = type(iterate.scheme) is type(settings.scheme)
    same = same_scheme and iterate.controls == settings.controls
    return iterate if same else guess.trajectory


def first_mesh(problem: Problem, settings: Settings, guess: Trajectory | None = None) -> Mesh:
    """The mesh of a first round: uniform, unless the guess moves too fast for that."""
    highest = settings.refinement.highest_degree
    degrees = [
        first_degree(problem, phase, settings.scheme, settings.controls, highest)
        for phase in problem.phases
    ]
    uniformly = map(uniform, first_intervals(settings, problem), degrees)
    stated = initial_guess(problem, parameters_of(problem), guess)
    return Mesh(
        tuple(
            following(mesh, stated.phases[phase.name], [state.name for state in phase.states])
            for mesh, phase in zip(uniformly, problem.phases, strict=True)
        )
    )


@dataclass(frozen=True, eq=False, repr=False)
class _Checked:
    """The replay of an iterate and what it says.

    Attributes
    ----------
    motion : SimulatedMotion
        Of the replay, without phases where the settings ask for none.
    replayed : Trajectory
        The same as a trajectory; that of the iterate where nothing was replayed.
    verification : Verification
    """

    motion: SimulatedMotion
    replayed: Trajectory
    verification: Verification


def _checked(meshes: MeshSolver, best: SolvedMesh) -> _Checked:
    """Replay an iterate and check it, unless the settings say not to."""
    iterate = best.iterate
    if not meshes.settings.verify:
        return _Checked(SimulatedMotion(()), iterate.trajectory, unverified(iterate.objective))
    begin = clock.perf_counter()
    motion = simulate(meshes.problem, iterate.trajectory, dict(iterate.scales.signals))
    again = replayed(iterate.trajectory, motion)
    verification = verify(
        iterate,
        motion,
        again,
        meshes.settings.accuracy,
        meshes.evaluator,
        best.errors.of_motion,
    )
    seconds = clock.perf_counter() - begin
    return _Checked(motion, again, replace(verification, seconds=seconds))


def _costs_the_same(meshes: MeshSolver, refinement: Refinement, checked: _Checked) -> bool:
    """Whether the replay has the same objective, to what was asked of the objective itself.

    Not asked where a peak enters it: the dynamics are not what a peak is off by. Nor where a step
    is told, or the refinement had no end: a finer mesh would begin to resolve what is steep, and
    what it hides would be told no longer.
    """
    if any(isinstance(symbol, Peak) for symbol in meshes.problem.objective_symbols):
        return True
    accuracy, found = meshes.settings.accuracy, checked.verification
    iterate, miss = refinement.best.iterate, abs(found.replayed_objective - found.objective)
    if miss <= max(accuracy.objective, accuracy.replay) * iterate.objective_size:
        return True
    steps = any(True for _ in steps_along(meshes.problem, iterate.trajectory, meshes.evaluator))
    return steps or refinement.ending != "tolerances"


def _solution(
    meshes: MeshSolver,
    refinement: Refinement,
    checked: Callable[[], _Checked],
    bound: float | None,
) -> Solution:
    """The solution, or the error of an answer that takes no time or does not pass.

    Parameters
    ----------
    checked : callable
        Gives the replay and what it says, when that is asked for.
    """
    settings, iterate = meshes.settings, refinement.best.iterate
    if error := collapsed(iterate.transcription, iterate.trajectory):
        raise error

    fitted = fitted_to_switches(iterate)

    def verdict(calls: int) -> str:
        """The verdict. A warning names the line so many calls away, which solves or reads it."""
        passed = checked().verification.passed
        said = verdict_on(meshes, refinement, bound) if passed else "unverified"
        if remark := _remark_on_steps(meshes, iterate):
            said += f"; {remark}"
            warnings.warn(f"'{meshes.problem.name}': {remark}", StatementWarning, stacklevel=calls)
        return said

    adapts = settings.refinement.adapts

    solution = Solution(
        problem=meshes.problem,
        objective=iterate.objective,
        trajectory=iterate.trajectory,
        replayed=later(lambda: checked().replayed),
        replay=later(lambda: checked().motion),
        verification=later(lambda: checked().verification),
        mesh=iterate.mesh,
        mesh_iterations=refinement.rounds,
        verdict=verdict(6) if adapts else later(lambda: verdict(4)),
        multipliers=later(lambda: multipliers(fitted)),
        evaluator=meshes.evaluator,
        seconds=clock.perf_counter() - meshes.budget.begin,
        iterate=fitted,
    )

    # on a fixed mesh the user wants to see what it gives
    if adapts and settings.verify and not solution.verification.passed:
        raise _unverified(meshes, refinement, solution)
    return solution


def _remark_on_steps(meshes: MeshSolver, iterate: Iterate) -> str:
    """What steps make of an answer, along the motion and beside it; empty without any."""
    along = step_remark(steps_along(meshes.problem, iterate.trajectory, meshes.evaluator))
    beside = number_remark(number_steps(iterate, meshes.evaluator))
    return "; ".join(filter(None, (along, beside)))


def _unverified(meshes: MeshSolver, refinement: Refinement, solution: Solution) -> Unverified:
    """The error of an answer that did not pass; a remark on steps explains that better."""
    ended = refinement.ending == "budget"
    when = f" when the budget of {meshes.budget} was used up" if ended else ""
    reasons = "; ".join(solution.verification.reasons)
    remark = _remark_on_steps(meshes, refinement.best.iterate)
    bends = remedy_for_bends(meshes.problem)
    advice = remark or f"{bends}loosen the tolerance named, allow more rounds or intervals"
    return Unverified(
        f"the answer for '{meshes.problem.name}' did not pass its verification{when}: {reasons}; "
        f"{advice}, or look at the unverified answer in error.iterate",
        solution,
    )
