"""The loop of mesh iterations: solve, estimate errors, choose the next mesh, until it is good."""

from __future__ import annotations

import itertools
import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from ocp.errors import BudgetSpent, Collapsed, Interrupted, NumericalTrouble
from ocp.mesh.mesh import Mesh, same_intervals
from ocp.mesh.trajectory import Trajectory
from ocp.nlp.failures import failure
from ocp.nlp.result import NEAR, NlpResult
from ocp.optimality.iterate import Iterate
from ocp.problem.problem import Problem
from ocp.refinement.accuracy import Accuracy
from ocp.refinement.estimates.error_estimate import MeshErrors
from ocp.refinement.first_round.first_answer import first_answer
from ocp.refinement.first_round.starts import FirstRound
from ocp.refinement.mesh_iteration import MeshIteration, iterations_of, record_of
from ocp.refinement.mesh_solver import MeshSolver, Start
from ocp.refinement.policies.movable import most_iterations
from ocp.refinement.policies.policy import RefinementPolicy
from ocp.refinement.saddles import lower_motion
from ocp.refinement.solved_mesh import LOOSER, SolvedMesh, best_of, gain_falls
from ocp.refinement.unwrapping import lost_angle
from ocp.transcription.packing import trajectory_of
from ocp.transcription.transcribe import Transcription

Ending = Literal["tolerances", "standstill", "rounds", "failure", "budget"]

# While the last mesh was off by this much or more, the next one is about to be replaced, too.
_FAR = 1e-3

# Mesh iterations after which an angle that still turns to and fro does so on finer meshes, too, and
# after which a motion that has shrunk to next to no time will not grow.
_TURNING = 3

# Part of the objective that is as good as all of it, and of the typical time that is next to none.
_ALL_OF_IT = 0.5
_NEXT_TO_NO_TIME = 1e-2

# Times that a mesh without errors is solved again because its objective was far from its size.
_SIZINGS = 4

# Rounds in a row over which the objective stands still where nothing more is to be gained. It takes
# one more where only a promised gain is open or much is promised, as a mesh may have been finer at
# the wrong place, and where the next round only closes leaks, which costs little.
_STILL = 2
_STILL_IN_DOUBT = 3

# Times the tolerance, up to which a promised gain is little: it is of first order, and often ten
# times what is gained.
_LITTLE = 10.0

# A round may end above the least objective of its mesh by this part of what finer controls promise,
# or of the tolerance on the objective. A motion further from it is not the one to be refined.
_NEAR = 0.1

# Saddles that are left one after the other.
_SADDLES = 2

# Part of the last leak that the next round may have, where a leak is about to be closed.
_FALLING = 0.5

log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False, repr=False)
class Refinement:
    """The end of a refinement.

    Attributes
    ----------
    best : SolvedMesh
        The best mesh iteration that holds between its points, if need be to a looser tolerance; the
        last one if none does.
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
        Mesh iterations until then.

    Raises
    ------
    SolveFailed
        No mesh was solved, the budget ended before one held between its points, an angle without
        bounds turns to and fro, or the motion shrinks to next to no time.
    Interrupted
        The user stopped it.
    """
    solved: list[SolvedMesh] = []
    rounds, lower = list(before), list[float]()
    try:
        ending = _refine(meshes, start, mesh, accuracy, solved, rounds)
        while len(lower) < _SADDLES and ending not in ("budget", "failure"):
            best = best_of(solved, accuracy)
            if _seems_least(best, solved):
                break
            below = lower_motion(meshes, best.iterate, rounds)
            if below is None:
                break
            lower.append(below.objective)
            further: list[SolvedMesh] = []
            try:
                ending = _refine(meshes, below, below.mesh, accuracy, further, rounds)
            finally:
                solved += further
    except KeyboardInterrupt as stop:
        raise _interrupted(meshes.problem, solved, accuracy, None) from stop

    best = best_of(solved, accuracy)
    if ending == "budget" and not best.holds(accuracy, LOOSER):
        raise _budget_spent(meshes, rounds, best.iterate.trajectory, best)
    return Refinement(best, tuple(rounds), ending)


