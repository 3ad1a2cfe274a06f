"""Angles of the joints and their rates, from the slopes on either side.

The joint angle phi is counter-clockwise from the end slope of the link before (the x axis at
the root) to the start slope of the link after [rad].
"""

from __future__ import annotations

import numpy as np

from models.ancf.chain import Chain
from models.arrays import Array


def slope_pair(chain: Chain, joint: int) -> tuple[slice | None, slice]:
    """Places in the node vector of the slopes before (None at the root) and after a joint."""
    after = chain.slots(joint, 0)[2]
    before = chain.slots(joint - 1, -1)[2] if joint else None
    return None if before is None else slice(before, before + 2), slice(after, after + 2)


def rotate(phi: Array, a: Array) -> Array:
    """R(phi) a for vectors (2, m)."""
    c, s = np.cos(phi), np.sin(phi)
    return np.array((c * a[0] - s * a[1], s * a[0] + c * a[1]))


def quarter(a: Array) -> Array:
    """Counter-clockwise quarter turn of vectors (2, m)."""
    return np.array((-a[1], a[0]))


def joint_angles(chain: Chain, q: Array) -> Array:
    """Joint angles phi in (-pi, pi], (L, m), of node vectors (size, m) [rad]."""
    angles = []
    for k in range(len(chain.links)):
        before, after = slope_pair(chain, k)
        b = q[after]
        a = np.stack((np.ones_like(b[0]), np.zeros_like(b[0]))) if before is None else q[before]
        angles.append(np.arctan2(a[0] * b[1] - a[1] * b[0], (a * b).sum(axis=0)))
    return np.array(angles)


def joint_rates(chain: Chain, q: Array, v: Array) -> Array:
    """Rates of the joint angles, (L, m) [rad/s]."""
    rates = []
    for k in range(len(chain.links)):
        before, after = slope_pair(chain, k)
        spin = (quarter(q[after]) * v[after]).sum(axis=0) / (q[after] ** 2).sum(axis=0)
        if before is not None:
            spin = spin - (quarter(q[before]) * v[before]).sum(axis=0) / (q[before] ** 2).sum(0)
        rates.append(spin)
    return np.array(rates)
