"""Switches that a fixed breakpoint holds at the wrong time, and what that costs.

The optimiser moves some inner breakpoints of a mesh, and the others are *fixed*. Where a control
jumps at a fixed one, its switch is *held* there. A held switch that should come earlier or later is
*displaced*. The policies *free* its breakpoint: from the next mesh on it may move. A breakpoint at
a known time is left out. It has to stay, and the Hamiltonian may jump there.

The Hamiltonian tells what better controls gain inside the intervals. Where a control jumps at a
breakpoint that cannot move, the controls on both sides of it may be the best ones, and the jump
should come earlier or later all the same: before it a constraint may leave the controls no room,
but for the last part of an interval. Then the Hamiltonian jumps, too.

A control may also jump from one *valley* of the Hamiltonian, a local minimum by the controls, to
another, as a thruster does that is on or off. In an interval it is one polynomial, and stays in one
valley. The other one may be better in a part of the interval. Then the control is smooth, and the
Hamiltonian has no slope. Only controls far away tell.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ocp.arrays import Array, Flags
from ocp.estimates.other_controls.promise import others_of_phase
from ocp.estimates.switch_detection import Jump, switches_at_breakpoints
from ocp.mesh.mesh import SAME_POINT
from ocp.mesh.trajectory import Evaluator
from ocp.optimality.hamiltonian import relative_jumps, shifts
from ocp.optimality.iterate import Iterate

# Of the objective: what a shift by the shorter interval beside it has to promise. At the optima of
# the benchmarks the costates' errors promise up to 3e-5, and a switch that was missed 1.
_MISSED = 1e-3

# Of the Hamiltonian's terms: by what it may differ on both sides of a switch. At the optima of the
# benchmarks the costates' errors leave up to 1.4e-3. A switch of two valleys that was 40 s off left
# 2.5e-3, at a loss of 2e-4 of the objective.
_BALANCED = 2e-3


def held_switches(iterate: Iterate, index: int, jumps: Sequence[Jump]) -> Flags:
    """Whether a switch is held at inner breakpoints, by where jumps were located, (N - 1,)."""
    inner = iterate.trajectory.phases[index].fractions[1:-1]
    located = _near(inner, np.array([jump.at for jump in jumps]))
    return _fixed_breakpoints(iterate, index) & located


def missed_switches(
    iterate: Iterate, evaluator: Evaluator, index: int, jumps: Sequence[Jump]
) -> Array:
    """Gain that other times of held switches promise, by jumps of the Hamiltonian, (N - 1,).

    For each inner breakpoint, relative to the objective. It is 0 where no switch is held, and for
    schemes whose multipliers do not tell.
    """
    held = held_switches(iterate, index, jumps)
    if not (held.any() and iterate.scheme.informative_multipliers):
        return np.zeros(held.size)

    gained = shifts(iterate, evaluator, index) / iterate.objective_size
    return np.where(held & (gained >= _MISSED), gained, 0.0)


def displaced_switches(iterate: Iterate, evaluator: Evaluator, index: int) -> Flags:
    """Whether a held switch is displaced, by a jump of the Hamiltonian there, (N - 1,).

    At the right time of a switch the Hamiltonian is the same on both sides. Beside a narrow
    interval its jump promises little, however far off the switch is. None where expressions of
    the statement jump: the Hamiltonian may jump there by itself. None in a phase that takes no
    time: its controls matter for nothing, and neither do their switches.
    """
    held = _held_by_sides(iterate, index)
    told = iterate.scheme.informative_multipliers and not iterate.takes_no_time(index)
    if not (held.any() and told) or iterate.problem.is_discontinuous:
        return np.zeros_like(held)
    return held & (relative_jumps(iterate, evaluator, index) > _BALANCED)


def between_valleys(iterate: Iterate, evaluator: Evaluator, index: int) -> Array:
    """Gain that other times of held switches between valleys promise, (N - 1,).

    For each inner breakpoint, relative to the objective. A control that jumps from one valley of
    the Hamiltonian to another is in the worse one on one side of a breakpoint where its switch is
    displaced. The gain is 0 where no switch is held, and for schemes whose multipliers do not tell.
    It is also 0 in a phase that takes no time: other controls tell there that it should be longer.
    """
    motion = iterate.trajectory.phases[index]
    held = _held_by_sides(iterate, index)
    others = None
    if held.any() and iterate.scheme.informative_multipliers:
        others = others_of_phase(iterate, evaluator, index, beside(held), valleys_only=True)
    if others is None or others.vanished:
        return np.zeros(held.size)
    of_intervals = others.of_intervals(motion.intervals) / iterate.objective_size
    return np.where(held, of_intervals[:-1] + of_intervals[1:], 0.0)


def beside(breakpoints: Flags) -> Flags:
    """Whether intervals begin or end at one of some inner breakpoints (N - 1,), shape (N,)."""
    ends = np.concatenate([[False], breakpoints, [False]])
    return np.asarray(ends[:-1] | ends[1:])


def shared(missed: Array) -> Array:
    """What inner breakpoints promise (N - 1,), half of it for each side, (N,)."""
    halves = np.concatenate([[0.0], 0.5 * missed, [0.0]])
    return np.asarray(halves[:-1] + halves[1:])


def _fixed_breakpoints(iterate: Iterate, index: int) -> Flags:
    """Whether inner breakpoints neither move nor stand at a known time, (N - 1,)."""
    motion, mesh = iterate.trajectory.phases[index], iterate.mesh.phases[index]
    known = motion.fractions_of(iterate.problem.instants[motion.name])
    moving = np.isin(np.arange(1, motion.intervals), mesh.movable)
    return ~_near(motion.fractions[1:-1], known) & ~moving


def _held_by_sides(iterate: Iterate, index: int) -> Flags:
    """Whether a switch is held at inner breakpoints, by the controls on both sides, (N - 1,).

    A control may go on rising behind its step, so that the jump is located inside an interval, and
    `held_switches` does not have it.
    """
    switches = switches_at_breakpoints(iterate.trajectory.phases[index], iterate.scales.signals)
    return _fixed_breakpoints(iterate, index) & switches


def _near(inner: Array, places: Array) -> Flags:
    """Whether one of some places (m,) is at inner breakpoints (N - 1,), shape (N - 1,)."""
    off = np.abs(inner[:, None] - places).min(axis=1, initial=np.inf)
    return np.asarray(off <= SAME_POINT)
