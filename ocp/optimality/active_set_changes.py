"""Intervals that hold a corner of an optimal control: a jump, or a limit met or left.

There costates jump or bend inside an interval, which polynomials follow to first order only, so
that the minimum principle can be judged strictly in all other intervals.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ocp.mesh.initial_guess import evaluate_limit
from ocp.mesh.trajectory import PhaseTrajectory, Trajectory
from ocp.optimality.multipliers import SolvedProgram, path_rows
from ocp.refinement.switch_detection import control_samples, jumps
from ocp.transcription.variables import PhaseLayout

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
_PRESSING = 1e-6  # of the largest multiplier of a limit, below which it does not press
_AT = 1e-5  # of a control's size, closer than which it is at a bound


def corners(solved: SolvedProgram, trajectory: Trajectory, index: int) -> Mask:
    """Which intervals of a phase hold a corner or are next to one, shape (N,)."""
    layout, own = solved.transcription.layouts[index], trajectory.phases[index]
    found = _jumping(solved, own)
    for status in (*_pressing(solved, index), *_at_bounds(solved, trajectory, layout)):
        changed = np.flatnonzero(np.diff(status) != 0)
        found[changed], found[changed + 1] = True, True
    return found


def _jumping(solved: SolvedProgram, own: PhaseTrajectory) -> Mask:
    """Intervals that overlap a jump of a control or touch it."""
    fractions = (own.breakpoints - own.start) / (own.end - own.start)
    found = np.zeros(fractions.size - 1, dtype=bool)
    for j, name in enumerate(own.controls):
        times, values = control_samples(own, j)
        if np.ptp(values) <= _AT * solved.scales.signals[name]:
            continue  # round-off of a constant
        for jump in jumps(times, values, fractions):
            found |= (fractions[:-1] <= jump.last + 1e-12) & (fractions[1:] >= jump.first - 1e-12)
    return found


def _pressing(solved: SolvedProgram, index: int) -> list[Array]:
    """Whether each continuous constraint of a phase presses in each interval, (N,) each."""
    count = solved.transcription.layouts[index].intervals
    masses: dict[int, Array] = {}
    for part in path_rows(solved.transcription):
        if part.phase == index:
            total = masses.setdefault(part.constraint, np.zeros(count))
            np.add.at(total, part.intervals, np.abs(solved.row_multipliers[part.rows]))
    return [(m > _PRESSING * m.max(initial=0.0)).astype(float) for m in masses.values()]


def _at_bounds(solved: SolvedProgram, trajectory: Trajectory, layout: PhaseLayout) -> list[Array]:
    """How much of each signal is at its lower and at its upper bound in each interval, (N,)."""
    values, found = solved.x * solved.transcription.sizes, []
    tables = [(layout.constant, layout.steps[:, None, :]), (layout.linear, layout.ramps)]
    held = [(s, [(np.arange(layout.intervals), table[:, :, j])])
            for signals, table in tables for j, s in enumerate(signals)]  # fmt: skip
    held += [(s, [(g.intervals, g.controls[:, :, j]) for g in layout.groups])
             for j, s in enumerate(layout.polynomial)]  # fmt: skip
    held += [(s, [(g.intervals, g.support[:, :, j]) for g in layout.groups])
             for j, s in enumerate(layout.states)]  # fmt: skip
    for signal, parts in held:
        near = _AT * solved.scales.signals[signal.name]
        for limit in (signal.lower, signal.upper):
            at = evaluate_limit(limit, trajectory.constants)
            status = np.zeros(layout.intervals)
            for intervals, ids in parts:
                status[intervals] = (np.abs(values[ids] - at) <= near).mean(axis=1)
            found.append(status)
    return found
