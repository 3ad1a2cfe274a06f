"""Whether a stationary point is an inflection along one of its unknowns, and the way down from it.

Fix one unknown at a value and make all others the best. The least objective is then a function of
that value, and its slope vanishes at a stationary point. Where its curvature vanishes as well, the
point may be an inflection, as that of ``t**3`` at 0: no condition of first or second order tells it
from a minimum, and a solver that comes from above stops there.

All others follow the unknown by the linear system of Karush, Kuhn and Tucker. Let ``dz`` be their
slopes by it, those of the multipliers included. The curvature of the least objective is that of the
Lagrangian along ``dz``. By the "2n + 1" rule its third derivative is how that curvature changes
along ``dz`` (A. Griewank and A. Walther, Evaluating Derivatives, 2nd ed., SIAM 2008, chapter 13).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from ocp.arrays import Array, Integers
from ocp.nlp.solver import StartingPoint
from ocp.transcription.kernels import Program
from ocp.transcription.transcribe import ProgramLimits

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix

# A cubic that has a minimum has a hill beside it, behind which it falls. Where that is lower than
# this part of the objective, the point is an inflection or next to one: the way beyond is tried.
# A higher hill is one that changes of the active limits make as often: of a motion with dozens of
# switches a cubic says little so far from its minimum.
_HILL = 1e-5

# How far the cubic has to fall behind the hill where the unknown changes by its reach, as a part of
# the objective. Less may be what rounding makes of an unknown without influence.
_FALL = 1e-3

# Part of the reach by which the unknown is changed to measure the third derivative
_STEP = 1e-3

# Scaled stiffness of a limit that is met, and what keeps the system regular where rows depend on
# each other, or nothing on an unknown
_STIFF = 1e10
_REGULAR = 1e-10

# Part of the largest change of a time or an unknown, up to which another one stays as it is
_HELD = 1e-6

# Times the square root of its rows: entries beyond which a column counts as dense, as in COLAMD
_DENSE = 10.0

# Solutions of a system: the second one takes away what rounding leaves of the first
_GOES = 2

# Unknowns and rows up to which CasADi's factors take less than loading SciPy
_SMALL = 1000

# Scaled objective below which its size is no longer its own
_LEAST_OBJECTIVE = 1e-3


def inflection(
    program: Program,
    point: StartingPoint,
    limits: ProgramLimits,
    parameters: Array,
    along: Integers,
    reaches: Array,
) -> Array | None:
    """The way down from a stationary point that is an inflection along one of some unknowns.

    Parameters
    ----------
    point : StartingPoint
        With its multipliers.
    along : (k,)
        The columns of the unknowns that are looked at.
    reaches : (k,)
        How far each may reasonably change, scaled.

    Returns
    -------
    (n,) or None
        How all scaled unknowns change where that one changes by its reach, to first order; None
        where the point is no inflection.
    """
    lower, upper = limits.columns
    free = lower[along] < upper[along]
    if point.multipliers is None or not free.any():
        return None
    beside = _Neighbourhood(program, point, limits, parameters)
    size = max(abs(float(program.oracle(point.x, parameters)[0])), _LEAST_OBJECTIVE)
    try:
        responses = beside.pulled_by(along[free])
    except (RuntimeError, np.linalg.LinAlgError):  # the system is singular, or holds no numbers
        return None
    # where a change leads beyond all numbers nothing is told: no comparison with nan holds
    with np.errstate(all="ignore"):
        for column, reach, pulled in zip(along[free], reaches[free], responses, strict=True):
            curvature, slopes = 1.0 / pulled[column], pulled / pulled[column]
            third = beside.third(slopes, _STEP * reach)
            change = -math.copysign(reach, third) * slopes[: program.variables]
            way = beside.room(change, along) * reach
            fall = abs(third) * way**3 / 6.0 - abs(curvature) * way**2 / 2.0
            low = 2.0 / 3.0 * abs(curvature) ** 3 <= _HILL * size * third**2
            if low and fall >= _FALL * size:
                return change * (way / reach)
    return None


@dataclass(frozen=True, eq=False, repr=False)
class _Neighbourhood:
    """Stationary points beside one, with one of its unknowns fixed at another value."""

    program: Program
    point: StartingPoint
    limits: ProgramLimits
    parameters: Array

    def pulled_by(self, columns: Integers) -> Array:
        """Changes of all unknowns and multipliers by a unit slope along some unknowns (k,).

        Returns
        -------
        (k, n + m)
            Of each one, its own change is one over the curvature.
        """
        units = np.zeros((self.program.variables + self.program.rows, columns.size))
        units[columns, np.arange(columns.size)] = 1.0
        return _solved(self._optimality, units).T

    def room(self, change: Array, along: Integers) -> float:
        """Part of a change (n,), 1 at most, that limits of times and unknowns leave room for.

        They are those of the unknowns `along`, and of rows that no other unknown enters.
        """
        _, jacobian = self._derivatives(np.zeros(self.program.variables + self.program.rows))
        others = np.ones(self.program.variables)
        others[along] = 0.0
        pattern = ca.DM(jacobian.sparsity(), 1.0)
        alone = _vector(ca.mtimes(pattern, ca.DM(others))) == 0.0
        values = [self.point.x[along], self._rows[alone]]
        changes = [change[along], _vector(ca.mtimes(jacobian, ca.DM(change)))[alone]]
        sides = [
            np.concatenate([columns[along], rows[alone]])
            for columns, rows in zip(self.limits.columns, self.limits.rows, strict=True)
        ]
        value, rate = np.concatenate(values), np.concatenate(changes)
        distance = np.where(rate > 0.0, sides[1] - value, value - sides[0])
        # what is fixed moves by rounding only, and what a limit holds hardly does
        moves = np.abs(rate) > _HELD * float(np.abs(change[along]).max())
        moves &= sides[0] < sides[1]
        parts = np.maximum(distance[moves], 0.0) / np.abs(rate[moves])
        return float(min(1.0, parts.min(initial=1.0)))

    def curvature(self, slopes: Array, step: float = 0.0) -> float:
        """Of the Lagrangian along some slopes, after a step along them."""
        hessian, jacobian = self._derivatives(step * slopes)
        by_x, by_rows = np.split(slopes, [self.program.variables])
        rows = ca.mtimes(jacobian, ca.DM(by_x))
        return float(by_x @ _vector(ca.mtimes(hessian, ca.DM(by_x))) + 2 * by_rows @ _vector(rows))

    def third(self, slopes: Array, step: float) -> float:
        """Derivative of that curvature by the unknown."""
        return (self.curvature(slopes, step) - self.curvature(slopes, -step)) / (2.0 * step)

    @property
    def _rows(self) -> Array:
        """Values of the rows."""
        return _vector(self.program.oracle(self.point.x, self.parameters)[1])

    def _derivatives(self, change: Array) -> tuple[ca.DM, ca.DM]:
        """Hessian of the Lagrangian and Jacobian of the rows at a changed point."""
        _, on_rows = self.point.multipliers or (None, np.zeros(self.program.rows))
        by_x, by_rows = np.split(change, [self.program.variables])
        x, constants = self.point.x + by_x, self.parameters
        hessian = self.program.lagrangian_hessian(x, constants, 1.0, on_rows + by_rows)
        return ca.triu2symm(hessian), self.program.constraint_jacobian(x, constants)[1]

    @property
    def _optimality(self) -> ca.DM:
        """The system of Karush, Kuhn and Tucker, each limit as stiff as the barrier has it."""
        zeros = np.zeros(self.program.variables + self.program.rows)
        hessian, jacobian = self._derivatives(zeros)
        rows = self._rows
        on_bounds, on_rows = self.point.multipliers or np.split(zeros, [self.program.variables])
        bounds = _stiffness(self.point.x, on_bounds, self.limits.columns) + _REGULAR
        softness = 1.0 / np.maximum(_stiffness(rows, on_rows, self.limits.rows), _REGULAR)
        return ca.blockcat(
            [
                [hessian + ca.diag(ca.DM(bounds)), jacobian.T],
                [jacobian, -ca.diag(ca.DM(softness))],
            ]
        )


def _solved(matrix: ca.DM, right: Array) -> Array:
    """The solutions of a linear system for some right sides (n, k).

    SciPy is slow to load, and CasADi's own factors are slow for large matrices.
    """
    pattern = matrix.sparsity()
    if pattern.size1() <= _SMALL:
        return np.array(ca.Linsol("system", "csparse", pattern).solve(matrix, ca.DM(right)))
    from scipy.sparse import csc_matrix

    numbers = np.array(matrix.nonzeros()), pattern.row(), pattern.colind()
    return _bordered(csc_matrix(numbers, shape=matrix.shape), right)


def _bordered(matrix: csc_matrix, right: Array) -> Array:
    """The solutions of a symmetric sparse system for some right sides (n, k).

    A time, a peak or a parameter is in the rows of every interval. The factors of a matrix with
    such columns fill up: 2 GB for 360 intervals. They are set apart and found from a small dense
    system (the Schur complement), with whatever depends on them alone.
    """
    from scipy.sparse.linalg import splu

    entries = np.diff(matrix.indptr)
    apart = entries > _DENSE * math.sqrt(matrix.shape[0])
    others = np.diff(matrix[~apart].tocsc().indptr)
    apart |= (others <= 1) & (entries > others)
    rest, few = np.flatnonzero(~apart), np.flatnonzero(apart)
    factors, beside = splu(matrix[rest][:, rest].tocsc()), matrix[rest][:, few].toarray()
    follows = factors.solve(beside)
    dense = matrix[few][:, few].toarray() - beside.T @ follows

    solution, left = np.zeros_like(right), right
    for _ in range(_GOES):
        alone = factors.solve(left[rest])
        change = np.zeros_like(right)
        change[few] = np.linalg.solve(dense, left[few] - beside.T @ alone)
        change[rest] = alone - follows @ change[few]
        solution, left = solution + change, left - matrix @ change
    return solution


def _stiffness(values: Array, multipliers: Array, limits: tuple[Array, Array]) -> Array:
    """How strongly each limit holds a value: its multiplier over the distance from it."""
    lower, upper = limits
    distance = np.where(multipliers > 0.0, upper - values, values - lower)
    held = np.abs(multipliers) / np.maximum(distance, 1.0 / _STIFF)
    return np.where(lower >= upper, _STIFF, np.minimum(held, _STIFF))


def _vector(values: ca.DM) -> Array:
    return np.array(values).ravel()
