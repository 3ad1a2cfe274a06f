"""Breakpoints where other controls of a motion's own valley are better for a short time.

Where the Hamiltonian has one valley only, the best controls are neighbours, and a program finds
them at its points. Where they are better between two points only, it cannot: an interval has one
polynomial. With breakpoints on both sides of such a time it can.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ocp.estimates.other_controls.promise import OtherControls
from ocp.mesh.mesh import Mesh, with_points


def mesh_with_points_there(mesh: Mesh, found: Sequence[OtherControls], names: list[str]) -> Mesh:
    """A mesh with breakpoints where other controls begin and end to be better, and between.

    Without added points and back-offs: the intervals are others.

    Parameters
    ----------
    names : list of str
        Of the phases of the mesh.
    """
    phases = list(mesh.phases)
    for other in found:
        better = np.concatenate([[False], other.less > 0.0, [False]])
        known = np.concatenate([[0.0], other.fractions, [1.0]])
        edges = np.flatnonzero(better[1:] != better[:-1])
        # halfway between a point where they are better and the next one
        ends = 0.5 * (known[edges] + known[edges + 1])
        middles = 0.5 * (ends[::2] + ends[1::2])
        index = names.index(other.phase)
        inner = np.concatenate([ends, middles])
        phases[index] = with_points(phases[index], inner[(inner > 0.0) & (inner < 1.0)])
    return Mesh(tuple(phases))
