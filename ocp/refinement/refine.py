"""A refinement: meshes until all tolerances are met, and on from what the answer misses.

The loop of mesh iterations (`ocp.refinement.loop`) ends at a motion that meets all tolerances at
the points that are looked at. Here it is run again where the points of that motion miss something
narrow, where switches seem to be held far from their times, and from a lower motion where it is a
saddle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ocp.errors import BudgetSpent, Collapsed, Interrupted, SolveFailed, Unbounded
from ocp.mesh.mesh import Mesh
from ocp.nlp.result import NEAR
from ocp.nlp.solver import StartingPoint
from ocp.optimality.iterate import Iterate
from ocp.problem.symbols import Constant
from ocp.refinement.accuracy import Accuracy
from ocp.refinement.better_motions.fresh_mesh import on_fresh_mesh
from ocp.refinement.better_motions.saddles import held_still, lower_motion, may_be_saddle
from ocp.refinement.endings import Ending
from ocp.refinement.estimates.missed_slopes import missed_slopes
from ocp.refinement.estimates.motion_errors import MotionErrors
from ocp.refinement.estimates.narrow_features import (
    NarrowFeature,
    mesh_that_sees,
    narrow_features,
)
from ocp.refinement.estimates.promised_gain import CERTIFIED_GAIN
from ocp.refinement.loop import (
    History,
    PlannedMesh,
    first_plan,
    plan_after,
    round_of,
    solve_planned,
)
from ocp.refinement.mesh_iteration import MeshIteration
from ocp.refinement.mesh_solver import MeshSolver, Start
from ocp.refinement.other_controls.points_there import mesh_with_points_there
from ocp.refinement.other_controls.promise import (
    other_controls,
    promise_of_other_valleys,
    promised_by,
)
from ocp.refinement.past_kinks.first_motion import first_motion
from ocp.refinement.past_kinks.past_kinks import lost_until_now, past_kinks
from ocp.refinement.policies.adaptive_mesh import AdaptiveMesh
from ocp.refinement.raised_peaks import verifiable
from ocp.refinement.solved_mesh import VERIFIABLE_SLACK, SolvedMesh, best_of
from ocp.refinement.stopped import budget_spent, interrupted

# How often a refinement goes on because its points missed something narrow.
_SIGHTS = 4

# How often a refinement goes on because other controls are better between its points.
_SHORT_CHANGES = 3

# Meshes made anew, one after the other, to free switches
_FRESH_MESHES = 3

# Saddles that are left one after the other.
_SADDLES = 2

# Part of what controls far away promise that a motion beside a saddle has to bring.
_LITTLE_OF_OTHERS = 0.01


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
    timed : bool
        Whether its switches were tried at other times, and none gained.
    """

    best: SolvedMesh
    rounds: tuple[MeshIteration, ...]
    ending: Ending
    lower: float | None = None
    features: tuple[NarrowFeature, ...] = ()
    sighted: bool = False
    timed: bool = False


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
    history = History(list(before))
    try:
        ending = _refine_past_kinks(meshes, start, mesh, accuracy, history)
        ending, features, sighted = _seen(meshes, accuracy, history, ending)
        ending = _with_short_changes(meshes, accuracy, history, ending)
        ending, timed = _with_switches_freed(meshes, accuracy, history, ending)
        ending, lower = _left_saddles(meshes, accuracy, history, ending)
    except KeyboardInterrupt as stop:
        raise interrupted(meshes.problem, history.solved, accuracy, None) from stop

    best = verifiable(meshes, history.solved, accuracy)
    if ending == "budget" and not best.is_verifiable(accuracy):
        raise budget_spent(meshes, history.rounds, best.iterate.trajectory, best)
    return Refinement(best, tuple(history.rounds), ending, lower, features, sighted, timed)


def _refine_past_kinks(
    meshes: MeshSolver, start: Start, mesh: Mesh, accuracy: Accuracy, history: History
) -> Ending:
    """`refine_meshes`, in which a solver that is lost among kinks is led past them.

    That is done on the first mesh, and once on a later one while none has led to a motion.
    """
    planned, led = first_plan(meshes, start, mesh), False
    while True:
        if history.solved:
            found = solve_planned(meshes, planned, accuracy, history)
        else:
            this_round = round_of(meshes, planned, accuracy, history)
            found = first_motion(this_round, planned.start, planned.program)

        if not led and lost_until_now(meshes, found.result, history.solved, accuracy):
            this_round, led = round_of(meshes, planned, accuracy, history), True
            motion = history.solved[-1].iterate.trajectory
            found = past_kinks(this_round, motion, planned.program, found.result)

        following = plan_after(meshes, planned, found, accuracy, history)
        if not isinstance(following, PlannedMesh):
            return following
        planned = following


