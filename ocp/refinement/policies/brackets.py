"""Brackets: breakpoints around the jumps of controls, in which another one can move onto a jump.

In a bracket of fixed breakpoints a movable one cannot wander, nor drag others along. Where the jump
may lie anywhere in an interval, that interval is the bracket.

Movable breakpoints may be in the way. They make a program less convex. Where many limits act that
can cost more iterations than switches in their places gain. They may also move to where limits
are exceeded between the points, mesh after mesh, because that pays.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ocp.accuracy import Accuracy
from ocp.arrays import Array, Flags
from ocp.estimates.error_estimate import held_switches
from ocp.estimates.switch_detection import ROUND_OFF, Jump, control_jumps, jumps_at
from ocp.mesh.mesh import SAME_POINT, Mesh, PhaseMesh, distinct, same_intervals
from ocp.mesh.trajectory import PhaseTrajectory
from ocp.optimality.iterate import Iterate
from ocp.refinement.solved_mesh import SolvedMesh

# Movable breakpoints are in the way where a mesh takes more than these iterations, and this many
# times as many as any mesh without them. The first mesh starts from afar, and does not count.
_DOZENS = 50
_FAR_MORE = 2

# Meshes in a row after which what is open has to have fallen to this part of what it was.
_PATIENCE = 3
_FALLING = 0.5

# A switch is on the way to its time while each mesh improves the objective by this many times the
# tolerance on it.
_STEP = 10.0


def most_iterations(solved: Sequence[SolvedMesh], mesh: Mesh) -> float:
    """Iterations after which a mesh is given up; infinite where there is none to fall back on.

    There is one where breakpoints move, and where the mesh has the intervals of the last one, with
    more points or tighter limits.

    Parameters
    ----------
    solved : sequence of SolvedMesh
        Until then. Without any there is nothing to go back to, and nothing to compare with.
    mesh : Mesh
        About to be solved.
    """
    if not solved:
        return math.inf
    pairs = zip(mesh.phases, solved[-1].iterate.mesh.phases, strict=True)
    again = mesh is solved[-1].iterate.mesh
    only_points = not again and all(same_intervals(new, old) for new, old in pairs)
    if not (_moves(mesh) or only_points):
        return math.inf
    still, _ = _iterations(solved)
    return _FAR_MORE * still


def hindered(solved: Sequence[SolvedMesh], accuracy: Accuracy) -> bool:
    """Whether movable breakpoints have cost far more iterations than they gain, or led nowhere."""
    still, moving = _iterations(solved)
    return moving > _FAR_MORE * still or _led_nowhere(solved, accuracy)


def _iterations(solved: Sequence[SolvedMesh]) -> tuple[int, int]:
    """Most iterations of a fixed mesh, some dozens at least, and of one that moves."""
    still, moving = [_DOZENS], [0]
    for each in solved[1:]:
        (moving if _moves(each.iterate.mesh) else still).append(each.iterations)
    return max(still), max(moving)


def _led_nowhere(solved: Sequence[SolvedMesh], accuracy: Accuracy) -> bool:
    """Whether some meshes in a row, all with movable breakpoints, left open what was open."""
    for first in range(len(solved) - _PATIENCE + 1):
        row = solved[first : first + _PATIENCE]
        if not all(_moves(each.iterate.mesh) for each in row):
            continue
        before, after = (row[k].worst_in_tolerances(accuracy) for k in (0, -1))
        if after > max(1.0, _FALLING * before) and not _on_the_way(row, accuracy):
            return True
    return False


def _on_the_way(row: Sequence[SolvedMesh], accuracy: Accuracy) -> bool:
    """Whether each mesh has a better objective than the one before, and no limit is exceeded.

    A switch that is far from its time gets there through several intervals.
    """
    if any(each.excess > accuracy.path for each in row):
        return False
    sense, size = row[-1].iterate.problem.sense, row[-1].iterate.objective_size
    objectives = [sense * each.iterate.objective for each in row]
    gained = [old - new for old, new in itertools.pairwise(objectives)]
    return min(gained) >= _STEP * accuracy.objective * size


def _moves(mesh: Mesh) -> bool:
    """Whether a breakpoint of a mesh is movable."""
    return any(phase.movable for phase in mesh.phases)


# Half the width of a bracket as a part of the width within which the jump may lie: narrow enough
# that its ends need not move, wide enough that the optimum is inside.
_BRACKET = 0.15
# Of its width before: an interval this narrow is pressed together by a movable breakpoint.
_PRESSED = 0.03
# Of the phase: an interval this narrow is none beside a movable breakpoint, and none is cut to such
# widths for its controls or constraints.
NARROWEST = 1e-7
_NOWHERE = np.empty(0)


def with_brackets(
    mesh: PhaseMesh, bracketed: Sequence[Jump], move: bool, known: Array = _NOWHERE
) -> PhaseMesh | None:
    """The mesh with every jump in a bracket; None if there is nothing new.

    A bracket is a pair of breakpoints close on both sides of the located jump. With `move`, a
    breakpoint that the optimiser may move between them stands at the jump. A jump that may lie
    anywhere in an interval has that for its bracket then. A jump at an instant that is `known`
    (m,), as a fraction of the phase, needs no bracket: a breakpoint stands there.
    """
    points = mesh.breakpoints
    movable = {float(points[i]) for i in mesh.movable}
    new = False

    for jump in sorted(bracketed, key=lambda j: -j.size):
        followed = any(jump.first - ROUND_OFF <= p <= jump.last + ROUND_OFF for p in movable)
        if followed or not SAME_POINT < jump.at < 1 - SAME_POINT:
            continue
        if np.any(np.abs(known - jump.at) <= SAME_POINT):
            continue
        if move and _is_interval(points, jump):
            points = distinct(np.append(points, jump.at))
            movable.add(jump.at)
            new = True
            continue
        reach = _BRACKET * _uncertainty(points, jump)
        sides = np.array([jump.at - reach, jump.at + reach])
        sides = sides[(sides > 0.0) & (sides < 1.0)]

        close = np.abs(points - jump.at) < 1.5 * reach
        kept = np.abs(points[:, None] - known).min(axis=1, initial=np.inf) <= SAME_POINT
        replaced = close & ~kept & ~np.isin(points, [0.0, 1.0, *movable], assume_unique=True)
        if replaced.sum() >= 2 and not move:
            # it stands already; a bracket that follows a jump to and fro undoes splits
            continue
        middle = [jump.at] if move else []
        points = distinct(np.concatenate([points[~replaced], sides, middle]))
        movable.update(middle)
        new = True

    if not new:
        return None
    centres = 0.5 * (points[:-1] + points[1:])
    parents = np.searchsorted(mesh.breakpoints, centres) - 1
    parents = np.clip(parents, 0, mesh.intervals - 1)
    indices = tuple(int(np.searchsorted(points, p)) for p in sorted(movable))
    return PhaseMesh(points, mesh.degrees[parents], indices)


def _is_interval(points: Array, jump: Jump) -> bool:
    """Whether a jump may lie anywhere in one interval, and in no other."""
    k = int(np.clip(np.searchsorted(points, jump.at) - 1, 0, points.size - 2))
    off = max(abs(points[k] - jump.first), abs(points[k + 1] - jump.last))
    return bool(points[k] < jump.at < points[k + 1] and off <= SAME_POINT)


def _uncertainty(points: Array, jump: Jump) -> float:
    """Width within which a jump may lie: between its samples, at least a neighbouring interval."""
    k = int(np.clip(np.searchsorted(points, jump.at) - 1, 0, points.size - 2))
    near = np.diff(points)[max(k - 1, 0) : k + 2]
    return max(jump.last - jump.first, float(near.min()))


def with_movable_switches(iterate: Iterate) -> Mesh | None:
    """The mesh of a solved one whose breakpoints may move where a control jumps at them.

    Beside a jump at a fixed breakpoint the multipliers are not unique, and the gain by them means
    nothing. None if there is no such jump, or at known times only.
    """
    phases, none = list[PhaseMesh](), True
    for index, motion in enumerate(iterate.trajectory.phases):
        mesh = iterate.mesh.phases[index]
        jumps = control_jumps(motion, iterate.scales.signals)
        held = np.flatnonzero(held_switches(iterate, index, jumps)) + 1
        movable = tuple(sorted({*mesh.movable, *held.tolist()}))
        phases.append(replace(mesh, breakpoints=motion.fractions, movable=movable))
        none &= not held.size
    return None if none else replace(iterate.mesh, phases=tuple(phases))


def freed_at(mesh: PhaseMesh, fractions: Array) -> PhaseMesh:
    """The mesh whose inner breakpoints at some fractions of the phase (m,) may move, too."""
    off = np.abs(mesh.breakpoints[1:-1, None] - fractions).min(axis=1, initial=np.inf)
    freed = np.flatnonzero(off <= SAME_POINT) + 1
    if not freed.size:
        return mesh
    return replace(mesh, movable=tuple(sorted({*mesh.movable, *freed.tolist()})))


def settled(
    mesh: PhaseMesh, motion: PhaseTrajectory, known: Array = _NOWHERE
) -> tuple[PhaseMesh, bool]:
    """The mesh at the solved breakpoints, and whether a breakpoint wants to move on.

    A breakpoint that ran into a fixed neighbour takes its place, so that it can go further in the
    next mesh. Not so at an instant that is `known` (m,), as a fraction of the phase. An interval
    that vanished is dropped. A breakpoint without a jump stays put.
    """
    fractions = motion.fractions
    before, after = np.diff(mesh.breakpoints), np.diff(fractions)
    movable = {i for i in mesh.movable if jumps_at(motion, i)}
    last = mesh.intervals
    pinned = np.abs(fractions[:, None] - known).min(axis=1, initial=np.inf) <= SAME_POINT
    pinned[[0, -1]] = False

    fixed = ~pinned
    fixed[[0, -1, *mesh.movable]] = False
    gone: set[int] = set()
    blocked = False
    for k in np.flatnonzero(mesh.moving & (after < _PRESSED * before)):
        left, right = int(k), int(k) + 1
        if after[k] < NARROWEST:
            gone.add(right if right in movable and right < last else left)
            blocked = True
        elif pinned[left] or pinned[right]:
            continue
        elif left in movable and right not in mesh.movable and right < last:
            gone |= _in_the_way(fractions, left, 1, fixed)
            blocked = True
        elif right in movable and left not in mesh.movable and left > 0:
            gone |= _in_the_way(fractions, right, -1, fixed)
            blocked = True
        elif left in movable or right in movable:
            blocked = True

    kept = [i for i in range(last + 1) if i not in gone or i in (0, last)]
    indices = tuple(kept.index(i) for i in sorted(movable) if i in kept)
    return PhaseMesh(fractions[kept], mesh.degrees[np.array(kept[:-1])], indices), blocked


def _in_the_way(fractions: Array, number: int, side: int, fixed: Flags) -> set[int]:
    """Fixed breakpoints on one side of one that moves, nearer than its neighbour on the other.

    Narrow intervals beside a switch were made for where it was before. It would take a mesh for
    each of them to pass them one by one.

    Parameters
    ----------
    number : int
        Of the breakpoint.
    side : int
        1 for the right, -1 for the left.
    fixed : (N + 1,)
        Which breakpoints may be dropped.
    """
    room = abs(fractions[number] - fractions[number - side])
    passed = {number + side}
    k = number + 2 * side
    while fixed[k] and abs(fractions[k] - fractions[number]) < room:
        passed.add(k)
        k += side
    return passed
