"""The loop of mesh iterations: solve, estimate errors, choose the next mesh, until it is good."""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ocp.arrays import Array
from ocp.errors import BudgetSpent, Collapsed, Interrupted, SolveFailed, Unbounded
from ocp.mesh.mesh import Mesh, same_intervals
from ocp.nlp.result import NEAR
from ocp.nlp.solver import StartingPoint
from ocp.numerics.interval_maxima import Extremes
from ocp.optimality.iterate import Iterate
from ocp.problem.symbols import Constant
from ocp.refinement.accuracy import Accuracy
from ocp.refinement.endings import Ending, ending_of
from ocp.refinement.estimates.error_estimate import MotionErrors
from ocp.refinement.estimates.missed_slopes import missed_slopes
from ocp.refinement.estimates.narrow_features import (
    NarrowFeature,
    mesh_that_sees,
    narrow_features,
)
from ocp.refinement.estimates.promised_gain import CERTIFIED_GAIN
from ocp.refinement.first_round.first_motion import first_motion
from ocp.refinement.first_round.past_kinks import lost_until_now, past_kinks
from ocp.refinement.first_round.starts import FirstMotion, FirstRound
from ocp.refinement.mesh_iteration import MeshIteration, record_of
from ocp.refinement.mesh_solver import MeshSolver, Start
from ocp.refinement.other_controls.promise import other_controls, promised_by
from ocp.refinement.policies.movable import most_iterations
from ocp.refinement.policies.policy import RefinementPolicy
from ocp.refinement.raised_peaks import verifiable
from ocp.refinement.saddles import held_still, lower_motion, may_be_saddle
from ocp.refinement.solved_mesh import LITTLE, LOOSER, SolvedMesh, best_of
from ocp.refinement.stopped import budget_spent, check_failure, interrupted

# While the last mesh was off by this much or more, the next one is about to be replaced, too.
_FAR = 1e-3

# Times that a mesh without errors is solved again because its objective was far from its size.
_SIZINGS = 4

# A round may end above the least objective of its mesh by this part of what finer controls promise,
# or of the tolerance on the objective. A motion further from it is not the one to be refined.
_NEAR = 0.1

# How often a refinement goes on because its points missed something narrow.
_SIGHTS = 4

# Saddles that are left one after the other.
_SADDLES = 2

