"""Errors of a program's costates, by the differential equation that costates have to meet.

In an interval they are the polynomial through the values at the collocation points. They ought to
meet ``lambda' = -H_x`` between the points, too. A motion with fast states may be smooth where they
are not: at the end of a phase the costates of fast states change within a small part of the last
interval. The errors of the dynamics do not show that. By such costates a control may seem to belong
on its bound where it should leave it.

The costates at the end of each interval follow from the program. They are the slopes of its optimum
by the state there, and as accurate as the state at the end of an interval (Hager, "Runge-Kutta
methods in optimal control and the transformed adjoint system", Numerische Mathematik 87, 2000).
From them the linear differential equation of the errors is solved backwards.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import casadi as ca
import numpy as np

from ocp.arrays import Array, Flags, Integers
from ocp.mesh.trajectory import Evaluator, PhaseTrajectory
from ocp.numerics.columnwise import columnwise
from ocp.numerics.piecewise_polynomial import lagrange
from ocp.numerics.schemes import Radau
from ocp.optimality.hamiltonian import hamiltonian_of
from ocp.optimality.iterate import Iterate
from ocp.optimality.multipliers import PhaseCostates, phase_costates

# Where the parts of an interval begin and end, as local times. The costates of stable fast states
# have their layers at the end.
PARTS = np.array([0.0, 1.0 - 1.0 / 8.0, 1.0 - 1.0 / 64.0, 1.0])

# The same parts, in what is left of the interval: from its end backwards
_PARTS_BACKWARDS = tuple(pairwise((1.0 - PARTS[::-1]).tolist()))

# The rule by which each part is integrated backwards: Radau's, because the equation may be stiff
_RULE = Radau().at(4)


@dataclass(frozen=True, eq=False, repr=False)
class CostateErrors:
    """What is to be added to the costates of a phase [unit of the costates].

    Attributes
    ----------
    values : (p, N, s + 1, n)
        In each of the parts, from the last one on, and in each interval, at the support points of a
        rule that runs backwards.
    """

    values: Array

    def local(self, intervals: Integers, tau: Array) -> Array:
        """Values at local times of intervals, both (m,), shape (m, n)."""
        found = np.empty((tau.size, self.values.shape[3]))
        for values, (first, last) in zip(self.values, _PARTS_BACKWARDS, strict=True):
            here = np.flatnonzero((1.0 - tau >= first) & (1.0 - tau <= last))
            basis = lagrange(_RULE.support, (1.0 - tau[here] - first) / (last - first))
            found[here] = np.einsum("ms,msn->mn", basis, values[intervals[here]])
        return found


def costate_errors(
    iterate: Iterate, evaluator: Evaluator, index: int, acting: Flags
) -> CostateErrors:
    """What is to be added to the costates of a phase so that they meet their equation.

    It is 0 for running totals, whose costates are constant. It is 0 in intervals in which a path
    constraint acts, and in phases with equations, because their multipliers have a share in
    ``lambda'``. And it is 0 for schemes whose costates meet the minimum principle on any mesh.

    Parameters
    ----------
    index : int
        Of the phase.
    acting : (N,)
        Intervals in which a path constraint, a peak or a state's bound acts.
    """
    equation = _Equation(iterate, evaluator, index)
    states, free = equation.states, np.flatnonzero(~acting)
    parts, support = len(_PARTS_BACKWARDS), _RULE.degree + 1
    found = np.zeros((parts, acting.size, support, len(equation.costates.names)))
    with_equations = any(c.is_equation for c in iterate.transcription.constraints[index])
    if with_equations or not free.size or not iterate.scheme.informative_multipliers:
        return CostateErrors(found)

    ends = equation.costates.polynomial.ends()[free, 1, :states]
    error = equation.at_ends[free] - ends
    for part, (first, last) in enumerate(_PARTS_BACKWARDS):
        # d error / d back = step (matrix error + residual)
        step = (last - first) * np.diff(equation.motion.breakpoints)[free]
        residual, matrix = equation.along(free, 1.0 - (first + _RULE.points * (last - first)))
        known = step[:, None, None] * residual - _RULE.derivative[:, :1] * error[:, None, :]
        coupled = np.einsum("ij,ab->iajb", _RULE.derivative[:, 1:], np.eye(states))
        own = np.einsum("ij,k,kiab->kiajb", np.eye(_RULE.degree), step, matrix)

        size = _RULE.degree * states
        solved = np.linalg.solve(
            (coupled - own).reshape(-1, size, size), known.reshape(-1, size, 1)
        ).reshape(-1, _RULE.degree, states)
        found[part, free, :, :states] = np.concatenate([error[:, None], solved], axis=1)
        error = solved[:, -1]
    # a slope may be infinite at the edge of what a state may be
    return CostateErrors(np.where(np.isfinite(found), found, 0.0))


@dataclass(frozen=True, eq=False, repr=False)
class _Equation:
    """The equation of the costates of one phase."""

    iterate: Iterate
    evaluator: Evaluator
    index: int

    @property
    def motion(self) -> PhaseTrajectory:
        """The phase of the trajectory."""
        return self.iterate.trajectory.phases[self.index]

    @property
    def states(self) -> int:
        """Their number, n_x."""
        return len(self.motion.states)

    @cached_property
    def costates(self) -> PhaseCostates:
        """Those of the program."""
        return phase_costates(self.iterate, self.index)

    @cached_property
    def at_ends(self) -> Array:
        """Costates at the end of each interval, from the rows of the program, (N, n_x).

        Where no limit acts, the Lagrangian is stationary by the states at the last support point:
        ``e lambda = sum_j w_j D_j lambda_j - h w H_x``. Here ``h`` is the width of the interval,
        ``w`` and ``D`` are weights and slopes of the scheme, and ``e`` is the weight of the states
        at that point in the state at the end.
        """
        found = np.empty((self.motion.intervals, self.states))
        for group in self.iterate.transcription.columns.phases[self.index].groups:
            rule, k = group.collocation, group.intervals
            points = np.repeat(k, rule.degree), np.tile(rule.points, k.size)
            costates = self.costates.local(*points)[:, : self.states]
            of_rows = np.einsum(
                "s,ksn->kn",
                rule.weights * rule.derivative[:, -1],
                costates.reshape(k.size, rule.degree, -1),
            )
            slope, _ = self._evaluated(k, np.full(k.size, rule.points[-1]))
            widths = np.diff(self.motion.breakpoints)[k, None]
            found[k] = (of_rows - rule.weights[-1] * widths * slope) / rule.end[-1]
        return found

    def along(self, intervals: Integers, tau: Array) -> tuple[Array, Array]:
        """``lambda' + H_x`` and its derivative by the costates, at local times (m,) of intervals.

        Returns
        -------
        residual : (k, m, n_x)
        matrix : (k, m, n_x, n_x)
        """
        k, local = np.repeat(intervals, tau.size), np.tile(tau, intervals.size)
        slope, matrix = self._evaluated(k, local)
        residual = self.costates.polynomial.rate(k, local)[:, : self.states] + slope
        shape = (intervals.size, tau.size, self.states)
        return residual.reshape(shape), matrix.reshape(*shape, self.states)

    def _evaluated(self, intervals: Integers, tau: Array) -> tuple[Array, Array]:
        """``H_x`` (m, n_x) and its derivative by the costates (m, n_x, n_x)."""
        slope, matrix = columnwise(
            self._function,
            self.motion.local(intervals, tau),
            self.evaluator.times(self.motion, intervals, tau)[:, None],
            self.evaluator.numbers(self.iterate.trajectory),
            self.costates.local(intervals, tau),
        )
        # columns of a matrix follow each other in the output
        return slope, matrix.reshape(-1, self.states, self.states).transpose(0, 2, 1)

    @property
    def _function(self) -> ca.Function:
        """``(signals, time, unknowns and constants, costates) -> H_x, H_x by lambda``, kept."""
        hamiltonian = hamiltonian_of(self.evaluator, self.iterate.transcription, self.index)

        def made() -> ca.Function:
            inputs = [ca.SX.sym(f"i{i}", hamiltonian.function.size1_in(i)) for i in range(4)]
            value = hamiltonian.function(*inputs)[0]
            slope = ca.gradient(value, inputs[0])[: self.states]
            matrix = ca.jacobian(slope, inputs[3])[:, : self.states]
            outputs = [ca.densify(slope), ca.densify(ca.vec(matrix))]
            return ca.Function("costates", inputs, ca.cse(outputs))

        key = ("equation of the costates", self.index, self.motion.signals)
        return self.evaluator.once(key, made)
