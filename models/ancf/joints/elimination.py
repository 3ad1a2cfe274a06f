"""The nonlinear elimination of the ties b = g R(phi(t)) a of locked and driven joints.

The coordinates x (n,) of a chain with closed hinges are functions of fewer coordinates
z (n - ties,): the entry of z at the place of b_x is the stretch g, and b_y is dropped. With
J = dx/dz, forces on x become J^T f on z and symmetric matrices become J^T S J.

Symbols: a, b slopes before and after a joint [-]; g stretch of b over a [-]; u = R(phi) a;
m columns (instants). A trailing d is a derivative by time.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from models.ancf.joints.angles import quarter, rotate
from models.ancf.joints.ties import SlopeTie
from models.arrays import Array, Places


@dataclass(frozen=True, eq=False)
class SlopeElimination:
    """The map z -> x of all ties at given instants, with its rates and tangent.

    Attributes
    ----------
    ties : tuple of SlopeTie
        From the root outward.
    size : int
        Number of coordinates n of x.
    """

    ties: tuple[SlopeTie, ...]
    size: int

    @cached_property
    def kept(self) -> Places:
        """Places in x that are entries of z."""
        dropped = [tie.after[1] for tie in self.ties]
        return np.setdiff1d(np.arange(self.size), dropped)

    @cached_property
    def _runs(self) -> list[tuple[slice, slice]]:
        """Places in x and in z of neighbouring entries of z: slices, as they are many and short."""
        ends = np.flatnonzero(np.diff(self.kept) > 1) + 1
        edges = [0, *ends.tolist(), len(self.kept)]
        return [
            (slice(int(self.kept[low]), int(self.kept[high - 1]) + 1), slice(low, high))
            for low, high in itertools.pairwise(edges)
        ]

    def motion(self, t: Array, z: Array, v: Array, a: Array) -> tuple[Array, Array, Array]:
        """x, its velocity and acceleration (n, m) from those of z at times t (m,)."""
        full = np.empty((3, self.size, z.shape[1]))
        for part, given in zip(full, (z, v, a), strict=True):
            for places, kept in self._runs:
                part[places] = given[kept]

        # Root outward: the slope before a joint is complete when that joint's turn comes.
        x, xd, xdd = full
        for tie in self.ties:
            stretch_place, after = tie.after[0], _together(tie.after)
            if tie.clamp is not None:  # half of the work of a step would be its sines and zeros
                full[:, after] = full[:, stretch_place, None] * tie.clamp
                continue

            g, gd, gdd = full[:, stretch_place].copy()
            if tie.held is None or tie.before is None:
                u, ud, udd = tie.direction(t, x, xd, xdd)
            else:
                u, ud, udd = tie.held @ full[:, _together(tie.before)]
            x[after] = g * u
            xd[after] = gd * u + g * ud
            xdd[after] = gdd * u + 2 * gd * ud + g * udd
        return x, xd, xdd

    def restrict(self, t: float, x: Array, xd: Array) -> tuple[Array, Array]:
        """Z and its velocity from x and its velocity (n,) that respect the ties at one instant."""
        z, v = x.copy(), xd.copy()
        for tie in self.ties:
            phi, w, _ = tie.joint.law(np.full(1, t))
            a = tie.slope_before(x[:, None])
            ad = np.zeros((2, 1)) if tie.before is None else xd[tie.before, None]
            u = rotate(phi, a)
            ud = rotate(phi, ad) + w * quarter(u)

            # g and its rate are the components of b and of bd - g ud along u.
            b, bd = x[tie.after, None], xd[tie.after, None]
            g = (u * b).sum() / (u**2).sum()
            z[tie.after[0]] = g
            v[tie.after[0]] = ((u * (bd - g * ud)).sum()) / (u**2).sum()
        return z[self.kept], v[self.kept]

    def force(self, t: Array, x: Array, force: Array) -> Array:
        """J^T f: generalised force on z of a force f (n, m) on x, (n_z, m)."""
        force = force.copy()
        for tie in self.ties:
            if tie.clamp is not None:
                force[tie.after[0]] = tie.clamp[:, 0] @ force[tie.after]
                continue
            after = _together(tie.after)
            force_after = force[after]

            # A turn of a carries b along, so the force on b acts on a as well.
            if tie.before is None:
                u = tie.turned(t, tie.slope_before(x))
            else:
                before = _together(tie.before)
                u = tie.turned(t, x[before])
                g = _inner(x[after], u) / _inner(u, u)
                force[before] += g * tie.turned_back(t, force_after)
            force[tie.after[0]] = _inner(u, force_after)
        return force.take(self.kept, axis=0)

    def jacobian(self, t: float, x: Array) -> Array:
        """J = dx/dz (n, n_z) at one instant and configuration x (n,)."""
        return self._times_jacobian(t, x, np.eye(self.size))

    def reduce(self, t: float, x: Array, matrix: Array) -> Array:
        """J^T S J of a symmetric matrix S (n, n) at one instant."""
        if not self.ties:
            return matrix
        return self._times_jacobian(t, x, self._times_jacobian(t, x, matrix).T)

    def geometric_stiffness(self, t: float, force: Array) -> Array:
        """Part f . d2x/dz2 of the stiffness for a force f (n,) on x, (n_z, n_z)."""
        stiffness = np.zeros((self.size, self.size))
        for tie in self.ties:
            # x is bilinear in g and a; where a is the x axis it is linear in g
            if tie.before is not None:
                phi = tie.joint.law(np.full(1, t))[0]
                mixed = rotate(-phi, force[tie.after, None])[:, 0]
                stiffness[tie.after[0], tie.before] = mixed
                stiffness[tie.before, tie.after[0]] = mixed
        return stiffness[np.ix_(self.kept, self.kept)]

    def _times_jacobian(self, t: float, x: Array, matrix: Array) -> Array:
        """S J of a matrix S with n columns, without forming J."""
        product = matrix.copy()
        for tie in self.ties:
            phi = tie.joint.law(np.full(1, t))[0][0]
            rotation = np.array([[np.cos(phi), -np.sin(phi)], [np.sin(phi), np.cos(phi)]])
            u = rotation[:, 0] if tie.before is None else rotation @ x[tie.before]

            # columns of b become those of a, turned and stretched, and of g
            columns = matrix[:, tie.after]
            if tie.before is not None:
                g = (x[tie.after] @ u) / (u @ u)
                product[:, tie.before] += columns @ rotation * g
            product[:, tie.after[0]] = columns @ u
        return product[:, self.kept]


def _together(places: list[int]) -> slice | list[int]:
    """Two places as a slice where they are neighbours: half the time of a list."""
    first, second = places
    return slice(first, second + 1) if second == first + 1 else places


def _inner(a: Array, b: Array) -> Array:
    """Inner products of vectors (2, m); of two rows a sum takes longer than it adds."""
    return np.asarray(a[0] * b[0] + a[1] * b[1])
