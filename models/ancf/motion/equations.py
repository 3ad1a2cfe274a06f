"""Shared part of the two forms of the equations of motion: elastic, gravity, joint forces.

The axial forces N at the Gauss points are unknowns of the implicit step beside the
accelerations: N = EA (eps + eta deps/dt). A Newton step with a Jacobian frozen over the time
step then converges at the rate of the rotation in the step; with N eliminated, the axial
stiffness times that rotation would push the iteration out.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from models.ancf.assembly import Assembly
from models.ancf.element import moment_force
from models.ancf.joints import Torque
from models.arrays import Array


class EquationsOfMotion(Protocol):
    """What the integrator needs of a form of the equations of motion.

    Columns are instants (s of them). `unknowns` counts accelerations and multipliers; the
    first `size` rows of `a` are the accelerations.
    """

    size: int
    unknowns: int
    relaxation: float

    def start(self, t: float, z: Array, v: Array) -> tuple[Array, Array]:
        """Accelerations with multipliers (unknowns,), axial forces (G,)."""

    def residual(self, t: Array, z: Array, v: Array, a: Array, pull: Array) -> tuple[Array, Array]:
        """Equations of motion (unknowns, s) and `N - EA (eps + eta deps/dt)` (G, s)."""

    def linearise(self, t: float, z: Array) -> None:
        """Freeze mass, stiffness and strain gradient at a configuration."""

    def factor(self, steps: NDArray[np.complex128]) -> None:
        """Factorise the Newton matrix for the products h lambda."""

    def solve(self, k: int, rhs: NDArray[Any]) -> NDArray[Any]:
        """Newton matrix k inverse times a column."""

    def pull_change(self, dz: Array) -> Array:
        """EA deps/dz dz of the frozen configuration, (G, s) [N]."""

    def pull_force(self, pull: Array) -> Array:
        """Generalised force of axial forces at the frozen configuration, (unknowns, s)."""

    def inertia(self, a: Array) -> Array:
        """Frozen mass matrix times a column of accelerations, (unknowns,)."""


class Mechanics:
    """Forces of a chain on its coordinates x."""

    def __init__(
        self,
        assembly: Assembly,
        relaxation: float,
        torques: list[tuple[tuple[int, int] | None, tuple[int, int], Torque]],
    ) -> None:
        self.assembly = assembly
        self.relaxation = relaxation
        self.torques = torques
        self.axial = assembly.axial[:, None]
        self.weight = assembly.weight[:, None]
        self.points = len(assembly.axial)

    def slopes(self, x: Array) -> Array:
        """R' at the axial Gauss points, (2, G, s)."""
        return np.asarray(self.assembly.slope @ x).reshape(2, self.points, -1)

    def pulls(self, slope: Array, x_rate: Array) -> Array:
        """Axial forces N that the motion asks for, (G, s) [N]."""
        strain = 0.5 * (slope[0] ** 2 + slope[1] ** 2 - 1.0)
        if self.relaxation:
            strain = strain + self.relaxation * (slope * self.slopes(x_rate)).sum(axis=0)
        return np.asarray(self.axial * strain)

    def pull_force(self, slope: Array, pull: Array) -> Array:
        """Generalised force of axial forces, (n, s) [N]."""
        weighted = (slope * (self.weight * pull)).reshape(2 * self.points, -1)
        return np.asarray(self.assembly.slope.T @ weighted)

    def balance(
        self, t: Array, x: Array, rate: Array, acc: Array, slope: Array, pull: Array
    ) -> Array:
        """M xddot + grad U + damping - gravity - joint torques, (n, s) [N]; (11)."""
        out = self.assembly.mass @ acc + self.assembly.bending @ x
        out += self.pull_force(slope, pull)
        out -= self.assembly.gravity[:, None]
        if self.relaxation:
            out += self.bending_damping(x, rate)[0]
        for before, after, joint in self.torques:
            moment = joint.torque(t)
            self._moment(out, x, after, -moment)
            if before is not None:
                self._moment(out, x, before, moment)
        return np.asarray(out)

    @staticmethod
    def _moment(out: Array, x: Array, slot: tuple[int, int], moment: Array) -> None:
        fx, fy = moment_force(x[slot[0]], x[slot[1]], moment)
        out[slot[0]] += fx
        out[slot[1]] += fy

    def bending_damping(self, x: Array, rate: Array) -> tuple[Array, Array]:
        """Force of eta EI dkappa/dt (n, s) and its power (s,), kappa = r' x r'' (objective)."""
        asm = self.assembly
        r1, r2, d1, d2 = (
            np.asarray(op @ y).reshape(2, len(asm.bend_weight), -1)
            for op, y in (
                (asm.bend_slope, x),
                (asm.bend_curve, x),
                (asm.bend_slope, rate),
                (asm.bend_curve, rate),
            )
        )
        curl = d1[0] * r2[1] - d1[1] * r2[0] + r1[0] * d2[1] - r1[1] * d2[0]
        moment = self.relaxation * asm.bend_weight[:, None] * curl
        on_slope = np.concatenate((moment * r2[1], -moment * r2[0]))
        on_curve = np.concatenate((-moment * r1[1], moment * r1[0]))
        force = asm.bend_slope.T @ on_slope + asm.bend_curve.T @ on_curve
        return np.asarray(force), (moment * curl).sum(axis=0)

    def dissipation(self, x: Array, rate: Array) -> Array:
        """Power lost to damping, (s,) [W]."""
        if not self.relaxation:
            return np.zeros(x.shape[1])
        stretch = (self.slopes(x) * self.slopes(rate)).sum(axis=0)
        axial = self.relaxation * (self.weight * self.axial * stretch**2).sum(axis=0)
        return np.asarray(axial + self.bending_damping(x, rate)[1])
