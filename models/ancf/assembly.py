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

from models.ancf.chain import Chain
from models.ancf.element import AXIAL_POINTS, BENDING_POINTS, mass_matrix, shape_row
from models.arrays import Array, Places
from models.numerics import gauss_legendre

Matrix: TypeAlias = Any
"""A dense array or, for a large mesh, a sparse one of SciPy."""

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

    def energies(self, x: Array, rate: Array) -> tuple[Array, Array, Array]:
        """Kinetic, strain and gravity energy [J], (s,) each; that of gravity is 0 at the root."""
        kinetic = 0.5 * (rate * (self.mass @ rate)).sum(axis=0)
        return kinetic, self.strain_energy(x), -self.gravity @ x

    def tangent(self, x: Array, axial_force: Array | None = None) -> Array:
        """Hessian of (6) at one configuration x (n,), dense (n, n) [N/m].

        `axial_force` (G,) takes the place of EA eps [N] where the axial forces are unknowns.
        """
        slope = (self.slope @ x).reshape(2, -1)
        if axial_force is None:
            axial_force = self.axial * 0.5 * ((slope**2).sum(axis=0) - 1.0)
        n_e, n_g, _ = self.rows.shape

        # Material part: EA (S'^T r') (S'^T r')^T at each Gauss point.
        strain_gradient = self.rows[..., None] * slope.T.reshape(n_e, n_g, 1, 2)
        strain_gradient = strain_gradient.reshape(n_e, n_g, 8)
        weighted = strain_gradient * (self.weight * self.axial).reshape(n_e, n_g, 1)
        blocks = (strain_gradient.transpose(0, 2, 1) @ weighted).reshape(n_e, 4, 2, 4, 2)

        # Geometric part: N S'^T S', the same for both axes.
        force = (self.weight * axial_force).reshape(n_e, n_g, 1)
        geometric = self.rows.transpose(0, 2, 1) @ (self.rows * force)
        blocks[:, :, 0, :, 0] += geometric
        blocks[:, :, 1, :, 1] += geometric

        return scatter(self.elements, blocks.reshape(n_e, 8, 8), self.size) + dense(self.bending)


def dense(matrix: Matrix) -> Array:
    """Dense copy or view of a matrix."""
    return np.asarray(matrix if isinstance(matrix, np.ndarray) else matrix.toarray())


def scatter(elements: Places, blocks: Array, n: int) -> Array:
    """Sum element matrices (E, 8, 8) into a dense (n, n); coordinate n is dropped."""
    entries = elements[:, :, None] * (n + 1) + elements[:, None, :]
    flat = np.bincount(entries.ravel(), weights=blocks.ravel(), minlength=(n + 1) ** 2)
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
    elements = _element_places(chain, place, n)

    # one value for each element
    link_of = np.repeat(np.arange(len(chain.links)), chain.elements)
    lengths = np.array([link.length / chain.elements for link in chain.links])[link_of]
    density = np.array([link.linear_density for link in chain.links])[link_of]
    EA = np.array([link.axial_stiffness for link in chain.links])[link_of]
    EI = np.array([link.bending_stiffness for link in chain.links])[link_of]

    def shape_table(points: int, derivative: int) -> Array:
        xi, _ = gauss_legendre(points)
        return np.array([[shape_row(x, L, derivative) for x in xi] for L in lengths])

    weights_axial = gauss_legendre(AXIAL_POINTS)[1]
    weights_bending = gauss_legendre(BENDING_POINTS)[1]
    slope_rows, curve_rows = shape_table(AXIAL_POINTS, 1), shape_table(BENDING_POINTS, 2)
    bend_weight = EI[:, None] * lengths[:, None] * weights_bending
    bending = np.einsum("eg,egi,egj->eij", bend_weight, curve_rows, curve_rows)

    masses = np.array([mass_matrix(*pair) for pair in zip(lengths, density, strict=True)])
    particles, hub = _lumps(chain, place, n)
    mass = scatter(elements, masses, n) + np.diag((particles + hub)[:n])

    return Assembly(
        place=place,
        mass=_pack(mass),
        bending=_pack(scatter(elements, np.kron(bending, np.eye(2)), n)),
        slope=_pack(_point_rows(elements, slope_rows, n)),
        axial=np.repeat(EA, AXIAL_POINTS),
        weight=(lengths[:, None] * weights_axial).ravel(),
        bend_slope=_pack(_point_rows(elements, shape_table(BENDING_POINTS, 1), n)),
        bend_curve=_pack(_point_rows(elements, curve_rows, n)),
        bend_weight=bend_weight.ravel(),
        gravity=_gravity(chain, place, elements, masses, particles),
        elements=elements,
        rows=slope_rows,
    )


