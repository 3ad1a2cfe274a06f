"""Constraints Phi(q, t) = 0 of (12) over all node coordinates, with the terms of (13).

Rows: the pinned root (2), each hinge (2), each locked or driven joint (1):
Phi = u x b with u = R(phi) a, the slopes a and b on either side.

Symbols: m rows, n node coordinates, s columns (instants).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from models.ancf.chain import Chain
from models.ancf.joints import Driven, Joint, Locked, rotate, slope_pair
from models.ancf.joints.elimination import SlopeElimination, SlopeTie
from models.arrays import Array


class Constraints:
    """Values, rates and Jacobian of the constraints of a chain with its joints."""

    def __init__(self, chain: Chain, joints: Sequence[Joint]) -> None:
        rows = []
        for k in range(len(chain.links)):
            for axis in (0, 1):
                row = np.zeros(chain.size)
                row[chain.slots(k, 0)[axis]] = 1.0
                if k:
                    row[chain.slots(k - 1, -1)[axis]] = -1.0
                if k or chain.pinned:
                    rows.append(row)
        self.linear = np.array(rows).reshape(-1, chain.size)
        self.ties: list[SlopeTie] = []
        for k, joint in enumerate(joints):
            if isinstance(joint, Locked | Driven):
                before, after = slope_pair(chain, k)
                a = None if before is None else (before.start, before.start + 1)
                self.ties.append(SlopeTie(a, (after.start, after.start + 1), joint))
        self.rows = len(self.linear) + len(self.ties)

    def value(self, t: Array, q: Array) -> Array:
        """Phi, (m, s)."""
        return np.vstack([self.linear @ q, *(self._tie(tie, t, q)[0] for tie in self.ties)])

    def acceleration_bias(self, t: Array, q: Array, v: Array, alpha: float, beta: float) -> Array:
        """Gamma of (14), stabilised after Baumgarte, (m, s)."""
        rows = [-2 * alpha * (self.linear @ v) - beta**2 * (self.linear @ q)]
        for tie in self.ties:
            value, rate, second = self._tie(tie, t, q, v)
            rows.append(-second - 2 * alpha * rate - beta**2 * value)
        return np.vstack(rows)

    def jacobian(self, t: float, q: Array) -> Array:
        """Phi_q at one instant, (m, n)."""
        out = np.zeros((self.rows, q.size))
        out[: len(self.linear)] = self.linear
        for row, tie in zip(out[len(self.linear) :], self.ties, strict=True):
            for slots, part in self._gradients(tie, np.full(1, t), q[:, None]):
                row[list(slots)] = part[:, 0]
        return out

    def times(self, t: Array, q: Array, a: Array) -> Array:
        """Phi_q a, (m, s)."""
        rows = [self.linear @ a]
        for tie in self.ties:
            parts = self._gradients(tie, t, q)
            rows.append(sum((part * a[list(slots)]).sum(axis=0) for slots, part in parts))
        return np.vstack(rows)

    def force(self, t: Array, q: Array, multipliers: Array) -> Array:
        """Phi_q^T lambda, (n, s)."""
        linear = len(self.linear)
        out = self.linear.T @ multipliers[:linear]
        for tie, multiplier in zip(self.ties, multipliers[linear:], strict=True):
            for slots, part in self._gradients(tie, t, q):
                out[list(slots)] += part * multiplier
        return np.asarray(out)

    @staticmethod
    def _tie(tie: SlopeTie, t: Array, q: Array, v: Array | None = None) -> tuple[Array, ...]:
        """Phi, its rate and its second rate without the accelerations, (1, s) each."""
        rest = np.zeros_like(q)
        moving = rest if v is None else v
        u, ud, udd = SlopeElimination.direction(tie, *tie.joint.law(t), [q, moving, rest])
        b, bd = q[list(tie.b)], moving[list(tie.b)]
        value, rate = _cross(u, b), _cross(ud, b) + _cross(u, bd)
        return value[None], rate[None], (_cross(udd, b) + 2 * _cross(ud, bd))[None]

    @staticmethod
    def _gradients(tie: SlopeTie, t: Array, q: Array) -> list[tuple[tuple[int, int], Array]]:
        phi, b = tie.joint.law(t)[0], q[list(tie.b)]
        if tie.a is None:
            return [(tie.b, np.stack((-np.sin(phi), np.cos(phi))))]
        u = rotate(phi, q[list(tie.a)])
        across = rotate(-phi, np.stack((b[1], -b[0])))
        return [(tie.b, np.stack((-u[1], u[0]))), (tie.a, across)]


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[0] * b[1] - a[1] * b[0])
