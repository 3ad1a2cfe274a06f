"""Switches that a fixed breakpoint holds at the wrong time, and what that costs.

The Hamiltonian tells what better controls gain inside the intervals. Where a control jumps at a
breakpoint that cannot move, the controls on both sides of it may be the best ones, and the jump
should come earlier or later all the same: before it a constraint may leave the controls no room,
but for the last part of an interval. Then the Hamiltonian jumps, too.

A control may also jump from one valley of the Hamiltonian to another. In an interval it is one
polynomial, and stays in one valley. Where the other valley is better for a part of the interval,
neither a rough control nor a slope of the Hamiltonian tells, and only controls far away do.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ocp.arrays import Array, Flags
from ocp.mesh.mesh import SAME_POINT
from ocp.mesh.trajectory import Evaluator
from ocp.optimality.hamiltonian import relative_jumps, shifts
from ocp.optimality.iterate import Iterate
from ocp.optimality.steps import steps_along
from ocp.refinement.estimates.other_controls import others_of_phase
from ocp.refinement.estimates.switch_detection import Jump, switches_at_breakpoints

# Of the objective: what a shift by the shorter interval beside it has to promise. At the optima of
# the benchmarks the costates' errors promise up to 3e-5, and a switch that was missed 1.
_MISSED = 1e-3

# Of the Hamiltonian's terms: by what it may differ on both sides of a switch. A certificate refuses
# as much. At the optima of the benchmarks the costates' errors leave up to 1.4e-3.
_BALANCED = 5e-3


def held_switches(iterate: Iterate, index: int, jumps: Sequence[Jump]) -> Flags:
    """Whether controls jump at an inner breakpoint that cannot move, (N - 1,).

    Not at a known time, where the Hamiltonian may jump.
    """
    inner = iterate.trajectory.phases[index].fractions[1:-1]
    return _held(iterate, index) & _near(inner, np.array([jump.at for jump in jumps]))


def missed_switches(
    iterate: Iterate, evaluator: Evaluator, index: int, jumps: Sequence[Jump]
) -> Array:
    """What inner breakpoints promise beside which the Hamiltonian jumps, (N - 1,).

    Relative to the objective. Nothing for breakpoints that move, or that stand at a known time, and
    nothing by schemes whose multipliers do not tell.
    """
    fixed = held_switches(iterate, index, jumps)
    if not (fixed.any() and iterate.scheme.informative_multipliers):
        return np.zeros(fixed.size)

    gained = shifts(iterate, evaluator, index) / iterate.objective_size
    return np.where(fixed & (gained >= _MISSED), gained, 0.0)


def displaced_switches(iterate: Iterate, evaluator: Evaluator, index: int) -> Flags:
    """Whether the Hamiltonian jumps at inner breakpoints as it must not at a switch, (N - 1,).

    Beside a narrow interval such a jump promises little, however far off the switch is. None where
    an expression steps along the motion: the Hamiltonian jumps there by itself.
    """
    stepped = _stepped(iterate, index)
    if not (stepped.any() and iterate.scheme.informative_multipliers):
        return np.zeros_like(stepped)
    found = stepped & (relative_jumps(iterate, evaluator, index) > _BALANCED)
    if found.any() and _steps(iterate, evaluator, index):
        return np.zeros_like(found)
    return found


def between_valleys(iterate: Iterate, evaluator: Evaluator, index: int) -> Array:
    """What inner breakpoints promise at which a control is too long in a valley, (N - 1,).

    Relative to the objective. A control that jumps from one valley of the Hamiltonian to another is
    in the worse one on one side of such a breakpoint. It may go on rising behind its step, so that
    the jump seems to lie inside an interval: both sides of the breakpoint are compared. Nothing
    where `missed_switches` has nothing to tell either.
    """
    motion = iterate.trajectory.phases[index]
    stepped = _stepped(iterate, index)
    others = None
    if stepped.any() and iterate.scheme.informative_multipliers:
        others = others_of_phase(iterate, evaluator, index, beside(stepped))
    if others is None:
        return np.zeros(stepped.size)
    of_intervals = others.of_intervals(motion.intervals) / iterate.objective_size
    return np.where(stepped, of_intervals[:-1] + of_intervals[1:], 0.0)


def beside(breakpoints: Flags) -> Flags:
    """Whether intervals begin or end at one of some inner breakpoints (N - 1,), shape (N,)."""
    ends = np.concatenate([[False], breakpoints, [False]])
    return np.asarray(ends[:-1] | ends[1:])


def shared(missed: Array) -> Array:
    """What inner breakpoints promise (N - 1,), half of it for each side, (N,)."""
    halves = np.concatenate([[0.0], 0.5 * missed, [0.0]])
    return np.asarray(halves[:-1] + halves[1:])


def _held(iterate: Iterate, index: int) -> Flags:
    """Whether inner breakpoints neither move nor stand at a known time, (N - 1,)."""
    motion, mesh = iterate.trajectory.phases[index], iterate.mesh.phases[index]
    known = motion.fractions_of(iterate.problem.instants[motion.name])
    moving = np.isin(np.arange(1, motion.intervals), mesh.movable)
    return ~_near(motion.fractions[1:-1], known) & ~moving


def _stepped(iterate: Iterate, index: int) -> Flags:
    """Whether a control jumps at such breakpoints, by their two sides, (N - 1,).

    A control may go on rising behind its step, so that the jump seems to lie inside an interval.
    """
    return _held(iterate, index) & switches_at_breakpoints(iterate.trajectory.phases[index])


def _steps(iterate: Iterate, evaluator: Evaluator, index: int) -> bool:
    """Whether an expression of a phase steps where no derivative tells."""
    found = steps_along(iterate.problem, iterate.trajectory, evaluator)
    name = iterate.trajectory.phases[index].name
    return any(step.unseen and step.phase == name for step in found)


def _near(inner: Array, places: Array) -> Flags:
    """Whether one of some places (m,) is at inner breakpoints (N - 1,), shape (N - 1,)."""
    off = np.abs(inner[:, None] - places).min(axis=1, initial=np.inf)
    return np.asarray(off <= SAME_POINT)
