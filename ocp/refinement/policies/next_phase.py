"""One phase from its solved mesh to the next: its intervals, their further points and back-offs.

Marks say what is to happen to each interval: whether it is cut, and which degree it gets.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ocp.accuracy import Accuracy
from ocp.arrays import Array, Flags, Integers
from ocp.estimates.error_estimate import PhaseErrors, beside, held_switches
from ocp.estimates.kink_crossings import NEAR, NEAR_WHILE_LOOSE, KinkCrossings
from ocp.estimates.switch_detection import ROUND_OFF, Jump
from ocp.mesh.mesh import ExtraPoints, PhaseMesh, distinct, same_intervals
from ocp.mesh.trajectory import PhaseTrajectory
from ocp.optimality.control_gains import PARTS
from ocp.refinement.policies.back_off import without_closed
from ocp.refinement.policies.brackets import NARROWEST, freed_at, settled, with_brackets
from ocp.refinement.policies.kink_breakpoints import with_crossings, with_sides
from ocp.refinement.solved_mesh import SolvedMesh

# times the tolerance on the dynamics, beyond which an interval is cut in four and not in two
_FAR = 1e4
# Parts into which an interval is cut at once at most: what a coarse interval tells of its controls
# is not worth more.
_MOST_PARTS = 3
# Parts of an interval from which on its control is not smooth, but turns quickly or jumps. There a
# polynomial of a higher degree swings, and its swings exceed limits. Few points cannot tell.
_TURNS = 2.0
_TELLING_DEGREE = 4
# States and algebraic variables times degree, up to which a degree is raised beyond 5. To factorise
# an interval takes the cube of this number, and two of half the degree together a quarter of that.
_WORTHWHILE = 40
_ANYWHERE = 5
# If the error of the first interval of a phase is this factor above that of the next one, it
# contains a layer in which fast states settle. It is cut at these places, because a halved one
# would take a mesh for each factor of 2 to 4 in the error.
_LAYER = 10.0
_PARTS_OF_LAYER = np.array([1 / 16, 1 / 4])
# An interval that keeps this part of its width beside a new bracket still stands for itself.
WHOLE = 0.8
# Of its end: intervals below this are not cut for their dynamics, because their breakpoints
# would be rounded. Stiff kinetics of hours begin within microseconds.
_ROUNDED = 1e-9


@dataclass(frozen=True, eq=False, repr=False)
class Marks:
    """What is to happen to each interval of a mesh, (N,) each.

    Attributes
    ----------
    split : whether it is cut.
    parts : into how many it is cut then.
    forced : whether it is cut whatever the breakpoints do: for its dynamics, because it holds
        enough added points, because it is too long for a constraint, or because a breakpoint beside
        it has missed its switch.
    far : whether it is cut in four for its dynamics.
    at_end : whether it is cut for its control, near its end, in parts that get narrower.
    at_start : whether it is cut for a layer at the start of the phase, in parts that get wider.
    degrees : to which its degree is raised.
    """

    split: Flags
    parts: Integers
    forced: Flags
    far: Flags
    at_end: Flags
    at_start: Flags
    degrees: Integers

    @classmethod
    def of(
        cls,
        mesh: PhaseMesh,
        errors: PhaseErrors,
        *,
        tolerance: float,
        highest: int,
        least_gain: float,
        missed: float,
        halve: bool,
        on_its_way: Flags,
    ) -> Marks:
        """Marks from the errors; degrees are not raised above `highest`.

        Their errors tell into how many parts intervals are to be cut, as if controls were smooth;
        with `halve` that is two. An interval that gains more than `missed` beside a breakpoint that
        came to rest holds a switch that the breakpoint has missed. Intervals at whose end a
        breakpoint is `on_its_way` (N,) are not cut, whatever their errors.
        """
        ratio = errors.dynamics / tolerance
        degrees = mesh.degrees.astype(float)

        # the error falls by about the degree with every point more
        wanted = np.ceil(degrees + np.log(np.maximum(ratio, 1.0)) / np.log(degrees + 1.0))
        turns = (errors.parts > _TURNS) & (mesh.degrees >= _TELLING_DEGREE)
        too_high = (wanted > highest) | turns
        inexact = (ratio > 1.0) & too_high
        forced = errors.crowded | errors.coarse
        forced |= (errors.gain >= least_gain) & (errors.gain > missed)
        raised = np.where((ratio > 1.0) & ~too_high, wanted, degrees).astype(np.int64)

        # a cut there would be one more place for the breakpoint to stop at
        inexact, forced = inexact & ~on_its_way, forced & ~on_its_way
        at_start = inexact & (ratio <= _FAR)
        at_start[0] &= errors.dynamics[0] > _LAYER * errors.dynamics[1:2].min(initial=np.inf)
        at_start[1:] = False

        width = np.diff(mesh.breakpoints)
        wide, inexact = width > NARROWEST, inexact & (width > _ROUNDED * mesh.breakpoints[1:])
        return cls(
            split=inexact | ((forced | (errors.gain >= least_gain)) & wide),
            parts=np.full(mesh.intervals, 2) if halve else _parts(errors, least_gain),
            forced=inexact | (forced & wide),
            far=inexact & (ratio > _FAR),
            at_end=~inexact & errors.at_end & (errors.gain >= least_gain),
            at_start=at_start,
            degrees=raised,
        )

    def refine(self, mesh: PhaseMesh, base: PhaseMesh, most_intervals: int) -> PhaseMesh:
        """Cut and raise the intervals of a mesh; those that a bracket replaced are left alone.

        The marks are those of `base`; `mesh` is the same with brackets around jumps.
        """
        if not (self.split.any() or np.any(self.degrees != base.degrees)):
            return mesh
        points, width = mesh.breakpoints, np.diff(mesh.breakpoints)
        middle = 0.5 * (points[:-1] + points[1:])
        parent = np.searchsorted(base.breakpoints, middle) - 1
        parent = np.clip(parent, 0, base.intervals - 1)

        old = np.isin(points, base.breakpoints, assume_unique=True)
        whole = width >= WHOLE * np.diff(base.breakpoints)[parent]
        untouched = (old[:-1] & old[1:]) | (whole & (old[:-1] | old[1:]))

        # beside a breakpoint that has not moved yet only what has to be cut
        split = self.split[parent] & untouched & ~(_beside_new(mesh, base) & ~self.forced[parent])
        if mesh.intervals + 3 * split.sum() > most_intervals:
            split[:] = False
        parts = np.where(self.far[parent], 4, self.parts[parent])

        marks = zip(self.at_end[parent], self.at_start[parent], parts, strict=True)
        shares = [
            PARTS[1:-1] if end else _PARTS_OF_LAYER if start else np.arange(1, count) / count
            for end, start, count in marks
        ]
        cuts = [points[k] + width[k] * shares[k] for k in np.flatnonzero(split)]
        refined = np.sort(np.concatenate([points, *cuts]))
        parents = np.searchsorted(points, refined[:-1], side="right") - 1
        degrees = np.where(untouched, self.degrees[parent], mesh.degrees)[parents]
        movable = tuple(int(np.searchsorted(refined, points[i])) for i in mesh.movable)
        return PhaseMesh(refined, degrees, movable)


def _beside_new(mesh: PhaseMesh, base: PhaseMesh) -> Flags:
    """Intervals of a mesh that begin or end at a movable breakpoint that `base` lacks, (N,)."""
    new = np.zeros(mesh.intervals + 1, dtype=bool)
    movable = list(mesh.movable)
    new[movable] = ~np.isin(mesh.breakpoints[movable], base.breakpoints, assume_unique=True)
    return new[:-1] | new[1:]


def _parts(errors: PhaseErrors, least_gain: float) -> Integers:
    """Into how many parts intervals are cut: until controls are smooth, and what is gained little.

    What other breakpoints gain along an arc falls with the cube of the width, and what finer
    controls gain elsewhere falls faster.
    """
    wanted = np.maximum(errors.parts, np.cbrt(errors.gain / least_gain))
    return np.clip(np.ceil(wanted), 2, _MOST_PARTS).astype(np.int64)


# Where a constraint is exceeded it is held there and at both sides, in parts of the interval: a
# violation that is held at one point only moves to the side.
_AROUND = np.array([-0.15, 0.0, 0.15])

# of an interval: points closer than this are one
_SAME_POINT = 1e-6


@dataclass(frozen=True)
class MeshDemands:
    """What the next mesh is to bring, and what it may use for that; the same for all phases.

    Attributes
    ----------
    accuracy : Accuracy
        What is asked for.
    least_gain : float
        Estimated gain from which on an interval is cut for its controls, relative to the objective.
    most_intervals : int
        Of the phase.
    highest_degree : int
        Up to which the degree of an interval is raised; 0 where no degree is raised.
    move_breakpoints : bool
        Whether breakpoints may move onto the jumps of controls.
    brackets_move : bool
        Whether a breakpoint moves in the bracket of a jump that was located.
    is_motion : bool
        Whether the solved mesh holds the dynamics well enough to say where anything switches.
    resolves_jumps : bool
        Whether it also tells where controls jump. If not its intervals are cut in two.
    leaves_controls : bool
        Whether controls and their jumps are left as they are, because the program is large.
    """

    accuracy: Accuracy
    least_gain: float
    most_intervals: int
    highest_degree: int
    move_breakpoints: bool
    brackets_move: bool
    is_motion: bool
    resolves_jumps: bool
    leaves_controls: bool = False


@dataclass(frozen=True, eq=False, repr=False)
class NextPhase:
    """The next mesh of a phase.

    Attributes
    ----------
    mesh : PhaseMesh
    extra : tuple of ExtraPoints
        On it.
    back_off : mapping of int to (N,)
        On it, by path constraint.
    changes : bool
        Whether there is anything to solve again for.
    """

    mesh: PhaseMesh
    extra: tuple[ExtraPoints, ...]
    back_off: dict[int, Array]
    changes: bool


def next_phase(
    last: SolvedMesh,
    index: int,
    demands: MeshDemands,
    back_off: Mapping[int, Array],
    crossed: KinkCrossings,
) -> NextPhase:
    """The next mesh of phase number `index`.

    Parameters
    ----------
    back_off : mapping of int to (N,)
        By path constraint, on the solved mesh: what is added to the back-offs that it has.
    crossed : KinkCrossings
        Where the motion crosses kinks that breakpoints are to meet.
    """
    solved, motion = last.iterate.mesh.phases[index], last.iterate.trajectory.phases[index]
    errors = without_closed(last.errors.phases[index], back_off, demands.accuracy.path)
    known = motion.fractions_of(last.iterate.problem.instants[motion.name])
    base, blocked = settled(solved, motion, known) if solved.movable else (solved, False)
    refined = _refined(last, index, demands, errors, base, crossed, blocked=blocked)

    exceeded = any(float(e.values.max()) > demands.accuracy.path for e in errors.excess)
    backed_off = any(values.any() for values in back_off.values())
    # what was found on a side of a kink that the motion has left is no answer
    off_sides = bool(errors.crossings.left.any())
    changes = blocked or exceeded or backed_off or off_sides or not equal_phases(refined, base)

    # of the solved intervals, where the optimiser left them if none is gone
    same = base.intervals == solved.intervals
    breakpoints = base.breakpoints if same else solved.breakpoints
    whole = last.iterate.mesh
    jumping = [c.has_control for c in last.iterate.transcription.constraints[index]]
    return NextPhase(
        mesh=refined,
        extra=_extra_points(
            whole.extra[index], errors, jumping, demands.accuracy.path, breakpoints, refined
        ),
        back_off=_back_off(whole.back_off[index], back_off, breakpoints, refined),
        changes=changes,
    )


def _refined(
    last: SolvedMesh,
    index: int,
    demands: MeshDemands,
    errors: PhaseErrors,
    base: PhaseMesh,
    crossed: KinkCrossings,
    *,
    blocked: bool,
) -> PhaseMesh:
    """The intervals of a phase after `base`, which is as the optimiser left it.

    With `blocked` a movable breakpoint wants to go further.
    """
    mesh, motion = last.iterate.mesh.phases[index], last.iterate.trajectory.phases[index]
    known = motion.fractions_of(last.iterate.problem.instants[motion.name])
    objective, unresolved = demands.accuracy.objective, not demands.resolves_jumps
    telling = demands.is_motion and not (unresolved or demands.leaves_controls)
    jumps = worthwhile_jumps(mesh, errors, objective) if telling else []

    held = _wrongly_held(last, index, errors)
    start = base
    if demands.move_breakpoints and telling and held.any():
        # Between its neighbours: how far off a switch is, nobody knows. Until it is there, the
        # gains beside it are those of controls that will change.
        start = freed_at(base, motion.fractions[1:-1][held])
        errors = replace(errors, gain=np.where(beside(held), 0.0, errors.gain))
    bracketed = with_brackets(start, jumps, demands.brackets_move, known)
    near = NEAR if last.tight else NEAR_WHILE_LOOSE
    stops = with_crossings(bracketed or start, crossed, known, near)
    errors = _without_errors_at(errors, motion, stops.crossings.places[stops.moved])

    # While a breakpoint is still on its way, gains are those of a control that will change, and so
    # are the errors of controls before each jump has its bracket.
    halve = start is not base or bracketed is not None
    marks = Marks.of(
        base,
        _gathered(errors, motion, base),
        tolerance=demands.accuracy.dynamics,
        highest=min(demands.highest_degree, _worthwhile_degree(last, index)),
        least_gain=np.inf if blocked else demands.least_gain,
        on_its_way=start.moving & (start is not base),
        missed=max(demands.least_gain, objective),
        halve=halve or (demands.is_motion and unresolved),
    )
    refined = marks.refine(stops.mesh, base, demands.most_intervals)
    return with_sides(refined, stops.crossings, near)


def _back_off(
    old: Mapping[int, Array], new: Mapping[int, Array], breakpoints: Array, refined: PhaseMesh
) -> dict[int, Array]:
    """Old back-offs and new ones, in the intervals that stay.

    Parameters
    ----------
    old, new : mapping of int to (N,)
        By path constraint, on the solved mesh.
    breakpoints : (N + 1,)
        Of the solved mesh.
    """
    count = breakpoints.size - 1
    middle = 0.5 * (refined.breakpoints[:-1] + refined.breakpoints[1:])
    parent = np.clip(np.searchsorted(breakpoints, middle) - 1, 0, count - 1)
    kept = np.diff(refined.breakpoints) >= WHOLE * np.diff(breakpoints)[parent]

    nothing = np.zeros(count)
    return {
        number: np.where(kept, (old.get(number, nothing) + new.get(number, nothing))[parent], 0.0)
        for number in {*old, *new}
    }


def _extra_points(
    old: Sequence[ExtraPoints],
    errors: PhaseErrors,
    jumping: Sequence[bool],
    tolerance: float,
    breakpoints: Array,
    refined: PhaseMesh,
) -> tuple[ExtraPoints, ...]:
    """Old added points, carried over, and new ones wherever a constraint is exceeded.

    Parameters
    ----------
    old : sequence of ExtraPoints
        On the solved mesh.
    jumping : sequence of bool
        Whether each constraint may jump at breakpoints, as its controls do.
    tolerance : float
        Excess from which on a violation is removed.
    breakpoints : (N + 1,)
        Of the solved mesh.
    """
    width = np.diff(breakpoints)
    fractions: dict[int, list[float]] = {}
    for points in old:
        places = breakpoints[points.intervals] + points.tau * width[points.intervals]
        fractions.setdefault(points.constraint, []).extend(places)
    for constraint, excess in enumerate(errors.excess):
        # a crowded interval is split instead
        exceeded = np.flatnonzero((excess.values > tolerance) & ~errors.crowded)
        if exceeded.size:
            tau = np.clip(excess.tau[exceeded][:, None] + _AROUND, 0.0, 1.0)
            places = (breakpoints[exceeded][:, None] + tau * width[exceeded][:, None]).ravel()
            fractions.setdefault(constraint, []).extend(places)
        # the parts of an interval that is cut have no points of their own where they begin
        cut = exceeded[errors.coarse[exceeded]]
        if jumping[constraint] and cut.size:
            holders = np.searchsorted(breakpoints, refined.breakpoints, side="right") - 1
            fractions[constraint].extend(refined.breakpoints[np.isin(holders, cut)])

    return tuple(
        _points_at(constraint, distinct(np.array(places)), refined)
        for constraint, places in fractions.items()
        if places
    )


def _points_at(constraint: int, fractions: Array, mesh: PhaseMesh) -> ExtraPoints:
    """Points of a mesh at fractions of the phase; one of several that lie on top of each other."""
    intervals = np.searchsorted(mesh.breakpoints, fractions, side="right") - 1
    intervals = np.clip(intervals, 0, mesh.intervals - 1)
    tau = (fractions - mesh.breakpoints[intervals]) / np.diff(mesh.breakpoints)[intervals]

    repeated = (np.diff(intervals) == 0) & (np.diff(tau) < _SAME_POINT)
    keep = np.concatenate([[True], ~repeated])
    return ExtraPoints(constraint, intervals[keep], np.clip(tau[keep], 0.0, 1.0))


def worthwhile_jumps(mesh: PhaseMesh, errors: PhaseErrors, tolerance: float) -> list[Jump]:
    """Jumps whose place matters for the objective.

    A switch may have to go to either side of the breakpoint that holds it, so that what is gained
    beside it counts, too. Not where another jump is inside an interval there: that one makes the
    controls on both sides of it what they are.
    """
    points = mesh.breakpoints
    at = np.array([[jump.at] for jump in errors.jumps]).reshape(-1, 1)
    inside = (points[:-1] + ROUND_OFF < at) & (at < points[1:] - ROUND_OFF)
    beside = (points[:-1] - ROUND_OFF < at) & (at < points[1:] + ROUND_OFF) & ~inside

    found = []
    for jump, sides in zip(errors.jumps, beside, strict=True):
        around = (points[1:] > jump.first) & (points[:-1] < jump.last)
        much = errors.switching[around].max(initial=0.0) >= 0.5 * tolerance
        alone = not inside[:, sides].any()
        if much or (alone and errors.gain[sides].max(initial=0.0) > tolerance):
            found.append(jump)
    return found


def _worthwhile_degree(last: SolvedMesh, index: int) -> int:
    """The degree beyond which shorter intervals of a phase are cheaper than a higher degree."""
    problem, phase = last.iterate.problem, last.iterate.problem.phases[index]
    unknowns = len(phase.states) + len(problem.algebraics[phase.name])
    return max(_ANYWHERE, _WORTHWHILE // unknowns)


def _wrongly_held(last: SolvedMesh, index: int, errors: PhaseErrors) -> Flags:
    """Whether a switch at a fixed inner breakpoint should be elsewhere, (N - 1,)."""
    # costates of a rough solve are rough, too
    if not last.tight or not errors.displaced.any():
        return np.zeros(errors.displaced.size, dtype=bool)
    # multipliers are not unique beside any of them: another one may be displaced next time
    return errors.displaced | held_switches(last.iterate, index, errors.jumps)


def _without_errors_at(errors: PhaseErrors, motion: PhaseTrajectory, places: Array) -> PhaseErrors:
    """The errors, none of dynamics and controls in the intervals that hold given fractions."""
    held = np.clip(np.searchsorted(motion.fractions, places) - 1, 0, motion.intervals - 1)
    dynamics, gain = errors.dynamics.copy(), errors.gain.copy()
    dynamics[held], gain[held] = 0.0, 0.0
    return replace(errors, dynamics=dynamics, gain=gain)


def equal_phases(a: PhaseMesh, b: PhaseMesh) -> bool:
    """Whether two meshes of a phase have the same intervals, and move the same breakpoints."""
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
