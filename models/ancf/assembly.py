"""Constant matrices of a chain, over all node coordinates or with the hinges merged.

The strain energy (6) of the whole chain needs three constant matrices only, because the
bending energy is quadratic in the coordinates and the strain is a function of `r' = D q`:
U = 1/2 q^T K_b q + sum_g 1/2 w_g EA eps_g^2,  eps_g = (r'_g . r'_g - 1) / 2.

Symbols: n coordinates, G axial Gauss points, H bending Gauss points, s columns (instants).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, TypeAlias

import numpy as np
from scipy import sparse

from models.ancf.chain import Chain
from models.ancf.element import AXIAL_POINTS, BENDING_POINTS, gauss, mass_matrix, shape_row
from models.arrays import Array, Places

Matrix: TypeAlias = Any  # a dense array, or a sparse one of a large mesh
_DENSE_BELOW = 160  # coordinates; under this size dense products beat sparse ones


@dataclass(frozen=True, eq=False)
class Assembly:
    """Matrices of a chain in `n` coordinates.

    Attributes
    ----------
    place : (size,) int
        Coordinate of each entry of the full node vector; -1 where it is fixed at zero.
    mass, bending : (n, n)
        M of (5) with particles and hub, and the bending part of K_l in (9).
    slope : (2 G, n)
        D: all x components of `r'` at the Gauss points, then all y components [-].
    axial : (G,)
        EA [N] at each Gauss point.
    weight : (G,)
        Quadrature weights times element length [m].
    bend_slope, bend_curve : (2 H, n)
        `r'` and `r''` at the bending Gauss points, for the damping.
    bend_weight : (H,)
        EI times quadrature weight [N m^3].
    gravity : (n,)
        Generalised force of gravity [N].
    elements : (E, 8) int
        Coordinates of each element, `n` where fixed.
    rows : (E, 5, 4)
        S' at the Gauss points of each element [1/m and -].
    """

    place: Places
    mass: Matrix
    bending: Matrix
    slope: Matrix
    axial: Array
    weight: Array
    bend_slope: Matrix
    bend_curve: Matrix
    bend_weight: Array
    gravity: Array
    elements: Places
    rows: Array

    @property
    def size(self) -> int:
        """Number of coordinates n."""
        return len(self.gravity)

    def spread(self, x: Array) -> Array:
        """Full node vector (size, ...) of coordinates x (n, ...)."""
        padded = np.concatenate((x, np.zeros((1, *x.shape[1:]))))
        return padded[self.place]

    def gather(self, q: Array) -> Array:
        """Coordinates x (n, ...) of a full node vector that keeps the hinges closed."""
        x = np.zeros((self.size + 1, *q.shape[1:]))
        x[self.place] = q
        return x[:-1]

    def strain(self, x: Array) -> Array:
        """Axial strain eps of (7) at the Gauss points, (G, s)."""
        slope = (self.slope @ x).reshape(2, len(self.axial), -1)
        return 0.5 * ((slope**2).sum(axis=0) - 1.0)

    def strain_energy(self, x: Array) -> Array:
        """U of (6) [J], (s,)."""
        stretch = 0.5 * (self.weight * self.axial) @ self.strain(x) ** 2
        curve = np.asarray(self.bend_curve @ x).reshape(2, len(self.bend_weight), -1)
        return np.asarray(stretch + 0.5 * self.bend_weight @ (curve**2).sum(axis=0))

    def internal_force(self, x: Array) -> Array:
        """Gradient of (6) [N], (n, s)."""
        slope = (self.slope @ x).reshape(2, len(self.axial), -1)
        force = self.axial[:, None] * 0.5 * ((slope**2).sum(axis=0) - 1.0)
        pull = (slope * (self.weight[:, None] * force)).reshape(2 * len(self.axial), -1)
        return np.asarray(self.slope.T @ pull + self.bending @ x)

    def tangent(self, x: Array, pull: Array | None = None) -> Array:
        """Hessian of (6) at one configuration x (n,), dense (n, n) [N/m].

        `pull` (G,) takes the place of the axial forces EA eps [N] where these are unknowns.
        """
        slope = (self.slope @ x).reshape(2, -1)
        if pull is None:
            pull = self.axial * 0.5 * ((slope**2).sum(axis=0) - 1.0)
        force = self.weight * pull
        n_e, n_g, _ = self.rows.shape
        pulled = self.rows[..., None] * slope.T.reshape(n_e, n_g, 1, 2)
        pulled = pulled.reshape(n_e, n_g, 8)
        weighted = pulled * (self.weight * self.axial).reshape(n_e, n_g, 1)
        stiff = (pulled.transpose(0, 2, 1) @ weighted).reshape(n_e, 4, 2, 4, 2)
        stress = self.rows.transpose(0, 2, 1) @ (self.rows * force.reshape(n_e, n_g, 1))
        stiff[:, :, 0, :, 0] += stress
        stiff[:, :, 1, :, 1] += stress
        return scatter(self.elements, stiff.reshape(n_e, 8, 8), self.size) + dense(self.bending)


def dense(matrix: Matrix) -> Array:
    """Dense copy or view of a matrix."""
    return matrix.toarray() if sparse.issparse(matrix) else np.asarray(matrix)


def scatter(elements: Places, blocks: Array, n: int) -> Array:
    """Sum element matrices (E, 8, 8) into a dense (n, n); coordinate n is dropped."""
    at = elements[:, :, None] * (n + 1) + elements[:, None, :]
    flat = np.bincount(at.ravel(), weights=blocks.ravel(), minlength=(n + 1) ** 2)
    return np.ascontiguousarray(flat.reshape(n + 1, n + 1)[:n, :n])


@lru_cache(maxsize=16)
def assemble(chain: Chain, *, merged: bool = True) -> Assembly:
    """Build the matrices of a chain.

    Parameters
    ----------
    chain : Chain
    merged : bool
        True shares the position of the two nodes at a hinge and drops the pinned root: linear
        constraints eliminated. False keeps all node coordinates for the form with multipliers.
    """
    place, n = _merged_places(chain) if merged else (np.arange(chain.size), chain.size)
    first = [chain.slots(k, i)[0] for k in range(len(chain.links)) for i in range(chain.elements)]
    full = np.array(first)[:, None] + np.arange(8)
    elements = np.where(place[full] < 0, n, place[full])
    link_of = np.repeat(np.arange(len(chain.links)), chain.elements)
    lengths = np.array([k.length / chain.elements for k in chain.links])[link_of]

    def field(name: str) -> Array:
        return np.array([getattr(k, name) for k in chain.links])[link_of]

    def table(points: int, order: int) -> Array:
        xi, _ = gauss(points)
        return np.array([[shape_row(x, le, order) for x in xi] for le in lengths])

    w_axial, w_bend = gauss(AXIAL_POINTS)[1], gauss(BENDING_POINTS)[1]
    bend_weight = field("bending_stiffness")[:, None] * lengths[:, None] * w_bend
    curve = table(BENDING_POINTS, 2)
    bend = np.einsum("eg,egi,egj->eij", bend_weight, curve, curve)
    density = field("linear_density")
    mass = np.array([mass_matrix(*pair) for pair in zip(lengths, density, strict=True)])
    particles, hub = _lumps(chain, place, n)
    mass_full = scatter(elements, mass, n) + np.diag((particles + hub)[:n])
    weight = mass @ np.kron([1.0, 0.0, 1.0, 0.0], chain.gravity)
    gravity: Array = np.bincount(elements.ravel(), weight.ravel(), n + 1).astype(float)
    for axis in (0, 1):
        here = np.unique(place[axis::4])
        gravity[here] += particles[here] * chain.gravity[axis]
    rows = table(AXIAL_POINTS, 1)
    return Assembly(
        place=place,
        mass=_pack(mass_full),
        bending=_pack(scatter(elements, np.kron(bend, np.eye(2)), n)),
        slope=_pack(_point_rows(elements, rows, n)),
        axial=np.repeat(field("axial_stiffness"), AXIAL_POINTS),
        weight=(lengths[:, None] * w_axial).ravel(),
        bend_slope=_pack(_point_rows(elements, table(BENDING_POINTS, 1), n)),
        bend_curve=_pack(_point_rows(elements, curve, n)),
        bend_weight=bend_weight.ravel(),
        gravity=gravity[:n],
        elements=elements,
        rows=rows,
    )


def _merged_places(chain: Chain) -> tuple[Places, int]:
    """Order the coordinates along the chain, hinges as `r'_end, r, r'_start`: narrow band."""
    place = np.full(chain.size, -1, dtype=np.intp)
    order: list[tuple[int, ...]] = []
    for k in range(len(chain.links)):
        for i in range(chain.nodes):
            rx, ry, tx, ty = chain.slots(k, i)
            if i == 0 and k > 0:
                px, py, *_ = chain.slots(k - 1, -1)
                order += [(px, rx), (py, ry), (tx,), (ty,)]
            elif (i == chain.elements and k + 1 < len(chain.links)) or (i == 0 and chain.pinned):
                order += [(tx,), (ty,)]
            else:
                order += [(rx,), (ry,), (tx,), (ty,)]
    for number, slots in enumerate(order):
        place[list(slots)] = number
    return place, len(order)


def _lumps(chain: Chain, place: Places, n: int) -> tuple[Array, Array]:
    """Diagonals of the particles and of the hub, (n + 1,) each."""
    particles, hub = np.zeros((2, n + 1))
    ends = [chain.slots(k, 0) for k in range(len(chain.links))]
    ends.append(chain.slots(len(chain.links) - 1, -1))
    for slots, particle in zip(ends, chain.masses or [0.0] * len(ends), strict=True):
        particles[place[list(slots[:2])]] += particle
    hub[place[list(ends[0][2:])]] += chain.hub_inertia
    return particles, hub


def _point_rows(elements: Places, rows: Array, n: int) -> Array:
    """Rows that map coordinates to a vector field at points, x components before y; (2 P, n)."""
    n_e, n_g, _ = rows.shape
    out = np.zeros((2, n_e, n_g, n + 1))
    e, g = np.arange(n_e)[:, None, None], np.arange(n_g)[None, :, None]
    for axis in (0, 1):
        out[axis, e, g, elements[:, None, axis::2]] = rows
    return out[..., :n].reshape(2 * n_e * n_g, n)


def _pack(matrix: Array) -> Matrix:
    """Sparse form of a large matrix; read-only, as `assemble` hands it out more than once."""
    matrix.setflags(write=False)
    return matrix if matrix.shape[1] < _DENSE_BELOW else sparse.csr_array(matrix)