def _seen(
    meshes: MeshSolver,
    accuracy: Accuracy,
    history: History,
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
        best = best_of(history.solved, accuracy)
        features, of_constants = _features(meshes, best)
        sighted |= bool(features)
        unseen = (*features, *of_constants)
        if not (unseen and meshes.settings.refinement.adapts) or goes == _SIGHTS:
            break
        if ending == "budget" or meshes.spent(history.rounds):
            return "budget", features, sighted

        mesh = mesh_that_sees(held_still(best.iterate), unseen)
        ending, further = _gone_on(meshes, best.iterate, mesh, accuracy, history)
        if not further:
            break
        history.solved[:] = further
    return ending, features, sighted


def _with_short_changes(
    meshes: MeshSolver, accuracy: Accuracy, history: History, ending: Ending
) -> Ending:
    """Go on while other controls of the same valley are better between the points; the ending.

    What was solved before is dropped: as good an answer on a mesh without these points is none.
    """
    for _ in range(_SHORT_CHANGES):
        best = best_of(history.solved, accuracy)
        if ending in ("budget", "rounds") or not meshes.settings.refinement.adapts:
            break
        if not best.is_verifiable(accuracy) or meshes.spent(history.rounds):
            break
        others = list(other_controls(best.iterate, meshes.evaluator))
        nearby = [other for other in others if other.one_valley and not other.vanished]
        if not promised_by(nearby, best.iterate) > CERTIFIED_GAIN:
            break
        names = [phase.name for phase in meshes.problem.phases]
        mesh = mesh_with_points_there(held_still(best.iterate), nearby, names)
        gone_on, further = _gone_on(meshes, best.iterate, mesh, accuracy, history)
        if not any(s.is_verifiable(accuracy) for s in further):
            break
        history.solved[:] = further
        ending = gone_on
    return ending


def _with_switches_freed(
    meshes: MeshSolver, accuracy: Accuracy, history: History, ending: Ending
) -> tuple[Ending, bool]:
    """Go on from a mesh made anew while that frees a switch that is held at a wrong time.

    Returns
    -------
    ending : str
    timed : bool
        As in `Refinement`.
    """
    policy = meshes.settings.refinement
    if not (isinstance(policy, AdaptiveMesh) and policy.move_breakpoints):
        return ending, False
    for _ in range(_FRESH_MESHES):
        best = best_of(history.solved, accuracy)
        if ending in ("budget", "rounds") or not best.is_verifiable(accuracy):
            break
        fresh = on_fresh_mesh(meshes, best.iterate, history.rounds)
        if fresh is None or fresh.better is None:
            return ending, fresh is not None and fresh.refutes
        gone_on, further = _gone_on(meshes, fresh.better, fresh.better.mesh, accuracy, history)
        if not any(s.is_verifiable(accuracy) for s in further):
            break
        history.solved.extend(further)
        ending = gone_on
    return ending, False


def _gone_on(
    meshes: MeshSolver, start: Iterate, mesh: Mesh, accuracy: Accuracy, history: History
) -> tuple[Ending, list[SolvedMesh]]:
    """The loop once more: its ending, and what it solved. Only its records join the history.

    A failure or the end of the budget is an ending, as there is an answer already.
    """
    further = History(history.rounds)
    try:
        ending = _refine_past_kinks(meshes, start, mesh, accuracy, further)
    except Interrupted as stop:
        found = [*history.solved, *further.solved]
        raise interrupted(meshes.problem, found, accuracy, stop.iterate) from stop
    except BudgetSpent:
        ending = "budget"
    except (Collapsed, Unbounded):
        raise
    except SolveFailed:
        ending = "failure"
    return ending, further.solved


def _features(
    meshes: MeshSolver, best: SolvedMesh
) -> tuple[tuple[NarrowFeature, ...], tuple[NarrowFeature, ...]]:
    """What the points of a solved mesh do not see, and what sensitivities alone miss by that."""
    iterate, known = best.iterate, best.errors.of_motion
    errors = known or MotionErrors(
        iterate.transcription, iterate.trajectory, meshes.evaluator, iterate.parameters
    )
    allowed = VERIFIABLE_SLACK * meshes.settings.accuracy.dynamics
    slopes = list(missed_slopes(iterate, meshes.evaluator, allowed))
    moving = [slope.feature for slope in slopes if not isinstance(slope.symbol, Constant)]
    of_constants = [slope.feature for slope in slopes if isinstance(slope.symbol, Constant)]
    return (*narrow_features(errors, allowed), *moving), tuple(of_constants)


def _left_saddles(
    meshes: MeshSolver, accuracy: Accuracy, history: History, ending: Ending
) -> tuple[Ending, float | None]:
    """Go on from motions beside the answer while that is a saddle: the ending, and `lower`.

    The second one is as in `Refinement`. What is solved is appended to the history.
    """
    for _ in range(_SADDLES):
        best = best_of(history.solved, accuracy)
        if ending == "budget" or not _may_be_saddle(meshes, best, history.solved):
            break
        below = lower_motion(meshes, best.iterate, history.rounds)
        if below is None or _is_little_beside_others(meshes, best.iterate, below):
            return "budget" if meshes.spent(history.rounds) else ending, None

        ending, further = _gone_on(meshes, below, below.mesh, accuracy, history)
        if further and not meshes.settings.refinement.adapts:
            # on a fixed mesh a saddle may hold better than what is lower, and is no answer
            history.solved.clear()
        history.solved.extend(further)
        if not any(s.is_verifiable(accuracy) for s in further):
            return ending, below.objective
    return ending, None


def _is_little_beside_others(meshes: MeshSolver, answer: Iterate, below: Iterate) -> bool:
    """Whether a lower motion brings next to nothing of what controls far away promise.

    Other than a motion on a fresh mesh it is known already, and is judged by what it brings.
    """
    sense = meshes.problem.sense
    brought = sense * (answer.objective - below.objective) / answer.objective_size
    promised = promise_of_other_valleys(answer, meshes.evaluator)
    return promised > 0.0 and brought < _LITTLE_OF_OTHERS * promised


def _may_be_saddle(meshes: MeshSolver, best: SolvedMesh, solved: Sequence[SolvedMesh]) -> bool:
    """Whether the best answer may be no minimum, by what the solver last told on the way to it."""
    # a mesh solved again takes hardly a step, and tells nothing new
    until = solved[: solved.index(best) + 1]
    told = [s.seems_least for s in until if s.iterations >= NEAR]
    program, point = best.iterate.transcription, StartingPoint.at(best.iterate)
    return may_be_saddle(meshes, program, point, seems_least=bool(told) and told[-1])
