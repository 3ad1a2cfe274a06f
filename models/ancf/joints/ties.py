"""The tie b = g R(phi(t)) a: a slope that follows the one before it at the angle of a joint.

A locked or driven joint ties the slope b after it to the slope a before it (the x axis at the
root). The stretch g of b stays free. Both forms of the equations of motion are made of ties:
one adds the constraint R(phi) a x b = 0, the other eliminates it.

Symbols: a, b slopes (2, m) [-]; phi joint angle [rad]; u = R(phi) a the direction of b;
m columns (instants). A trailing d is a derivative by time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from models.ancf.chain import Chain
from models.ancf.joints.angles import cross, quarter, rotate, slope_pair
from models.ancf.joints.kinds import Driven, Joint, LastAsked, Locked
from models.arrays import Array, Places


@dataclass(frozen=True, eq=False)
class SlopeTie:
    """The two slopes at a locked or driven joint, and the law of the angle between them.

    Attributes
    ----------
    number : int
        Of the joint, 0 at the root.
    before : two int, or None
        Places of a in the coordinates; None for the x axis.
    after : two int
        Places of b.
    joint : Locked or Driven
    """

    number: int
    before: list[int] | None
    after: list[int]
    joint: Locked | Driven

    @cached_property
    def clamp(self) -> Array | None:
        """U (2, 1) of a locked root, which never changes; None of any other joint."""
        if self.before is not None or not isinstance(self.joint, Locked):
            return None
        return np.array([[np.cos(self.joint.angle)], [np.sin(self.joint.angle)]])

    @cached_property
    def law(self) -> LastAsked[tuple[Array, Array, Array]]:
        """Angle of the joint and its two derivatives at times (m,)."""
        return LastAsked(self.joint.law)

    @cached_property
    def held(self) -> Array | None:
        """R(phi) (2, 2) of a locked joint; None of a driven one."""
        if not isinstance(self.joint, Locked):
            return None
        c, s = np.cos(self.joint.angle), np.sin(self.joint.angle)
        return np.array([[c, -s], [s, c]])

    def turned(self, t: Array, a: Array) -> Array:
        """R(phi) a for vectors (2, m) at times (m,)."""
        return rotate(self.law(t)[0], a) if self.held is None else self.held @ a

    def turned_back(self, t: Array, b: Array) -> Array:
        """R(-phi) b for vectors (2, m) at times (m,)."""
        return rotate(-self.law(t)[0], b) if self.held is None else self.held.T @ b

    def slope_before(self, x: Array) -> Array:
        """The slope a, (2, m), of coordinates (n, m)."""
        if self.before is None:
            return np.array((np.ones(x.shape[1]), np.zeros(x.shape[1])))
        return x[self.before]

    def direction(self, t: Array, x: Array, xd: Array, xdd: Array) -> tuple[Array, Array, Array]:
        """U and its two derivatives by time, (2, m), along coordinates and rates (n, m)."""
        phi, w, dw = self.law(t)
        if self.before is None:
            u = np.array((np.cos(phi), np.sin(phi)))
            n = quarter(u)
            return u, w * n, dw * n - w**2 * u

        # product rule on R(phi) a: ud and udd first hold the parts in which phi stands still
        u, ud, udd = (self.turned(t, y[self.before]) for y in (x, xd, xdd))
        if self.held is not None:
            return u, ud, udd
        n = quarter(u)
        return u, ud + w * n, udd + 2 * w * quarter(ud) + dw * n - w**2 * u

    def misalignment(self, t: Array, x: Array, xd: Array) -> tuple[Array, Array, Array]:
        """Phi = u x b, its rate, and its second rate but for the accelerations, (1, m) each."""
        u, ud, udd = self.direction(t, x, xd, np.zeros_like(x))
        b, bd = x[self.after], xd[self.after]
        value, rate = cross(u, b), cross(ud, b) + cross(u, bd)
        return value[None], rate[None], (cross(udd, b) + 2 * cross(ud, bd))[None]

    def gradients(self, t: Array, x: Array) -> list[tuple[list[int], Array]]:
        """Derivatives of Phi by the slopes: places and values (2, m), of b and, if any, of a."""
        phi, b = self.joint.law(t)[0], x[self.after]
        if self.before is None:
            return [(self.after, np.stack((-np.sin(phi), np.cos(phi))))]

        u = rotate(phi, x[self.before])
        by_before = rotate(-phi, np.stack((b[1], -b[0])))
        return [(self.after, np.stack((-u[1], u[0]))), (self.before, by_before)]


def slope_ties(
    chain: Chain, joints: Sequence[Joint], place: Places | None = None
) -> tuple[SlopeTie, ...]:
    """The ties of all locked and driven joints, from the root outward; see `slope_pair`."""
    return tuple(
        SlopeTie(k, *slope_pair(chain, k, place), joint)
        for k, joint in enumerate(joints)
        if isinstance(joint, Locked | Driven)
    )
