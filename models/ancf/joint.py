"""What is done at a hinge: left free, given a torque, locked, or driven along an angle.

The joint angle phi is counter-clockwise from the end slope of the link before (the x axis at
the root) to the start slope of the link after [rad]; a torque [N m] acts on the latter and
its opposite on the former.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from models.ancf.link import Chain
from models.errors import ModelError

Array = NDArray[np.float64]
Law = Callable[[Array], Array]


@dataclass(frozen=True)
class Free:
    """A hinge without torque."""

    breakpoints: tuple[float, ...] = ()


@dataclass(frozen=True)
class Torque:
    """A hinge with a given torque.

    Parameters
    ----------
    torque : callable
        Times (m,) [s] to torques (m,) [N m]; smooth between breakpoints.
    breakpoints : tuple of float
        Times at which it or a derivative jumps [s]; the integration restarts there.
    """

    torque: Law
    breakpoints: tuple[float, ...] = ()


@dataclass(frozen=True)
class Locked:
    """A hinge locked at an angle [rad]; at the root, a clamp."""

    angle: float
    breakpoints: tuple[float, ...] = ()

    def law(self, t: Array) -> tuple[Array, Array, Array]:
        """Angle, rate and acceleration."""
        return np.full_like(t, self.angle), np.zeros_like(t), np.zeros_like(t)


@dataclass(frozen=True)
class Driven:
    """A hinge that follows phi(t); the torque is the reaction.

    Parameters
    ----------
    angle, rate, acceleration : callable
        Times (m,) [s] to phi [rad] and its two derivatives [rad/s, rad/s^2].
    breakpoints : tuple of float
        Times at which the acceleration or a derivative of it jumps [s].
    """

    angle: Law
    rate: Law
    acceleration: Law
    breakpoints: tuple[float, ...] = ()

    def law(self, t: Array) -> tuple[Array, Array, Array]:
        """Angle, rate and acceleration."""
        return self.angle(t), self.rate(t), self.acceleration(t)


Joint = Free | Torque | Locked | Driven


def check_joints(chain: Chain, joints: Sequence[Joint]) -> tuple[Joint, ...]:
    """Raise ModelError unless there is one joint a link and a flying root is free."""
    if len(joints) != len(chain.links):
        raise ModelError(
            f"joints: {len(joints)} given for {len(chain.links)} links; give one a link, "
            "the root first."
        )
    if not chain.pinned and not isinstance(joints[0], Free):
        raise ModelError("joints: the root flies but is not Free; pin the chain to act on it.")
    return tuple(joints)


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