def _merged_places(chain: Chain) -> tuple[Places, int]:
    """Order the coordinates along the chain, hinges as `r'_end, r, r'_start`: narrow band."""
    last_link = len(chain.links) - 1
    order: list[tuple[int, ...]] = []  # the slots of the node vector that share a coordinate
    for k in range(len(chain.links)):
        for i in range(chain.nodes):
            rx, ry, tx, ty = chain.slots(k, i)
            if i == 0 and k > 0:
                px, py, *_ = chain.slots(k - 1, -1)
                order += [(px, rx), (py, ry), (tx,), (ty,)]
            elif (i == chain.elements and k < last_link) or (i == 0 and chain.pinned):
                # the position is that of the next link's first node, or fixed
                order += [(tx,), (ty,)]
            else:
                order += [(rx,), (ry,), (tx,), (ty,)]

    place = np.full(chain.size, -1, dtype=np.intp)
    for number, slots in enumerate(order):
        place[list(slots)] = number
    return place, len(order)


def _element_places(chain: Chain, place: Places, n: int) -> Places:
    """Coordinates of each element, (E, 8), `n` where fixed."""
    first = [chain.slots(k, i)[0] for k in range(len(chain.links)) for i in range(chain.elements)]
    slots = np.array(first)[:, None] + np.arange(8)
    return np.where(place[slots] < 0, n, place[slots])


def _lumps(chain: Chain, place: Places, n: int) -> tuple[Array, Array]:
    """Diagonals of the particles and of the hub, (n + 1,) each."""
    particles, hub = np.zeros((2, n + 1))

    ends = [chain.slots(k, 0) for k in range(len(chain.links))]
    ends.append(chain.slots(len(chain.links) - 1, -1))
    for slots, particle in zip(ends, chain.masses or [0.0] * len(ends), strict=True):
        particles[place[list(slots[:2])]] += particle  # a fixed place, -1, is the entry dropped

    hub[place[list(ends[0][2:])]] += chain.hub_inertia
    return particles, hub


def _gravity(
    chain: Chain, place: Places, elements: Places, masses: Array, particles: Array
) -> Array:
    """Generalised force of gravity [N], (n,), on elements and particles."""
    n = len(particles) - 1

    # translations are exact motions of the elements: M times a uniform acceleration is the weight
    weight = masses @ np.kron([1.0, 0.0, 1.0, 0.0], chain.gravity)
    gravity: Array = np.bincount(elements.ravel(), weight.ravel(), n + 1).astype(float)

    for axis in (0, 1):
        positions = np.unique(place[axis::4])
        gravity[positions] += particles[positions] * chain.gravity[axis]
    return gravity[:n]


def _point_rows(elements: Places, rows: Array, n: int) -> Array:
    """Rows that map coordinates to a vector field at points, x components before y; (2 P, n)."""
    n_e, n_g, _ = rows.shape
    field = np.zeros((2, n_e, n_g, n + 1))
    e, g = np.arange(n_e)[:, None, None], np.arange(n_g)[None, :, None]
    for axis in (0, 1):
        field[axis, e, g, elements[:, None, axis::2]] = rows
    return field[..., :n].reshape(2 * n_e * n_g, n)


def _pack(matrix: Array) -> Matrix:
    """Sparse form of a large matrix; read-only, as `assemble` hands it out more than once."""
    matrix.setflags(write=False)
    if matrix.shape[1] < _DENSE_BELOW:
        return matrix

    from scipy import sparse

    return sparse.csr_array(matrix)
