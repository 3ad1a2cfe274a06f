"""Reduced model of the arm: one co-rotated ANCF element a link, axial strain condensed.

An unreduced mesh has axial modes thousands of times faster than the first bending mode, too
stiff for collocation. Here each link keeps its cubic bending shape in a frame on its start
tangent, and the stretch follows from inextensibility (the foreshortening u).

Symbols: theta_k absolute root-tangent angle [rad], delta_k transverse tip displacement [m], psi_k
tip slope [-] and beta_k bulge in the middle [m] of link k in its frame, the bulge with both ends
clamped; p = (theta1, delta1, psi1, beta1, theta2, delta2, psi2, beta2); q the coordinates kept,
v their rates; e node coordinates of the two elements and the bulges as vectors (16 or 20,).

A variant is named by the shapes of each link. "B21" ties psi2 (no moment at the tip) and the
bulges (to delta_k and psi_k, see `models.arm.bulges`; none by default); "B22" keeps psi2; "B32"
keeps the bulges: its frequencies below 45 Hz are right to 1 per cent, but it is too stiff for
collocation. A locked elbow substitutes theta2, a clamped root drops theta1. All expressions are
CasADi in, CasADi out.

A satellite that is free to turn about the root has the angle theta0 and the inertia H [kg m^2]. All
angles are measured in its frame, so that those of the joints are what they are on one that is held.
From rest, arm and satellite keep no angular momentum: H theta0' + a^T M v_abs = 0, with M and b of
the arm on a root that turns, a the coordinates' rates by theta0 and v_abs = v + a theta0'. That
gives theta0' without a state of its own, and leaves of the equations of motion, with m = M a,

    (M - m m^T / (H + a^T m)) vdot = force - (b - m (a^T b) / (H + a^T m)).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import casadi as ca
import numpy as np

from models.ancf.chain import Link
from models.ancf.element import mass_matrix, shape_row
from models.arm.moving_frames import (
    FramedLink,
    mass_and_bias,
    rotation,
    slope_coefficients,
    stiffness,
)
from models.arm.parameters import ArmParameters
from models.arrays import Array
from models.errors import require, require_positive
from models.numerics import gauss_legendre

COORDINATES = ("theta1", "delta1", "psi1", "beta1", "theta2", "delta2", "psi2", "beta2")
Variant = Literal["B21", "B22", "B32"]
_DROPPED: dict[str, set[str]] = {
    "B21": {"beta1", "psi2", "beta2"},
    "B22": {"beta1", "beta2"},
    "B32": {"psi2"},
}
_OF_A_LINK = len(COORDINATES) // 2
_BULGE_POINTS = 5  # of the quadrature, exact for the square of the quartic
_NODES = 16  # node coordinates of one element a link


@dataclass(frozen=True)
class ReducedArm:
    """The arm as a few ordinary differential equations.

    Parameters
    ----------
    parameters : ArmParameters
    variant : {"B21", "B22", "B32"}
    root_lock : float or None
        Angle of a clamped root [rad]; None leaves it pinned.
    elbow_lock : float or None
        Angle of a locked elbow [rad] (0 straight, pi folded); None leaves it free.
    ties : (3,) of float
        Of B21: beta1 over delta1 [1], beta1 over psi1 [m], beta2 over delta2 [1].
    satellite_inertia : float or None
        H of a satellite that is free to turn about the root [kg m^2]; None for one that is held.

    Raises
    ------
    ModelError
        For an unknown variant, or a satellite whose inertia is not positive.
    """

    parameters: ArmParameters
    variant: Variant = "B21"
    root_lock: float | None = None
    elbow_lock: float | None = None
    ties: tuple[float, float, float] = (0.0, 0.0, 0.0)
    satellite_inertia: float | None = None

    def __post_init__(self) -> None:
        require(
            self.variant in _DROPPED,
            f"ReducedArm: variant is {self.variant!r}; use 'B21', 'B22' or 'B32'.",
        )
        if self.satellite_inertia is not None:
            require_positive("ReducedArm", satellite_inertia=self.satellite_inertia)

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the entries of q."""
        dropped = set(_DROPPED[self.variant])
        dropped |= set() if self.root_lock is None else {"theta1"}
        dropped |= set() if self.elbow_lock is None else {"theta2"}
        return tuple(name for name in COORDINATES if name not in dropped)

    @property
    def bulges(self) -> bool:
        """Whether the links bulge beyond their cubic shapes."""
        return self.variant == "B32" or any(self.ties)

    @property
    def size(self) -> int:
        """Number of coordinates n; the model has 2 n states."""
        return len(self.coordinates)

    # expressions

    def embed(self, q: Any) -> Any:
        """All coordinates p (8, 1) from q (n, 1)."""
        p = {name: q[i] for i, name in enumerate(self.coordinates)}

        # What is not in q: a locked angle, measured from the bent big arm at the elbow, and the
        # slope of a tip without moment.
        if self.root_lock is not None:
            p["theta1"] = ca.DM(self.root_lock)
        if "beta1" not in p:
            a, b, c = self.ties
            p["beta1"] = a * p["delta1"] + b * p["psi1"]
            p["beta2"] = c * p["delta2"]
        if self.elbow_lock is not None:
            p["theta2"] = p["theta1"] + tip_turn(p["psi1"]) + self.elbow_lock
        if "psi2" in _DROPPED[self.variant]:
            p["psi2"] = (1.5 * p["delta2"] - 8.0 * p["beta2"]) / self.parameters.small.length

        return ca.vertcat(*(p[name] for name in COORDINATES))

    def node_coordinates(self, q: Any, elements: int = 1) -> Any:
        """ANCF node coordinates of both links on a mesh of `elements` a link, (size, 1).

        Node position `r_0 + R (s + u, v)`, slope `R (1 - v'^2 / 2, v')`.
        """
        p = self.embed(q)
        start, nodes = ca.DM.zeros(2), []

        for k, link in enumerate(self._links):
            theta, *bent = _of_link(p, k)
            shape = slope_coefficients(link, *bent)
            for i in range(elements + 1):
                position, slope = _point(start, theta, shape, link.length * i / elements)
                nodes += [position, slope]
            start = position  # the last node of a link is where the next one begins

        return ca.vertcat(*nodes)

    def mass_coordinates(self, q: Any) -> Any:
        """E: what the constant mass matrix belongs to, nodes of one element a link and bulges."""
        nodes = self.node_coordinates(q)
        if not self.bulges:
            return nodes
        p = self.embed(q)
        bulges = [
            rotation(theta)[:, 1] * beta for theta, _, _, beta in (_of_link(p, k) for k in (0, 1))
        ]
        return ca.vertcat(nodes, *bulges)

    def elbow_angle(self, q: Any) -> Any:
        """Joint angle of the elbow, phi = theta2 - theta1 - atan2(psi1, 1 - psi1^2/2) [rad]."""
        p = self.embed(q)
        return _of_link(p, 1)[0] - p[0] - tip_turn(p[COORDINATES.index("psi1")])

    def tip(self, q: Any) -> Any:
        """Position of the tip in the satellite's frame (2, 1) [m]."""
        return self.node_coordinates(q)[12:14]

    def elbow(self, q: Any) -> Any:
        """Position of the elbow (2, 1) [m]."""
        return self.node_coordinates(q)[4:6]

    def first_moment(self, q: Any) -> Any:
        """Mass times centre of mass (2, 1) [kg m]; its second derivative is the root's force.

        Translations are exact motions of the elements: M times a unit shift weighs the nodes.
        """
        places = np.arange(self._mass.size1())
        shift = np.array([(places < _NODES) & (places % 4 == axis) for axis in (0, 1)], dtype=float)
        return ca.DM(shift) @ self._mass @ self.mass_coordinates(q)

    def strain_energy(self, q: Any) -> Any:
        """Bending energy 1/2 q^T K q of both shapes [J]."""
        return 0.5 * ca.dot(q, self._stiffness @ q)

    def mass_matrix(self, q: Any) -> Any:
        """J^T M J with J = de/dq, and the hub on theta1; (n, n) [kg m^2, ...].

        On a free satellite it is what its turn leaves of that, of which the kinetic energy of both
        is made.
        """
        return self._inertia(q, ca.DM.zeros(self.size))[0]

    def angular_momentum(self, q: Any, v: Any) -> Any:
        """Of the arm about the root, which is what it hands to the satellite [N m s]."""
        row, inertia = self._turning(q)
        handed, H = ca.dot(row, v), self.satellite_inertia
        return handed if H is None else handed * H / (H + inertia)

    def satellite_rate(self, q: Any, v: Any) -> Any:
        """theta0', at which the satellite turns [rad/s]."""
        if self.satellite_inertia is None:
            return ca.SX(1, 1)
        return -self.angular_momentum(q, v) / self.satellite_inertia

    def kinetic_energy(self, q: Any, v: Any) -> Any:
        """Kinetic energy [J]."""
        return 0.5 * ca.dot(v, self.mass_matrix(q) @ v)

    def mass_and_force(self, q: Any, v: Any, torque: Any) -> tuple[Any, Any]:
        """Mass matrix (n, n), and what it accelerates (n, 1), from terms that both share.

        The force is B tau - K q - C v - J^T M (Jdot v); `torque` is (root, elbow) (2, 1) [N m].
        """
        mass, bias = self._inertia(q, v)
        elastic = self._stiffness @ q
        damping = self.parameters.relaxation_time * (self._stiffness @ v)

        # Torques do work on the joint angles: B is the transpose of their derivatives.
        angles = ca.vertcat(self.embed(q)[0], self.elbow_angle(q))
        drive = ca.jacobian(angles, q).T @ torque
        return mass, drive - elastic - damping - bias

    def force(self, q: Any, v: Any, torque: Any) -> Any:
        """What the mass matrix accelerates (n, 1), see `mass_and_force`."""
        return self.mass_and_force(q, v, torque)[1]

    def _inertia(self, q: Any, v: Any) -> tuple[Any, Any]:
        """Mass matrix, and the inertial force where no rate changes, see `mass_and_bias`."""
        H = self.satellite_inertia
        if H is None:
            return self._inertia_if_held(q, v)
        row, inertia = self._turning(q)
        rate = self.satellite_rate(q, v)

        whole, on_all = self._on_turning_root(q, v, rate)
        turned, kept = self._places
        mass, bias = whole[kept, kept], on_all[kept]
        by_turn = ca.sum1(on_all[turned]) / (H + inertia)
        return mass - row @ row.T / (H + inertia), bias - row * by_turn

    def _turning(self, q: Any) -> tuple[Any, Any]:
        """M a on the coordinates (n, 1), and the arm's moment of inertia a^T M a about the root."""
        mass, _ = self._on_turning_root(q, ca.DM.zeros(self.size), 0.0)
        turned, kept = self._places
        row = ca.sum2(mass[:, turned])
        return row[kept], ca.sum1(row[turned])

    def _on_turning_root(self, q: Any, v: Any, rate: Any) -> tuple[Any, Any]:
        """Mass matrix and inertial force of the arm whose root may turn, with all its angles.

        `rate` is that of the satellite [rad/s].
        """
        model = self._unlocked
        x, y = ca.SX.sym("q", model.size), ca.SX.sym("v", model.size)
        inertia = ca.Function("turning", [x, y], model._inertia_if_held(x, y))
        place = dict(zip(self.coordinates, ca.vertsplit(q), strict=True))
        speed = dict(zip(self.coordinates, ca.vertsplit(v), strict=True))
        names = model.coordinates
        found: tuple[Any, Any] = inertia(
            ca.vertcat(*(place.get(name, self.root_lock or 0.0) for name in names)),
            ca.vertcat(*(speed.get(name, 0.0) + rate * name.startswith("theta") for name in names)),
        )
        return found

    @cached_property
    def _unlocked(self) -> ReducedArm:
        """The same arm on a root that turns."""
        return replace(self, root_lock=None, satellite_inertia=None)

    @property
    def _places(self) -> tuple[list[int], list[int]]:
        """Of the angles among the coordinates with a turning root, and of the own ones."""
        names = self._unlocked.coordinates
        turned = [i for i, name in enumerate(names) if name.startswith("theta")]
        return turned, [i for i, name in enumerate(names) if name in self.coordinates]

    def _inertia_if_held(self, q: Any, v: Any) -> tuple[Any, Any]:
        """The same on a satellite that is held."""
        p = self.embed(q)
        links = [
            FramedLink(
                link=link,
                mass=self._mass_of(k),
                shape=ca.vertcat(*_of_link(p, k)[1:]),
                by_coordinates=self._shapes[k],
                angle=_of_link(p, k)[0],
            )
            for k, link in enumerate(self._links)
        ]

        # of a locked elbow it is known without the angle of the big arm, which cancels
        elbow = p[_OF_A_LINK] - p[0]
        if self.elbow_lock is not None:
            elbow = tip_turn(p[COORDINATES.index("psi1")]) + self.elbow_lock
        mass, bias = mass_and_bias(links, [elbow], q, v)
        hub = ca.jacobian(p[0], q)
        return mass + self.parameters.hub_inertia * hub.T @ hub, bias

    def residual(self, q: Any, v: Any, a: Any, torque: Any) -> Any:
        """Equations of motion in implicit form, zero along a motion, (n, 1)."""
        mass, force = self.mass_and_force(q, v, torque)
        return mass @ a - force

    def acceleration(self, q: Any, v: Any, torque: Any) -> Any:
        """Accelerations (n, 1)."""
        return ca.vertcat(*solve_small(*self.mass_and_force(q, v, torque)))

    @property
    def _links(self) -> tuple[Link, Link]:
        return self.parameters.big, self.parameters.small

    @cached_property
    def _mass(self) -> Any:
        """M of the two elements with the particles and of the bulges, (16, 16) or (20, 20)."""
        arm, half = self.parameters, _NODES // 2
        mass = np.zeros((_NODES + 4, _NODES + 4))
        for k, link in enumerate(self._links):
            nodes = slice(half * k, half * (k + 1))
            bulge = slice(_NODES + 2 * k, _NODES + 2 * k + 2)
            mass[nodes, nodes] = mass_matrix(link.length, link.linear_density)
            with_nodes, alone = _bulge_mass(link)
            mass[bulge, nodes] = with_nodes
            mass[nodes, bulge] = with_nodes.T
            mass[bulge, bulge] = alone

        # the particles sit at the end nodes of the two elements
        mass[[4, 5], [4, 5]] += arm.elbow_mass
        mass[[12, 13], [12, 13]] += arm.tip_mass
        return ca.sparsify(ca.DM(mass if self.bulges else mass[:_NODES, :_NODES]))

    def _mass_of(self, link: int) -> Any:
        """Its part for a link's nodes and bulge, (10, 10)."""
        half = _NODES // 2
        places = [*range(half * link, half * (link + 1))]
        if not self.bulges:
            return ca.diagcat(self._mass[places, places], ca.DM(2, 2))
        places += [_NODES + 2 * link, _NODES + 2 * link + 1]
        return self._mass[places, places]

    @cached_property
    def _shapes(self) -> tuple[Any, Any]:
        """Deflection, slope and bulge of each link by q, (3, n); they are linear in it."""
        q = ca.SX.sym("q", self.size)
        big, small = (
            ca.sparsify(ca.evalf(ca.jacobian(ca.vertcat(*_of_link(self.embed(q), k)[1:]), q)))
            for k in (0, 1)
        )
        return big, small

    @cached_property
    def _stiffness(self) -> Any:
        """K of the bending of both links, (n, n)."""
        forms = (
            by.T @ ca.DM(stiffness(link)) @ by
            for link, by in zip(self._links, self._shapes, strict=True)
        )
        return ca.sparsify(sum(forms))

    # compiled functions

    @cached_property
    def dynamics(self) -> ca.Function:
        """Compiled `(q, v, torque) -> acceleration`."""
        q, v, tau = self._symbols()
        return ca.Function("arm", [q, v, tau], [self.acceleration(q, v, tau)])

    @cached_property
    def rates(self) -> ca.Function:
        """Compiled `(state, torque) -> its rates`, of the state (q, v) (2 n,)."""
        q, v, tau = self._symbols()
        rates = ca.vertcat(v, self.acceleration(q, v, tau))
        return ca.Function("rates", [ca.vertcat(q, v), tau], [rates])

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

    def _symbols(self) -> tuple[Any, Any, Any]:
        n = self.size
        return ca.SX.sym("q", n), ca.SX.sym("v", n), ca.SX.sym("tau", 2)


