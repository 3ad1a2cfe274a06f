"""Where the active set of a solved phase changes: a control jumps, or a limit is met or left."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ocp.arrays import Array, Flags
from ocp.estimates.switch_detection import ROUND_OFF, control_samples, jumps
from ocp.mesh.trajectory import PhaseTrajectory
from ocp.optimality.active_set import (
    AT,
    STRONGLY_ACTIVE,
    path_multiplier_sums,
    share_at_limit,
    strongly_active,
)
from ocp.optimality.iterate import Iterate


def active_set_changes(iterate: Iterate, index: int) -> Flags:
    """Which intervals of a phase hold a change of the active set or are next to one, (N,)."""
    changes = _jumping(iterate, iterate.trajectory.phases[index])
    for status in (*_strongly_active(iterate, index), *_at_bounds(iterate, index)):
        changed = np.flatnonzero(np.diff(status) != 0)
        changes[changed], changes[changed + 1] = True, True
    return changes


def _jumping(iterate: Iterate, phase: PhaseTrajectory) -> Flags:
    """Intervals that overlap a jump of a control or touch it."""
    fractions = phase.fractions
    jumping = np.zeros(phase.intervals, dtype=bool)
    for name in phase.controls:
        times, values = control_samples(phase, name)
        if np.ptp(values) <= AT * iterate.scales.signals[name]:
            continue  # round-off of a constant
        for jump in jumps(times, values, fractions):
            ends_after = fractions[1:] >= jump.first - ROUND_OFF
            jumping |= ends_after & (fractions[:-1] <= jump.last + ROUND_OFF)
    return jumping


def _strongly_active(iterate: Iterate, index: int) -> Iterator[Array]:
    """Whether each path constraint of a phase is strongly active in each interval, (N,) each."""
    for sums in path_multiplier_sums(iterate, index).values():
        yield strongly_active(sums, STRONGLY_ACTIVE).astype(float)


def _at_bounds(iterate: Iterate, index: int) -> Iterator[Array]:
    """How much of each control and state is at its lower, and its upper bound, (N,) each."""
    phase, columns = iterate.trajectory.phases[index], iterate.transcription.columns.phases[index]
    for signal in (*columns.controls, *columns.states):
        polynomial = phase.polynomial(signal.name)
        margin = AT * iterate.scales.signals[signal.name]
        for limit in iterate.parameters.signal_limits[signal.name]:
            yield share_at_limit(polynomial, limit, margin)
