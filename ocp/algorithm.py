"""The one verb: `solve` a problem, refine its mesh, verify the answer."""

from __future__ import annotations

import functools
import math
import time as clock
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from ocp.errors import BudgetSpent, Interrupted, SolveFailed, StatementError, Unverified
from ocp.keywords import checked_keywords
from ocp.later import later
from ocp.mesh.initial_guess import following, initial_guess
from ocp.mesh.mesh import Mesh, uniform
from ocp.mesh.trajectory import Evaluator, Trajectory
from ocp.nlp.failures import collapse_of, remedy_for_kinks
from ocp.optimality.multipliers import multipliers
from ocp.problem.checks_before_solve import check_before_solve
from ocp.problem.functionals import Peak
from ocp.problem.parameters import parameters_of
from ocp.problem.problem import Problem, check_is_problem
from ocp.problem.symbols import Constant, is_real
from ocp.progress import Progress, shown
from ocp.refinement.mesh_solver import MeshSolver, Start
from ocp.refinement.refine import Refinement, refine
from ocp.refinement.solved_mesh import CUT_SHORT
from ocp.refinement.switch_multipliers import with_free_switches
from ocp.reformulate.form import Form, reformulated
from ocp.reformulate.split_controls import check_parts
from ocp.settings import Settings, first_intervals
from ocp.solution.solution import Solution
from ocp.verdict import verdict_on
from ocp.verification.simulation import SimulatedMotion
from ocp.verification.verify import ReplayedAnswer, Verification, unverified, verify

_DEFAULTS = Settings()

# Every interval can meet its tolerance while their errors add up to a miss of the replayed end
# state, or of the objective. The tolerance is then made stricter by this factor.
_STRICTER = 30.0

# Factor of the growth of errors from which on a motion is unstable
_UNSTABLE = 10.0

# What a motion has to be accurate to, if a solve that is cut short is to hand it over
_OF_USE = 1e-2

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


