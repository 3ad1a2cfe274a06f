"""Angles of the joints and their rates, from the slopes on either side.

The joint angle phi is counter-clockwise from the end slope of the link before (the x axis at
the root) to the start slope of the link after [rad].

Symbols: a, b slopes before and after a joint (2, m) [-]; L links.
"""

from __future__ import annotations

import numpy as np

from models.ancf.chain import Chain
from models.arrays import Array, Places


def slope_pair(
    chain: Chain, joint: int, place: Places | None = None
) -> tuple[list[int] | None, list[int]]:
    """Places of the slopes before (None at the root) and after a joint, two each.

    They are places in the node vector or, with the `place` of an assembly, in its coordinates.
    """
    after = list(chain.slots(joint, 0)[2:])
    before = list(chain.slots(joint - 1, -1)[2:]) if joint else None

    if place is None:
        return before, after
    return None if before is None else place[before].tolist(), place[after].tolist()


def rotate(phi: Array, a: Array) -> Array:
    """R(phi) a for vectors (2, m)."""
    c, s = np.cos(phi), np.sin(phi)
    return np.array((c * a[0] - s * a[1], s * a[0] + c * a[1]))


def quarter(a: Array) -> Array:
    """Counter-clockwise quarter turn of vectors (2, m)."""
    return np.array((-a[1], a[0]))


def cross(a: Array, b: Array) -> Array:
    """The component of a x b out of the plane, (m,), for vectors (2, m)."""
    return np.asarray(a[0] * b[1] - a[1] * b[0])


def joint_angles(chain: Chain, q: Array) -> Array:
    """Joint angles phi in (-pi, pi], (L, m), of node vectors (size, m) [rad]."""
    angles = []
    for joint in range(len(chain.links)):
        before, after = slope_pair(chain, joint)
        b = q[after]
        a = np.stack((np.ones_like(b[0]), np.zeros_like(b[0]))) if before is None else q[before]
        angles.append(np.arctan2(cross(a, b), (a * b).sum(axis=0)))
    return np.array(angles)


def joint_rates(chain: Chain, q: Array, v: Array) -> Array:
    """Rates of the joint angles, (L, m) [rad/s]."""
    rates = []
    for joint in range(len(chain.links)):
        before, after = slope_pair(chain, joint)
        rate = _turning_rate(q[after], v[after])
        if before is not None:
            rate = rate - _turning_rate(q[before], v[before])
        rates.append(rate)
    return np.array(rates)


def _turning_rate(slope: Array, rate: Array) -> Array:
    """Rate at which slopes (2, m) turn, (m,) [rad/s]; stretching them does not turn them."""
    return np.asarray((quarter(slope) * rate).sum(axis=0) / (slope**2).sum(axis=0))
