"""Breakpoints where a motion crosses a kink of its dynamics or integrands.

The breakpoint is fixed, at the crossing that the last motion had. On each side of it the expression
is that of the side, also a little beyond the kink, so that the program is smooth: a collocation
point that is on the kink itself would be on either side by turns, and the solver would come to no
end.

An error of the place moves the crossing by a part of it, so that both come nearer to each other
from mesh to mesh.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ocp.arrays import Array, Flags
from ocp.estimates.kink_crossings import NEAR_WHILE_LOOSE, KinkCrossings
from ocp.mesh.mesh import SAME_POINT, PhaseMesh
from ocp.refinement.solved_mesh import SolvedMesh

# Crossings or jumps by intervals of a mesh, and how many at least, beyond which it does not resolve
# them
TOO_MANY = 0.3
MANY = 16

# Meshes after which the farthest crossing has to have come as near as this to its breakpoint
_PATIENCE = 4
_FALLING = 0.5

# Times its distance from its breakpoint, by which a crossing may be off the next one.
_REACH = 10.0

# Of the interval that holds a crossing: a breakpoint this close to a new one was that of the same
# crossing on the mesh before, or would leave an interval too narrow for anything.
_REPLACED = 0.1


@dataclass(frozen=True, eq=False, repr=False)
class KinkBreakpoints:
    """A mesh with breakpoints at crossings of kinks.

    Attributes
    ----------
    mesh : PhaseMesh
    crossings : KinkCrossings
        Each at its breakpoint.
    moved : (m,)
        Whether each was on no breakpoint. The errors of the interval that held it are those of the
        kink.
    """

    mesh: PhaseMesh
    crossings: KinkCrossings
    moved: Flags


def crossings_to_meet(solved: Sequence[SolvedMesh], *, is_motion: bool) -> list[KinkCrossings]:
    """The crossings of each phase of the last mesh, those left out that cannot be met.

    Parameters
    ----------
    is_motion : bool
        Whether the last mesh holds the dynamics well enough to say where kinks are crossed.
    """
    found = []
    for index, phase in enumerate(solved[-1].iterate.mesh.phases):
        history = [each.errors.phases[index].crossings for each in solved]
        met = is_motion and are_met(history, phase.intervals)
        found.append(history[-1] if met else history[-1].none())
    return found


def are_met(history: Sequence[KinkCrossings], intervals: int) -> bool:
    """Whether breakpoints can follow the crossings of the last motion.

    Not where a mesh has so many that it does not resolve the motion, nor where breakpoints have
    followed them over some meshes and came no nearer.

    Parameters
    ----------
    history : sequence of KinkCrossings
        Of a phase, on each solved mesh.
    intervals : int
        Of the last one.
    """
    if history[-1].count > max(MANY, TOO_MANY * intervals):
        return False
    off = np.array([crossings.farthest for crossings in history])
    then, now = off[: -_PATIENCE or None], off[_PATIENCE:]
    return not bool(np.any((now > NEAR_WHILE_LOOSE) & (now > _FALLING * then[: now.size])))


def with_crossings(
    mesh: PhaseMesh, crossings: KinkCrossings, known: Array, near: float
) -> KinkBreakpoints:
    """A mesh with a breakpoint at each crossing of the last motion.

    Parameters
    ----------
    mesh : PhaseMesh
        That of the last motion, maybe with other breakpoints for other reasons.
    known : (n,)
        Known instants, as fractions of the phase, whose breakpoints stay.
    near : float
        Of the phase, within which a breakpoint is at a crossing.
    """
    before = mesh.breakpoints
    if not crossings.count:
        return KinkBreakpoints(mesh, crossings, np.empty(0, dtype=bool))
    nearest = before[np.abs(crossings.places[:, None] - before).argmin(axis=1)]
    moved = np.abs(crossings.places - nearest) > near
    places = np.clip(crossings.places, near, 1.0 - near)
    places = np.where(moved, places, nearest)
    if not moved.any():
        return KinkBreakpoints(mesh, replace(crossings, places=places), moved)

    # what is so near that it serves for nothing else goes
    wanted = places[moved]
    holders = np.clip(np.searchsorted(before, wanted) - 1, 0, mesh.intervals - 1)
    close = np.abs(before[:, None] - wanted) < _REPLACED * np.diff(before)[holders]
    goes = close.any(axis=1)
    stays = np.abs(before[:, None] - known).min(axis=1, initial=np.inf) <= SAME_POINT
    stays[[0, -1, *mesh.movable]] = True
    stays |= np.isin(before, nearest[~moved])

    points = before[stays | ~goes]
    for place in np.sort(wanted):
        if np.abs(points - place).min() > near:
            points = np.sort(np.append(points, place))
    centres = 0.5 * (points[:-1] + points[1:])
    parents = np.clip(np.searchsorted(before, centres) - 1, 0, mesh.intervals - 1)
    movable = tuple(int(np.searchsorted(points, before[i])) for i in mesh.movable)
    refined = PhaseMesh(points, mesh.degrees[parents], movable)
    return KinkBreakpoints(refined, replace(crossings, places=places), moved)


def with_sides(
    mesh: PhaseMesh, crossings: KinkCrossings, near: float, reach: Array | None = None
) -> PhaseMesh:
    """The mesh with the sides of kinks given in the intervals beside their breakpoints.

    On the next mesh a crossing may be in a further interval, where these are narrow. So sides are
    given as far as it may move, and at most half-way to the next crossing of the kink. No side is
    given in an interval that the motion leaves through another crossing of the kink.

    Parameters
    ----------
    crossings : KinkCrossings
        Each at its breakpoint, if it has one.
    near : float
        Of the phase, within which a breakpoint is at a crossing.
    reach : (m,), optional
        How far each crossing may move, as a fraction of the phase; some times the distance that it
        had from the nearest breakpoint if not given.
    """
    sides = np.zeros((mesh.intervals, crossings.kinks), dtype=np.int64)
    begin, end = mesh.breakpoints[:-1], mesh.breakpoints[1:]
    reach = _REACH * crossings.off if reach is None else reach
    for (place, surface, behind), far in zip(crossings.each(), reach, strict=True):
        at = int(np.abs(mesh.breakpoints - place).argmin())
        if 0 < at < mesh.intervals and abs(mesh.breakpoints[at] - place) <= near:
            low, high = _half_way(crossings.places[crossings.surfaces == surface], place)
            before = (end > max(place - far, low)) & (begin >= low) & (end <= place + near)
            after = (begin < min(place + far, high)) & (end <= high) & (begin >= place - near)
            sides[before, surface], sides[after, surface] = -behind, behind
            sides[at - 1, surface], sides[at, surface] = -behind, behind
    for place, surface, _ in crossings.each():
        if np.abs(mesh.breakpoints - place).min() > near:
            sides[np.searchsorted(mesh.breakpoints, place) - 1, surface] = 0
    return replace(mesh, sides=sides if sides.any() else None)


def _half_way(places: Array, place: float) -> tuple[float, float]:
    """Half-way to the crossings before and behind one, or the ends of the phase."""
    before, behind = places[places < place], places[places > place]
    low = 0.5 * (before.max() + place) if before.size else 0.0
    high = 0.5 * (behind.min() + place) if behind.size else 1.0
    return float(low), float(high)