def _seems_least(best: SolvedMesh, solved: Sequence[SolvedMesh]) -> bool:
    """Whether the best answer is no saddle, by what the solver last told on the way to it."""
    # a mesh solved again takes hardly a step, and tells nothing new
    until = solved[: solved.index(best) + 1]
    told = [s.seems_least for s in until if s.iterations >= NEAR]
    return bool(told) and told[-1]


@dataclass(frozen=True, eq=False, repr=False)
class _Step:
    """From one mesh iteration to the next.

    Attributes
    ----------
    mesh : Mesh or None
        The next one; None where the last one is good enough.
    policy : RefinementPolicy
        That it goes on with.
    rough : bool
        Whether the next mesh is not solved to the tolerance asked for, as it will be replaced too.
    again : bool
        Whether the next mesh is the last one, to be solved to the tolerance asked for.
    closes_leaks : bool
        Whether the next mesh only imposes limits at more points, and each time less is left over
        them.
    """

    mesh: Mesh | None
    policy: RefinementPolicy
    rough: bool = False
    again: bool = False
    closes_leaks: bool = False


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
    program, finer = meshes.first_program(start, mesh), False
    before, leaks_closed = len(rounds), 0

    # without multipliers the first mesh is a rough one, and its digits are lost with it
    rough = policy.adapts and not isinstance(start, Iterate)

    while True:
        rough = rough and meshes.rough_solver is not asked
        gap = _gap(solved, accuracy, rough=rough)
        solver = (meshes.rough_solver if rough else asked).within_gap(gap)
        iterations = most_iterations(solved, program.mesh)
        result, starts = meshes.solve(program, start, solver, rounds, most=iterations), 1
        if start is None and not solved:
            found = first_answer(FirstRound(meshes, solver, tuple(rounds)), program, result)
            program, result, starts = found.program, found.result, found.starts

        step: _Step | None
        if result.outcome == "solved":
            last = meshes.examined(program, result, tight=not rough, finer=finer)
            solved.append(last)
            rounds.append(record_of(program.mesh, result, last, starts))
            log.info("round %d: %s", len(rounds), rounds[-1])
            step = _after_solved(solved, policy, accuracy)
        else:
            rounds.append(record_of(program.mesh, result, None))
            _check_failure(meshes, program, result, solved, rounds)
            if meshes.spent(rounds):
                return "budget"
            step = _after_failure(solved, policy, program.mesh, accuracy, rough=rough)
            if step is None:
                return "failure"

        # points that close a leak step by step cost little, and are no finer mesh
        leaks_closed += step.closes_leaks
        over = len(rounds) - before >= policy.rounds + min(leaks_closed, policy.rounds)
        if result.outcome == "solved" and _once_more(meshes, solved, step.mesh, over=over):
            step = replace(step, mesh=program.mesh, rough=False, again=True)
        if step.mesh is None:
            return "tolerances"
        if ending := _ending(meshes, solved, rounds, accuracy, step, over=over):
            return ending

        finer = step.mesh.intervals > program.mesh.intervals
        start, policy, rough = solved[-1].iterate, step.policy, step.rough
        program = meshes.next_program(start, step.mesh)


def _after_solved(
    solved: Sequence[SolvedMesh], policy: RefinementPolicy, accuracy: Accuracy
) -> _Step:
    """The step after a mesh that was solved."""
    following = policy.next_mesh(solved, accuracy)
    return _Step(
        following,
        policy,
        rough=following is not None and _worst(solved[-1].errors) >= _FAR,
        closes_leaks=_closes_leaks(solved, following),
    )


def _after_failure(
    solved: Sequence[SolvedMesh],
    policy: RefinementPolicy,
    failed: Mesh,
    accuracy: Accuracy,
    *,
    rough: bool,
) -> _Step | None:
    """The step after a mesh on which the solver failed, if the policy knows one."""
    recovery = policy.after_failure(solved, failed, accuracy)
    if recovery is None:
        return None
    other, mesh = recovery
    return _Step(mesh, other, rough=rough)


