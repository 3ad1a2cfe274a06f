"""Meshes that adapt: degrees, cuts, brackets around jumps, further points and back-offs."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from ocp.accuracy import Accuracy
from ocp.estimates.error_estimate import MeshErrors
from ocp.estimates.estimated_gain import cost_of_raising, is_affordable
from ocp.keywords import as_written, checked_keywords
from ocp.mesh.mesh import Mesh, PhaseMesh, bisected, same_intervals
from ocp.optimality.iterate import Iterate
from ocp.refinement.policies.back_off import chosen_back_offs
from ocp.refinement.policies.brackets import hindered, with_movable_switches
from ocp.refinement.policies.kink_breakpoints import MANY, TOO_MANY, crossings_to_meet
from ocp.refinement.policies.next_phase import (
    MeshDemands,
    NextPhase,
    equal_phases,
    next_phase,
    worthwhile_jumps,
)
from ocp.refinement.policies.policy import HIGHEST_DEGREE, MeshPolicy, check_counts
from ocp.refinement.solved_mesh import SolvedMesh, is_refuted

# Relative error of the dynamics above which switches are as imaginary as the motion: breakpoints
# that move onto them lead the solver astray.
_A_MOTION = 1e-2
# Intervals that share this part of the tolerance on the objective need no finer control.
_LEFT_ALONE = 0.25
# Nor does one that gains less than this part of what the worst one gains. It is small, because what
# a rough control is estimated to gain is often a thousand times what it gains.
_LEAST_GAIN = 1e-5
# Unknowns of a program up to which breakpoints move in brackets. In a larger one an iteration is
# dear, and they cost more of them than short intervals beside each jump.
_MOST_IN_MOTION = 10_000
# finer meshes in a row on which nothing was gained, after which an estimated gain counts as noise
_REFUTED = 2


@checked_keywords()
@dataclass(frozen=True, repr=False)
class AdaptiveMesh:
    """Meshes that adapt until all tolerances are met.

    Errors of the dynamics raise the degree of an interval, or split it. Jumps of controls are put
    in brackets, in which a breakpoint may move. Controls are refined where the Hamiltonian shows
    a gain, not where they look rough. A constraint that is exceeded between the points is imposed
    there, too.

    Parameters
    ----------
    rounds : int
        Most meshes that are solved. Those that only impose limits at more points, and so leave less
        over them each time, do not count, up to as many again.
    most_intervals : int
        Of a phase.
    highest_degree : int
        Of an interval.
    move_breakpoints : bool
        Whether breakpoints may move onto the jumps of controls. With more than 10,000 unknowns they
        do so only where one stands at a wrong time.
    most_unknowns : int
        Of a nonlinear program, up to which intervals are cut for their controls. Beyond it they are
        cut only where the dynamics or the limits do not hold, and the verdict says what finer
        controls may still give.

    Raises
    ------
    StatementError
        For a number that is no positive integer.
    """

    rounds: int = 25
    most_intervals: int = 4000
    highest_degree: int = HIGHEST_DEGREE
    move_breakpoints: bool = True
    most_unknowns: int = 100_000

    adapts: ClassVar[bool] = True

    def __repr__(self) -> str:
        return as_written(self)

    def __post_init__(self) -> None:
        counts = ("rounds", "most_intervals", "highest_degree", "most_unknowns")
        check_counts(self, "an adaptive mesh", *counts)

    def next_mesh(self, solved: Sequence[SolvedMesh], accuracy: Accuracy) -> Mesh | None:
        """A better mesh, or None when the last one meets all tolerances."""
        if self.move_breakpoints and hindered(solved, accuracy):
            return self._held_still().next_mesh(solved, accuracy)
        last = solved[-1]
        informative = last.iterate.scheme.informative_multipliers
        converged = _controls_converged(solved, accuracy, informative)
        following = self._adapted(solved, accuracy, resolve_controls=not converged)
        if following is not None and not self.move_breakpoints:
            following = following.frozen()
        elif following is not None and informative and _finer_mesh_gained_nothing(solved, accuracy):
            following = with_movable_switches(last.iterate) or following

        if following is None and not converged and not informative:
            # the multipliers of these schemes meet the minimum principle on any mesh: compare two
            return bisected(last.iterate.mesh, self.most_intervals)
        return following

    def after_failure(
        self, solved: Sequence[SolvedMesh], failed: Mesh, accuracy: Accuracy
    ) -> tuple[MeshPolicy, Mesh] | None:
        """Go on from the last solved mesh, without what led the solver astray.

        Breakpoints that moved are held still. Where the mesh that failed had only more points or
        tighter limits, the intervals that exceed a limit are cut in their place.
        """
        if not any(phase.movable for phase in failed.phases):
            pairs = zip(failed.phases, solved[-1].iterate.mesh.phases, strict=True)
            only_points = all(same_intervals(new, old) for new, old in pairs)
            following = (
                self._cut_where_limits_are_exceeded(solved, accuracy) if only_points else None
            )
            return None if following is None else (self, following)
        still = self._held_still()
        following = still._adapted(solved, accuracy, resolve_controls=True)
        return still, (following or solved[-1].iterate.mesh).frozen()

    def _cut_where_limits_are_exceeded(
        self, solved: Sequence[SolvedMesh], accuracy: Accuracy
    ) -> Mesh | None:
        """The mesh after the last one as if all intervals that exceed a limit were too long."""
        last = solved[-1]
        phases = [
            replace(phase, coarse=np.any([e.values > accuracy.path for e in phase.excess], axis=0))
            for phase in last.errors.phases
        ]
        last = replace(last, errors=replace(last.errors, phases=tuple(phases)))
        seen = [*solved[:-1], last]
        following = self._adapted(seen, accuracy, resolve_controls=True, backs_off=False)
        if following is None or following.intervals <= last.iterate.mesh.intervals:
            return None
        return following.frozen()

    def _held_still(self) -> AdaptiveMesh:
        """The same policy with breakpoints that stay where they are."""
        return replace(self, move_breakpoints=False)

    def _adapted(
        self,
        solved: Sequence[SolvedMesh],
        accuracy: Accuracy,
        *,
        resolve_controls: bool,
        backs_off: bool = True,
    ) -> Mesh | None:
        """A better mesh, or None when the errors meet all tolerances."""
        last, mesh = solved[-1], solved[-1].iterate.mesh
        demands = MeshDemands(
            accuracy=accuracy,
            least_gain=_least_gain(last.errors, accuracy.objective) if resolve_controls else np.inf,
            most_intervals=self.most_intervals,
            highest_degree=0 if last.iterate.scheme.fixed_degree else self.highest_degree,
            move_breakpoints=self.move_breakpoints,
            brackets_move=self.move_breakpoints,
            is_motion=last.errors.dynamics <= _A_MOTION,
            resolves_jumps=_resolves_jumps(last, accuracy),
        )
        back_offs = chosen_back_offs(last, accuracy, accuracy.path if backs_off else np.inf)
        crossed = crossings_to_meet(solved, is_motion=demands.is_motion)

        def phases_for(demands: MeshDemands) -> list[NextPhase]:
            return [
                next_phase(last, index, demands, back_off, crossings)
                for index, (back_off, crossings) in enumerate(zip(back_offs, crossed, strict=True))
            ]

        phases = phases_for(demands)
        size = _unknowns(last.iterate, [phase.mesh for phase in phases])
        if size > _MOST_IN_MOTION:
            demands = replace(demands, brackets_move=False)
            phases = phases_for(demands)
        if size > self.most_unknowns:
            if _only_peaks_are_exceeded(last, accuracy):
                return None
            phases = phases_for(replace(demands, least_gain=np.inf, leaves_controls=True))
        if not any(phase.changes for phase in phases):
            return None

        following = Mesh(
            tuple(phase.mesh for phase in phases),
            tuple(phase.extra for phase in phases),
            tuple(phase.back_off for phase in phases),
        )
        # only points are missing: hold still
        same = all(map(equal_phases, following.phases, mesh.phases))
        return following.frozen() if same else following


def _resolves_jumps(last: SolvedMesh, accuracy: Accuracy) -> bool:
    """Whether a mesh tells jumps of controls from what it does not resolve of them."""
    pairs = list(zip(last.iterate.mesh.phases, last.errors.phases, strict=True))
    # beyond that they move and vanish on the next mesh, while a bracket around each leaves none of
    # its intervals to be cut for anything else, and makes programs that the solver gives up: a
    # finer mesh tells which of them there are
    jumps = sum(len(worthwhile_jumps(*pair, accuracy.objective)) for pair in pairs)
    return jumps <= max(MANY, TOO_MANY * last.iterate.mesh.intervals)


def _only_peaks_are_exceeded(last: SolvedMesh, accuracy: Accuracy) -> bool:
    """Whether nothing is open but peaks, and raising them costs less than finer controls may gain.

    See `ocp.refinement.raised_peaks`.
    """
    excess = [errors.excess for errors in last.errors.phases]
    cost = cost_of_raising(last.iterate, excess, accuracy.path)
    if cost == 0.0 or last.errors.dynamics > accuracy.dynamics:
        return False
    return is_affordable(cost, last.errors.gain)


def _unknowns(iterate: Iterate, phases: Sequence[PhaseMesh]) -> float:
    """About how many unknowns the program of a mesh has: as many for each point as before."""
    before = sum(int(phase.degrees.sum()) for phase in iterate.mesh.phases)
    return iterate.x.size * sum(int(phase.degrees.sum()) for phase in phases) / before


def _finer_mesh_gained_nothing(solved: Sequence[SolvedMesh], accuracy: Accuracy) -> bool:
    """Whether a gain is estimated for a motion that holds, though its finer mesh gained nothing."""
    if len(solved) < 2 or not solved[-1].holds(accuracy):
        return False
    before, after = solved[-2:]
    change = _change(before.iterate, after.iterate)
    return after.finer and after.errors.gain > accuracy.objective >= change


def _controls_converged(
    solved: Sequence[SolvedMesh], accuracy: Accuracy, informative: bool
) -> bool:
    """Whether finer controls have changed the objective by less than its tolerance."""
    # a mesh may have been finer at the wrong place: multipliers that say something get a second one
    count = _REFUTED if informative else 1
    latest = list(itertools.pairwise(solved))[-count:]
    refuted = not informative or is_refuted(solved, count, accuracy)
    return (
        len(latest) == count
        and refuted
        and all(
            _is_finer(before, after, everywhere=not informative)
            and _change(before.iterate, after.iterate) <= accuracy.objective
            for before, after in latest
        )
    )


def _is_finer(before: SolvedMesh, after: SolvedMesh, *, everywhere: bool) -> bool:
    """Whether a mesh has more intervals than the one before, or twice as many."""
    least = (2 if everywhere else 1) * before.iterate.mesh.intervals
    return after.finer and after.iterate.mesh.intervals >= least


def _change(before: Iterate, after: Iterate) -> float:
    """Relative change of the objective from one mesh iteration to another."""
    return abs(after.objective - before.objective) / after.objective_size


def _least_gain(errors: MeshErrors, tolerance: float) -> float:
    """The gain from which on an interval is refined: the rest together stays below tolerance."""
    gains = np.sort(np.concatenate([phase.gain for phase in errors.phases]))
    if gains.sum() <= tolerance:
        return float(np.inf)
    kept = np.searchsorted(np.cumsum(gains), _LEFT_ALONE * tolerance, side="right")
    return float(max(gains[kept], _LEAST_GAIN * gains[-1]))