@checked_keywords(_ELSEWHERE)
def solve(
    problem: Problem,
    *,
    settings: Settings | None = None,
    guess: Solution | Trajectory | None = None,
    mesh: Mesh | None = None,
    constants: Mapping[Constant, float] | None = None,
    bound: float | None = None,
    progress: Progress | bool | None = None,
    partial: bool = True,
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
    partial : bool
        Whether Ctrl-C and a spent budget hand over the best motion until then, if it is accurate to
        1e-2. ``solution.accuracy`` says to what, ``solution.ending`` and the verdict why.
        Without, both raise.

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
        The budget of the settings ended before any motion was accurate to 1e-2, or, if `partial` is
        false, before any was as accurate as asked for.
    Interrupted
        The user stopped the solve before that.
    """
    settings = _DEFAULTS if settings is None else settings
    check_arguments(problem, settings, guess, mesh)
    if not (bound is None or (is_real(bound) and math.isfinite(bound))):
        raise StatementError(f"the argument 'bound' is {bound!r}; give a finite number")
    form = form_of(problem, settings, guess)
    parameters = form.parameters(constants)
    start = start_from(form, settings, guess)
    mesh = mesh or mesh_of(form, settings, guess)
    known = guess.form_evaluator if isinstance(guess, Solution) else None
    with shown(progress) as say:
        meshes = MeshSolver.of(form.problem, settings, parameters, say, evaluator=known)
        try:
            return solve_from(form, meshes, start, mesh, bound, partial=partial)
        except (Interrupted, BudgetSpent) as stop:
            handed = _handed_over(form, meshes, stop, bound) if partial else None
            if handed is None:
                raise
            return handed


def solve_from(
    form: Form,
    meshes: MeshSolver,
    start: Start,
    mesh: Mesh,
    bound: float | None = None,
    *,
    partial: bool = False,
) -> Solution:
    """`solve` from a given start and mesh: refine, replay and check, and refine once more at most.

    The second refinement is to stricter dynamics, where the replay asks for that.
    """
    settings, accuracy = meshes.settings, meshes.settings.accuracy
    with errors_of_statement(form):
        check_before_solve(meshes.problem, meshes.parameters)
        refinement = refine(meshes, start, mesh, accuracy)
        check = cache(functools.partial(_checked, form, meshes, refinement))

        # else no decision depends on what the replay finds
        decides = settings.refinement.adapts and settings.verify
        if decides and _is_too_loose(meshes, refinement, check()):
            # than what was asked for, and than what the answer has
            has = max(refinement.best.errors.dynamics, accuracy.dynamics / _STRICTER)
            stricter = replace(accuracy, dynamics=min(has, accuracy.dynamics) / _STRICTER)
            last, seconds = refinement.best.iterate, check().verification.seconds
            refinement = refine(meshes, last, last.mesh, stricter, refinement.mesh_iterations)
            check = cache(functools.partial(_checked, form, meshes, refinement, seconds))
        return _solution(form, meshes, refinement, check, bound, partial=partial)


def _handed_over(
    form: Form, meshes: MeshSolver, stop: Interrupted | BudgetSpent, bound: float | None
) -> Solution | None:
    """What a stopped solve had reached, as a solution; None if it is not accurate enough.

    The error carries it then, for inspection.
    """
    reached = stop.refinement
    if not isinstance(reached, Refinement):
        return None
    check = cache(functools.partial(_checked, form, meshes, reached))
    with suppress(SolveFailed):
        solution = _solution(form, meshes, reached, check, bound, partial=True)
        if solution.accuracy <= _OF_USE:
            return solution
        stop.iterate = solution
    return None


def _is_too_loose(meshes: MeshSolver, refinement: Refinement, checked: _Checked) -> bool:
    """Whether an answer holds between the points, and not in the replay: its errors add up."""
    accuracy = meshes.settings.accuracy
    if meshes.spent(refinement.mesh_iterations) or refinement.ending in CUT_SHORT:
        return False
    # a motion that amplifies errors by more than stricter dynamics take away is flown with feedback
    miss, unstable = checked.verification.one_run, checked.motion.amplification > _UNSTABLE
    if miss > accuracy.replay:
        return not unstable or miss <= _STRICTER * accuracy.replay
    if not refinement.best.is_verifiable(accuracy):
        return False

    # a peak is not off by the dynamics, and what ended short of its tolerances would do so again
    peaks = any(isinstance(symbol, Peak) for symbol in meshes.problem.objective_symbols)
    found, size = checked.verification, refinement.best.iterate.objective_size
    off = abs(found.replayed_objective - found.objective) / size
    if off > max(accuracy.objective, accuracy.replay) and refinement.ending == "tolerances":
        return not (found.passed and peaks)
    return not found.passed


@contextmanager
def errors_of_statement(form: Form) -> Iterator[None]:
    """Errors of a solve with motions of the statement, not of what is solved in its place."""
    try:
        yield
    except (SolveFailed, Interrupted) as error:
        for name in ("iterate", "finished"):
            motion = getattr(error, name, None)
            if isinstance(motion, Trajectory):
                setattr(error, name, form.stated(motion))
        raise


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


def form_of(
    problem: Problem, settings: Settings, guess: Solution | Trajectory | None = None
) -> Form:
    """What is solved in place of a problem; a solution of the very problem brings its own."""
    passes = tuple(settings.reformulations)
    known = guess.form if isinstance(guess, Solution) and guess.problem is problem else None
    if known is not None and known.passes == tuple(map(repr, passes)):
        return known
    return reformulated(problem, passes)


def start_from(form: Form, settings: Settings, guess: Solution | Trajectory | None) -> Start:
    """Where to start; with multipliers if the guess is a solution of the very problem."""
    if not isinstance(guess, Solution):
        return None if guess is None else form.solved(guess)
    iterate = guess.iterate
    if iterate is None or iterate.problem is not form.problem:
        return form.solved(guess.trajectory)
    same_scheme = type(iterate.scheme) is type(settings.scheme)
    same = same_scheme and iterate.controls == settings.controls
    return iterate if same else iterate.trajectory


def mesh_of(form: Form, settings: Settings, guess: Solution | Trajectory | None) -> Mesh:
    """The first mesh where none is given: that of a solution, or a new one."""
    if isinstance(guess, Solution):
        return guess.mesh
    return first_mesh(form.problem, settings, None if guess is None else form.solved(guess))


def first_mesh(problem: Problem, settings: Settings, guess: Trajectory | None = None) -> Mesh:
    """The first mesh of a solve: uniform, unless the guess moves too fast for that."""
    intervals = first_intervals(settings, problem)
    uniformly = [uniform(count, settings.scheme.degree) for count in intervals]
    stated = initial_guess(problem, parameters_of(problem), guess)
    return Mesh(
        tuple(
            following(mesh, stated.phases[phase.name], [state.name for state in phase.states])
            for mesh, phase in zip(uniformly, problem.phases, strict=True)
        )
    )


@dataclass(frozen=True, eq=False, repr=False)
class _Checked:
    """The replay of an iterate by the statement, and what it says.

    Attributes
    ----------
    motion : SimulatedMotion
        Of the replay, without phases where the settings ask for none.
    replayed : Trajectory
        The same as a trajectory; that of the solution where nothing was replayed.
    verification : Verification
    """

    motion: SimulatedMotion
    replayed: Trajectory
    verification: Verification


def _checked(
    form: Form, meshes: MeshSolver, refinement: Refinement, spent: float = 0.0
) -> _Checked:
    """Replay an iterate and check it, unless the settings say not to.

    Parameters
    ----------
    spent : float
        Seconds that checks before it took.
    """
    best, iterate = refinement.best, refinement.best.iterate
    if not meshes.settings.verify:
        stated = form.stated(iterate.trajectory)
        return _Checked(SimulatedMotion(()), stated, unverified(iterate.objective))
    begin = clock.perf_counter()
    allowed = meshes.settings.accuracy.replay
    replay = ReplayedAnswer.of(form, iterate, meshes.evaluator, allowed)
    one_run = replay.simulated
    if one_run.miss > allowed and one_run.amplification > _UNSTABLE:
        # as far as errors grow from what the intervals are off by to half of what is allowed
        most = 0.5 * allowed * one_run.amplification / one_run.miss
        replay = ReplayedAnswer.of(form, iterate, meshes.evaluator, allowed, most)
    verification = verify(iterate, replay, meshes.settings.accuracy, best.errors.of_motion)
    # of first order, which may be too little by half: it counts twice, up to what was asked for
    error = refinement.objective_error
    error = max(error, min(2.0 * error, meshes.settings.accuracy.objective))
    worst = max(verification.accuracy, error)
    seconds = spent + clock.perf_counter() - begin
    verification = replace(verification, seconds=seconds, accuracy=worst, one_run=one_run.miss)
    return _Checked(replay.simulated, replay.motion, verification)


def _solution(
    form: Form,
    meshes: MeshSolver,
    refinement: Refinement,
    checked: Callable[[], _Checked],
    bound: float | None,
    *,
    partial: bool,
) -> Solution:
    """The solution, or the error of an answer that takes no time or does not pass.

    Parameters
    ----------
    checked : callable
        Gives the replay and what it says, when that is asked for.
    """
    settings, iterate = meshes.settings, refinement.best.iterate
    check_parts(meshes.problem, iterate.trajectory)
    if iterate.has_collapsed:
        raise collapse_of(iterate.problem, iterate.trajectory)

    def verdict() -> str:
        found = checked().verification
        judged = found.passed or refinement.ending in CUT_SHORT
        return verdict_on(meshes, refinement, found, bound) if judged else "unverified"

    fitted = cache(functools.partial(with_free_switches, meshes, iterate, all_of_them=False))
    adapts = settings.refinement.adapts
    stated, evaluator = form.stated(iterate.trajectory), meshes.evaluator
    objective = iterate.objective
    if not form.is_statement:
        evaluator = Evaluator(form.statement)
        objective = form.objective(stated, evaluator)

    solution = Solution(
        problem=form.statement,
        objective=objective,
        trajectory=stated,
        replayed=later(lambda: checked().replayed),
        replay=later(lambda: checked().motion),
        verification=later(lambda: checked().verification),
        mesh=iterate.mesh,
        mesh_iterations=refinement.mesh_iterations,
        verdict=verdict() if adapts else later(verdict),
        multipliers=later(lambda: multipliers(fitted())),
        evaluator=evaluator,
        form=form,
        form_evaluator=meshes.evaluator,
        seconds=clock.perf_counter() - meshes.budget.begin,
        iterate=later(fitted),
        ending=refinement.ending,
    )

    # on a fixed mesh the user wants to see what it gives
    if not (adapts and settings.verify) or solution.verification.passed:
        return solution
    if partial and refinement.ending in CUT_SHORT and solution.accuracy <= _OF_USE:
        return solution
    reasons = "; ".join(solution.verification.reasons)
    raise Unverified(
        f"the answer for '{meshes.problem.name}' did not pass its verification: {reasons}; "
        f"{remedy_for_kinks(meshes.problem)}loosen the named tolerance, allow more mesh "
        "iterations or intervals, or inspect the unverified solution in error.iterate",
        solution,
    )