def _gap(solved: Sequence[SolvedMesh], accuracy: Accuracy, *, rough: bool) -> float:
    """How far above the least objective of its mesh the next round may end, relative."""
    if not rough:
        return _NEAR * accuracy.objective
    if not solved:
        return math.inf
    return _NEAR * max(accuracy.objective, solved[-1].errors.gain)


def _closes_leaks(solved: Sequence[SolvedMesh], following: Mesh | None) -> bool:
    """Whether the next mesh has the same intervals, and the last one left less over its limits."""
    if following is None or len(solved) < 2:
        return False
    before, last = solved[-2:]
    if following is last.iterate.mesh or last.leak >= before.leak:
        return False
    pairs = zip(following.phases, last.iterate.mesh.phases, strict=True)
    return all(same_intervals(new, old) for new, old in pairs)


def _once_more(
    meshes: MeshSolver, solved: Sequence[SolvedMesh], following: Mesh | None, *, over: bool
) -> bool:
    """Whether the last mesh is solved again before the loop ends.

    It is where it was not yet solved to the tolerance asked for, or where the objective turned out
    to be far from the size that this tolerance is relative to.
    """
    last = solved[-1]
    if not last.tight:
        return following is None or over
    again = sum(s.iterate.mesh is last.iterate.mesh for s in solved if s.tight)
    if following is not None or over or again > _SIZINGS:
        return False
    return meshes.scales_after(last.iterate) is not last.iterate.scales


def _check_angles(solved: Sequence[SolvedMesh]) -> None:
    """NumericalTrouble where an angle without bounds is one that no finer mesh makes smooth."""
    last = solved[-1]
    # dynamics may hold while neighbouring intervals are whole turns apart, and much is promised
    if len(solved) < _TURNING or max(last.errors.dynamics, last.errors.gain) < _FAR:
        return
    if lost := lost_angle(last.iterate):
        phase, control = lost
        raise NumericalTrouble(
            f"the control '{control.name}' of phase '{phase}' turns to and fro between "
            f"neighbouring points, after {len(solved)} mesh iterations, too: it has no bounds, and "
            "more than its sine and cosine depends on it, so that whole turns cannot be taken out; "
            f"bound this angle, as in Control({control.name!r}, lower=-4, upper=4)",
            last.iterate.trajectory,
        )


def _check_duration(solved: Sequence[SolvedMesh]) -> None:
    """Collapsed where next to no time is left, and meshes in a row promise the whole objective.

    Where the optimum is at infinite controls, as a least time without a limit of the force, the
    solver stops somewhere on the way, and finer meshes lead nowhere.
    """
    latest = solved[-_TURNING:]
    if len(latest) < _TURNING or min(s.errors.gain for s in latest) < _ALL_OF_IT:
        return
    last = latest[-1].iterate
    duration = sum(phase.end - phase.start for phase in last.trajectory.phases)
    # later sizes are those of what was found
    if duration > _NEXT_TO_NO_TIME * solved[0].iterate.scales.time:
        return
    raise Collapsed(
        f"the motion of '{last.problem.name}' shrinks to {duration:.1e} s, and finer controls "
        "promise to gain all of the objective: nothing seems to limit them; bound the controls, or "
        "prescribe a least duration",
        last.trajectory,
    )


def _ending(
    meshes: MeshSolver,
    solved: Sequence[SolvedMesh],
    rounds: Sequence[MeshIteration],
    accuracy: Accuracy,
    step: _Step,
    *,
    over: bool,
) -> Ending | None:
    """What ends a refinement that has a next mesh, if anything does; an error for lost angles.

    Parameters
    ----------
    over : bool
        Whether the policy allows no further mesh.
    """
    _check_angles(solved)
    _check_duration(solved)
    if over and not step.again:
        return "rounds"
    if meshes.spent(rounds):
        return "budget"
    if step.again or not stands_still(solved, accuracy, closes_leaks=step.closes_leaks):
        return None
    return "standstill"


