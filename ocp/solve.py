"""The one verb: `solve` a problem, refine its mesh, verify the answer."""

from __future__ import annotations

import math
import time as clock
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from ocp.errors import Interrupted, StatementError, StatementWarning, Unverified
from ocp.keywords import checked_keywords
from ocp.mesh.first_mesh import following
from ocp.mesh.initial_guess import initial_guess
from ocp.mesh.mesh import Mesh, uniform
from ocp.mesh.simulated_fit import determined_motion
from ocp.mesh.trajectory import Trajectory
from ocp.nlp.collapse import collapsed
from ocp.nlp.failures import failure
from ocp.optimality.iterate import Iterate
from ocp.optimality.multiplier_sets import fitted_to_switches
from ocp.optimality.multipliers import multipliers
from ocp.optimality.number_steps import number_remark, number_steps
from ocp.optimality.steps import step_remark, steps_along
from ocp.problem.checks_before_solve import check_before_solve
from ocp.problem.integrator_chains import first_degree
from ocp.problem.parameters import parameters_of
from ocp.problem.problem import Problem, check_is_problem
from ocp.problem.symbols import Constant, is_real
from ocp.progress import Progress, shown
from ocp.refinement.estimates.missed_switches import displaced_remark
from ocp.refinement.estimates.narrow_features import feature_remark
from ocp.refinement.estimates.other_controls import other_controls, others_remark
from ocp.refinement.estimates.promised_gain import CERTIFIED_GAIN
from ocp.refinement.loop import Refinement, refine
from ocp.refinement.mesh_iteration import MeshIteration
from ocp.refinement.mesh_solver import MeshSolver, Start
from ocp.refinement.solved_mesh import LOOSER, SolvedMesh
from ocp.settings import Settings, first_intervals
from ocp.solution.solution import Solution
from ocp.transcription.packing import trajectory_of
from ocp.verification.simulation import SimulatedMotion, replayed, simulate
from ocp.verification.verify import Verification, unverified, verify

_DEFAULTS = Settings()

# Every interval can meet its tolerance while their errors add up to a miss of the replayed end
# state. The tolerance is then made stricter by this factor, so many times at most.
_STRICTER = 30.0
_STRICTER_GOES = 3

