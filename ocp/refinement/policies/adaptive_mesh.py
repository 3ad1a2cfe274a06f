"""Meshes that adapt: degrees, cuts, brackets around jumps, further points and back-offs."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from ocp.arrays import Array, Flags
from ocp.keywords import as_written, checked_keywords
from ocp.mesh.mesh import ExtraPoints, Mesh, PhaseMesh, bisected, distinct, same_intervals
from ocp.mesh.trajectory import PhaseTrajectory
from ocp.optimality.iterate import Iterate
from ocp.refinement.accuracy import Accuracy
from ocp.refinement.estimates.error_estimate import MeshErrors, PhaseErrors
from ocp.refinement.estimates.kink_crossings import NEAR, NEAR_WHILE_ROUGH
from ocp.refinement.estimates.missed_switches import beside, held_switches
from ocp.refinement.estimates.peak_leaks import cost_of_raising, is_affordable
from ocp.refinement.estimates.switch_detection import Jump
from ocp.refinement.policies.back_off import chosen_back_offs, without_closed
from ocp.refinement.policies.brackets import (
    freed_at,
    settled,
    with_brackets,
    with_movable_switches,
)
from ocp.refinement.policies.kink_breakpoints import (
    AwaitedCrossings,
    awaited_crossings,
    with_crossings,
    with_sides,
)
from ocp.refinement.policies.marks import WHOLE, Marks
from ocp.refinement.policies.movable import hindered
from ocp.refinement.policies.policy import RefinementPolicy, check_counts
from ocp.refinement.solved_mesh import SolvedMesh, is_refuted

# Relative error of the dynamics above which switches are as imaginary as the motion: breakpoints
# that move onto them lead the solver astray.
_A_MOTION = 1e-2
# Jumps by intervals of a mesh, and how many at least, beyond which it does not resolve controls.
# They move and vanish on the next mesh, while a bracket around each leaves none of its intervals to
# be cut for anything else, and makes programs that the solver gives up. A finer mesh tells which of
# them there are.
_TOO_MANY = 0.3
_MANY = 16
# Where a constraint leaks it is held at the leak and at both sides of it, in parts of the interval:
# a leak that is held at one point only moves to the side.
_AROUND = np.array([-0.15, 0.0, 0.15])
# Where any leak is to be closed, so are those above this part of the tolerance: where a motion is
# pushed back, its neighbours are the next ones.
_NEARLY = 0.3
# Intervals that share this part of the tolerance on the objective need no finer control.
_LEFT_ALONE = 0.25
# Nor does one that gains less than this part of what the worst one gains. It is small, because what
# a rough control promises is often a thousand times what it gains.
_LEAST_GAIN = 1e-5
# finer meshes in a row on which nothing was gained, after which a promised gain counts as noise
_REFUTED = 2
# of an interval: points closer than this are one
_SAME_POINT = 1e-6


@checked_keywords()
@dataclass(frozen=True, repr=False)
class AdaptiveMesh:
    """Meshes that adapt until all tolerances are met.

    Errors of the dynamics raise the degree of an interval, or split it. Jumps of controls are put
    in brackets, in which a breakpoint may move. Controls are refined where the Hamiltonian promises
    a gain, not where they look rough. A constraint that leaks between the points is imposed at the
    leak too.

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
        Whether breakpoints may move onto the jumps of controls.
    most_unknowns : int
        Of a nonlinear program, up to which intervals are cut for their controls. Beyond it they are
        cut only where the dynamics or the limits do not hold, and the verdict says what finer
        controls still promise.

    Raises
    ------
    StatementError
        For a number that is no positive integer.
    """

    rounds: int = 25
    most_intervals: int = 4000
    highest_degree: int = 8
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
        elif following is not None and informative and _promises_in_vain(solved, accuracy):
            following = with_movable_switches(last.iterate) or following

        if following is None and not converged and not informative:
            # the multipliers of these schemes meet the minimum principle on any mesh: compare two
            return bisected(last.iterate.mesh, self.most_intervals)
        return following

    def after_failure(
        self, solved: Sequence[SolvedMesh], failed: Mesh, accuracy: Accuracy
    ) -> tuple[RefinementPolicy, Mesh] | None:
        """Hold breakpoints that led the solver astray still; go on from the last solved mesh."""
        if not any(phase.movable for phase in failed.phases):
            return None
        still = self._held_still()
        following = still._adapted(solved, accuracy, resolve_controls=True)
        return still, (following or solved[-1].iterate.mesh).frozen()

    def _held_still(self) -> AdaptiveMesh:
        """The same policy with breakpoints that stay where they are."""
        return replace(self, move_breakpoints=False)

    def _adapted(
        self,
        solved: Sequence[SolvedMesh],
        accuracy: Accuracy,
        *,
        resolve_controls: bool,
    ) -> Mesh | None:
        """A better mesh, or None when the errors meet all tolerances."""
        last = solved[-1]
        least = _least_gain(last.errors, accuracy.objective) if resolve_controls else np.inf
        leaks = last.errors.excess > accuracy.path
        closed = _NEARLY * accuracy.path if leaks else accuracy.path
        back_offs = chosen_back_offs(last, accuracy, closed)

        resolved = _resolves_jumps(last, accuracy)
        awaited = awaited_crossings(solved, are_motions=last.errors.dynamics <= _A_MOTION)

        def steps_to(least: float, *, large: bool) -> list[_PhaseStep]:
            return [
                _PhaseStep.of(
                    last,
                    index,
                    self,
                    accuracy,
                    least,
                    back_offs[index],
                    awaited[index],
                    closed,
                    resolved=resolved,
                    large=large,
                )
                for index in range(len(last.iterate.mesh.phases))
            ]

        steps = steps_to(least, large=False)
        if _unknowns(last.iterate, [step.refined for step in steps]) > self.most_unknowns:
            if _only_peaks_leak(last, accuracy):
                return None
            steps = steps_to(np.inf, large=True)
        if not any(step.changes for step in steps):
            return None

        phases = [step.refined for step in steps]
        if all(_equal(new, old) for new, old in zip(phases, last.iterate.mesh.phases, strict=True)):
            # only points are missing: hold still
            phases = [mesh.frozen() for mesh in phases]
        return Mesh(
            tuple(phases),
            tuple(step.extra_points() for step in steps),
            tuple(step.back_off() for step in steps),
        )


def _resolves_jumps(last: SolvedMesh, accuracy: Accuracy) -> bool:
    """Whether a mesh tells jumps of controls from what it does not resolve of them."""
    pairs = list(zip(last.iterate.mesh.phases, last.errors.phases, strict=True))
    jumps = sum(len(_worthwhile_jumps(*pair, accuracy.objective)) for pair in pairs)
    return jumps <= max(_MANY, _TOO_MANY * last.iterate.mesh.intervals)


def _only_peaks_leak(last: SolvedMesh, accuracy: Accuracy) -> bool:
    """Whether nothing is open but peaks, and raising them costs less than finer controls promise.

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


