"""A refinement: meshes until all tolerances are met, and on from what the answer misses.

The loop of mesh iterations (`ocp.refinement.loop`) ends at a motion that meets all tolerances at
the points that are looked at. Then the motion is reviewed (`ocp.refinement.reviews`), and the loop
is run again from what a review finds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ocp.accuracy import Accuracy
from ocp.errors import BudgetSpent, Collapsed, Interrupted, SolveFailed, Unbounded
from ocp.estimates.narrow_features import NarrowFeature
from ocp.mesh.mesh import Mesh
from ocp.refinement.endings import Ending
from ocp.refinement.loop import History
from ocp.refinement.mesh_iteration import MeshIteration
from ocp.refinement.mesh_solver import MeshSolver, Start
from ocp.refinement.past_kinks.loop_past_kinks import loop_past_kinks
from ocp.refinement.raised_peaks import verifiable
from ocp.refinement.reviews.finding import Candidate, Onward, Review
from ocp.refinement.reviews.held_switches import held_switches
from ocp.refinement.reviews.left_saddle import left_saddle
from ocp.refinement.reviews.short_changes import short_changes
from ocp.refinement.reviews.unseen_features import unseen_features
from ocp.refinement.solved_mesh import SolvedMesh
from ocp.refinement.stopped import budget_spent, interrupted

# The reviews in the order in which they are asked, and how often a refinement goes on from what
# each one finds. What is cheap and tells that the motion is that of another problem comes first.
_REVIEWS: tuple[tuple[Review, int], ...] = (
    (unseen_features, 4),
    (short_changes, 3),
    (held_switches, 3),
    (left_saddle, 2),
)


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
        ending = loop_past_kinks(meshes, start, mesh, accuracy, history)
        reviewed = _reviewed(meshes, accuracy, history, ending)
    except KeyboardInterrupt as stop:
        raise interrupted(meshes.problem, history.solved, accuracy, None) from stop

    best = verifiable(meshes, history.solved, accuracy)
    if reviewed.ending == "budget" and not best.is_verifiable(accuracy):
        raise budget_spent(meshes, history.rounds, best.iterate.trajectory, best)
    return replace(reviewed, best=best, rounds=tuple(history.rounds))


def _reviewed(
    meshes: MeshSolver, accuracy: Accuracy, history: History, ending: Ending
) -> Refinement:
    """Go on from what the reviews find, until none finds anything.

    What that leads to is another answer, about which all reviews are asked again.
    """
    refinement = Refinement(history.solved[-1], (), ending)
    goes, number = [0] * len(_REVIEWS), 0
    while number < len(_REVIEWS):
        (review, most), records = _REVIEWS[number], len(history.rounds)
        answer = Candidate.of(meshes, accuracy, history, refinement.ending)
        finding = review(answer)
        refinement = replace(
            refinement,
            features=finding.features or refinement.features,
            sighted=refinement.sighted or bool(finding.features),
            timed=refinement.timed or finding.timed,
        )

        # what a review tried without success may have been cut short, too
        onward, busy = finding.onward, len(history.rounds) > records
        if (onward or busy) and (refinement.ending == "budget" or meshes.spent(history.rounds)):
            return replace(refinement, ending="budget", lower=onward.lower if onward else None)
        joins = False
        if onward and goes[number] < most:
            goes[number] += 1
            refinement, joins = _gone_on(answer, onward, refinement)
        number = 0 if joins else number + 1
    return refinement


def _gone_on(answer: Candidate, onward: Onward, refinement: Refinement) -> tuple[Refinement, bool]:
    """The loop once more, from what a review found.

    Returns
    -------
    refinement : Refinement
    joins : bool
        Whether what was solved joins the history, or takes the place of what was there.
    """
    solved, ending = answer.history.solved, answer.ending
    further_ending, further = _further(answer, onward)
    holds = any(s.is_verifiable(answer.accuracy) for s in further)
    joins = holds or (onward.former == "none" and bool(further))
    if joins:
        solved[:] = [*(solved if onward.former == "as good" else ()), *further]
        refinement = replace(refinement, features=(), timed=False)
    if joins or onward.former == "none" or further_ending == "budget":
        ending = further_ending
    return replace(refinement, ending=ending, lower=None if holds else onward.lower), joins


def _further(answer: Candidate, onward: Onward) -> tuple[Ending, list[SolvedMesh]]:
    """How the loop ends from there, and what it solved. Only its records join the history.

    A failure or the end of the budget is an ending, as there is an answer already.
    """
    meshes, history, accuracy = answer.meshes, answer.history, answer.accuracy
    further = History(history.rounds)
    try:
        ending = loop_past_kinks(meshes, onward.start, onward.mesh, accuracy, further)
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
