"""When movable breakpoints are in the way.

They make a program less convex. Where many limits act that can cost more iterations than switches
in their places gain. They may also move to where limits leak, mesh after mesh, because that pays.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

from ocp.accuracy import Accuracy
from ocp.mesh.mesh import Mesh
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
    """Iterations after which a mesh is given up; infinite where none of its breakpoints moves.

    Parameters
    ----------
    solved : sequence of SolvedMesh
        Until then. Without any there is nothing to go back to, and nothing to compare with.
    mesh : Mesh
        About to be solved.
    """
    if not solved or not _moves(mesh):
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
    """Whether each mesh has a better objective than the one before, and no limit leaks.

    A switch that is far from its time gets there through several intervals.
    """
    if any(each.leak > accuracy.path for each in row):
        return False
    sense, size = row[-1].iterate.problem.sense, row[-1].iterate.objective_size
    objectives = [sense * each.iterate.objective for each in row]
    gained = [old - new for old, new in itertools.pairwise(objectives)]
    return min(gained) >= _STEP * accuracy.objective * size


def _moves(mesh: Mesh) -> bool:
    """Whether a breakpoint of a mesh is movable."""
    return any(phase.movable for phase in mesh.phases)
