"""Switches that a fixed breakpoint holds at the wrong time, and what that costs.

The Hamiltonian tells what better controls gain inside the intervals. Where a control jumps at a
breakpoint that cannot move, the controls on both sides of it may be the best ones, and the jump
should come earlier or later all the same: before it a constraint may leave the controls no room,
but for the last part of an interval. Then the Hamiltonian jumps, too.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ocp.arrays import Array, Flags
from ocp.mesh.mesh import SAME_POINT
from ocp.mesh.trajectory import Evaluator
from ocp.optimality.hamiltonian import shifts
from ocp.optimality.iterate import Iterate
from ocp.refinement.estimates.other_controls import others_of_phase
from ocp.refinement.estimates.switch_detection import Jump

# Of the objective: what a shift by the shorter interval beside it has to promise. At the optima of
# the benchmarks the costates' errors promise up to 3e-5, and a switch that was missed 1.
_MISSED = 1e-3


def held_switches(iterate: Iterate, index: int, jumps: Sequence[Jump]) -> Flags:
    """Whether controls jump at an inner breakpoint that cannot move, (N - 1,).

    Not at a known time, where the Hamiltonian may jump.
    """
    motion, mesh = iterate.trajectory.phases[index], iterate.mesh.phases[index]
    inner = motion.fractions[1:-1, None]
    at = np.array([jump.at for jump in jumps])
    known = motion.fractions_of(iterate.problem.instants[motion.name])
    jumped, pinned = (
        np.abs(inner - places).min(axis=1, initial=np.inf) <= SAME_POINT for places in (at, known)
    )
    moving = np.isin(np.arange(1, motion.intervals), mesh.movable)
    return jumped & ~pinned & ~moving


def missed_switches(
    iterate: Iterate, evaluator: Evaluator, index: int, jumps: Sequence[Jump]
) -> Array:
    """What intervals gain whose end is a switch at the wrong time, relative to the objective, (N,).

    Nothing beside breakpoints that move, or that stand at a known time, and nothing by schemes
    whose multipliers do not tell.
    """
    motion = iterate.trajectory.phases[index]
    missed = np.zeros(motion.intervals)
    if not (jumps and iterate.scheme.informative_multipliers):
        return missed

    gained = shifts(iterate, evaluator, index) / iterate.objective_size
    fixed = held_switches(iterate, index, jumps)
    gained[gained < _MISSED] = 0.0

    # a control that jumps between two valleys of the Hamiltonian is in the worse one on one side
    beside = np.zeros(motion.intervals, dtype=bool)
    beside[:-1] |= fixed
    beside[1:] |= fixed
    others = others_of_phase(iterate, evaluator, index, beside)
    if others is not None:
        of_intervals = others.of_intervals(motion.intervals) / iterate.objective_size
        gained = np.maximum(gained, of_intervals[:-1] + of_intervals[1:])

    gained[~fixed] = 0.0
    missed[:-1] += 0.5 * gained
    missed[1:] += 0.5 * gained
    return missed