def tip_turn(psi: Any) -> Any:
    """Turn of the end slope R (1 - psi^2/2, psi) against the frame [rad]."""
    return ca.atan2(psi, 1 - psi**2 / 2)


def _of_link(p: Any, link: int) -> tuple[Any, Any, Any, Any]:
    """Angle, tip displacement, tip slope and bulge of a link."""
    first = _OF_A_LINK * link
    return p[first], p[first + 1], p[first + 2], p[first + 3]


def _square_integral(coefficients: Sequence[Any], end: float, first: int) -> Any:
    """Integral from 0 to `end` of the square of a polynomial whose lowest power is `first`."""
    total = 0
    for i, one in enumerate(coefficients, start=first):
        for k, other in enumerate(coefficients, start=first):
            total += one * other * end ** (i + k + 1) / (i + k + 1)
    return total


def _point(start: Any, theta: Any, shape: tuple[Any, ...], s: float) -> tuple[Any, Any]:
    """Position and slope (2, 1) of the point at arc length s of a link.

    `shape` are the coefficients of its slope v'; u = -1/2 int v'^2 ds is the foreshortening.
    """
    u = -_square_integral(shape, s, first=1) / 2
    v = sum(c * s ** (i + 1) / (i + 1) for i, c in enumerate(shape, start=1))
    dv = sum(c * s**i for i, c in enumerate(shape, start=1))

    R = rotation(theta)
    return start + R @ ca.vertcat(s + u, v), R @ ca.vertcat(1 - dv**2 / 2, dv)