# Part of what controls far away promise that a motion beside a saddle has to bring.
_LITTLE_OF_OTHERS = 0.01

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
    lower : float or None
        Where the best one is a saddle: the objective of a lower motion beside it, on the same mesh,
        whose refinement led to none that holds [unit of the objective]. None elsewhere.
    features : tuple of NarrowFeature
        That the points of the best one do not see.
    sighted : bool
        Whether there were such features on the way.
    """

    best: SolvedMesh
    rounds: tuple[MeshIteration, ...]
    ending: Ending
    lower: float | None = None
    features: tuple[NarrowFeature, ...] = ()
    sighted: bool = False


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
    rounds = list(before)
    try:
        ending = _refine(meshes, start, mesh, accuracy, solved, rounds)
        ending, features, sighted = _seen(meshes, accuracy, solved, rounds, ending)
        ending, lower = _left_saddles(meshes, accuracy, solved, rounds, ending)
    except KeyboardInterrupt as stop:
        raise interrupted(meshes.problem, solved, accuracy, None) from stop

    best = verifiable(meshes, solved, accuracy)
    if ending == "budget" and not best.holds(accuracy, LOOSER):
        raise budget_spent(meshes, rounds, best.iterate.trajectory, best)
    return Refinement(best, tuple(rounds), ending, lower, features, sighted)


def _seen(
    meshes: MeshSolver,
    accuracy: Accuracy,
    solved: list[SolvedMesh],
    rounds: list[MeshIteration],
    ending: Ending,
) -> tuple[Ending, tuple[NarrowFeature, ...], bool]:
    """Go on while the points of the answer miss something narrow.

    What was solved before is dropped: it holds for a problem without that.

    Returns
    -------
    ending : str
    features : tuple of NarrowFeature
        That are still missed.
    sighted : bool
        Whether there were any.
    """
    sighted = False
    for goes in range(_SIGHTS + 1):
        best = best_of(solved, accuracy)
        features, of_constants = _features(meshes, best)
        sighted |= bool(features)
        unseen = (*features, *of_constants)
        if not (unseen and meshes.settings.refinement.adapts) or goes == _SIGHTS:
            break
        if ending == "budget" or meshes.spent(rounds):
            return "budget", features, sighted

        mesh = mesh_that_sees(held_still(best.iterate), unseen)
        ending, further = _gone_on(meshes, best.iterate, mesh, accuracy, solved, rounds)
        if not further:
            break
        solved[:] = further
    return ending, features, sighted


def _gone_on(
    meshes: MeshSolver,
    start: Iterate,
    mesh: Mesh,
    accuracy: Accuracy,
    solved: Sequence[SolvedMesh],
    rounds: list[MeshIteration],
) -> tuple[Ending, list[SolvedMesh]]:
    """The loop once more, after what is already `solved`: its ending, and what it solved.

    A failure or the end of the budget is an ending, as there is an answer already.
    """
    further: list[SolvedMesh] = []
    try:
        return _refine(meshes, start, mesh, accuracy, further, rounds), further
    except Interrupted as stop:
        found = [*solved, *further]
        raise interrupted(meshes.problem, found, accuracy, stop.iterate) from stop
    except BudgetSpent:
        return "budget", further
    except (Collapsed, Unbounded):
        raise
    except SolveFailed:
        return "failure", further


def _features(
    meshes: MeshSolver, best: SolvedMesh
) -> tuple[tuple[NarrowFeature, ...], tuple[NarrowFeature, ...]]:
    """What the points of a solved mesh do not see, and what sensitivities alone miss by that."""
    iterate, known = best.iterate, best.errors.of_motion
    errors = known or MotionErrors(
        iterate.transcription, iterate.trajectory, meshes.evaluator, iterate.parameters
    )
    allowed = LOOSER * meshes.settings.accuracy.dynamics
    slopes = list(missed_slopes(iterate, meshes.evaluator, allowed))
    moving = [slope.feature for slope in slopes if not isinstance(slope.symbol, Constant)]
    of_constants = [slope.feature for slope in slopes if isinstance(slope.symbol, Constant)]
    return (*narrow_features(errors, allowed), *moving), tuple(of_constants)


def _left_saddles(
    meshes: MeshSolver,
    accuracy: Accuracy,
    solved: list[SolvedMesh],
    rounds: list[MeshIteration],
    ending: Ending,
) -> tuple[Ending, float | None]:
    """Go on from motions beside the answer while that is a saddle: the ending, and `lower`.

    The second one is as in `Refinement`. What is solved is appended to `solved` and `rounds`.
    """
    for _ in range(_SADDLES):
        best = best_of(solved, accuracy)
        if ending == "budget" or not _may_be_saddle(meshes, best, solved):
            break
        below = lower_motion(meshes, best.iterate, rounds)
        if below is None or _is_little_beside_others(meshes, best.iterate, below):
            return "budget" if meshes.spent(rounds) else ending, None

        ending, further = _gone_on(meshes, below, below.mesh, accuracy, solved, rounds)
        if further and not meshes.settings.refinement.adapts:
            # on a fixed mesh a saddle may hold better than what is lower, and is no answer
            solved.clear()
        solved += further
        if not any(s.holds(accuracy, LOOSER) for s in further):
            return ending, below.objective
    return ending, None


def _is_little_beside_others(meshes: MeshSolver, answer: Iterate, below: Iterate) -> bool:
    """Whether a lower motion brings next to nothing of what controls far away promise.

    Where ever faster changes between two valleys gain, every motion is a saddle, and each that is
    lower has more changes. To follow them would take ever finer meshes and come to no end.
    """
    others = list(other_controls(answer, meshes.evaluator))
    promised = promised_by(others, answer)
    sense = meshes.problem.sense
    brought = sense * (answer.objective - below.objective) / answer.objective_size
    return promised > CERTIFIED_GAIN and brought < _LITTLE_OF_OTHERS * promised


def _may_be_saddle(meshes: MeshSolver, best: SolvedMesh, solved: Sequence[SolvedMesh]) -> bool:
    """Whether the best answer may be no minimum, by what the solver last told on the way to it."""
    # a mesh solved again takes hardly a step, and tells nothing new
    until = solved[: solved.index(best) + 1]
    told = [s.seems_least for s in until if s.iterations >= NEAR]
    program, point = best.iterate.transcription, StartingPoint.at(best.iterate)
    return may_be_saddle(meshes, program, point, seems_least=bool(told) and told[-1])


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
    before, leaks_closed, rounded = len(rounds), 0, False

    # without multipliers the first mesh is a rough one, and its digits are lost with it
    rough = policy.adapts and not isinstance(start, Iterate)

    while True:
        rough = rough and meshes.rough_solver is not asked
        gap = _gap(solved, accuracy, rough=rough)
        solver = (meshes.rough_solver if rough else asked).within_gap(gap)
        first_round = FirstRound(meshes, solver, tuple(rounds))
        if solved:
            most = most_iterations(solved, program.mesh)
            found = FirstMotion(program, meshes.solve(program, start, solver, rounds, most=most))
        else:
            found = first_motion(first_round, start, program, _refine)
        if not rounded and lost_until_now(meshes, found.result, solved, accuracy):
            motion, rounded = solved[-1].iterate.trajectory, True
            found = past_kinks(first_round, motion, program, found.result, _refine)
        program, result, starts = found.program, found.result, found.starts

        step: _Step | None
        examining, began = 0.0, meshes.budget.elapsed
        if result.outcome == "solved":
            last = meshes.examined(program, result, tight=not rough, finer=finer)
            solved.append(last)
            rounds.append(record_of(program.mesh, result, last, starts))
            log.info("round %d: %s", len(rounds), rounds[-1])
            step = _after_solved(solved, policy, accuracy)
            examining = meshes.budget.elapsed - began
        else:
            rounds.append(record_of(program.mesh, result, None))
            check_failure(meshes, program, result, solved, rounds)
            if meshes.spent(rounds):
                return "budget"
            step = _after_failure(solved, policy, program.mesh, accuracy, rough=rough)
            if step is None:
                return "failure"

        # points that close a leak step by step cost little, and are no finer mesh
        leaks_closed += step.closes_leaks
        over = len(rounds) - before >= policy.rounds + min(leaks_closed, policy.rounds)
        if result.outcome == "solved" and _once_more(
            meshes, solved, step.mesh, accuracy, over=over
        ):
            step = replace(step, mesh=program.mesh, rough=False, again=True)
        if step.mesh is None:
            return "tolerances"
        ending = ending_of(
            meshes,
            solved,
            rounds,
            accuracy,
            over=over,
            again=step.again,
            closes_leaks=step.closes_leaks,
            examining=examining,
        )
        if ending is not None:
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
        rough=following is not None and _is_far(solved[-1], accuracy),
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
    meshes: MeshSolver,
    solved: Sequence[SolvedMesh],
    following: Mesh | None,
    accuracy: Accuracy,
    *,
    over: bool,
) -> bool:
    """Whether the last mesh is solved again before the loop ends.

    It is where it was not yet solved to the tolerance asked for, or where the objective turned out
    to be far from the size that this tolerance is relative to.
    """
    last = solved[-1]
    if not last.tight:
        # those digits are not worth a large program that is left with leaking peaks
        return over or (following is None and not _leaves_more_open(last, accuracy))
    again = sum(s.iterate.mesh is last.iterate.mesh for s in solved if s.tight)
    if following is not None or over or again > _SIZINGS:
        return False
    return meshes.scales_after(last.iterate) is not last.iterate.scales


def _leaves_more_open(last: SolvedMesh, accuracy: Accuracy) -> bool:
    """Whether what a mesh leaves open is far more than the digits of a rough solve."""
    much = last.errors.gain > LITTLE * accuracy.objective
    return much and not last.holds(accuracy, LOOSER)


def _is_far(last: SolvedMesh, accuracy: Accuracy) -> bool:
    """Whether digits of the next mesh are lost, because that one will be replaced, too.

    Where little is left to gain, a leak counts by the time that it takes. One in a few narrow
    intervals is no reason to be rough: most of the next mesh is the same as the one after it, and
    controls that are a little off leak at other places.
    """
    errors, leak = last.errors, last.errors.excess
    if errors.gain <= LITTLE * accuracy.objective:
        phases = zip(last.iterate.trajectory.phases, errors.phases, strict=True)
        leak = max(mean_excess(motion.fractions, of_phase.excess) for motion, of_phase in phases)
    return max(errors.gain / LITTLE, errors.dynamics, leak) >= _FAR


def mean_excess(fractions: Array, excess: Sequence[Extremes]) -> float:
    """The worst excess in each interval of a phase, averaged over its time; 0 without any.

    Parameters
    ----------
    fractions : (N + 1,)
        Breakpoints as fractions of the phase.
    excess : sequence of Extremes
        Of each path constraint, relative.
    """
    widths = np.diff(fractions)
    worst = np.max([np.zeros_like(widths), *[e.values for e in excess]], axis=0)
    return float(widths @ worst)
