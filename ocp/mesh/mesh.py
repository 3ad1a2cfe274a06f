"""Meshes: where the intervals of a phase begin, their degrees, and which breakpoints may move."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ocp.arrays import Array, Flags, Integers
from ocp.errors import StatementError

# Of the phase: breakpoints closer than this are one.
SAME_POINT = 1e-9

# Of an interval: the middles of equal parts, where a motion is looked at off the ends. One that
# begins at rest has a speed of zero there, whose sign is neither.
_PARTS = 8
MIDPOINTS = (np.arange(_PARTS) + 0.5) / _PARTS

# Of an interval: its points are moved inwards by this part, so that one at a breakpoint belongs to
# its own interval and not to a neighbour, where controls and costates may jump.
_INSIDE = 1e-9


@dataclass(frozen=True, eq=False, repr=False)
class PhaseMesh:
    """Mesh of one phase.

    Attributes
    ----------
    breakpoints : (N + 1,) fractions of the phase, from 0 to 1.
    degrees : (N,) collocation points of each interval.
    movable : (m,) indices of inner breakpoints that the optimiser may move between their
        neighbours.
    longest : times its width on this mesh that an interval with a movable end may grow to.
    sides : (N, k) sides on which the expressions of an interval are, of each kink that the motion
        may cross (`ocp.problem.kinks.crossable_kinks`): 1 or -1, and 0 where that is left
        open. None where it is left open everywhere.
    intervals : number of intervals N.
    moving : (N,) whether an interval has a movable end.

    Raises
    ------
    StatementError
        When the breakpoints do not increase from 0 to 1, or one that is no inner one may move.
    """

    breakpoints: Array
    degrees: Integers
    movable: tuple[int, ...] = ()
    longest: float = np.inf
    sides: Integers | None = None
    intervals: int = field(init=False, repr=False)
    moving: Flags = field(init=False, repr=False)

    def __repr__(self) -> str:
        lowest, highest = int(self.degrees.min()), int(self.degrees.max())
        degree = f"{lowest}" if lowest == highest else f"{lowest} to {highest}"
        return f"PhaseMesh({self.intervals} intervals of degree {degree})"

    def __post_init__(self) -> None:
        points = np.asarray(self.breakpoints, dtype=float)
        degrees = np.broadcast_to(np.asarray(self.degrees, dtype=np.int64), (len(points) - 1,))
        object.__setattr__(self, "breakpoints", points)
        object.__setattr__(self, "intervals", len(points) - 1)
        object.__setattr__(self, "degrees", degrees)
        if len(points) < 2 or points[0] != 0.0 or points[-1] != 1.0:
            raise StatementError("the breakpoints of a mesh run from 0 to 1, both included")
        if not np.all(np.diff(points) > 0):
            raise StatementError("the breakpoints of a mesh must increase; remove the repeated one")
        if any(not 0 < i < self.intervals for i in self.movable):
            raise StatementError(
                f"only inner breakpoints (1 to {self.intervals - 1}) can move, got {self.movable}"
            )
        free = np.zeros(len(points), dtype=bool)
        free[list(self.movable)] = True
        object.__setattr__(self, "moving", free[:-1] | free[1:])

    def frozen(self) -> PhaseMesh:
        """The same mesh without movable breakpoints."""
        return replace(self, movable=())

    def freed(self, longest: float = np.inf) -> PhaseMesh:
        """The same mesh with all inner breakpoints movable."""
        return replace(self, movable=tuple(range(1, self.intervals)), longest=longest)


@dataclass(frozen=True, eq=False, repr=False)
class ExtraPoints:
    """Points between the collocation points at which a continuous constraint is imposed too.

    Attributes
    ----------
    constraint : index into the phase's continuous constraints.
    intervals : (m,) intervals.
    tau : (m,) local times.
    """

    constraint: int
    intervals: Integers
    tau: Array


@dataclass(frozen=True, eq=False, repr=False)
class Mesh:
    """Meshes of all phases, with the extra points of their continuous constraints.

    Attributes
    ----------
    phases : tuple of PhaseMesh
        One for each phase, in the order of the problem.
    extra : tuple of tuple of ExtraPoints
        By phase and continuous constraint: where it is imposed beside the collocation points.
    back_off : tuple of mapping of int to (N,)
        By phase and number of a continuous constraint: how far inside its limits its points keep in
        each interval, so that it holds between them [unit of the constraint].
    """

    phases: tuple[PhaseMesh, ...]
    extra: tuple[tuple[ExtraPoints, ...], ...] = ()
    back_off: tuple[Mapping[int, Array], ...] = ()
    intervals: int = field(init=False, repr=False)

    def __repr__(self) -> str:
        return f"Mesh({', '.join(str(phase) for phase in self.phases)})"

    def __post_init__(self) -> None:
        if not self.extra:
            object.__setattr__(self, "extra", ((),) * len(self.phases))
        if not self.back_off:
            object.__setattr__(self, "back_off", ({},) * len(self.phases))
        object.__setattr__(self, "intervals", sum(mesh.intervals for mesh in self.phases))

    def frozen(self) -> Mesh:
        """The same mesh without movable breakpoints."""
        return replace(self, phases=tuple(phase.frozen() for phase in self.phases))

    def freed(self, longest: float = np.inf) -> Mesh:
        """The same mesh with all inner breakpoints movable."""
        return replace(self, phases=tuple(phase.freed(longest) for phase in self.phases))


def uniform(intervals: int, degree: int) -> PhaseMesh:
    """A mesh of equal intervals.

    Raises
    ------
    StatementError
        When the number of intervals is not whole, or less than 1.
    """
    if intervals < 1 or int(intervals) != intervals:
        raise StatementError(f"the number of intervals of a mesh is {intervals!r}; give 1 or more")
    return PhaseMesh(np.linspace(0.0, 1.0, int(intervals) + 1), np.array([degree]))


def with_points(mesh: PhaseMesh, fractions: Array, closest: float = SAME_POINT) -> PhaseMesh:
    """The mesh with further breakpoints; intervals that are cut keep their degree."""
    near = np.abs(mesh.breakpoints[:, None] - np.asarray(fractions)[None, :]).min(axis=0)
    added = distinct(np.asarray(fractions)[near > closest])
    added = added[np.append(True, np.diff(added) > closest)[: added.size]]
    points = np.sort(np.concatenate([mesh.breakpoints, added]))
    parents = np.searchsorted(mesh.breakpoints, points[:-1], side="right") - 1
    kept = tuple(int(np.searchsorted(points, mesh.breakpoints[i])) for i in mesh.movable)
    return PhaseMesh(points, mesh.degrees[parents], kept)


def bisected(mesh: Mesh, most_intervals: int) -> Mesh | None:
    """Every interval cut in two, extra points carried over; None if that is too many."""
    if 2 * mesh.intervals > most_intervals:
        return None
    return replace(cut_in_two(mesh, 0.5), back_off=())


def cut_in_two(mesh: Mesh, share: float) -> Mesh:
    """Every interval cut where its first part is this share, extra points and back-offs kept."""
    phases, extras, back_offs = [], [], []
    for phase, extra, back_off in zip(mesh.phases, mesh.extra, mesh.back_off, strict=True):
        cuts = phase.breakpoints[:-1] + share * np.diff(phase.breakpoints)
        phases.append(with_points(phase, cuts, closest=0.0))
        extras.append(tuple(_of_parts(points, share) for points in extra))
        back_offs.append({number: np.repeat(by, 2) for number, by in back_off.items()})
    return Mesh(tuple(phases), tuple(extras), tuple(back_offs))


def _of_parts(points: ExtraPoints, share: float) -> ExtraPoints:
    """The same points on a mesh whose intervals were all cut in two."""
    right = points.tau >= share
    intervals = 2 * points.intervals + right
    tau = np.where(right, (points.tau - share) / (1.0 - share), points.tau / share)
    return ExtraPoints(points.constraint, intervals, tau)


def same_intervals(a: PhaseMesh, b: PhaseMesh) -> bool:
    """Whether two meshes of a phase have the same breakpoints and degrees."""
    return np.array_equal(a.breakpoints, b.breakpoints) and np.array_equal(a.degrees, b.degrees)


def inside_intervals(breakpoints: Array, intervals: Integers, tau: Array) -> Array:
    """Fractions of the phase at local times in intervals, moved a little inwards.

    Parameters
    ----------
    breakpoints : (N + 1,)
        As fractions of the phase.
    intervals, tau : arrays that broadcast to one shape
        Interval and local time of each point.
    """
    inner = 0.5 + (tau - 0.5) * (1.0 - _INSIDE)
    return np.asarray(breakpoints[intervals] + inner * np.diff(breakpoints)[intervals])


def distinct(values: NDArray[Any]) -> NDArray[Any]:
    """The distinct values in order.

    With their counts, because `numpy.unique` alone imports the masked arrays, for which a solve
    has no other use.
    """
    return np.unique(values, return_counts=True)[0]