def _bulge_mass(link: Link) -> tuple[Array, Array]:
    """Mass of a bulge vector with the nodes of its element (2, 8), and alone (2, 2) [kg, kg m]."""
    L, with_shapes, alone = link.length, np.zeros(4), 0.0
    for xi, weight in zip(*gauss_legendre(_BULGE_POINTS), strict=True):
        bulge, piece = 16.0 * xi**2 * (1.0 - xi) ** 2, weight * L * link.linear_density
        with_shapes += piece * bulge * shape_row(xi, L)
        alone += piece * bulge**2
    return np.asarray(np.kron(with_shapes, np.eye(2)), dtype=float), alone * np.eye(2)


def solve_small(matrix: Any, right: Any) -> list[Any]:
    """Solution of a small symmetric positive system by elimination without pivoting.

    On symbols this makes expressions shorter than those of `ca.solve` by a fifth, and a positive
    matrix needs no pivots. The upper triangle is not read.
    """
    n = right.numel()
    a = [[matrix[i, k] for k in range(i + 1)] for i in range(n)]
    b = [right[i] for i in range(n)]

    # forward elimination of the lower triangle, which stays symmetric
    for k in range(n):
        for i in range(k + 1, n):
            factor = a[i][k] / a[k][k]
            b[i] = b[i] - factor * b[k]
            for m in range(k + 1, i + 1):
                a[i][m] = a[i][m] - factor * a[m][k]

    # back substitution
    x: list[Any] = [None] * n
    for i in reversed(range(n)):
        x[i] = (b[i] - sum(a[m][i] * x[m] for m in range(i + 1, n))) / a[i][i]
    return x
