"""What the equations of motion are, and the forces that both of their forms share.

The axial forces N at the Gauss points are unknowns of the implicit step beside the
accelerations: N = EA (eps + eta deps/dt). A Newton step with a Jacobian frozen over the time
step then converges at the rate of the rotation in the step; with N eliminated, the axial
stiffness times that rotation would push the iteration out.

Symbols: x coordinates of the assembly (n,), z coordinates of a form, v, a rates and accelerations,
N axial forces (G,) [N] at G Gauss points, r' slopes [-], eta relaxation time [s], s columns
(instants).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from models.ancf.assembly import Assembly
from models.ancf.chain import Chain
from models.ancf.element import moment_force
from models.ancf.joints import Joint, LastAsked, Torque, law_values, slope_pair
from models.arrays import Array


class EquationsOfMotion(Protocol):
    """What the integrator needs of a form of the equations of motion.

    Columns are instants (s of them). `unknowns` counts accelerations and multipliers; the
    first `size` rows of `a` are the accelerations. `factorizations` counts the factorised
    Newton matrices.
    """

    size: int
    unknowns: int
    relaxation: float
    factorizations: int

    def start(self, t: float, z: Array, v: Array) -> tuple[Array, Array]:
        """Accelerations with multipliers (unknowns,), axial forces (G,)."""

    def residual(self, t: Array, z: Array, v: Array, a: Array, N: Array) -> tuple[Array, Array]:
        """Equations of motion (unknowns, s) and the gap `N - EA (eps + eta deps/dt)` (G, s)."""

    def linearise(self, t: float, z: Array) -> None:
        """Freeze mass, stiffness and strain gradient at a configuration."""

    def factor(self, steps: NDArray[np.complex128]) -> None:
        """Factorise the Newton matrix for the products h lambda."""

    def solve(self, k: int, rhs: NDArray[Any]) -> NDArray[Any]:
        """Newton matrix k inverse times a column."""

    def axial_force_change(self, dz: Array) -> Array:
        """EA deps/dz dz of the frozen configuration, (G, s) [N]."""

    def axial_load(self, N: Array) -> Array:
        """Generalised force of axial forces at the frozen configuration, (unknowns, s)."""

    def inertia(self, a: Array) -> Array:
        """Frozen mass matrix times a column of accelerations, (unknowns,)."""


class Mechanics:
    """Forces of a chain on the coordinates x of its assembly."""

    def __init__(self, chain: Chain, joints: Sequence[Joint], assembly: Assembly) -> None:
        self.assembly = assembly
        self.relaxation = chain.relaxation_time
        self.torques = [
            (*slope_pair(chain, k, assembly.place), LastAsked(partial(law_values, joint.torque)))
            for k, joint in enumerate(joints)
            if isinstance(joint, Torque)
        ]
        # columns, to multiply fields (G, s)
        self.axial = assembly.axial[:, None]
        self.weight = assembly.weight[:, None]
        self.points = len(assembly.axial)

    def slopes(self, x: Array) -> Array:
        """R' at the axial Gauss points, (2, G, s)."""
        return np.asarray(self.assembly.slope @ x).reshape(2, self.points, -1)

    def axial_forces(self, slope: Array, x_rate: Array) -> Array:
        """Axial forces N that the motion asks for, (G, s) [N]."""
        strain = 0.5 * (slope[0] ** 2 + slope[1] ** 2 - 1.0)
        if self.relaxation:
            strain = strain + self.relaxation * (slope * self.slopes(x_rate)).sum(axis=0)
        return np.asarray(self.axial * strain)

    def axial_load(self, slope: Array, N: Array) -> Array:
        """Generalised force of axial forces N (G, s) at slopes r', (n, s) [N]."""
        weighted = (slope * (self.weight * N)).reshape(2 * self.points, -1)
        return np.asarray(self.assembly.slope.T @ weighted)

    def balance(self, t: Array, x: Array, rate: Array, acc: Array, slope: Array, N: Array) -> Array:
        """M xddot + grad U + damping - gravity - joint torques, (n, s) [N]; (11)."""
        balance = self.assembly.mass @ acc + self.assembly.bending @ x
        balance += self.axial_load(slope, N)
        balance -= self.assembly.gravity[:, None]
        if self.relaxation:
            balance += self.bending_damping(x, rate)[0]

        # A torque acts on the slope after its joint, its opposite on the slope before.
        for before, after, torque in self.torques:
            moment = torque(t)
            _add_moment(balance, x, after, -moment)
            if before is not None:
                _add_moment(balance, x, before, moment)
        return np.asarray(balance)

    def bending_damping(self, x: Array, rate: Array) -> tuple[Array, Array]:
        """Force of eta EI dkappa/dt (n, s) and its power (s,), kappa = r' x r'' (objective)."""
        asm = self.assembly

        def at_points(operator: Any, coordinates: Array) -> Array:
            return np.asarray(operator @ coordinates).reshape(2, len(asm.bend_weight), -1)

        r1, d1 = at_points(asm.bend_slope, x), at_points(asm.bend_slope, rate)
        r2, d2 = at_points(asm.bend_curve, x), at_points(asm.bend_curve, rate)

        # dkappa/dt by the product rule; a rigid turn leaves it zero, unlike the rate of r''
        kappa_rate = d1[0] * r2[1] - d1[1] * r2[0] + r1[0] * d2[1] - r1[1] * d2[0]
        moment = self.relaxation * asm.bend_weight[:, None] * kappa_rate

        # the transpose of that map: virtual work of the moment on r' and r''
        on_slope = np.concatenate((moment * r2[1], -moment * r2[0]))
        on_curve = np.concatenate((-moment * r1[1], moment * r1[0]))
        force = asm.bend_slope.T @ on_slope + asm.bend_curve.T @ on_curve
        return np.asarray(force), (moment * kappa_rate).sum(axis=0)

    def dissipation(self, x: Array, rate: Array) -> Array:
        """Power lost to damping, (s,) [W]."""
        if not self.relaxation:
            return np.zeros(x.shape[1])

        strain_rate = (self.slopes(x) * self.slopes(rate)).sum(axis=0)
        axial = self.relaxation * (self.weight * self.axial * strain_rate**2).sum(axis=0)
        return np.asarray(axial + self.bending_damping(x, rate)[1])


def _add_moment(balance: Array, x: Array, slope: list[int], moment: Array) -> None:
    """Add the generalised force of a moment (s,) on a slope to a balance (n, s)."""
    force_x, force_y = moment_force(x[slope[0]], x[slope[1]], moment)
    balance[slope[0]] += force_x
    balance[slope[1]] += force_y
