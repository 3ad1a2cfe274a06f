"""Multipliers of a solved program in the user's units and names, costates among them.

With ``J`` as it is minimised (the negative of what is maximised), the Lagrangian is ``J + sum mu .
expression``. A multiplier is positive where an upper limit holds the optimum back and negative
where a lower one does, and ``dJ/dlimit = -mu`` for either. The solver's multiplier ``nu`` of a row
``expression / scale`` gives ``mu = nu * objective scale / scale``.

The multipliers of the dynamics are the costates. The dynamics are adjoined as
``J + int lambda . (f - x') dt``. Hence ``H = L + lambda . f``, and a costate is the change of the
minimum per unit of a disturbance added to its state. Path constraints are adjoined as they are
stated and not by their derivatives. Costates therefore jump where the path meets or leaves a bound
of a state, by the masses of its `PathMultiplier`.

The multiplier ``nu`` of the scaled row ``(D X - h f) / size`` at a collocation point of quadrature
weight ``w`` gives ``lambda = -nu * objective scale / (size * w)`` (Garg et al., "A unified
framework for the numerical solution of optimal control problems using pseudospectral methods",
Automatica 46, 2010). The rows of a running total already hold the weights, so that theirs is
``lambda = -nu * objective scale / size``.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from ocp.arrays import Array, Integers
from ocp.numerics.piecewise_polynomial import Lagrange, Piece, PiecewisePolynomial
from ocp.optimality.iterate import Iterate
from ocp.transcription.columns import IntervalGroup
from ocp.transcription.rows import PathRows
from ocp.transcription.transcribe import Transcription


@dataclass(frozen=True, eq=False, repr=False)
class PathMultiplier:
    """Multipliers of one path bound or peak of a phase.

    Attributes
    ----------
    name, phase : str
    is_peak : bool
    sign : float
        -1 for the lower side of a peak of an absolute value.
    times : (m,)
        Where it is imposed [s].
    masses : (m,)
        Multipliers [unit of the objective / unit of the expression].
    densities : (m,)
        Masses per second: divided by step and quadrature weight at collocation points, nan at
        points added between them.
    """

    name: str
    phase: str
    is_peak: bool
    sign: float
    times: Array
    masses: Array
    densities: Array

    def __repr__(self) -> str:
        return f"PathMultiplier('{self.name}' in '{self.phase}': {self.times.size} points)"


@dataclass(frozen=True, eq=False, repr=False)
class Multipliers:
    """All multipliers of a solution.

    Attributes
    ----------
    costates : tuple of PhaseCostates
        Of each phase, functions of time.
    boundary : dict of str to float
        Of the problem's bounds and links, by name.
    paths : tuple of PathMultiplier
        Of the phases' bounds and peaks.
    """

    costates: tuple[PhaseCostates, ...]
    boundary: dict[str, float]
    paths: tuple[PathMultiplier, ...]

    def __repr__(self) -> str:
        names = dict.fromkeys(name for costates in self.costates for name in costates.names)
        others = dict.fromkeys((*self.boundary, *(path.name for path in self.paths)))
        return f"Multipliers(costates of {', '.join(names)}; of {', '.join(others) or 'no bounds'})"


def multipliers(iterate: Iterate) -> Multipliers:
    """Costates, multipliers of bounds and links, and those of path bounds and peaks."""
    return Multipliers(costates(iterate), boundary_multipliers(iterate), _path_multipliers(iterate))


def boundary_multipliers(iterate: Iterate) -> dict[str, float]:
    """Multipliers of the problem's bounds and links, by name."""
    problem, scales = iterate.problem, iterate.scales
    scaled = iterate.row_multipliers[iterate.transcription.rows.boundary]
    return {
        bound.name: float(multiplier * scales.objective / scales.bounds["", bound.name])
        for bound, multiplier in zip(problem.boundary_constraints, scaled, strict=True)
    }


def duration_multiplier(iterate: Iterate, index: int) -> float:
    """Multiplier of the least duration of a phase [unit of the objective / s].

    A phase with a free time has a tiny duration at least. Where it is as short as that, the
    multiplier is negative or zero: each further second, with the controls that the phase has, would
    raise the objective by minus the multiplier. Where it is longer, the multiplier is what the
    barrier leaves. It is 0 for a phase of fixed times.
    """
    scaled = iterate.row_multipliers[iterate.transcription.rows.phases[index].duration].sum()
    return float(scaled * iterate.scales.objective / iterate.scales.time)


def _path_multipliers(iterate: Iterate) -> tuple[PathMultiplier, ...]:
    """One for each path bound and each side of a peak, in the order of time."""
    parts: dict[tuple[int, int], list[PathRows]] = {}
    for rows in iterate.transcription.rows.path:
        parts.setdefault((rows.phase, rows.constraint), []).append(rows)

    found = []
    for (phase_index, constraint_index), rows_of_groups in parts.items():
        phase = iterate.trajectory.phases[phase_index]
        constraint = iterate.transcription.constraints[phase_index][constraint_index]

        # collocation points of all groups, and added points
        intervals = np.concatenate([rows.intervals for rows in rows_of_groups])
        tau = np.concatenate([rows.tau for rows in rows_of_groups])
        weights = np.concatenate([rows.weights for rows in rows_of_groups])
        scaled = np.concatenate([iterate.row_multipliers[rows.rows] for rows in rows_of_groups])

        masses = scaled * iterate.scales.objective / constraint.scale
        steps = np.diff(phase.breakpoints)[intervals]
        times = phase.breakpoints[intervals] + tau * steps
        order = np.argsort(times, kind="stable")
        found.append(
            PathMultiplier(
                name=constraint.name,
                phase=phase.name,
                is_peak=constraint.peak is not None,
                sign=constraint.sign,
                times=times[order],
                masses=masses[order],
                densities=(masses / (weights * steps))[order],
            )
        )
    return tuple(found)


def column_multipliers(iterate: Iterate) -> Array:
    """Scaled multipliers of the unknowns' bounds, shape (n,).

    Those of fixed unknowns, which the solver takes out of the program, follow from stationarity.
    """
    transcription, constants = iterate.transcription, iterate.parameters.vector
    program = transcription.program
    gradient = np.array(program.objective_gradient(iterate.x, constants)[1]).ravel()
    jacobian = program.constraint_jacobian(iterate.x, constants)[1]
    gradient += np.array(ca.mtimes(jacobian.T, ca.DM(iterate.row_multipliers))).ravel()

    lower, upper = iterate.limits.columns
    return np.where(lower == upper, -gradient, iterate.bound_multipliers)


def all_multipliers(iterate: Iterate) -> Array:
    """Scaled multipliers of the rows, then of the unknowns' bounds, shape (rows + n,)."""
    return np.concatenate([iterate.row_multipliers, column_multipliers(iterate)])


@dataclass(frozen=True, eq=False, repr=False)
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
