"""Mesh iterations: what the solver finished, the best of several, and their records."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Literal

from ocp.accuracy import SLACK, Accuracy
from ocp.estimates.error_estimate import MeshErrors
from ocp.estimates.estimated_gain import CERTIFIED_GAIN, effect_of_excess
from ocp.estimates.kink_crossings import NEAR
from ocp.later import lazy_fields, read_later
from ocp.mesh.mesh import Mesh
from ocp.nlp.solver import NlpResult
from ocp.optimality.iterate import Iterate
from ocp.scaling.scales import Scales, roomy


@lazy_fields("dynamics_error", "excess", "gain")
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
        In the user's sense and unit; nan where the solver failed, as are the next three. These are
        estimated when they are first read.
    dynamics_error : float
        Largest error of the dynamics in an interval, relative.
    excess : float
        Largest excess of a path constraint, bound or peak, relative.
    gain : float
        What finer controls could gain, relative to the objective, to first order.
    status : str
        The solver's own word for how it ended; Worse_Optimum where it ended far above the
        objective of an earlier motion that holds.
    solver : str
        The name of the one that ran.
    attempts : int
        Runs of the solver that it took.
    starts : int
        From which the solver ran, and the best of whose answers this is.
    lost : int
        Those of them that led to no answer.
    unknowns : int
        Of the nonlinear program.
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
    lost: int = 0
    unknowns: int = 0

    def __repr__(self) -> str:
        return (
            f"MeshIteration({self.intervals} intervals, {self.iterations} iterations in "
            f"{self.seconds:.2g} s, objective {self.objective:.8g}, dynamics off by "
            f"{self.dynamics_error:.1e}, constraints by {self.excess:.1e}, gain {self.gain:.1e}, "
            f"{self.status})"
        )


def record_of(
    mesh: Mesh, result: NlpResult, solved: SolvedMesh | None, starts: int = 1, lost: int = 0
) -> MeshIteration:
    """The record of a mesh iteration; `solved` is None where the solver failed."""

    def error(name: str) -> float:
        return read_later(solved, "errors", attrgetter(name)) if solved else math.nan

    return MeshIteration(
        intervals=mesh.intervals,
        extra_points=sum(points.tau.size for phase in mesh.extra for points in phase),
        movable=sum(len(phase.movable) for phase in mesh.phases),
        iterations=result.iterations,
        seconds=result.seconds,
        objective=solved.iterate.objective if solved else math.nan,
        dynamics_error=error("dynamics"),
        excess=error("excess"),
        gain=error("gain"),
        status=result.status,
        solver=result.solver,
        attempts=result.attempts,
        starts=starts,
        lost=lost,
        unknowns=result.x.size,
    )


def iterations_of(mesh_iterations: Sequence[MeshIteration]) -> int:
    """Iterations of the solver over some mesh iterations."""
    return sum(entry.iterations for entry in mesh_iterations)


# Factor by which an estimated gain, which is of first order, is often more than what is gained. Up
# to so many times the tolerance it is little.
OVERESTIMATE = 10.0

# Part of the tolerance on the objective that may be real of such an estimate by what its fall
# gained, over so many meshes at least: one may have been finer at the wrong place.
_LITTLE = 0.25
_TWICE = 2

# A mesh tells what finer ones gain by this factor more intervals, and by changes of its objective
# times the other.
_FINER, _SAFETY = 1.2, 3.0

# Part of the objective by which verified motions differ that are near two optima. Their errors
# explain less: in a layer of 1e-8 of its phase it was 3e-5, next to sizes of far limits 7e-4.
_ANOTHER = 1e-2

# Part of an objective that the solver may leave open
_SOLVED_TO = 1e-6

# Part of earlier changes that an objective which has settled may still change by
_NEXT_TO_NOTHING = 1e-3

# Error of the dynamics, or excess of a limit, from which on the motion of a mesh is none: it leaps
# over a limit between two points, say
_LEAPS = 1e-3

Ending = Literal[
    "tolerances", "standstill", "mesh iterations", "failure", "budget", "cost", "interrupted"
]
"""Why a refinement ends."""

CUT_SHORT: tuple[Ending, ...] = ("budget", "cost", "interrupted")


@lazy_fields("errors")
@dataclass(frozen=True, eq=False, repr=False)
class SolvedMesh:
    """A mesh iteration that the solver finished, as the next one and the mesh policy see it.

    Attributes
    ----------
    iterate : Iterate
        The motion found, with its multipliers.
    errors : MeshErrors
        What is wrong with it between its points; estimated when it is first read.
    violation : float
        Largest violation of the program's rows, scaled.
    tight : bool
        Whether it was solved to the tolerance asked for.
    finer : bool
        Whether its mesh has more intervals than the one before.
    iterations : int
        Of the solver.
    raised : float
        What it cost to raise its peaks to what the motion has between its points, relative to the
        objective; 0 where they were not.
    """

    iterate: Iterate
    errors: MeshErrors
    violation: float
    tight: bool
    finer: bool
    iterations: int = 0
    raised: float = 0.0

    def holds(self, accuracy: Accuracy, slack: float = 1.0) -> bool:
        """Whether the motion meets the dynamics and all constraints, between its points too.

        Parameters
        ----------
        slack : float
            Factor by which the constraints may miss their tolerance.
        """
        dynamics = self.errors.dynamics <= accuracy.dynamics
        return dynamics and self.excess <= slack * accuracy.path

    def is_verifiable(self, accuracy: Accuracy) -> bool:
        """Whether the motion holds to the slack that the verification has."""
        return self.holds(accuracy, SLACK)

    def meets(self, accuracy: Accuracy) -> bool:
        """Whether the motion holds, and finer controls may gain no more than the tolerance."""
        return self.holds(accuracy) and self.errors.gain <= accuracy.objective

    def worst_in_tolerances(self, accuracy: Accuracy) -> float:
        """The worst of dynamics, constraints and estimated gain, each over its tolerance."""
        return max(
            self.errors.dynamics / accuracy.dynamics,
            self.excess / accuracy.path,
            self.errors.gain / accuracy.objective,
        )

    @property
    def leaps(self) -> bool:
        """Whether it is so far from a motion that its objective tells nothing of the optimum."""
        return max(self.errors.dynamics, self.excess) >= _LEAPS

    @property
    def estimated_change(self) -> float:
        """By how much of the objective better meshes may change it, as far as this one tells."""
        # of first order, which may be too little by half
        of_excess = effect_of_excess(self.iterate, [p.excess for p in self.errors.phases])
        return 2.0 * (self.errors.gain + of_excess)

    @property
    def excess(self) -> float:
        """Largest excess of a constraint at the points or between them, relative."""
        return max(self.errors.excess, self.violation)


def best_of(solved: Sequence[SolvedMesh], accuracy: Accuracy) -> SolvedMesh:
    """The best mesh iteration that holds between the points, if need be to a looser tolerance.

    That is the slack of a verification. Of mesh iterations whose objectives are as good, those come
    first whose estimated gain is no more than a certificate allows, then those that meet their
    tolerances. One with less excess is no answer if it lies on a mesh that was too coarse. Without
    any that holds it is the last one, which the only one is. Errors that are small next to sizes
    which the last mesh has shown to be far too large say nothing.
    """
    if len(solved) == 1:
        return solved[0]
    good = _held(solved, solved[-1].iterate.scales, accuracy)
    # where one side of a kink acts beyond it, the objective may gain by that
    good = [s for s in good if s.errors.beyond_kinks <= NEAR] or good
    sense = solved[-1].iterate.problem.sense
    # values of those that are not solved to the tolerance asked for err by theirs
    good = _without_loose(good, sense)
    best = min(good, key=lambda s: sense * s.iterate.objective, default=solved[-1])

    def behind(s: SolvedMesh) -> float:
        return abs(s.iterate.objective - best.iterate.objective) / best.iterate.objective_size

    as_good = [s for s in good if behind(s) <= accuracy.objective]
    if not best.holds(accuracy):
        # violations may gain more than the tolerance on the objective
        as_good += [s for s in good if s.meets(accuracy) and behind(s) <= CERTIFIED_GAIN]
    as_good = [s for s in as_good if s.errors.gain <= CERTIFIED_GAIN] or as_good
    strict = [s for s in as_good if s.holds(accuracy)]
    # of answers that are as good, one whose estimated gain is nothing is proven better
    strict = [s for s in strict if s.errors.gain <= accuracy.objective] or strict
    # inside an interval a kink spoils the costates
    strict = [s for s in strict if s.errors.farthest_crossing <= NEAR] or strict
    if strict:
        return min(strict, key=lambda s: sense * s.iterate.objective)
    return min(as_good, key=lambda s: s.excess, default=best)


def _held(solved: Sequence[SolvedMesh], sizes: Scales, accuracy: Accuracy) -> list[SolvedMesh]:
    """Those that hold between the points, and not only next to sizes far above some others."""
    near = [s for s in solved if not roomy(s.iterate.scales, sizes)]
    return [s for s in near if s.is_verifiable(accuracy)]


def _without_loose(good: list[SolvedMesh], sense: float) -> list[SolvedMesh]:
    """Those solved to the tolerance asked for, and loose ones in a better optimum than all these.

    Without any that is solved so, all of them.
    """
    least = min((sense * s.iterate.objective for s in good if s.tight), default=math.inf)

    def is_another(s: SolvedMesh) -> bool:
        return least - sense * s.iterate.objective > _ANOTHER * s.iterate.objective_size

    return [s for s in good if s.tight or is_another(s)]


def worst_objective(solved: Sequence[SolvedMesh], sizes: Scales, accuracy: Accuracy) -> float:
    """From where on a further mesh has ended in another, worse optimum; times the sense.

    A finer mesh can follow a motion that holds. Where it ends above that one by more than this one
    is estimated to change, and by more than errors of verified motions explain, the solver has
    strayed. Infinite where no motion holds.

    Parameters
    ----------
    sizes : Scales
        Of the further mesh.
    """
    held = [s for s in _held(solved, sizes, accuracy) if not s.leaps]
    held = [s for s in held if s.errors.beyond_kinks <= NEAR]
    sense = solved[-1].iterate.problem.sense if solved else 1.0
    best = min(held, key=lambda s: sense * s.iterate.objective, default=None)
    if best is None:
        return math.inf
    allowed = max(best.estimated_change, _ANOTHER)
    return sense * best.iterate.objective + allowed * best.iterate.objective_size


def best_start(solved: Sequence[SolvedMesh]) -> SolvedMesh:
    """Where the next mesh starts: at the last one that leaps over no limit, if there is one.

    A solver may leap over a ridge between two points of a mesh that seemed fine. What later meshes
    lead back to from there is another local optimum.
    """
    return next((s for s in reversed(solved) if not s.leaps), solved[-1])


def is_refuted(solved: Sequence[SolvedMesh], back: int, accuracy: Accuracy) -> bool:
    """Whether an estimated gain is none, after finer meshes that hardly gained anything.

    Either it is about what it was some meshes ago, as noise is. Or it is little, and its fall tells
    how much of it is real: where the objective gained far less than the estimate fell by, so it
    will for the rest. Along singular arcs it falls like the intervals themselves, and what is lost
    like their square.

    Parameters
    ----------
    back : int
        Meshes that are looked back.
    """
    if len(solved) <= back:
        return True
    before, last = solved[-1 - back], solved[-1]
    left, fallen = last.errors.gain, before.errors.gain - last.errors.gain
    if left > 0.5 * before.errors.gain:
        return True
    if back < _TWICE or left > OVERESTIMATE * accuracy.objective:
        return False
    gained = abs(before.iterate.objective - last.iterate.objective) / last.iterate.objective_size
    return left * gained <= _LITTLE * accuracy.objective * fallen


def objective_error(solved: Sequence[SolvedMesh], best: SolvedMesh) -> float:
    """What the objective of a mesh may be off by, relative, as far as the meshes tell.

    It is the estimated gain of finer controls, or the change from the mesh before if that is more.
    An estimate that finer meshes have refuted is no more than noise: there it is three times the
    changes over these meshes. Nor is it less than the changes that no estimate showed. Where
    multipliers show nothing, it follows from the last mesh that has half the intervals, or twice as
    many: errors that fall at least like the width are no more than the change between the two, or
    twice as much. Infinite if there is none.
    """

    def change(other: SolvedMesh) -> float:
        return abs(other.iterate.objective - best.iterate.objective) / best.iterate.objective_size

    if not best.iterate.scheme.informative_multipliers:
        count = best.iterate.mesh.intervals
        coarse = [change(s) for s in solved if 2 * s.iterate.mesh.intervals <= count]
        fine = [2.0 * change(s) for s in solved if s.iterate.mesh.intervals >= 2 * count]
        return max(_SOLVED_TO, *coarse[-1:], *fine[-1:]) if coarse or fine else math.inf
    latest = solved[-1 - _TWICE :]
    changes, unsettled = [change(s) for s in latest], unexpected_changes(solved)
    if len(latest) > _TWICE and _are_finer(latest):
        return max(unsettled, min(_SAFETY * max(changes), max(best.errors.gain, *changes)))
    return max(unsettled, best.errors.gain, *changes[-_TWICE:])


def unexpected_changes(solved: Sequence[SolvedMesh]) -> float:
    """Changes of the objective that were more than estimated, relative, all together.

    Where an objective wanders from mesh to mesh, as among many local optima, one small change tells
    nothing. It has settled where two changes in a row were as little as estimated, or one is
    next to nothing beside those before.
    """
    total, kept = 0.0, 0
    for before, after in itertools.pairwise(s for s in solved if not s.leaps):
        change = abs(after.iterate.objective - before.iterate.objective)
        change /= after.iterate.objective_size
        broken = change > before.estimated_change
        kept = 0 if broken else kept + 1
        settled = kept == _TWICE or (kept and change <= _NEXT_TO_NOTHING * total)
        total = 0.0 if settled else total + broken * change
    return total


def _are_finer(solved: Sequence[SolvedMesh]) -> bool:
    """Whether each mesh has enough intervals more than the one before to tell what is gained."""
    counts = [s.iterate.mesh.intervals for s in solved]
    return all(new >= _FINER * old for old, new in itertools.pairwise(counts))
