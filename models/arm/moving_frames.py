"""The links of the reduced arm, each in a frame that moves with its start tangent.

Seen from its own frame, a link's inertia depends on its shape alone, and not on where it is or
points to. So mass matrix and inertial force are short: of node coordinates in a fixed frame they
are four times as long, and so are all their derivatives.

Symbols: z = (delta, psi, beta) shape of a link, see `models.arm.reduced`; u(z) the foreshortening;
e(z) node coordinates of its one ANCF element, and of the bulge as a vector, in its frame (10,);
V, A velocity and acceleration of its start (2,) in its frame, omega the frame's turn rate; q, v all
coordinates and rates (n,). Node rates in the frame are B (V, omega, v), with B = (S, e', de/dq) of
shifts S and of e' = e turned by a right angle; node accelerations are

    B (A, omegadot, vdot) + 2 omega (de/dq v)' - omega^2 e + d(de/dq v)/dq v.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from models.ancf.chain import Link
from models.arrays import Array

_POWERS = np.arange(1.0, 4.0)  # of the arc length, in the slope of a link
_TURNED = ca.DM([[0.0, -1.0], [1.0, 0.0]])
_VECTORS = 5  # positions and slopes of both nodes, and the bulge
_ALL_TURNED = ca.kron(ca.DM.eye(_VECTORS), _TURNED)
_SHIFTS = ca.sparsify(ca.kron(ca.DM([1, 0, 1, 0, 0]), ca.DM.eye(2)))  # S: of both positions
_END = slice(4, 6)  # position of the last node


@dataclass(frozen=True, eq=False)
class FramedLink:
    """A link in its frame.

    Attributes
    ----------
    link : Link
    mass : (10, 10) of e, with the particles at its nodes.
    shape : (3, 1) expressions z of q.
    by_coordinates : (3, n) dz/dq; shapes are linear in q.
    angle : expression of the frame's angle [rad].
    """

    link: Link
    mass: Any
    shape: Any
    by_coordinates: Any
    angle: Any

    def nodes(self, q: Any) -> Any:
        """Node coordinates e (10, 1) [m and -]."""
        delta, psi, beta = ca.vertsplit(self.shape)
        form = self.by_coordinates.T @ ca.DM(foreshortening(self.link)) @ self.by_coordinates
        u = -0.5 * ca.dot(q, ca.sparsify(form) @ q)
        start, across = ca.SX(2, 1), ca.SX(1, 1)  # zeros that no expression carries along
        end, slope = (self.link.length + u, delta), (1 - psi**2 / 2, psi)
        return ca.sparsify(ca.vertcat(start, 1, across, *end, *slope, across, beta))


def mass_and_bias(
    links: Sequence[FramedLink], angles_between: Sequence[Any], q: Any, v: Any
) -> tuple[Any, Any]:
    """Mass matrix of a chain of links that starts at a fixed point, and what inertia takes.

    Parameters
    ----------
    links : from the root on, each beginning where the one before ends.
    angles_between : from the frame of each link to that of the next one [rad].
    q, v : (n, 1)
        Symbols of coordinates and rates.

    Returns
    -------
    mass : (n, n) M.
    bias : (n, 1) generalised inertial force where vdot is zero.
    """
    n = q.numel()
    mass, bias = ca.SX(n, n), ca.SX(n, 1)
    # acceleration of the next link's start: `by_rates @ vdot + at_rest`
    by_rates, at_rest = ca.SX(2, n), ca.SX(2, 1)

    for number, link in enumerate(links):
        if number:
            back = rotation(-angles_between[number - 1])
            by_rates, at_rest = back @ by_rates, back @ at_rest

        e = link.nodes(q)
        e_turned, bending = _ALL_TURNED @ e, ca.jacobian(e, q)
        turning = ca.jacobian(link.angle, q)
        omega, bent = turning @ v, bending @ v

        B = ca.horzcat(_SHIFTS, e_turned, bending)
        own = 2 * omega * (_ALL_TURNED @ bent) - omega**2 * e + ca.jtimes(bent, q, v)
        # (A, omegadot, vdot) = Y vdot + y
        Y = ca.vertcat(by_rates, turning, ca.DM.eye(n))
        y = ca.vertcat(at_rest, ca.jtimes(omega, q, v), ca.SX(n, 1))

        MB = link.mass @ B
        of_frame = symmetric(B.T @ MB)
        mass += symmetric(Y.T @ of_frame @ Y)
        bias += Y.T @ (of_frame @ y + MB.T @ own)

        end = B[_END, :]
        by_rates, at_rest = end @ Y, end @ y + own[_END]
    return mass, bias


def symmetric(matrix: Any) -> Any:
    """A symmetric matrix by its lower triangle alone: the upper one is not computed."""
    return ca.tril2symm(ca.tril(matrix))


def rotation(theta: Any) -> Any:
    """Matrix (2, 2) that turns by an angle [rad]."""
    c, s = ca.cos(theta), ca.sin(theta)
    return ca.vertcat(ca.horzcat(c, -s), ca.horzcat(s, c))


def slope_coefficients(link: Link, delta: Any, psi: Any, bulge: Any) -> tuple[Any, Any, Any]:
    """Coefficients (a, b, c) of the slope v' = a s + b s^2 + c s^3.

    The deflection at the tip is delta, the slope there psi; the bulge is 16 xi^2 (1 - xi)^2.
    """
    L = link.length
    return (
        6 * delta / L**2 - 2 * psi / L + 32 * bulge / L**2,
        -6 * delta / L**3 + 3 * psi / L**2 - 96 * bulge / L**3,
        64 * bulge / L**4,
    )


def foreshortening(link: Link) -> Array:
    """Integral of v'^2 over a link as a quadratic form of z, (3, 3); u is minus half of it."""
    slopes = _slopes(link)
    return np.asarray(slopes @ _products(link.length, _POWERS) @ slopes.T)


def stiffness(link: Link) -> Array:
    """EI times the integral of v''^2 over a link as a quadratic form of z, (3, 3) [N m, N]."""
    curvatures = _slopes(link) * _POWERS
    products = _products(link.length, _POWERS - 1)
    return np.asarray(link.bending_stiffness * (curvatures @ products @ curvatures.T))


def _slopes(link: Link) -> Array:
    """Coefficients of the slope (3, 3), a row for each of delta, psi and beta."""
    return np.array([slope_coefficients(link, *unit) for unit in np.eye(3).tolist()])


def _products(end: float, powers: Array) -> Array:
    """Integrals from 0 to `end` of the products of two powers of s, (3, 3)."""
    total = powers[:, None] + powers + 1
    return np.asarray(end**total / total)
