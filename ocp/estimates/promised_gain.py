"""What finer controls promise to gain, to first order, and where that promise says something."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ocp.arrays import Array, Flags
from ocp.estimates.back_off_cost import back_off_costs
from ocp.estimates.control_resolution import (
    control_errors,
    parts_to_resolve,
    saturated,
)
from ocp.mesh.trajectory import Evaluator
from ocp.optimality.active_set import ACTING, STRONGLY_ACTIVE, saturated_constraints
from ocp.optimality.control_gains import gains
from ocp.optimality.iterate import Iterate

# part of a control's range that its shape may be off by before the control counts as rough: what a
# finer smooth control would gain is the square of it, a tenth of the tolerance on the objective
_SMOOTH = 3e-4


# Part of what an interval gains, which is most of it.
_MOST = 0.5

# Of the objective: what a certificate lets finer controls promise. It is ten times the default of a
# solve, because the promise is of first order, and often ten times what they give.
CERTIFIED_GAIN = 1e-5


@dataclass(frozen=True, eq=False, repr=False)
class PhaseGains:
    """What finer controls promise in each interval of a phase, (N,) each.

    Attributes
    ----------
    anywhere : (N,)
        To gain, relative to the objective, wherever it is.
    told : (N,)
        The part of it that says something, with `back_offs`. Where a control is smooth and a
        constraint acts, its gain is noise: multipliers of the constraint sit at points, so that
        the costates between them say little of the controls. Another control that is rough, or on
        its bound, makes it no less so.
    telling : (N,)
        Whether the gain of any control says something.
    back_offs : (N,)
        To gain from limits that are backed off, which finer intervals do without.
    parts : (N,)
        In how many a smooth control is resolved, a real number.
    at_end : (N,)
        Whether most of `anywhere` is to be gained behind the first of `costate_errors.PARTS`.
    """

    anywhere: Array
    told: Array
    telling: Flags
    back_offs: Array
    parts: Array
    at_end: Flags

    @classmethod
    def of(cls, iterate: Iterate, evaluator: Evaluator, index: int, strongest: Array) -> PhaseGains:
        """Those of phase number `index`.

        Parameters
        ----------
        strongest : (N,)
            As of `strongest_multipliers` for the phase.
        """
        gained = gains(iterate, evaluator, index, strongest > STRONGLY_ACTIVE)
        of_controls = gained / iterate.objective_size
        of_parts = of_controls.sum(axis=2)
        anywhere = of_parts.sum(axis=1)
        motion, mesh = iterate.trajectory.phases[index], iterate.mesh.phases[index]
        parts = parts_to_resolve(motion, mesh, _SMOOTH)
        back_offs = back_off_costs(iterate, index)
        free = ~(strongest > ACTING)
        telling = _rough(iterate, index) | free[:, None]
        return cls(
            anywhere,
            np.where(telling, of_controls.sum(axis=1), 0.0).sum(axis=1) + back_offs,
            np.asarray(free | telling.any(axis=1)),
            back_offs,
            parts,
            at_end=of_parts[:, 1:].sum(axis=1) > _MOST * anywhere,
        )


def promised_gain(iterate: Iterate, evaluator: Evaluator, strongest: Sequence[Array]) -> float:
    """What finer controls could still gain, of the objective, the cost of back-offs included.

    Parameters
    ----------
    strongest : sequence of (N,)
        As of `ocp.optimality.active_set.strongest_multipliers`.
    """
    phases = [PhaseGains.of(iterate, evaluator, k, of_k) for k, of_k in enumerate(strongest)]
    return sum(float(phase.told.sum()) for phase in phases)


def _rough(iterate: Iterate, index: int) -> Flags:
    """Whether each control is not resolved, or stays on a bound that it should leave, (N, n_u)."""
    motion, mesh = iterate.trajectory.phases[index], iterate.mesh.phases[index]
    on_bound = saturated(motion, iterate.parameters.signal_limits)
    on_bound |= saturated_constraints(iterate, index)
    return (control_errors(motion, mesh) >= _SMOOTH) | on_bound
