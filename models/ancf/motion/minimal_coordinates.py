"""Equations of motion with the constraints eliminated: the coordinates z move freely.

Hinges share a position and a pinned root is dropped (linear, in the assembly); a locked or
driven hinge is a tie, b = g R(phi) a. The equations are J^T (M xddot + grad U - Q) = 0 with
xddot = J zddot + Jdot zdot. Along the chain the matrices are narrow bands.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack, solve

from models.ancf.assembly import assemble, dense
from models.ancf.chain import Chain
from models.ancf.joints import Driven, Joint, Locked, Torque, check_joints, slope_pair
from models.ancf.joints.elimination import SlopeElimination, SlopeTie
from models.ancf.motion.equations import Mechanics
from models.arrays import Array, Places


class MinimalCoordinates:
    """The form of the equations used by default; see `EquationsOfMotion`."""

    def __init__(self, chain: Chain, joints: Sequence[Joint]) -> None:
        joints = check_joints(chain, joints)
        asm = assemble(chain)
        places = [self._places(chain, asm.place, k) for k in range(len(joints))]
        ties = [
            SlopeTie(*places[k], joint)
            for k, joint in enumerate(joints)
            if isinstance(joint, Locked | Driven)
        ]
        torques = [
            (*places[k], joint) for k, joint in enumerate(joints) if isinstance(joint, Torque)
        ]
        self.assembly = asm
        self.mechanics = Mechanics(asm, chain.relaxation_time, torques)
        self.ties = SlopeElimination(tuple(ties), asm.size)
        self.keep = self.ties.keep
        self.size = self.unknowns = len(self.keep)
        self.relaxation = chain.relaxation_time
        self._band = _Band(self.size, 9 if ties else 7)
        self.factorizations = 0

    @staticmethod
    def _places(
        chain: Chain, place: Places, joint: int
    ) -> tuple[tuple[int, int] | None, tuple[int, int]]:
        def pair(slots: slice) -> tuple[int, int]:
            return int(place[slots.start]), int(place[slots.start + 1])

        before, after = slope_pair(chain, joint)
        return None if before is None else pair(before), pair(after)

    # the coordinates

    def state(self, t: float, q: Array, v: Array) -> tuple[Array, Array]:
        """Z and its velocity of a node vector and its velocity."""
        return self.ties.drop(t, self.assembly.gather(q), self.assembly.gather(v))

    def nodes(self, t: Array, z: Array, v: Array) -> tuple[Array, Array]:
        """Node vectors and velocities (size, m) of z and its velocity (n, m)."""
        x, rate, _ = self.ties.motion(t, z, v, np.zeros_like(z))
        return self.assembly.spread(x), self.assembly.spread(rate)

    def motion(self, t: Array, z: Array, v: Array, a: Array) -> tuple[Array, Array, Array]:
        """X with velocity and acceleration."""
        return self.ties.motion(t, z, v, a) if self.ties.ties else (z, v, a)

    # what the integrator asks

    def residual(self, t: Array, z: Array, v: Array, a: Array, pull: Array) -> tuple[Array, Array]:
        x, rate, acc = self.motion(t, z, v, a)
        slope = self.mechanics.slopes(x)
        gap = pull - self.mechanics.pulls(slope, rate)
        force = self.mechanics.balance(t, x, rate, acc, slope, pull)
        return (self.ties.pull(t, x, force) if self.ties.ties else force), gap

    def start(self, t: float, z: Array, v: Array) -> tuple[Array, Array]:
        at, z, v = np.full(1, t), z[:, None], v[:, None]
        x, rate, _ = self.motion(at, z, v, np.zeros_like(z))
        pull = self.mechanics.pulls(self.mechanics.slopes(x), rate)
        force, _ = self.residual(at, z, v, np.zeros_like(z), pull)
        mass = self.ties.reduce(t, x[:, 0], dense(self.assembly.mass))
        return solve(mass, -force[:, 0], assume_a="pos"), pull[:, 0]

    def linearise(self, t: float, z: Array) -> None:
        zero = np.zeros((self.size, 1))
        self._at = np.full(1, t)
        self._x = self.motion(self._at, z[:, None], zero, zero)[0]
        self._slope = self.mechanics.slopes(self._x)
        x = self._x[:, 0]
        self._mass = self.ties.reduce(t, x, dense(self.assembly.mass))
        stiffness = self.ties.reduce(t, x, self.assembly.tangent(x))
        self._bands = self._band.pack(self._mass), self._band.pack(stiffness)
        self._jacobian = self.ties.jacobian(t, x) if self.ties.ties else None

    def factor(self, steps: NDArray[np.complex128]) -> None:
        mass, stiffness = self._bands
        self._factors = []
        for step in steps:
            scale = step**2 + self.relaxation * step
            matrix = mass + (scale if scale.imag else scale.real) * stiffness
            self._factors.append(self._band.factor(matrix))
        self.factorizations += len(steps)

    def solve(self, k: int, rhs: NDArray[Any]) -> NDArray[Any]:
        return self._band.solve(self._factors[k], rhs)

    def pull_change(self, dz: Array) -> Array:
        dx = dz if self._jacobian is None else self._jacobian @ dz
        return np.asarray(self.mechanics.axial * (self._slope * self.mechanics.slopes(dx)).sum(0))

    def pull_force(self, pull: Array) -> Array:
        force = self.mechanics.pull_force(self._slope, pull)
        return force if self._jacobian is None else self._jacobian.T @ force

    def inertia(self, a: Array) -> Array:
        return np.asarray(self._mass @ a)


class _Band:
    """LAPACK storage of n x n matrices with `width` diagonals on either side."""

    def __init__(self, n: int, width: int) -> None:
        self.width = width = min(width, n - 1)
        rows, cols = np.indices((n, n))
        inside = np.abs(rows - cols) <= width
        self._from = rows[inside], cols[inside]
        self._to = 2 * width + rows[inside] - cols[inside], cols[inside]
        self._shape = 3 * width + 1, n

    def pack(self, matrix: Array) -> Array:
        band = np.zeros(self._shape, order="F")
        band[self._to] = matrix[self._from]
        return band

    def factor(self, band: Array) -> tuple[Array, Array]:
        routine = lapack.zgbtrf if np.iscomplexobj(band) else lapack.dgbtrf
        factors, pivots, _ = routine(band, self.width, self.width)
        return factors, pivots

    def solve(self, factors: tuple[Array, Array], rhs: Array) -> Array:
        routine = lapack.zgbtrs if np.iscomplexobj(factors[0]) else lapack.dgbtrs
        return np.asarray(routine(factors[0], self.width, self.width, rhs, factors[1])[0])
