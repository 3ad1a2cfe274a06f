"""Reduced model of the arm: one co-rotated ANCF element a link, axial strain condensed.

An unreduced mesh has axial modes thousands of times faster than the first bending mode, too
stiff for collocation. Here each link keeps its cubic bending shape in a frame on its start
tangent, and the stretch follows from inextensibility (the foreshortening u).

Symbols: theta_k absolute root-tangent angle [rad], delta_k transverse tip displacement [m] and
psi_k tip slope [-] of link k in its frame; p = (theta1, delta1, psi1, theta2, delta2, psi2);
q the coordinates kept, v their rates; e node coordinates of the two elements (16,).

"B21" ties psi2 = 3 delta2 / (2 L2) (no moment at the tip); "B22" keeps psi2. A locked elbow
substitutes theta2, a clamped root drops theta1. All expressions are CasADi in, CasADi out.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import casadi as ca
import numpy as np

from models.ancf.chain import Chain, Link
from models.ancf.element import mass_matrix
from models.arm.parameters import ArmParameters
from models.arrays import Array
from models.errors import require

COORDINATES = ("theta1", "delta1", "psi1", "theta2", "delta2", "psi2")


@dataclass(frozen=True)
class ReducedArm:
    """The arm as a few ordinary differential equations.

    Parameters
    ----------
    parameters : ArmParameters
    variant : {"B21", "B22"}
    root_lock : float or None
        Angle of a clamped root [rad]; None leaves it pinned.
    elbow_lock : float or None
        Angle of a locked elbow [rad] (0 straight, pi folded); None leaves it free.

    Raises
    ------
    ModelError
        For an unknown variant.
    """

    parameters: ArmParameters
    variant: Literal["B21", "B22"] = "B21"
    root_lock: float | None = None
    elbow_lock: float | None = None

    def __post_init__(self) -> None:
        require(
            self.variant in ("B21", "B22"),
            f"ReducedArm: variant is {self.variant!r}; use 'B21' or 'B22'.",
        )

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the entries of q."""
        dropped = {"psi2"} if self.variant == "B21" else set()
        dropped |= set() if self.root_lock is None else {"theta1"}
        dropped |= set() if self.elbow_lock is None else {"theta2"}
        return tuple(name for name in COORDINATES if name not in dropped)

    @property
    def size(self) -> int:
        """Number of coordinates n; the model has 2 n states."""
        return len(self.coordinates)

    # expressions

    def embed(self, q: Any) -> Any:
        """All six coordinates p (6, 1) from q (n, 1)."""
        p = {name: q[i] for i, name in enumerate(self.coordinates)}

        # What is not in q: a locked angle, measured from the bent big arm at the elbow, and the
        # slope of a tip without moment.
        if self.root_lock is not None:
            p["theta1"] = ca.DM(self.root_lock)
        if self.elbow_lock is not None:
            p["theta2"] = p["theta1"] + tip_turn(p["psi1"]) + self.elbow_lock
        if self.variant == "B21":
            p["psi2"] = 1.5 * p["delta2"] / self.parameters.small.length

        return ca.vertcat(*(p[name] for name in COORDINATES))

    def node_coordinates(self, q: Any, elements: int = 1) -> Any:
        """ANCF node coordinates of both links on a mesh of `elements` a link, (size, 1).

        Node position `r_0 + R (s + u, v)`, slope `R (1 - v'^2 / 2, v')`.
        """
        p = self.embed(q)
        start, nodes = ca.DM.zeros(2), []

        for k, link in enumerate((self.parameters.big, self.parameters.small)):
            for i in range(elements + 1):
                s = link.length * i / elements
                position, slope = _point(link, start, p[3 * k], p[3 * k + 1], p[3 * k + 2], s)
                nodes += [position, slope]
            start = position  # the last node of a link is where the next one begins

        return ca.vertcat(*nodes)

    def elbow_angle(self, q: Any) -> Any:
        """Joint angle of the elbow, phi = theta2 - theta1 - atan2(psi1, 1 - psi1^2/2) [rad]."""
        p = self.embed(q)
        return p[3] - p[0] - tip_turn(p[2])

    def tip(self, q: Any) -> Any:
        """Position of the tip (2, 1) [m]."""
        return self.node_coordinates(q)[12:14]

    def elbow(self, q: Any) -> Any:
        """Position of the elbow (2, 1) [m]."""
        return self.node_coordinates(q)[4:6]

    def first_moment(self, q: Any) -> Any:
        """Mass times centre of mass (2, 1) [kg m]; its second derivative is the root's force.

        Translations are exact motions of the elements: M times a unit shift weighs the nodes.
        """
        shift = np.array([[i % 4 == axis for i in range(16)] for axis in (0, 1)], dtype=float)
        return ca.DM(shift) @ self._element_mass @ self.node_coordinates(q)

    def strain_energy(self, q: Any) -> Any:
        """Bending energy 1/2 q^T K q of both cubic shapes [J]."""
        p = self.embed(q)
        energy = 0
        for k, link in enumerate((self.parameters.big, self.parameters.small)):
            delta, psi, L = p[3 * k + 1], p[3 * k + 2], link.length

            # the integral of the square of the curvature a + 2 b s, see `_point`
            curvature_squared = 12 * delta**2 / L**3 - 12 * delta * psi / L**2 + 4 * psi**2 / L
            energy += 0.5 * link.bending_stiffness * curvature_squared
        return energy

    def mass_matrix(self, q: Any) -> Any:
        """J^T M J with J = de/dq, and the hub on theta1; (n, n) [kg m^2, ...]."""
        J = ca.jacobian(self.node_coordinates(q), q)
        J1 = ca.jacobian(self.embed(q)[0], q)
        return J.T @ self._element_mass @ J + self.parameters.hub_inertia * J1.T @ J1

    def kinetic_energy(self, q: Any, v: Any) -> Any:
        """Kinetic energy [J]."""
        return 0.5 * ca.dot(v, self.mass_matrix(q) @ v)

    def force(self, q: Any, v: Any, torque: Any) -> Any:
        """B tau - K q - C v - J^T M (Jdot v), (n, 1): what the mass matrix accelerates.

        `torque` is (root, elbow) (2, 1) [N m].
        """
        e = self.node_coordinates(q)
        J = ca.jacobian(e, q)
        bias = ca.jtimes(J @ v, q, v)

        elastic = ca.gradient(self.strain_energy(q), q)
        damping = self.parameters.relaxation_time * ca.jtimes(elastic, q, v)

        # Torques do work on the joint angles: B is the transpose of their derivatives.
        angles = ca.vertcat(self.embed(q)[0], self.elbow_angle(q))
        drive = ca.jacobian(angles, q).T @ torque
        return drive - elastic - damping - J.T @ (self._element_mass @ bias)

    def residual(self, q: Any, v: Any, a: Any, torque: Any) -> Any:
        """Equations of motion in implicit form, zero along a motion, (n, 1)."""
        return self.mass_matrix(q) @ a - self.force(q, v, torque)

    def acceleration(self, q: Any, v: Any, torque: Any) -> Any:
        """Accelerations (n, 1)."""
        return ca.solve(self.mass_matrix(q), self.force(q, v, torque))

    @cached_property
    def _element_mass(self) -> Any:
        """M of the two elements with the particles, (16, 16)."""
        arm = self.parameters
        mass = np.zeros((16, 16))
        mass[:8, :8] = mass_matrix(arm.big.length, arm.big.linear_density)
        mass[8:, 8:] = mass_matrix(arm.small.length, arm.small.linear_density)

        # the particles sit at the end nodes of the two elements
        mass[[4, 5], [4, 5]] += arm.elbow_mass
        mass[[12, 13], [12, 13]] += arm.tip_mass
        return ca.DM(mass)

    # compiled functions

    @cached_property
    def dynamics(self) -> ca.Function:
        """Compiled `(q, v, torque) -> acceleration`."""
        q, v, tau = self._symbols()
        return ca.Function("arm", [q, v, tau], [self.acceleration(q, v, tau)])

    @cached_property
    def energies(self) -> ca.Function:
        """Compiled `(q, v) -> (kinetic, strain)`."""
        q, v, _ = self._symbols()
        return ca.Function("energies", [q, v], [self.kinetic_energy(q, v), self.strain_energy(q)])

    @cached_property
    def linear(self) -> ca.Function:
        """Compiled `q -> (mass matrix, stiffness)`."""
        q, _, _ = self._symbols()
        stiffness, _ = ca.hessian(self.strain_energy(q), q)
        return ca.Function("linear", [q], [self.mass_matrix(q), stiffness])

    def to_nodes(self, q: Array, v: Array, elements: int = 8) -> tuple[Array, Array]:
        """Full node coordinates and rates (size, m) on a finer mesh, from q, v (n, m)."""
        qs, vs, _ = self._symbols()
        e = self.node_coordinates(qs, elements)
        kernel = ca.Function("nodes", [qs, vs], [e, ca.jtimes(e, qs, vs)])
        nodes, rates = kernel.map(q.shape[1])(q, v)
        return nodes.full(), rates.full()

    def at(self, root: float = 0.0, elbow: float = 0.0) -> Array:
        """Undeformed coordinates (n,) at joint angles [rad]; a lock has its own angle."""
        root = root if self.root_lock is None else self.root_lock
        elbow = elbow if self.elbow_lock is None else self.elbow_lock
        straight = dict.fromkeys(COORDINATES, 0.0) | {"theta1": root, "theta2": root + elbow}
        return np.array([straight[name] for name in self.coordinates])

    def full_chain(self, elements: int = 8) -> Chain:
        """The full ANCF model of the same arm."""
        return self.parameters.chain(elements)

    def _symbols(self) -> tuple[Any, Any, Any]:
        n = self.size
        return ca.SX.sym("q", n), ca.SX.sym("v", n), ca.SX.sym("tau", 2)


