"""Costates from the multipliers of the collocation equations.

Convention: the dynamics are adjoined as ``J + int lambda . (f - x') dt`` to the objective as it is
minimised, so ``H = L + lambda . f`` and a costate is the change of the minimum per unit of a
disturbance added to its state.  Path constraints are adjoined directly, as they are stated and not
by their derivatives, so that costates jump where the path meets or leaves a bound of a state, by
the masses in `ocp.optimality.multipliers`.  The multiplier ``nu`` of the scaled row
``(D X - h f) / size`` at a collocation point with quadrature weight ``w`` gives
``lambda = -nu * objective scale / (size * w)`` (Garg et al., "A unified framework for the numerical
solution of optimal control problems using pseudospectral methods", Automatica 46, 2010).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ocp.numerics.schemes import SchemeName, lagrange, scheme
from ocp.transcription.transcribe import Transcription

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class PhaseCostates:
    """Costates of one phase at the collocation points.

    Attributes
    ----------
    pieces : (degree, intervals (m,), values (m, degree, n)) per degree.
    names : states, then integrals that enter the problem as running totals.
    """

    name: str
    scheme: SchemeName
    names: tuple[str, ...]
    pieces: tuple[tuple[int, Integers, Array], ...]

    def local(self, intervals: Integers, tau: Array) -> Array:
        """Costates at local times of intervals, shape (m, n)."""
        k, tau = np.broadcast_arrays(np.asarray(intervals), np.asarray(tau, dtype=float))
        values = np.empty((k.size, len(self.names)))
        for degree, own, table in self.pieces:
            row = np.clip(np.searchsorted(own, k), 0, own.size - 1)
            here = np.flatnonzero(own[row] == k)
            if here.size:
                weights = lagrange(scheme(self.scheme, degree).points, tau[here])
                values[here] = np.einsum("ms,msn->mn", weights, table[row[here]])
        return values


def costates(transcription: Transcription, multipliers: Array) -> tuple[PhaseCostates, ...]:
    """Costates of all phases from the row multipliers of a solved transcription."""
    scales, found = transcription.scales, []
    for layout in transcription.layouts:
        label = f"{layout.phase.name}: collocation"
        blocks = [b for b in transcription.blocks if b.name == label]
        sizes = [scales.signals[s.name] for s in layout.states]
        sizes += [scales.functionals[f] for f in layout.integrals]
        pieces = []
        n_x, n_q = len(layout.states), len(layout.integrals)
        for block, group in zip(blocks, layout.groups, strict=True):
            s = group.scheme.degree
            nu = multipliers[block.rows]
            own = np.hstack([nu[:, :n_x], nu[:, nu.shape[1] - n_q :]]).reshape(-1, s, n_x + n_q)
            weights = group.scheme.weights[None, :, None]
            own = -own * scales.objective / np.asarray(sizes)
            own[:, :, :n_x] /= weights
            pieces.append((s, group.intervals, own))
        names = (*(s.name for s in layout.states), *(f.name for f in layout.integrals))
        found.append(PhaseCostates(
            layout.phase.name, layout.groups[0].scheme.name, names, tuple(pieces)))  # fmt: skip
    return tuple(found)
