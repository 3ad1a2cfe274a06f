"""Equations of motion with multipliers: the index-1 form (13)-(15) of Algorithm 1.

The unknowns of an instant are `[qddot; lambda]`; the second row of (14) is
Phi_q qddot = gamma with Baumgarte's stabilisation, critical at alpha = beta.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lu_factor, lu_solve, solve

from models.ancf.assembly import assemble, dense
from models.ancf.chain import Chain
from models.ancf.joints import Joint, Torque, check_joints, slope_pair
from models.ancf.joints.constraints import Constraints
from models.ancf.motion.equations import Mechanics
from models.arrays import Array
from models.errors import require_not_negative


class Index1:
    """The form of the paper; see `EquationsOfMotion`."""

    def __init__(
        self, chain: Chain, joints: Sequence[Joint], alpha: float = 20.0, beta: float = 20.0
    ) -> None:
        require_not_negative("Index1", alpha=alpha, beta=beta)
        joints = check_joints(chain, joints)
        torques = []
        for k, joint in enumerate(joints):
            if isinstance(joint, Torque):
                before, after = slope_pair(chain, k)
                a = None if before is None else (before.start, before.start + 1)
                torques.append((a, (after.start, after.start + 1), joint))
        self.assembly = assemble(chain, merged=False)
        self.mechanics = Mechanics(self.assembly, chain.relaxation_time, torques)
        self.constraints = Constraints(chain, joints)
        self.size = chain.size
        self.unknowns = chain.size + self.constraints.rows
        self.relaxation = chain.relaxation_time
        self.alpha, self.beta = alpha, beta
        self.factorizations = 0

    def state(self, t: float, q: Array, v: Array) -> tuple[Array, Array]:
        """The coordinates are the node vector."""
        return q, v

    def nodes(self, t: Array, z: Array, v: Array) -> tuple[Array, Array]:
        """The node vector is the coordinates."""
        return z, v

    def residual(self, t: Array, z: Array, v: Array, a: Array, pull: Array) -> tuple[Array, Array]:
        acc, multipliers = a[: self.size], a[self.size :]
        slope = self.mechanics.slopes(z)
        gap = pull - self.mechanics.pulls(slope, v)
        force = self.mechanics.balance(t, z, v, acc, slope, pull)
        force += self.constraints.force(t, z, multipliers)
        gamma = self.constraints.acceleration_bias(t, z, v, self.alpha, self.beta)
        return np.vstack((force, self.constraints.times(t, z, acc) - gamma)), gap

    def start(self, t: float, z: Array, v: Array) -> tuple[Array, Array]:
        at, z, v = np.full(1, t), z[:, None], v[:, None]
        pull = self.mechanics.pulls(self.mechanics.slopes(z), v)
        rest, _ = self.residual(at, z, v, np.zeros((self.unknowns, 1)), pull)
        matrix = self._saddle(dense(self.assembly.mass), self.constraints.jacobian(t, z[:, 0]))
        return solve(matrix, -rest[:, 0]), pull[:, 0]

    def linearise(self, t: float, z: Array) -> None:
        self._slope = self.mechanics.slopes(z[:, None])
        self._stiffness = self.assembly.tangent(z)
        self._jacobian = self.constraints.jacobian(t, z)

    def factor(self, steps: NDArray[np.complex128]) -> None:
        mass = dense(self.assembly.mass)
        self._factors, self._scales = [], []
        for step in (step if step.imag else step.real for step in steps):
            upper = mass + (step**2 + self.relaxation * step) * self._stiffness
            self._factors.append(lu_factor(self._saddle(upper, self._jacobian)))
            self._scales.append(1 + 2 * self.alpha * step + (self.beta * step) ** 2)
        self.factorizations += len(steps)

    def solve(self, k: int, rhs: NDArray[Any]) -> NDArray[Any]:
        rhs = rhs.copy()
        rhs[self.size :] /= self._scales[k]
        return np.asarray(lu_solve(self._factors[k], rhs))

    def pull_change(self, dz: Array) -> Array:
        return np.asarray(self.mechanics.axial * (self._slope * self.mechanics.slopes(dz)).sum(0))

    def pull_force(self, pull: Array) -> Array:
        force = self.mechanics.pull_force(self._slope, pull)
        return np.vstack((force, np.zeros((self.constraints.rows, pull.shape[1]))))

    def inertia(self, a: Array) -> Array:
        out = np.zeros(self.unknowns)
        out[: self.size] = self.assembly.mass @ a[: self.size]
        return out

    @staticmethod
    def _saddle(upper: Array, jacobian: Array) -> Array:
        rows = len(jacobian)
        return np.block([[upper, jacobian.T], [jacobian, np.zeros((rows, rows))]])
