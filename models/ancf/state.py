"""Node coordinates and velocities of a chain: where they start, whether they fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from models.ancf.chain import Chain
from models.ancf.joints import Driven, Joint, Locked, joint_angles
from models.arrays import Array
from models.errors import ModelError


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
    if len(angles) != len(chain.links):
        raise ModelError(
            f"posed: {len(angles)} angles for {len(chain.links)} links; give one a joint."
        )
    q, start = [], np.zeros(2)
    for link, heading in zip(chain.links, np.cumsum(angles), strict=True):
        axis = np.array([np.cos(heading), np.sin(heading)])
        for s in np.linspace(0.0, link.length, chain.nodes):
            q.append(np.concatenate((start + s * axis, axis)))
        start = start + link.length * axis
    return NodalState(np.concatenate(q), np.zeros(chain.size))


def check_start(
    chain: Chain, joints: Sequence[Joint], given: NodalState, kept: NodalState, t: float
) -> None:
    """Raise ModelError unless the given state is the one the constraints keep."""
    for k, angle in enumerate(joint_angles(chain, given.q[:, None])[:, 0]):
        joint = joints[k]
        if isinstance(joint, Locked | Driven):
            wanted = float(joint.law(np.array([t]))[0][0])
            miss = np.angle(np.exp(1j * (angle - wanted)))
            if abs(miss) > 1e-9:
                raise ModelError(
                    f"simulate: joint {k} starts at {angle:.9g} rad but its {type(joint).__name__} "
                    f"law asks for {wanted:.9g} rad; start from a state at that angle."
                )
    gap = float(np.abs(given.q - kept.q).max())
    if gap > 1e-8:
        raise ModelError(
            f"simulate: the initial coordinates leave the hinges or the root open by {gap:.2e} m; "
            "start from posed(...) or from a simulated state."
        )
    jump = float(np.abs(given.v - kept.v).max())
    if jump > 1e-7 * max(1.0, float(np.abs(given.v).max())):
        raise ModelError(
            f"simulate: the initial velocities break the constraints by {jump:.2e} m/s; "
            "project them with engage(...) first."
        )
