"""How a phase depends on controls that are tried, and limits that tie controls together.

Where ``engine + battery`` has to meet a demand, or to exceed it, another value of the one goes with
another value of the other. Where a cost has to stay above a curve of a control, it may fall along
that curve only with the control. So controls that are tried in place of a motion's own are moved to
within these limits first, or along those that the motion touches, with the states as they are.
Algebraic signals are moved along with the controls that determine them, and count as controls here.

How the Hamiltonian and the path constraints depend on the signals that are tried is a matter of the
statement, and the same for all motions and meshes. So it is worked out once for a problem, each
part when it is first asked for.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from ocp.arrays import Array, Flags
from ocp.mesh.trajectory import Evaluator
from ocp.numerics.columnwise import columnwise
from ocp.numerics.polynomial_expressions import is_linear, is_quadratic, polynomial_degree
from ocp.optimality.hamiltonian import hamiltonian_of
from ocp.optimality.iterate import Iterate
from ocp.problem.symbols import Algebraic, Control


@dataclass(frozen=True, eq=False, repr=False)
class ControlDependence:
    """The Hamiltonian and `n_c` path constraints of a phase, as functions of `n_u` tried signals.

    Attributes
    ----------
    inputs : list of SX
        Signals, time, unknowns and constants, and costates.
    value : SX
        The Hamiltonian.
    path : (n_c,) SX
        The constraints that have rows at the collocation points, `paths` of the Hamiltonian.
    columns : tuple of int
        Of the tried signals among all signals.
    """

    inputs: list[ca.SX]
    value: ca.SX
    path: ca.SX
    columns: tuple[int, ...]

    @property
    def tried(self) -> ca.SX:
        """The symbols of the tried signals, (n_u,)."""
        return self.inputs[0][list(self.columns)]

    @cached_property
    def is_straight(self) -> bool:
        """Whether the Hamiltonian and all constraints are linear."""
        return is_linear(self.value, self.tried) and is_linear(self.path, self.tried)

    @cached_property
    def is_square(self) -> bool:
        """Whether the Hamiltonian is a quadratic function, without steps and kinks."""
        return is_quadratic(self.value, self.tried)

    @cached_property
    def changes_shortly(self) -> bool:
        """Whether what controls do to the Hamiltonian may change for a short time, as in a gust.

        It may where time enters their slopes otherwise than as a polynomial.
        """
        slopes = ca.vertsplit(ca.gradient(self.value, self.tried))
        return any(polynomial_degree(slope, [self.inputs[1]], [1]) is None for slope in slopes)

    @cached_property
    def hamiltonian(self) -> ca.Function:
        """``(signals, time, unknowns and constants, costates) -> H``."""
        return ca.Function("hamiltonian_alone", self.inputs, [self.value])

    @cached_property
    def shared(self) -> tuple[tuple[int, ...], ca.Function] | None:
        """Numbers of the constraints in which tried signals are, and these with their slopes.

        None where there are none. The function is ``(signals, time, unknowns and constants) ->
        constraints (k,), slopes by the tried signals (k n_u,)``.
        """
        slopes = ca.jacobian(self.path, self.tried)
        places = [i for i in range(self.path.numel()) if slopes[i, :].nnz() > 0]
        if not places:
            return None
        outputs = [ca.densify(self.path[places]), ca.densify(ca.vec(slopes[places, :]))]
        return tuple(places), ca.Function("limits", self.inputs[:3], ca.cse(outputs))

    @cached_property
    def tied(self) -> tuple[int, ...]:
        """Numbers of linear constraints that tie tried signals to each other by states or by time.

        A cost above a power is tied to the force by the speed.
        """
        signals, time = self.inputs[:2]
        columns = [i for i in range(signals.numel()) if i not in self.columns]
        along = ca.vertcat(signals[columns], time)
        slopes = ca.jacobian(self.path, self.tried)
        shared = [i for i in range(self.path.numel()) if slopes[i, :].nnz() > 1]
        several = [i for i in shared if is_linear(self.path[i], self.tried)]
        return tuple(i for i in several if ca.depends_on(self.path[i], along))

    @cached_property
    def curved(self) -> tuple[int, ...]:
        """Numbers of the constraints that are not linear."""
        every = range(self.path.numel())
        return tuple(i for i in every if not is_linear(self.path[i], self.tried))

    @cached_property
    def curvatures(self) -> ca.Function | None:
        """``(signals, time, unknowns and constants) -> second derivatives (n_u^2,)`` of `curved`.

        None where one of these is no quadratic function.
        """
        if not all(is_quadratic(self.path[i], self.tried) for i in self.curved):
            return None
        second = [ca.densify(ca.vec(ca.hessian(self.path[i], self.tried)[0])) for i in self.curved]
        return ca.Function("curvatures", self.inputs[:3], ca.cse(second))


def tried_signals(iterate: Iterate, index: int) -> tuple[Control | Algebraic, ...]:
    """The controls of phase number `index`, and its algebraic signals, which change with them."""
    columns = iterate.transcription.columns.phases[index]
    return (*columns.controls, *columns.algebraics)


def dependence_on_controls(iterate: Iterate, evaluator: Evaluator, index: int) -> ControlDependence:
    """That of phase number `index` on its `tried_signals`, made once for a problem."""
    signals = iterate.trajectory.phases[index].signals
    columns = tuple(signals.index(signal.name) for signal in tried_signals(iterate, index))

    def made() -> ControlDependence:
        hamiltonian = hamiltonian_of(evaluator, iterate.transcription, index)
        return ControlDependence(*hamiltonian.expressions(), columns)

    return evaluator.once(("dependence on controls", index, signals, columns), made)


def are_tied(iterate: Iterate, evaluator: Evaluator, index: int) -> bool:
    """Whether several controls share an inequality with states or time in phase number `index`.

    What such controls gain together is no part of `ocp.optimality.control_gains`: there the
    inequality leaves none of them any room.
    """
    dependence = dependence_on_controls(iterate, evaluator, index)
    paths = hamiltonian_of(evaluator, iterate.transcription, index).paths
    constraints = iterate.transcription.constraints[index]
    return any(not constraints[paths[place]].is_equation for place in dependence.tied)


# Steps of Newton's method towards controls within their limits: the first ones may begin far away
_NEWTON_STEPS = 6

# Part of a constraint's size that is rounding
_ROUNDING = 1e-9

# Part of its scale within which a limit is touched: between points a motion is a little off it
_TOUCHED = 1e-3


@dataclass(frozen=True, eq=False, repr=False)
class ControlLimits:
    """The path constraints of a phase in which controls are, `n_c` in number, at `m` points.

    Attributes
    ----------
    function : casadi.Function
        ``(signals, time, unknowns and constants)`` to the constraints, (n_c,), and their slopes by
        the controls, (n_c n_u,).
    columns : tuple of int
        Of the controls among the signals.
    motion : (m, n)
        Signals of the motion.
    times : (m, 1)
        [s].
    numbers : (n,)
        Values of the unknowns and constants.
    own : (m, n_c)
        Values of the constraints on the motion.
    lower, upper : (m, n_c)
        Their limits, as loose as the motion itself is.
    touched : (m, n_c)
        Which inequalities the motion touches.
    """

    function: ca.Function
    columns: tuple[int, ...]
    motion: Array
    times: Array
    numbers: Array
    own: Array
    lower: Array
    upper: Array
    touched: Flags

    @classmethod
    def of(
        cls,
        iterate: Iterate,
        evaluator: Evaluator,
        index: int,
        motion: Array,
        times: Array,
    ) -> ControlLimits | None:
        """Those of phase number `index`; None if it has none.

        Parameters
        ----------
        motion : (m, n)
            Signals at the points.
        times : (m, 1)
            [s].
        """
        dependence = dependence_on_controls(iterate, evaluator, index)
        if dependence.shared is None:
            return None
        places, function = dependence.shared
        numbers = evaluator.numbers(iterate.trajectory)

        # with the motion's own controls a constraint may be beyond its limits by what is tolerated
        own, _ = columnwise(function, motion, times, numbers)
        constraints = iterate.transcription.constraints[index]
        hamiltonian = hamiltonian_of(evaluator, iterate.transcription, index)
        stated = [constraints[hamiltonian.paths[place]] for place in places]
        peaks = iterate.trajectory.peaks_of(iterate.problem)
        limits = np.array([one.limits(iterate.parameters, peaks) for one in stated])
        slack = _ROUNDING * (1.0 + np.abs(own))
        lower, upper = np.minimum(limits[:, 0], own) - slack, np.maximum(limits[:, 1], own) + slack

        off = np.abs(own[:, :, None] - limits).min(axis=2)
        near = off <= _TOUCHED * np.array([one.scale for one in stated])
        touched = near & ~np.array([one.is_equation for one in stated])
        return cls(function, dependence.columns, motion, times, numbers, own, lower, upper, touched)

    def met(self, controls: Array, kept: int | None, *, along: bool) -> Array:
        """Controls near those given with which no constraint is beyond its limits, (m, n_u).

        Newton's method takes the smallest step onto the limits that are exceeded. Where it does not
        converge, what comes out exceeds them, and the caller has to look.

        Parameters
        ----------
        controls : (m, n_u)
        kept : int or None
            Number of a control that keeps its value.
        along : bool
            Whether the limits that the motion touches are not left to the inside either.
        """
        lower = np.where(along & self.touched, self.own, self.lower)
        upper = np.where(along & self.touched, self.own, self.upper)
        signals = self.motion.copy()
        for _ in range(_NEWTON_STEPS):
            signals[:, self.columns] = controls
            found, slopes = columnwise(self.function, signals, self.times, self.numbers)
            wanted = np.nan_to_num(np.clip(found, lower, upper) - found)
            exceeded = wanted != 0.0
            if not exceeded.any():
                break
            slopes = slopes.reshape(*controls.shape, -1).transpose(0, 2, 1) * exceeded[:, :, None]
            if kept is not None:
                slopes[:, :, kept] = 0.0
            step = np.linalg.pinv(np.nan_to_num(slopes)) @ wanted[:, :, None]
            controls = controls + step[:, :, 0]
        return controls

    def allow(self, controls: Array) -> Flags:
        """Whether no constraint is beyond its limits with controls (m, n_u), shape (m,)."""
        signals = self.motion.copy()
        signals[:, self.columns] = controls
        found, _ = columnwise(self.function, signals, self.times, self.numbers)
        return np.asarray(((found >= self.lower) & (found <= self.upper)).all(axis=1))
