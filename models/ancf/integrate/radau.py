"""Radau IIA collocation on the unit step, for q'' = a directly.

Symbols: s stages, c nodes (s,), A Butcher matrix (s, s), lambda and T the eigenvalues and
eigenvectors of A. The step from (q_0, v_0) with stage accelerations a_j is
V_i = v_0 + h sum_j A_ij a_j,  Q_i = q_0 + h c_i v_0 + h^2 sum_j (A^2)_ij a_j;
c_s = 1, so the last stage is the end of the step. The order is 2 s - 1, the method L-stable.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import factorial

import numpy as np
from numpy.typing import NDArray

from models.arrays import Array
from models.errors import require
from models.numerics import radau_nodes


@dataclass(frozen=True, eq=False)
class RadauIIA:
    """Tables of the method with `stages` stages (an odd number).

    Attributes
    ----------
    nodes : (s,)
    matrix, square : (s, s)
        A and A^2.
    values, vectors, inverse : complex (s,), (s, s), (s, s)
        A = vectors diag(values) inverse; the real eigenvalue first, then one of each pair.
    joined : complex ((s + 1) / 2, s)
        Real part of `w @ joined` sums the eigenvectors and their conjugates.
    lagrange : (s, s)
        Monomial coefficients (rows, degree 0 up) of the Lagrange polynomials (columns).
    at_start : (s,)
        Lagrange polynomials at 0.
    """

    nodes: Array
    matrix: Array
    square: Array
    values: NDArray[np.complex128]
    vectors: NDArray[np.complex128]
    inverse: NDArray[np.complex128]
    joined: NDArray[np.complex128]
    lagrange: Array
    at_start: Array

    @property
    def stages(self) -> int:
        """Number of stages s."""
        return len(self.nodes)

    @cached_property
    def decoupling(self) -> Array:
        """(s, s + 1): stages to parts along the eigenvectors, real and imaginary by turns.

        So is `joining` (s + 1, s) for the way back: products of real arrays take half the time.
        """
        return np.ascontiguousarray(self.inverse.T).view(float)

    @cached_property
    def joining(self) -> Array:
        """(s + 1, s), see `decoupling`."""
        parts = np.stack((self.joined.real, -self.joined.imag), axis=1)
        return np.asarray(parts.reshape(-1, self.stages))

    def weights(self, theta: Array, integrals: int) -> Array:
        """Lagrange polynomials, integrated 0, 1 or 2 times from 0, at `theta` (m,); (m, s)."""
        powers = [
            theta ** (k + integrals) * factorial(k) / factorial(k + integrals)
            for k in range(self.stages)
        ]
        return np.stack(powers, axis=-1) @ self.lagrange


@lru_cache(maxsize=8)
def radau(stages: int) -> RadauIIA:
    """Tables of Radau IIA with 3, 5 or 7 stages (orders 5, 9, 13).

    Raises
    ------
    ModelError
        For another number of stages.
    """
    require(stages in (3, 5, 7), f"Radau stages is {stages}; use 3, 5 or 7.")

    # Collocation: row i of A integrates the Lagrange polynomials from 0 to c_i.
    nodes = radau_nodes(stages)
    degrees = np.arange(stages)
    lagrange: Array = np.linalg.inv(nodes[:, None] ** degrees).astype(float)
    matrix = (nodes[:, None] ** (degrees + 1) / (degrees + 1)) @ lagrange

    # Of a conjugate pair of eigenvalues one is enough, as the stages are real.
    values, vectors = np.linalg.eig(matrix)
    kept = np.flatnonzero(values.imag > -1e-12)
    kept = kept[np.argsort(np.abs(values[kept].imag))]
    inverse = np.linalg.inv(vectors)
    multiplicity = np.where(np.arange(len(kept)) == 0, 1.0, 2.0)

    return RadauIIA(
        nodes=nodes,
        matrix=matrix,
        square=matrix @ matrix,
        values=values[kept],
        vectors=vectors[:, kept],
        inverse=inverse[kept],
        joined=(vectors[:, kept] * multiplicity).T,
        lagrange=lagrange,
        at_start=lagrange[0].copy(),
    )
