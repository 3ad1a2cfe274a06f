"""Constraints Phi(q, t) = 0 of (12) over all node coordinates, with the terms of (13).

Rows: the pinned root (2), each hinge (2), each locked or driven joint (1):
Phi = u x b with u = R(phi) a, the slopes a and b on either side.

Symbols: m rows, n node coordinates, s columns (instants).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from models.ancf.chain import Chain
from models.ancf.joints.kinds import Joint
from models.ancf.joints.ties import slope_ties
from models.arrays import Array


class Constraints:
    """Values, rates and Jacobian of the constraints of a chain with its joints."""

    def __init__(self, chain: Chain, joints: Sequence[Joint]) -> None:
        self.linear = _closed_hinges(chain)
        self.ties = slope_ties(chain, joints)
        self.rows = len(self.linear) + len(self.ties)

    def value(self, t: Array, q: Array) -> Array:
        """Phi, (m, s)."""
        still = np.zeros_like(q)
        tied = [tie.misalignment(t, q, still)[0] for tie in self.ties]
        return np.vstack([self.linear @ q, *tied])

    def acceleration_bias(self, t: Array, q: Array, v: Array, alpha: float, beta: float) -> Array:
        """Gamma of (14), stabilised after Baumgarte, (m, s)."""
        rows = [-2 * alpha * (self.linear @ v) - beta**2 * (self.linear @ q)]
        for tie in self.ties:
            value, rate, second = tie.misalignment(t, q, v)
            rows.append(-second - 2 * alpha * rate - beta**2 * value)
        return np.vstack(rows)

    def jacobian(self, t: float, q: Array) -> Array:
        """Phi_q at one instant, (m, n)."""
        linear_rows = len(self.linear)
        jacobian = np.zeros((self.rows, q.size))
        jacobian[:linear_rows] = self.linear

        for row, tie in zip(jacobian[linear_rows:], self.ties, strict=True):
            for places, gradient in tie.gradients(np.full(1, t), q[:, None]):
                row[places] = gradient[:, 0]
        return jacobian

    def times(self, t: Array, q: Array, a: Array) -> Array:
        """Phi_q a, (m, s)."""
        rows = [self.linear @ a]
        for tie in self.ties:
            gradients = tie.gradients(t, q)
            rows.append(sum((part * a[places]).sum(axis=0) for places, part in gradients))
        return np.vstack(rows)

    def force(self, t: Array, q: Array, multipliers: Array) -> Array:
        """Phi_q^T lambda, (n, s)."""
        linear_rows = len(self.linear)
        force = self.linear.T @ multipliers[:linear_rows]
        for tie, multiplier in zip(self.ties, multipliers[linear_rows:], strict=True):
            for places, gradient in tie.gradients(t, q):
                force[places] += gradient * multiplier
        return np.asarray(force)


def _closed_hinges(chain: Chain) -> Array:
    """Rows of Phi_q that pin the root and make both nodes of a hinge meet; they are constant."""
    rows = []
    for k in range(len(chain.links)):
        if k == 0 and not chain.pinned:
            continue  # a flying root
        for axis in (0, 1):
            row = np.zeros(chain.size)
            row[chain.slots(k, 0)[axis]] = 1.0
            if k:
                row[chain.slots(k - 1, -1)[axis]] = -1.0
            rows.append(row)
    return np.array(rows).reshape(-1, chain.size)