# Part of a proven bound by which a value that meets it may be off: bounds that are computed are not
# better themselves.
BOUND_MET = 1e-5

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
    """`solve` from a given start and mesh."""
    settings, accuracy = meshes.settings, meshes.settings.accuracy
    check_before_solve(meshes.problem, meshes.parameters)
    rounds: tuple[MeshIteration, ...] = ()
    checking = 0.0

    for _ in range(_STRICTER_GOES):
        refinement = refine(meshes, start, mesh, accuracy, rounds)
        iterate, rounds = refinement.best.iterate, refinement.rounds
        checked = _checked(meshes, refinement.best)
        checking += checked.seconds

        if not (settings.refinement.adapts and settings.verify) or meshes.spent(rounds):
            break
        # what holds between the points and not in the replay is off by the dynamics' errors
        holds = refinement.best.holds(accuracy, LOOSER)
        passed = checked.verification.passed or not holds
        if passed and checked.motion.miss <= settings.accuracy.replay:
            break
        accuracy = replace(accuracy, dynamics=accuracy.dynamics / _STRICTER)
        mesh, start = iterate.mesh, iterate

    return _solution(meshes, refinement, replace(checked, seconds=checking), bound)


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
    replayed : Trajectory
    verification : Verification
    seconds : float
        That this took [s].
    """

    motion: SimulatedMotion
    replayed: Trajectory
    verification: Verification
    seconds: float


def _checked(meshes: MeshSolver, best: SolvedMesh) -> _Checked:
    """Replay an iterate and check it, unless the settings say not to."""
    iterate = best.iterate
    if not meshes.settings.verify:
        nothing = SimulatedMotion(())
        return _Checked(nothing, iterate.trajectory, unverified(iterate.objective), 0.0)
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
    return _Checked(motion, again, verification, clock.perf_counter() - begin)


def _solution(
    meshes: MeshSolver,
    refinement: Refinement,
    checked: _Checked,
    bound: float | None,
) -> Solution:
    """The solution, or the error of an answer that takes no time or does not pass."""
    settings, iterate = meshes.settings, refinement.best.iterate
    if error := collapsed(iterate.transcription, iterate.trajectory):
        raise error

    fitted = fitted_to_switches(iterate)
    verdict = "unverified"
    if checked.verification.passed:
        verdict = _verdict(meshes, refinement, bound)
        remarks = (*_remarks(meshes, refinement, fitted), feature_remark(refinement.features))
        verdict += "".join(f"; {remark}" for remark in remarks if remark)
    steps = step_remark(steps_along(meshes.problem, iterate.trajectory, meshes.evaluator))
    beside = number_remark(number_steps(iterate, meshes.evaluator))
    remark = "; ".join(filter(None, (steps, beside)))
    if remark:
        verdict += f"; {remark}"
        warnings.warn(f"'{meshes.problem.name}': {remark}", StatementWarning, stacklevel=5)
    solution = Solution(
        problem=meshes.problem,
        objective=iterate.objective,
        trajectory=iterate.trajectory,
        replayed=checked.replayed,
        replay=checked.motion,
        verification=replace(checked.verification, seconds=checked.seconds),
        mesh=iterate.mesh,
        mesh_iterations=refinement.rounds,
        verdict=verdict,
        evaluator=meshes.evaluator,
        seconds=clock.perf_counter() - meshes.budget.begin,
        multipliers=multipliers(fitted),
        iterate=fitted,
    )

    # on a fixed mesh the user wants to see what it gives
    if not checked.verification.passed and settings.refinement.adapts and settings.verify:
        ended = refinement.ending == "budget"
        when = f" when the budget of {meshes.budget} was used up" if ended else ""
        raise Unverified(
            f"the answer for '{meshes.problem.name}' did not pass its verification{when}: "
            + "; ".join(checked.verification.reasons)
            + (
                f"; {remark}"
                if remark
                else "; loosen the tolerance named, allow more rounds or intervals"
            )
            + ", or look at the unverified answer in error.iterate",
            solution,
        )
    return solution


def _remarks(meshes: MeshSolver, refinement: Refinement, fitted: Iterate) -> Iterator[str]:
    """Sentences of a verdict on what is open or may be better, though the answer is verified.

    Parameters
    ----------
    fitted : Iterate
        The answer, with multipliers that fit its switches.
    """
    iterate, adapts = refinement.best.iterate, meshes.settings.refinement.adapts
    shortfall = _shortfall(meshes, refinement)
    if shortfall:
        yield shortfall
    if refinement.best.raised:
        yield (
            "its peaks were raised to what the motion has between its points, which cost "
            f"{refinement.best.raised:.0e} of the objective"
        )
    if refinement.lower is not None and adapts:
        yield (
            f"it is a saddle: a motion beside it reaches {refinement.lower:.6g}, but none was "
            "found there that meets the dynamics and all limits between its points"
        )
    others = list(other_controls(iterate, meshes.evaluator))
    if told := others_remark(others, iterate):
        yield told
    # a fixed mesh may be coarse on purpose, and what else is open explains a displaced switch
    if adapts and not shortfall and (displaced := displaced_remark(fitted, meshes.evaluator)):
        yield displaced


def _shortfall(meshes: MeshSolver, refinement: Refinement) -> str:
    """Why the refinement ended short of its tolerances, and which they are, if it did."""
    gain = refinement.best.errors.gain
    if not meshes.settings.refinement.adapts:
        # it may be coarse on purpose, but what that costs should be known
        if not meshes.settings.scheme.informative_multipliers:
            return "the mesh is fixed, and this scheme does not tell what a finer one gains"
        coarse = gain > CERTIFIED_GAIN
        return f"the mesh is fixed, and a finer one promises a gain of {gain:.0e}" if coarse else ""
    endings = {
        "tolerances": "",
        "standstill": "refinement ended where the objective stood still",
        "rounds": f"refinement ended after {len(refinement.rounds)} mesh iterations",
        "failure": "refinement ended after a mesh that failed",
        "budget": f"the budget of {meshes.budget} ended the refinement",
    }
    ending, best, accuracy = endings[refinement.ending], refinement.best, meshes.settings.accuracy

    open_tolerances = [
        f"{what} hold to {value:.1e}; asked for were {allowed:.0e}"
        for what, value, allowed in (
            ("the constraints", best.leak, accuracy.path),
            ("the dynamics", best.errors.dynamics, accuracy.dynamics),
        )
        if value > allowed
    ]
    # refuted by a finer mesh or not, what is promised is said
    if best.errors.gain > accuracy.objective:
        open_tolerances.append(f"finer controls promise a gain of {best.errors.gain:.0e}")
    return ": ".join(part for part in (ending, "; ".join(open_tolerances)) if part)


def _verdict(meshes: MeshSolver, refinement: Refinement, bound: float | None) -> str:
    starts = max(entry.starts for entry in refinement.rounds)
    verdict = f"local: best of {starts} start{'s' if starts > 1 else ''}"
    if bound is None:
        return verdict

    value = refinement.best.iterate.objective
    gap = gap_to_bound(value, bound, meshes.problem.sense)
    if abs(gap) <= max(meshes.settings.accuracy.objective, BOUND_MET):
        return f"global: bound met (gap {abs(gap):.1e})"
    if gap < 0:
        verdict += f"; the bound of {bound:.6g} is refuted by {value:.6g}"
    return verdict


def gap_to_bound(value: float, bound: float, sense: float) -> float:
    """How far a value is from a proven bound, relative to the bound; negative if it refutes it.

    Parameters
    ----------
    value, bound : float
        [unit of the objective]
    sense : float
        Of the problem: 1 where it is minimised, -1 where it is maximised.
    """
    # only zero meets a bound of zero
    return sense * (value - bound) / max(abs(bound), 1e-300)
