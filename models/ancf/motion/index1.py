"""Equations of motion with multipliers: the index-1 form (13)-(15) of Algorithm 1.

The unknowns of an instant are `[qddot; lambda]`; the second row of (14) is
Phi_q qddot = gamma with Baumgarte's stabilisation, critical at alpha = beta.

Symbols: z = q node coordinates (n,), v, a rates and accelerations (with multipliers); N axial
forces (G,) [N]; alpha, beta [1/s] stabilisation; s columns (instants).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from models.ancf.assembly import assemble, dense
from models.ancf.chain import Chain
from models.ancf.joints import Joint, check_joints
from models.ancf.joints.constraints import Constraints
from models.ancf.motion.equations import Mechanics
from models.arrays import Array
from models.errors import require_not_negative


class Index1:
    """The form of the paper; see `EquationsOfMotion`.

    Parameters
    ----------
    chain : Chain
    joints : sequence of Joint
    alpha, beta : float
        Baumgarte's stabilisation of rate and value of the constraints [1/s].

    Raises
    ------
    ModelError
        If the joints do not fit the chain, or alpha or beta is negative.
    """

    def __init__(
        self, chain: Chain, joints: Sequence[Joint], alpha: float = 20.0, beta: float = 20.0
    ) -> None:
        require_not_negative("Baumgarte", alpha=alpha, beta=beta)
        joints = check_joints(chain, joints)
        self.assembly = assemble(chain, merged=False)
        self.mechanics = Mechanics(chain, joints, self.assembly)
        self.constraints = Constraints(chain, joints)

        self.size = chain.size
        self.unknowns = chain.size + self.constraints.rows
        self.relaxation = chain.relaxation_time
        self.alpha, self.beta = alpha, beta
        self.factorizations = 0

    def coordinates(self, t: float, q: Array, v: Array) -> tuple[Array, Array]:
        """The coordinates are the node vector."""
        return q, v

    def nodes(self, t: Array, z: Array, v: Array) -> tuple[Array, Array]:
        """The node vector is the coordinates."""
        return z, v

    def residual(self, t: Array, z: Array, v: Array, a: Array, N: Array) -> tuple[Array, Array]:
        acc, multipliers = a[: self.size], a[self.size :]
        slope = self.mechanics.slopes(z)
        gap = N - self.mechanics.axial_forces(slope, v)

        force = self.mechanics.balance(t, z, v, acc, slope, N)
        force += self.constraints.force(t, z, multipliers)
        gamma = self.constraints.acceleration_bias(t, z, v, self.alpha, self.beta)
        return np.vstack((force, self.constraints.times(t, z, acc) - gamma)), gap

    def start(self, t: float, z: Array, v: Array) -> tuple[Array, Array]:
        from scipy.linalg import solve

        instant, z, v = np.full(1, t), z[:, None], v[:, None]
        N = self.mechanics.axial_forces(self.mechanics.slopes(z), v)
        residual, _ = self.residual(instant, z, v, np.zeros((self.unknowns, 1)), N)
        matrix = _saddle(dense(self.assembly.mass), self.constraints.jacobian(t, z[:, 0]))
        return solve(matrix, -residual[:, 0]), N[:, 0]

    def linearise(self, t: float, z: Array) -> None:
        self._slope = self.mechanics.slopes(z[:, None])
        self._stiffness = self.assembly.tangent(z)
        self._jacobian = self.constraints.jacobian(t, z)

    def factor(self, steps: NDArray[np.complex128]) -> None:
        from scipy.linalg import lu_factor

        mass = dense(self.assembly.mass)
        self._factors, self._scales = [], []
        for step in (step if step.imag else step.real for step in steps):
            upper = mass + (step**2 + self.relaxation * step) * self._stiffness
            self._factors.append(lu_factor(_saddle(upper, self._jacobian)))

            # The stabilised rows change with z and v as well. By dividing their right-hand side
            # by this factor the matrix stays symmetric.
            self._scales.append(1 + 2 * self.alpha * step + (self.beta * step) ** 2)
        self.factorizations += len(steps)

    def solve(self, k: int, rhs: NDArray[Any]) -> NDArray[Any]:
        from scipy.linalg import lu_solve

        rhs = rhs.copy()
        rhs[self.size :] /= self._scales[k]
        return np.asarray(lu_solve(self._factors[k], rhs))

    def axial_force_change(self, dz: Array) -> Array:
        return np.asarray(self.mechanics.axial * (self._slope * self.mechanics.slopes(dz)).sum(0))

    def axial_load(self, N: Array) -> Array:
        force = self.mechanics.axial_load(self._slope, N)
        return np.vstack((force, np.zeros((self.constraints.rows, N.shape[1]))))

    def inertia(self, a: Array) -> Array:
        product = np.zeros(self.unknowns)
        product[: self.size] = self.assembly.mass @ a[: self.size]
        return product


def _saddle(upper: Array, jacobian: Array) -> Array:
    """The matrix [[upper, J^T], [J, 0]] of the unknowns `[qddot; lambda]`."""
    rows = len(jacobian)
    return np.block([[upper, jacobian.T], [jacobian, np.zeros((rows, rows))]])