def stands_still(
    solved: Sequence[SolvedMesh], accuracy: Accuracy, *, closes_leaks: bool = False
) -> bool:
    """Whether further rounds would change nothing but last digits of the constraints' tolerance.

    The objective has stayed within its tolerance for several rounds, and one of them is good enough
    to be verified. What the last of them promises to gain is below the tolerance, too, or refuted:
    a finer mesh has gained nothing, and the promise is about what it was.

    Parameters
    ----------
    closes_leaks : bool
        Whether the next round would only impose limits at more points: then one more is waited for.
    """
    last, promised = solved[-1], solved[-1].errors.gain
    leaks, much = last.leak > accuracy.path, promised > _LITTLE * accuracy.objective
    count = _STILL if leaks and not (much or closes_leaks) else _STILL_IN_DOUBT
    latest = solved[-count:]
    # a rough solve that is made again to the tolerance asked for is no second mesh
    if len(latest) < count or not all(s.tight for s in latest):
        return False

    # what leaks of the looser tolerance may be worth, however loosely the optimum is asked for
    objectives = [s.iterate.objective for s in latest]
    slack = min(accuracy.objective, LOOSER * accuracy.path) * last.iterate.objective_size
    if max(objectives) - min(objectives) > slack:
        return False
    refuted = any(s.finer for s in latest[1:]) and not gain_falls(latest, len(latest) - 1)
    if promised > accuracy.objective and not refuted:
        return False
    if leaks and _leaks_fall(latest):
        return False
    return any(s.holds(accuracy, LOOSER) for s in latest)


def _leaks_fall(latest: Sequence[SolvedMesh]) -> bool:
    """Whether each of the rounds left much less over the limits than the one before."""
    return all(new.leak <= _FALLING * old.leak for old, new in itertools.pairwise(latest))


def _worst(errors: MeshErrors) -> float:
    """What is wrong with a mesh, or what a better one may gain, whichever is more."""
    return max(errors.gain / _LITTLE, errors.excess, errors.dynamics)


def _check_failure(
    meshes: MeshSolver,
    program: Transcription,
    result: NlpResult,
    solved: Sequence[SolvedMesh],
    rounds: Sequence[MeshIteration],
) -> None:
    """The error of a failed round, raised where it leaves nothing to go on from."""
    accuracy = meshes.settings.accuracy
    last = trajectory_of(program, result.x, meshes.parameters)
    if result.outcome == "interrupted":
        raise _interrupted(meshes.problem, solved, accuracy, last)
    if meshes.spent(rounds) and not any(s.holds(accuracy, LOOSER) for s in solved):
        raise _budget_spent(meshes, rounds, last, solved[-1] if solved else None)
    if not solved:
        raise failure(program, result, meshes.parameters, last)


def _budget_spent(
    meshes: MeshSolver,
    rounds: Sequence[MeshIteration],
    last: Trajectory,
    finished: SolvedMesh | None,
) -> BudgetSpent:
    """The error of a budget that ended before a round held between its points."""
    state = "no mesh iteration was solved"
    if finished is not None:
        state = (
            f"the errors between the points were still {finished.errors.dynamics:.1e} of the "
            f"dynamics and {max(finished.errors.excess, 0.0):.1e} of the constraints"
        )
    return BudgetSpent(
        f"the budget of {meshes.budget} for '{meshes.problem.name}' ended in mesh iteration "
        f"{len(rounds)} after {iterations_of(rounds)} iterations: {state}; raise the budget, "
        "loosen the tolerances or give a better guess",
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
        verified = finished if best.holds(accuracy, LOOSER) else None
    kept = "the best round so far is kept" if verified else "no round had met its tolerances"
    return Interrupted(
        f"'{problem.name}' was stopped in mesh iteration {len(solved) + 1}; {kept}",
        last,
        finished,
        verified,
    )