def _promises_in_vain(solved: Sequence[SolvedMesh], accuracy: Accuracy) -> bool:
    """Whether a motion that holds promises a gain though its mesh, a finer one, gained nothing."""
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


@dataclass(frozen=True, eq=False, repr=False)
class _PhaseStep:
    """One phase from its solved mesh to the next.

    Attributes
    ----------
    mesh : PhaseMesh
        As it was solved, its breakpoints where they began.
    base : PhaseMesh
        The same with its breakpoints where the optimiser left them.
    blocked : bool
        Whether a movable breakpoint wants to go further.
    refined : PhaseMesh
        The next one.
    errors : PhaseErrors
        On `mesh`.
    extra : tuple of ExtraPoints
        On `mesh`.
    old_back_off, new_back_off : mapping of int to (N,)
        By path constraint, on `mesh`: those that it was solved with, and what is added to them.
    tolerance : float
        On the excess of constraints.
    closed : float
        Excess from which on a leak is closed where the phase is solved again anyway.
    """

    mesh: PhaseMesh
    base: PhaseMesh
    blocked: bool
    refined: PhaseMesh
    errors: PhaseErrors
    extra: tuple[ExtraPoints, ...]
    old_back_off: Mapping[int, Array]
    new_back_off: Mapping[int, Array]
    tolerance: float
    closed: float

    @classmethod
    def of(
        cls,
        last: SolvedMesh,
        index: int,
        policy: AdaptiveMesh,
        accuracy: Accuracy,
        least: float,
        new_back_off: Mapping[int, Array],
        awaited: AwaitedCrossings,
        closed: float,
        *,
        resolved: bool,
        large: bool,
    ) -> _PhaseStep:
        """The step of phase number `index`; `least` is the gain that an interval is refined for.

        Jumps that the mesh has not `resolved` are cut in two. Where the program is `large` its
        controls are left as they are, and so are their jumps.
        """
        mesh = last.iterate.mesh.phases[index]
        errors = without_closed(last.errors.phases[index], new_back_off, accuracy.path)
        motion = last.iterate.trajectory.phases[index]
        known = motion.fractions_of(last.iterate.problem.instants[motion.name])
        base, blocked = settled(mesh, motion, known) if mesh.movable else (mesh, False)

        worth = _worthwhile_jumps(mesh, errors, accuracy.objective)
        is_motion = last.errors.dynamics <= _A_MOTION
        telling = is_motion and resolved and not large
        if not telling:
            worth = []

        held = _wrongly_held(last, index, errors, accuracy.objective)
        start = base
        if policy.move_breakpoints and telling and held.any():
            # Between its neighbours: how far off a switch is, nobody knows. Until it is there, the
            # gains beside it are those of controls that will change.
            start = freed_at(base, motion.fractions[1:-1][held])
            errors = replace(errors, gain=np.where(beside(held), 0.0, errors.gain))
        bracketed = with_brackets(start, worth, policy.move_breakpoints, known)
        near = NEAR if last.tight else NEAR_WHILE_ROUGH
        crossed = with_crossings(bracketed or start, awaited, known, near)
        errors = _without_errors_at(errors, motion, awaited.last.crossings.places[crossed.moved])

        # While a breakpoint is still on its way, gains are those of a control that will change, and
        # so are the errors of controls before each jump has its bracket.
        marks = Marks.of(
            base,
            _gathered(errors, motion, base),
            tolerance=accuracy.dynamics,
            highest=0 if last.iterate.scheme.fixed_degree else policy.highest_degree,
            least_gain=np.inf if blocked else least,
            on_its_way=start.moving & (start is not base),
            missed=max(least, accuracy.objective),
            halve=start is not base or bracketed is not None or (is_motion and not resolved),
        )
        refined = marks.refine(crossed.mesh, base, policy.most_intervals)
        refined = with_sides(refined, crossed.crossings, near)
        return cls(
            mesh,
            base,
            blocked,
            refined,
            errors,
            extra=last.iterate.mesh.extra[index],
            old_back_off=last.iterate.mesh.back_off[index],
            new_back_off=new_back_off,
            tolerance=accuracy.path,
            closed=closed,
        )

    @property
    def changes(self) -> bool:
        """Whether there is anything to solve again for."""
        leaks = any(float(e.values.max()) > self.tolerance for e in self.errors.excess)
        backed_off = any(values.any() for values in self.new_back_off.values())
        # what was found on a side of a kink that the motion has left is no answer
        off_sides = bool(self.errors.crossings.left.any())
        return (
            self.blocked or leaks or backed_off or off_sides or not _equal(self.refined, self.base)
        )

    @property
    def breakpoints(self) -> Array:
        """Those of the intervals of `mesh`, where the optimiser left them if none is gone."""
        same = self.base.intervals == self.mesh.intervals
        return self.base.breakpoints if same else self.mesh.breakpoints

    def back_off(self) -> dict[int, Array]:
        """Old back-offs and new ones, in the intervals that stay."""
        points = self.breakpoints
        middle = 0.5 * (self.refined.breakpoints[:-1] + self.refined.breakpoints[1:])
        parent = np.clip(np.searchsorted(points, middle) - 1, 0, self.mesh.intervals - 1)
        kept = np.diff(self.refined.breakpoints) >= WHOLE * np.diff(points)[parent]

        old, new, nothing = self.old_back_off, self.new_back_off, np.zeros(self.mesh.intervals)
        return {
            number: np.where(
                kept, (old.get(number, nothing) + new.get(number, nothing))[parent], 0.0
            )
            for number in {*old, *new}
        }

    def extra_points(self) -> tuple[ExtraPoints, ...]:
        """Old added points, carried over, and new ones wherever a constraint leaks."""
        before = self.breakpoints
        width = np.diff(before)

        fractions: dict[int, list[float]] = {}
        for points in self.extra:
            places = before[points.intervals] + points.tau * width[points.intervals]
            fractions.setdefault(points.constraint, []).extend(places)
        for constraint, excess in enumerate(self.errors.excess):
            # a crowded interval is split instead
            leaks = np.flatnonzero((excess.values > self.closed) & ~self.errors.crowded)
            if leaks.size:
                tau = np.clip(excess.tau[leaks][:, None] + _AROUND, 0.0, 1.0)
                places = (before[leaks][:, None] + tau * width[leaks][:, None]).ravel()
                fractions.setdefault(constraint, []).extend(places)

        return tuple(
            _extra_points(constraint, distinct(np.array(places)), self.refined)
            for constraint, places in fractions.items()
            if places
        )


