"""Limits that tie controls together, so that one of these cannot change alone.

Where ``engine + battery`` has to meet a demand, or to exceed it, another value of the one goes with
another value of the other. Where a cost has to stay above a curve of a control, it may fall along
that curve only with the control. So controls that are tried in place of a motion's own are moved to
within these limits first, or along those that the motion touches, with the states as they are.
Algebraic signals are moved along with the controls that determine them, and count as controls here.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from ocp.arrays import Array, Flags
from ocp.estimates.other_controls.dependence import dependence_on_controls
from ocp.mesh.trajectory import Evaluator
from ocp.numerics.columnwise import columnwise
from ocp.optimality.hamiltonian import hamiltonian_of
from ocp.optimality.iterate import Iterate

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