def tip_turn(psi: Any) -> Any:
    """Turn of the end slope R (1 - psi^2/2, psi) against the frame [rad]."""
    return ca.atan2(psi, 1 - psi**2 / 2)


def _point(link: Link, start: Any, theta: Any, delta: Any, psi: Any, s: float) -> tuple[Any, Any]:
    """Position and slope (2, 1) of the point at arc length s of a link.

    v' = a s + b s^2; u = -1/2 (a^2 s^3/3 + a b s^4/2 + b^2 s^5/5) is the foreshortening.
    """
    L = link.length

    # the shape whose deflection at the tip is delta and whose slope there is psi
    a = 6 * delta / L**2 - 2 * psi / L
    b = -6 * delta / L**3 + 3 * psi / L**2
    u = -(a**2 * s**3 / 3 + a * b * s**4 / 2 + b**2 * s**5 / 5) / 2
    v, dv = a * s**2 / 2 + b * s**3 / 3, a * s + b * s**2

    R = ca.vertcat(
        ca.horzcat(ca.cos(theta), -ca.sin(theta)), ca.horzcat(ca.sin(theta), ca.cos(theta))
    )
    return start + R @ ca.vertcat(s + u, v), R @ ca.vertcat(1 - dv**2 / 2, dv)


def solve_small(matrix: Any, right: Any) -> list[Any]:
    """Solution of a small symmetric positive system by elimination without pivoting.

    On symbols this makes expressions shorter than those of `ca.solve` by a fifth, and a positive
    matrix needs no pivots.
    """
    n = right.numel()
    a = [[matrix[i, k] for k in range(n)] for i in range(n)]
    b = [right[i] for i in range(n)]

    # forward elimination
    for k in range(n):
        for i in range(k + 1, n):
            factor = a[i][k] / a[k][k]
            b[i] = b[i] - factor * b[k]
            for m in range(k + 1, n):
                a[i][m] = a[i][m] - factor * a[k][m]

    # back substitution
    x: list[Any] = [None] * n
    for i in reversed(range(n)):
        x[i] = (b[i] - sum(a[i][m] * x[m] for m in range(i + 1, n))) / a[i][i]
    return x
