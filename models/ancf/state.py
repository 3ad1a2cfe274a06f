"""Node coordinates and velocities of a chain, and where a chain starts.

Symbols: q node coordinates (size,) `[r_x, r_y, r'_x, r'_y]` a node (3), v their rates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from models.ancf.chain import Chain
from models.arrays import Array
from models.errors import require


@dataclass(frozen=True, eq=False)
class NodalState:
    """Configuration and velocity of a chain.

    Attributes
    ----------
    q : (size,)
        Node coordinates of all links, `[r_x, r_y, r'_x, r'_y]` a node (3) [m, -].
    v : (size,)
        Their rates [m/s, 1/s].
    """

    q: Array
    v: Array


def posed(chain: Chain, angles: Sequence[float] | None = None) -> NodalState:
    """Undeformed chain at rest with the given joint angles [rad], the root's from the x axis.

    Raises
    ------
    ModelError
        If the number of angles is not the number of links.
    """
    angles = [0.0] * len(chain.links) if angles is None else list(angles)
    require(
        len(angles) == len(chain.links),
        f"posed: {len(angles)} angles for {len(chain.links)} links; give one a joint.",
    )

    # from the root outward, each link along its heading, the sum of the joint angles so far
    nodes, start = [], np.zeros(2)
    for link, heading in zip(chain.links, np.cumsum(angles), strict=True):
        axis = np.array([np.cos(heading), np.sin(heading)])
        for distance in np.linspace(0.0, link.length, chain.nodes):
            nodes.append(np.concatenate((start + distance * axis, axis)))
        start = start + link.length * axis
    return NodalState(np.concatenate(nodes), np.zeros(chain.size))
