"""The nonlinear elimination b = g R(phi(t)) a: a slope that follows another at an angle.

A locked or driven hinge ties the slope b after it to the slope a before it (the x axis at the
root); its stretch g stays free. The coordinates x (n,) are then functions of z (n - ties,):
the entry of z at the place of b_x is g, and b_y is dropped.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from models.ancf.joints import Driven, Locked, quarter, rotate
from models.arrays import Array, Places


@dataclass(frozen=True)
class SlopeTie:
    """Places in x of the slopes a (None: the x axis) and b, and the law of the angle."""

    a: tuple[int, int] | None
    b: tuple[int, int]
    joint: Locked | Driven


@dataclass(frozen=True, eq=False)
class SlopeElimination:
    """The map z -> x of all ties at given instants, with its rates and tangent."""

    ties: tuple[SlopeTie, ...]
    size: int

    @cached_property
    def keep(self) -> Places:
        """Places in x that are entries of z."""
        drop = [tie.b[1] for tie in self.ties]
        return np.setdiff1d(np.arange(self.size), drop)

    def motion(self, t: Array, z: Array, v: Array, a: Array) -> tuple[Array, Array, Array]:
        """x, its velocity and acceleration (n, m) from those of z at times t (m,)."""
        out = []
        for part in (z, v, a):
            x = np.empty((self.size, part.shape[1]))
            x[self.keep] = part
            out.append(x)
        x, xd, xdd = out
        for tie in self.ties:
            phi, w, dw = tie.joint.law(t)
            g, gd, gdd = (y[tie.b[0]].copy() for y in out)
            u, ud, udd = self.direction(tie, phi, w, dw, out)
            b = list(tie.b)
            x[b] = g * u
            xd[b] = gd * u + g * ud
            xdd[b] = gdd * u + 2 * gd * ud + g * udd
        return x, xd, xdd

    @staticmethod
    def direction(
        tie: SlopeTie, phi: Array, w: Array, dw: Array, xs: list[Array]
    ) -> tuple[Array, Array, Array]:
        """U = R(phi) a and its two time derivatives, (2, m)."""
        if tie.a is None:
            u = np.array((np.cos(phi), np.sin(phi)))
            n = quarter(u)
            return u, w * n, dw * n - w**2 * u
        u, ud, udd = (rotate(phi, y[list(tie.a)]) for y in xs)
        n = quarter(u)
        return u, ud + w * n, udd + 2 * w * quarter(ud) + dw * n - w**2 * u

    def pull(self, t: Array, x: Array, force: Array) -> Array:
        """J^T f: generalised force on z of a force on x, (n_z, m), with J = dx/dz."""
        force = force.copy()
        for tie in self.ties:
            phi = tie.joint.law(t)[0]
            a, fb = self._before(tie, x), force[list(tie.b)]
            u = rotate(phi, a)
            if tie.a is not None:
                g = (x[list(tie.b)] * u).sum(axis=0) / (u**2).sum(axis=0)
                force[list(tie.a)] += g * rotate(-phi, fb)
            force[tie.b[0]] = (u * fb).sum(axis=0)
        return force[self.keep]

    def jacobian(self, t: float, x: Array) -> Array:
        """J = dx/dz (n, n_z) at one instant and configuration x (n,)."""
        return self._columns(t, x, np.eye(self.size))

    def reduce(self, t: float, x: Array, matrix: Array) -> Array:
        """J^T S J of a symmetric matrix (n, n) at one instant."""
        if not self.ties:
            return matrix
        return self._columns(t, x, self._columns(t, x, matrix).T)

    def _columns(self, t: float, x: Array, matrix: Array) -> Array:
        """S J of a matrix with n columns."""
        out = matrix.copy()
        for tie in self.ties:
            phi, b = tie.joint.law(np.full(1, t))[0][0], list(tie.b)
            turn = np.array([[np.cos(phi), -np.sin(phi)], [np.sin(phi), np.cos(phi)]])
            u = turn[:, 0] if tie.a is None else turn @ x[list(tie.a)]
            if tie.a is not None:
                out[:, list(tie.a)] += matrix[:, b] @ turn * ((x[b] @ u) / (u @ u))
            out[:, tie.b[0]] = matrix[:, b] @ u
        return out[:, self.keep]

    def curvature(self, t: float, force: Array) -> Array:
        """Part f . d2x/dz2 of the stiffness for a force f (n,) on x, (n_z, n_z)."""
        out = np.zeros((self.size, self.size))
        for tie in self.ties:
            if tie.a is not None:
                phi = tie.joint.law(np.full(1, t))[0]
                part = rotate(-phi, force[list(tie.b), None])[:, 0]
                out[tie.b[0], list(tie.a)] = part
                out[list(tie.a), tie.b[0]] = part
        return out[np.ix_(self.keep, self.keep)]

    def drop(self, t: float, x: Array, rate: Array) -> tuple[Array, Array]:
        """Z and its velocity from x and xdot that respect the ties at one instant."""
        z, v = x.copy(), rate.copy()
        at = np.full(1, t)
        for tie in self.ties:
            phi, w, _ = tie.joint.law(at)
            a = self._before(tie, x[:, None])
            ad = np.zeros((2, 1)) if tie.a is None else rate[list(tie.a), None]
            u = rotate(phi, a)
            ud = rotate(phi, ad) + w * quarter(u)
            b, bd = x[list(tie.b), None], rate[list(tie.b), None]
            g = (u * b).sum() / (u**2).sum()
            z[tie.b[0]] = g
            v[tie.b[0]] = ((u * (bd - g * ud)).sum()) / (u**2).sum()
        return z[self.keep], v[self.keep]

    @staticmethod
    def _before(tie: SlopeTie, x: Array) -> Array:
        if tie.a is None:
            return np.array((np.ones(x.shape[1]), np.zeros(x.shape[1])))
        return x[list(tie.a)]