def _extra_points(constraint: int, fractions: Array, mesh: PhaseMesh) -> ExtraPoints:
    """Points of a mesh at fractions of the phase; one of several that lie on top of each other."""
    intervals = np.searchsorted(mesh.breakpoints, fractions, side="right") - 1
    intervals = np.clip(intervals, 0, mesh.intervals - 1)
    tau = (fractions - mesh.breakpoints[intervals]) / np.diff(mesh.breakpoints)[intervals]

    repeated = (np.diff(intervals) == 0) & (np.diff(tau) < _SAME_POINT)
    keep = np.concatenate([[True], ~repeated])
    return ExtraPoints(constraint, intervals[keep], np.clip(tau[keep], 0.0, 1.0))


def _worthwhile_jumps(mesh: PhaseMesh, errors: PhaseErrors, tolerance: float) -> list[Jump]:
    """Jumps whose place matters for the objective."""
    points = mesh.breakpoints
    worth = []
    for jump in errors.jumps:
        around = (points[1:] > jump.first) & (points[:-1] < jump.last)
        if errors.switching[around].max(initial=0.0) >= 0.5 * tolerance:
            worth.append(jump)
    return worth


def _wrongly_held(last: SolvedMesh, index: int, errors: PhaseErrors, tolerance: float) -> Flags:
    """Whether a switch at a fixed inner breakpoint should be elsewhere, (N - 1,)."""
    held = errors.valleys >= 0.5 * tolerance
    # costates of a rough solve are rough, too
    if last.tight and errors.displaced.any():
        # multipliers are not unique beside any of them: another one may be displaced next time
        held |= errors.displaced | held_switches(last.iterate, index, errors.jumps)
    return held


