"""Solved mesh iterations: their errors, the best of several, and their records."""

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
    """One mesh iteration: its mesh, the effort of the solver, and the errors between the points.

    Attributes
    ----------
    intervals : int
        Of all phases.
    extra_points : int
        Points between the collocation points at which constraints are also imposed.
    movable : int
        Breakpoints that the optimiser may move.
    iterations : int
        Of the solver.
    seconds : float
        Wall time of the solver [s].
    objective : float
        In the user's sense and unit; nan if the solver failed, as are the next three. These three
        are estimated when they are first read.
    dynamics_error : float
        Largest relative error of the dynamics in an interval.
    excess : float
        Largest relative violation of a path constraint, bound or peak.
    gain : float
        Estimated improvement by finer controls, relative to the objective, to first order.
    status : str
        The return status of the solver; Worse_Optimum if its objective is far worse than that of
        an earlier feasible motion.
    solver : str
        Its name.
    attempts : int
        Number of runs of the solver.
    starts : int
        Number of starts that were compared; this is the best of their answers.
    lost : int
        Number of starts that led to no answer.
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
    """The record of a mesh iteration; `solved` is None if the solver failed."""

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


# Factor by which an estimated improvement, which is of first order, often exceeds the real one. An
# estimate up to this many tolerances is small.
OVERESTIMATE = 10.0

# A small estimate is refuted if its real part, extrapolated from at least this number of meshes, is
# at most this part of the tolerance. One mesh may have been refined at the wrong place.
_LITTLE = 0.25
_TWICE = 2

# Meshes show the error of the objective if each has this factor more intervals than the one before.
# The error is then at most the changes of the objective, times the safety factor.
_FINER, _SAFETY = 1.2, 3.0

# Motions whose objectives differ by this part of the objective are near different optima. The
# errors of feasible motions explain less: 3e-5 in a layer of 1e-8 of its phase, and 7e-4 if scales
# come from limits far above the values.
_ANOTHER = 1e-2

# Relative error of the objective that the solver may leave
_SOLVED_TO = 1e-6

# A change of the objective up to this part of the sum of earlier changes is negligible
_NEXT_TO_NOTHING = 1e-3

# Relative error of the dynamics, or violation of a limit, from which a motion is infeasible: the
# solver may have jumped over a limit between two points
_INFEASIBLE = 1e-3

Ending = Literal[
    "tolerances", "standstill", "mesh iterations", "failure", "budget", "cost", "interrupted"
]
"""Why a refinement ends."""

CUT_SHORT: tuple[Ending, ...] = ("budget", "cost", "interrupted")


@lazy_fields("errors")
@dataclass(frozen=True, eq=False, repr=False)
class SolvedMesh:
    """A mesh iteration that the solver finished, with the data for the choice of the next mesh.

    Attributes
    ----------
    iterate : Iterate
        The motion, with its multipliers.
    errors : MeshErrors
        Its errors between the points; estimated when they are first read.
    violation : float
        Largest violation of the program's rows, scaled.
    tight : bool
        Whether the program was solved to the requested tolerance. Otherwise it was solved to a
        larger one, because its mesh was expected to be replaced.
    finer : bool
        Whether its mesh has more intervals than the one before.
    iterations : int
        Of the solver.
    raised : float
        Cost of raising its peaks to their largest values between the points, relative to the
        objective; 0 if they were not raised.
    """

    iterate: Iterate
    errors: MeshErrors
    violation: float
    tight: bool
    finer: bool
    iterations: int = 0
    raised: float = 0.0

    def holds(self, accuracy: Accuracy, slack: float = 1.0) -> bool:
        """Whether dynamics and all constraints are within tolerance, also between the points.

        Parameters
        ----------
        slack : float
            Factor on the tolerance of the constraints.
        """
        dynamics = self.errors.dynamics <= accuracy.dynamics
        return dynamics and self.excess <= slack * accuracy.path

    def is_verifiable(self, accuracy: Accuracy) -> bool:
        """Whether dynamics and constraints are within the tolerances of the verification."""
        return self.holds(accuracy, SLACK)

    def meets(self, accuracy: Accuracy) -> bool:
        """Whether errors and the estimated improvement by finer controls are within tolerance."""
        return self.holds(accuracy) and self.errors.gain <= accuracy.objective

    def worst_in_tolerances(self, accuracy: Accuracy) -> float:
        """Largest of the errors and the estimated improvement, each divided by its tolerance."""
        return max(
            self.errors.dynamics / accuracy.dynamics,
            self.excess / accuracy.path,
            self.errors.gain / accuracy.objective,
        )

    @property
    def is_infeasible(self) -> bool:
        """Whether its errors are so large that its objective does not approximate the optimum."""
        return max(self.errors.dynamics, self.excess) >= _INFEASIBLE

    @property
    def estimated_change(self) -> float:
        """Estimated change of the objective by finer meshes, relative to the objective."""
        # the estimates are of first order, and may be too small by half
        of_excess = effect_of_excess(self.iterate, [p.excess for p in self.errors.phases])
        return 2.0 * (self.errors.gain + of_excess)

    @property
    def excess(self) -> float:
        """Largest relative violation of a constraint, at the points or between them."""
        return max(self.errors.excess, self.violation)


def best_of(solved: Sequence[SolvedMesh], accuracy: Accuracy) -> SolvedMesh:
    """The best mesh iteration whose errors are within the tolerances of the verification.

    If objectives are equally good, an estimated improvement within the limit of a certificate
    counts first, then errors within the requested tolerances. A smaller violation alone does not
    count: its mesh may be too coarse. If no mesh iteration passes, it is the last one. Errors
    relative to scales that are far too large, compared with those of the last mesh, do not count.
    """
    if len(solved) == 1:
        return solved[0]
    good = _verifiable(solved, solved[-1].iterate.scales, accuracy)
    # if one side of a kink is used beyond the kink, the objective may be too good
    good = [s for s in good if s.errors.beyond_kinks <= NEAR] or good
    sense = solved[-1].iterate.problem.sense
    # objectives of programs that were not solved to the requested tolerance are less accurate
    good = _tight_or_better(good, sense)
    best = min(good, key=lambda s: sense * s.iterate.objective, default=solved[-1])

    def behind(s: SolvedMesh) -> float:
        return abs(s.iterate.objective - best.iterate.objective) / best.iterate.objective_size

    as_good = [s for s in good if behind(s) <= accuracy.objective]
    if not best.holds(accuracy):
        # violations may improve the objective by more than its tolerance
        as_good += [s for s in good if s.meets(accuracy) and behind(s) <= CERTIFIED_GAIN]
    as_good = [s for s in as_good if s.errors.gain <= CERTIFIED_GAIN] or as_good
    strict = [s for s in as_good if s.holds(accuracy)]
    # of equally good answers, one with a small estimated improvement is more certain
    strict = [s for s in strict if s.errors.gain <= accuracy.objective] or strict
    # a kink inside an interval makes the costates inaccurate
    strict = [s for s in strict if s.errors.farthest_crossing <= NEAR] or strict
    if strict:
        return min(strict, key=lambda s: sense * s.iterate.objective)
    return min(as_good, key=lambda s: s.excess, default=best)


def _verifiable(
    solved: Sequence[SolvedMesh], sizes: Scales, accuracy: Accuracy
) -> list[SolvedMesh]:
    """Those whose errors are within the verification's tolerances, by scales near given ones."""
    near = [s for s in solved if not roomy(s.iterate.scales, sizes)]
    return [s for s in near if s.is_verifiable(accuracy)]


