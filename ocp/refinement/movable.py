"""What movable breakpoints may cost, in iterations of the solver.

They make a program less convex. Where many limits act that can cost more than switches in their
places gain.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from ocp.mesh.mesh import Mesh

if TYPE_CHECKING:
    from ocp.refinement.mesh_iteration import SolvedMesh

# Iterations that any mesh may take, and times as many as meshes that stay still have taken, from
# which on movable breakpoints are in the way.
_DOZENS = 50
_FAR_MORE = 2


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
    still = [each.iterations for each in solved if not _moves(each.iterate.mesh)]
    return _FAR_MORE * max(_DOZENS, *still, 0)


def hindered(solved: Sequence[SolvedMesh]) -> bool:
    """Whether movable breakpoints have cost far more iterations than meshes that stay still."""
    still, moving = [_DOZENS], [0]
    for each in solved:
        (moving if _moves(each.iterate.mesh) else still).append(each.iterations)
    return max(moving) > _FAR_MORE * max(still)


def _moves(mesh: Mesh) -> bool:
    """Whether a breakpoint of a mesh is movable."""
    return any(phase.movable for phase in mesh.phases)
