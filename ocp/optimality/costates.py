"""Costates from the multipliers of the collocation equations, and back.

The dynamics are adjoined as ``J + int lambda . (f - x') dt`` to the objective as it is minimised.
Hence ``H = L + lambda . f``, and a costate is the change of the minimum per unit of a disturbance
added to its state. Path constraints are adjoined as they are stated and not by their derivatives.
Costates therefore jump where the path meets or leaves a bound of a state, by the masses in
`ocp.optimality.multipliers`.

The multiplier ``nu`` of the scaled row ``(D X - h f) / size`` at a collocation point of quadrature
weight ``w`` gives ``lambda = -nu * objective scale / (size * w)`` (Garg et al., "A unified
framework for the numerical solution of optimal control problems using pseudospectral methods",
Automatica 46, 2010). The rows of a running total already hold the weights, so that theirs is
``lambda = -nu * objective scale / size``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocp.arrays import Array, Integers
from ocp.numerics.piecewise_polynomial import Lagrange, Piece, PiecewisePolynomial
from ocp.optimality.iterate import Iterate
from ocp.transcription.columns import IntervalGroup
from ocp.transcription.transcribe import Transcription


@dataclass(frozen=True, eq=False)
class PhaseCostates:
    """Costates of one phase.

    Attributes
    ----------
    name : str
        Of the phase.
    names : tuple of str
        The states, then the integrals that enter the problem as running totals.
    polynomial : PiecewisePolynomial
        Through the values at the collocation points [unit of the objective / unit of the state].
    """

    name: str
    names: tuple[str, ...]
    polynomial: PiecewisePolynomial

    def __repr__(self) -> str:
        return f"PhaseCostates('{self.name}': {', '.join(self.names)})"

    def local(self, intervals: Integers, tau: Array) -> Array:
        """Costates at local times of intervals, shape (m, n)."""
        numbers, tau = np.broadcast_arrays(np.asarray(intervals), np.asarray(tau, dtype=float))
        return self.polynomial.value(numbers, tau)


def costates(iterate: Iterate) -> tuple[PhaseCostates, ...]:
    """Costates of all phases."""
    return tuple(phase_costates(iterate, i) for i in range(len(iterate.trajectory.phases)))


def phase_costates(iterate: Iterate, index: int) -> PhaseCostates:
    """Costates of one phase."""
    transcription, multipliers = iterate.transcription, iterate.row_multipliers
    phase, rows = transcription.columns.phases[index], transcription.rows.phases[index]
    state_factors, total_factors = _factors(transcription, index)

    pieces = []
    for group, defects in zip(phase.groups, rows.defects, strict=True):
        of_states = multipliers[defects] * state_factors / _weights(group)

        # a running total has one row in an interval: its costate is constant there
        of_totals = multipliers[rows.totals[group.intervals]] * total_factors
        of_totals = np.repeat(of_totals[:, None, :], group.collocation.degree, axis=1)

        basis = Lagrange(tuple(group.collocation.points.tolist()))
        values = np.concatenate([of_states, of_totals], axis=2)
        pieces.append(Piece(group.intervals, basis, values))

    names = (*(s.name for s in phase.states), *(f.name for f in phase.integrals))
    breakpoints = iterate.trajectory.phases[index].breakpoints
    return PhaseCostates(phase.phase.name, names, PiecewisePolynomial(breakpoints, tuple(pieces)))


def put_costates(
    multipliers: Array, transcription: Transcription, index: int, group: int, values: Array
) -> None:
    """Write the row multipliers that belong to costates, the inverse of `phase_costates`.

    Parameters
    ----------
    multipliers : (rows,)
        Row multipliers of the transcription, which are changed in place.
    index, group : int
        Numbers of the phase and of its group of intervals.
    values : (m, s, n)
        Costates at the collocation points of the group's intervals.
    """
    phase, rows = transcription.columns.phases[index], transcription.rows.phases[index]
    state_factors, total_factors = _factors(transcription, index)
    own = phase.groups[group]
    n_x = len(phase.states)

    multipliers[rows.defects[group]] = values[:, :, :n_x] * _weights(own) / state_factors
    multipliers[rows.totals[own.intervals]] = values[:, -1, n_x:] / total_factors


def _factors(transcription: Transcription, index: int) -> tuple[Array, Array]:
    """What a scaled multiplier is multiplied by, of the states (n_x,) and of the totals (n_q,)."""
    scales, phase = transcription.scales, transcription.columns.phases[index]
    states = np.array([scales.signals[s.name] for s in phase.states])
    totals = np.array([scales.functionals[f] for f in phase.integrals])
    return -scales.objective / states, -scales.objective / totals


def _weights(group: IntervalGroup) -> Array:
    """Quadrature weights of the collocation points, shape (s, 1)."""
    return group.collocation.weights[:, None]