def _tight_or_better(good: list[SolvedMesh], sense: float) -> list[SolvedMesh]:
    """Those solved to the requested tolerance, and those in a better optimum than all of these.

    If none was solved to the requested tolerance, all of them.
    """
    least = min((sense * s.iterate.objective for s in good if s.tight), default=math.inf)

    def is_another(s: SolvedMesh) -> bool:
        return least - sense * s.iterate.objective > _ANOTHER * s.iterate.objective_size

    return [s for s in good if s.tight or is_another(s)]


def worst_objective(solved: Sequence[SolvedMesh], sizes: Scales, accuracy: Accuracy) -> float:
    """The objective, times the sense, from which a further mesh is in another, worse optimum.

    A finer mesh can represent every feasible motion of an earlier one. If its objective is worse by
    more than the estimated change of the earlier motion, and by more than errors of feasible
    motions explain, the solver has found another optimum. Infinite if no motion is feasible.

    Parameters
    ----------
    sizes : Scales
        Of the further mesh.
    """
    good = [s for s in _verifiable(solved, sizes, accuracy) if not s.is_infeasible]
    good = [s for s in good if s.errors.beyond_kinks <= NEAR]
    sense = solved[-1].iterate.problem.sense if solved else 1.0
    best = min(good, key=lambda s: sense * s.iterate.objective, default=None)
    if best is None:
        return math.inf
    allowed = max(best.estimated_change, _ANOTHER)
    return sense * best.iterate.objective + allowed * best.iterate.objective_size


def best_start(solved: Sequence[SolvedMesh]) -> SolvedMesh:
    """The start of the next mesh: the last one that is not infeasible, else the last one.

    The solver may jump over a limit between two points of a mesh. Later meshes that start there
    lead to another local optimum.
    """
    return next((s for s in reversed(solved) if not s.is_infeasible), solved[-1])


def is_refuted(solved: Sequence[SolvedMesh], back: int, accuracy: Accuracy) -> bool:
    """Whether finer meshes have refuted an estimated improvement.

    Either it is about as large as some meshes ago, like noise. Or it is small, and its decrease
    shows which part of it is real: if the objective improved by far less than the estimate
    decreased, the same holds for the rest. Along singular arcs the estimate decreases in proportion
    to the interval width, and the real loss in proportion to its square.

    Parameters
    ----------
    back : int
        Number of meshes between the two estimates that are compared.
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
    """The possible relative error of the objective of a mesh iteration, by all meshes.

    It is the estimated improvement by finer controls, or the change from the previous mesh if that
    is larger. An estimate that finer meshes have refuted is noise: then it is three times the
    changes over these meshes. It is at least the sum of changes that no estimate predicted. If the
    multipliers of the scheme give no estimate, it follows from the last mesh with half the
    intervals, or twice as many: if errors decrease at least in proportion to the width, it is at
    most the change between the two, or twice this change. Infinite if there is no such mesh.
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
    """The sum of the relative changes of the objective that were larger than estimated.

    If the objective changes irregularly from mesh to mesh, as among many local optima, one small
    change proves nothing. It has settled if two changes in a row were as small as estimated, or if
    one is negligible compared with those before.
    """
    total, kept = 0.0, 0
    for before, after in itertools.pairwise(s for s in solved if not s.is_infeasible):
        change = abs(after.iterate.objective - before.iterate.objective)
        change /= after.iterate.objective_size
        broken = change > before.estimated_change
        kept = 0 if broken else kept + 1
        settled = kept == _TWICE or (kept and change <= _NEXT_TO_NOTHING * total)
        total = 0.0 if settled else total + broken * change
    return total


def _are_finer(solved: Sequence[SolvedMesh]) -> bool:
    """Whether each mesh has enough more intervals than the previous one to show the error."""
    counts = [s.iterate.mesh.intervals for s in solved]
    return all(new >= _FINER * old for old, new in itertools.pairwise(counts))