def _without_errors_at(errors: PhaseErrors, motion: PhaseTrajectory, places: Array) -> PhaseErrors:
    """The errors, none of dynamics and controls in the intervals that hold given fractions."""
    held = np.clip(np.searchsorted(motion.fractions, places) - 1, 0, motion.intervals - 1)
    dynamics, gain = errors.dynamics.copy(), errors.gain.copy()
    dynamics[held], gain[held] = 0.0, 0.0
    return replace(errors, dynamics=dynamics, gain=gain)


def _equal(a: PhaseMesh, b: PhaseMesh) -> bool:
    return a.movable == b.movable and same_intervals(a, b)


def _gathered(errors: PhaseErrors, motion: PhaseTrajectory, base: PhaseMesh) -> PhaseErrors:
    """Errors on a mesh that lacks some of the motion's breakpoints."""
    if base.intervals == errors.dynamics.size:
        return errors
    middle = 0.5 * (motion.fractions[:-1] + motion.fractions[1:])
    parent = np.searchsorted(base.breakpoints, middle) - 1

    def gathered(values: Array | Flags, gather: np.ufunc) -> Array:
        result = np.zeros(base.intervals)
        gather.at(result, parent, values)
        return result

    return replace(
        errors,
        dynamics=gathered(errors.dynamics, np.maximum),
        gain=gathered(errors.gain, np.add),
        crowded=gathered(errors.crowded, np.maximum) > 0,
        coarse=gathered(errors.coarse, np.maximum) > 0,
        parts=gathered(errors.parts, np.maximum),
        at_end=gathered(errors.at_end, np.maximum) > 0,
    )
