"""Equations of a phase that tie controls together, so that none of these can change alone.

Where ``engine + battery`` has to meet a demand, another value of the one goes with another value of
the other. Controls that are tried in place of a motion's own are moved onto the equations first.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from ocp.arrays import Array
from ocp.mesh.trajectory import Evaluator
from ocp.numerics.columnwise import columnwise
from ocp.optimality.hamiltonian import Hamiltonian
from ocp.optimality.iterate import Iterate

# Steps of Newton's method towards controls that meet equations: the first ones may begin far away
_NEWTON_STEPS = 6


@dataclass(frozen=True, eq=False, repr=False)
class ControlEquations:
    """Equations of a phase in which controls are, `n_e` in number.

    Attributes
    ----------
    function : casadi.Function
        ``(signals, time, unknowns and constants)`` to what the equations hold constant, (n_e,), and
        its slopes by the controls, (n_e n_u,).
    columns : list of int
        Of the controls among the signals.
    """

    function: ca.Function
    columns: list[int]

    @classmethod
    def of(
        cls, iterate: Iterate, evaluator: Evaluator, hamiltonian: Hamiltonian, index: int
    ) -> ControlEquations | None:
        """Those of phase number `index`; None if it has none."""
        constraints = iterate.transcription.constraints[index]
        places = [
            place
            for place, number in enumerate(hamiltonian.paths)
            if constraints[number].is_equation and hamiltonian.limits_controls[place]
        ]
        if not places:
            return None
        signals = iterate.trajectory.phases[index].signals
        columns = [signals.index(control.name) for control in hamiltonian.controls]
        key = ("equations of controls", index, tuple(signals))
        if key not in evaluator.compiled:
            inputs, _, path = hamiltonian.expressions()
            slopes = ca.vec(ca.jacobian(path[places], inputs[0][columns]))
            outputs = [ca.densify(path[places]), ca.densify(slopes)]
            evaluator.compiled[key] = ca.Function("equations", inputs[:3], ca.cse(outputs))
        return cls(evaluator.compiled[key], columns)

    def met(
        self, controls: Array, kept: int | None, motion: Array, times: Array, numbers: Array
    ) -> Array:
        """Controls near those given that meet the equations as well as a motion does, (m, n_u).

        Newton's method takes the smallest step that solves the linear equations. Where it does not
        converge, what comes out misses the equations, and the caller has to look.

        Parameters
        ----------
        controls : (m, n_u)
        kept : int or None
            Number of a control that keeps its value.
        motion : (m, n)
            Signals of the motion.
        times : (m, 1)
            [s].
        numbers : (n,)
            Values of the unknowns and constants.
        """
        wanted, _ = columnwise(self.function, motion, times, numbers)
        signals = motion.copy()
        for _ in range(_NEWTON_STEPS):
            signals[:, self.columns] = controls
            found, slopes = columnwise(self.function, signals, times, numbers)
            slopes = slopes.reshape(*controls.shape, -1).transpose(0, 2, 1)
            if kept is not None:
                slopes[:, :, kept] = 0.0
            step = np.linalg.pinv(np.nan_to_num(slopes)) @ np.nan_to_num(wanted - found)[:, :, None]
            controls = controls + step[:, :, 0]
        return controls
