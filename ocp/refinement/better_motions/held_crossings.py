"""Crossings of a cost's kink that a breakpoint holds at a wrong time.

A cost above a power is raised to a control, which lies on one side of the kink before the motion
crosses it and on the other side behind. An interval in which it crosses costs a little more than
the kink, and least if the crossing is at its end. So each breakpoint holds a crossing that should
come a little earlier or later, the more the longer its intervals are. Refinement makes them short
where the crossing is, and with each mesh it moves by an interval at best.

At the right time the Hamiltonian is the same before and behind. Its jump at one breakpoint is
hidden by the multipliers, which sit at points. Its means over many intervals tell.
"""

from __future__ import annotations

import numpy as np

from ocp.arrays import Array
from ocp.estimates.constrained_arcs import changes_by_time
from ocp.estimates.other_controls.dependence import are_tied
from ocp.mesh.trajectory import Evaluator
from ocp.optimality.hamiltonian import hamiltonian_of
from ocp.optimality.interval_means import collocation_points
from ocp.optimality.iterate import Iterate
from ocp.optimality.multipliers import phase_costates

# Parts of a phase: over which the Hamiltonian is averaged on each side, and that are left out
# beside a breakpoint, as they may hold the multipliers of the crossing itself
_SIDE = 0.05
_BESIDE = 0.01

# Part of a phase by which a crossing is moved in mind. What that promises is no estimate of what is
# lost: the Hamiltonian's step falls to nothing on the way, and how soon it does not tell.
_WAY = 0.01


def held_crossing(iterate: Iterate, evaluator: Evaluator, index: int) -> float:
    """What moving a crossing of a raised kink by 1 % of its phase promises, of the objective.

    By the largest step of the Hamiltonian's means. Nothing where no limit ties controls to each
    other by states, in a phase that takes no time, and where multipliers do not tell.
    """
    told = iterate.scheme.informative_multipliers and not iterate.takes_no_time(index)
    if not (told and are_tied(iterate, evaluator, index)):
        return 0.0
    phase = iterate.trajectory.phases[index]
    hamiltonian = hamiltonian_of(evaluator, iterate.transcription, index)
    points = collocation_points(iterate.transcription.columns.phases[index])
    costates = phase_costates(iterate, index)
    values = hamiltonian.along(
        evaluator, iterate.trajectory, costates, points.intervals, points.tau
    )
    means = points.means(values.value)
    if not hamiltonian.autonomous:
        means = means - changes_by_time(iterate, evaluator, costates, index)[0]
    step = _largest_step(phase.fractions, means)
    return step * _WAY * (phase.end - phase.start) / iterate.objective_size


def _largest_step(fractions: Array, means: Array) -> float:
    """The largest difference of means on both sides of an inner breakpoint.

    Parameters
    ----------
    fractions : (N + 1,)
        Breakpoints of the phase.
    means : (N,)
        Over its intervals.
    """
    until = np.concatenate([[0.0], np.cumsum(means * np.diff(fractions))])

    def mean(first: Array, last: Array) -> Array:
        sums = np.interp(last, fractions, until) - np.interp(first, fractions, until)
        return np.asarray(sums / (last - first))

    inner = fractions[1:-1]
    inner = inner[(inner > 2 * _BESIDE) & (inner < 1.0 - 2 * _BESIDE)]
    before, behind = inner - _BESIDE, inner + _BESIDE
    left = mean(np.maximum(before - _SIDE, 0.0), before)
    right = mean(behind, np.minimum(behind + _SIDE, 1.0))
    return float(np.abs(right - left).max(initial=0.0))
