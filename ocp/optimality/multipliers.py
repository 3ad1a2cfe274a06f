"""Multipliers of a solved program in the user's units and names.

With ``J`` as it is minimised (the negative of what is maximised), the Lagrangian is ``J + sum mu .
expression``. A multiplier is positive where an upper limit holds the optimum back and negative
where a lower one does, and ``dJ/dlimit = -mu`` for either. The solver's multiplier ``nu`` of a row
``expression / scale`` gives ``mu = nu * objective scale / scale``. Dynamics have costates instead,
see `ocp.optimality.costates`.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from ocp.arrays import Array
from ocp.optimality.costates import PhaseCostates, costates
from ocp.optimality.iterate import Iterate
from ocp.transcription.rows import PathRows


@dataclass(frozen=True, eq=False)
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


@dataclass(frozen=True, eq=False)
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

    lower, upper = transcription.columns.limits.at(iterate.parameters)
    return np.where(lower == upper, -gradient, iterate.bound_multipliers)


def all_multipliers(iterate: Iterate) -> Array:
    """Scaled multipliers of the rows, then of the unknowns' bounds, shape (rows + n,)."""
    return np.concatenate([iterate.row_multipliers, column_multipliers(iterate)])
