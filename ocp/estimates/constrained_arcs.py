"""What other breakpoints gain along arcs on which a path constraint, peak or state's bound acts.

There the multipliers are masses at points. The Hamiltonian swings inside the intervals, and its
interval means are off by an error that falls with the square of the interval. To first order the
objective changes with the time of a breakpoint by the difference of the Hamiltonian on both sides
(Bryson and Ho, "Applied Optimal Control", ch. 3.7). Means that differ therefore tell what is lost
to the mesh, where costates at single points say nothing of the controls.

At the ends of an arc there are two losses. That of the interval itself is taken from inside of the
arc: it falls with the cube of the interval. And where an arc begins or ends inside an interval, the
limit may be met at all of its points, so that the control is what the limit asks for too early or
too late. Then nothing is rough, and the costates have jumps that the limit explains. The
Hamiltonian tells: it differs on both sides of the breakpoint from which the arc is held.

Where time enters the phase, the Hamiltonian changes with it, by ``H_t`` and by the multipliers of
limits that move. That part is subtracted.

An arc ends where the active set changes: a control jumps, or a limit is met or left.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ocp.arrays import Array, Flags, Integers
from ocp.estimates.switch_detection import ROUND_OFF, control_samples, jumps
from ocp.mesh.trajectory import Evaluator, PhaseTrajectory
from ocp.optimality.active_set import (
    AT,
    STRONGLY_ACTIVE,
    path_multiplier_sums,
    share_at_limit,
    strongly_active,
)
from ocp.optimality.hamiltonian import hamiltonian_of
from ocp.optimality.iterate import Iterate
from ocp.optimality.multipliers import PhaseCostates, phase_costates
from ocp.transcription.columns import PhaseColumns


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


@dataclass(frozen=True, eq=False, repr=False)
class CollocationPoints:
    """All collocation points of a phase of `count` intervals, (m,) each."""

    intervals: Integers
    tau: Array
    weights: Array
    count: int

    def means(self, values: Array) -> Array:
        """Means over each interval of values (m, ...) at the points, (N, ...)."""
        means = np.zeros((self.count, *values.shape[1:]))
        np.add.at(means, self.intervals, (self.weights * values.T).T)
        return means


def collocation_points(columns: PhaseColumns) -> CollocationPoints:
    """The collocation points of a phase, group by group."""
    intervals, tau, weights = [], [], []
    for group in columns.groups:
        rule, count = group.collocation, group.intervals.size
        intervals.append(np.repeat(group.intervals, rule.degree))
        tau.append(np.tile(rule.points, count))
        weights.append(np.tile(rule.weights, count))
    return CollocationPoints(
        np.concatenate(intervals), np.concatenate(tau), np.concatenate(weights), columns.intervals
    )


def arc_gains(iterate: Iterate, evaluator: Evaluator, index: int, acting: Flags) -> Array:
    """What other breakpoints gain in each interval of a phase [unit of the objective], (N,).

    Zero outside of arcs.

    Parameters
    ----------
    index : int
        Of the phase.
    acting : (N,)
        Intervals in which a path constraint, a peak or a state's bound acts.
    """
    phase = iterate.trajectory.phases[index]
    if not acting.any():
        return np.zeros(phase.intervals)
    hamiltonian = hamiltonian_of(evaluator, iterate.transcription, index)
    changes = active_set_changes(iterate, index)
    steps, stretches = np.diff(phase.breakpoints), stretches_of(iterate, phase)
    points = collocation_points(iterate.transcription.columns.phases[index])
    costates = phase_costates(iterate, index)
    values = hamiltonian.along(
        evaluator, iterate.trajectory, costates, points.intervals, points.tau
    )
    means = points.means(values.value)
    if not hamiltonian.autonomous:
        means -= changes_by_time(iterate, evaluator, costates, index)[0]
    return gains_by_means(means, steps, stretches, acting, changes)


def changes_by_time(
    iterate: Iterate, evaluator: Evaluator, costates: PhaseCostates, index: int
) -> tuple[Array, float]:
    """Change of the Hamiltonian by time alone since the start of the phase.

    The mean over each interval (N,), and that of the whole phase, its last instant included [unit
    of the objective / s].

    ``dH/dt = H_t + sum mu c_t`` along an optimum (Bryson and Ho, ch. 3.10), where the multipliers
    of limits that act are masses at points.
    """
    phase = iterate.trajectory.phases[index]
    hamiltonian = hamiltonian_of(evaluator, iterate.transcription, index)
    whole, mean = np.zeros(phase.intervals), np.zeros(phase.intervals)

    def add(intervals: Integers, tau: Array, change: Array) -> None:
        # what changes at a point counts in the rest of its interval
        np.add.at(whole, intervals, change)
        np.add.at(mean, intervals, (1.0 - tau) * change)

    points = collocation_points(iterate.transcription.columns.phases[index])
    of_terms, _ = hamiltonian.slopes_by_time(
        evaluator, iterate.trajectory, costates, points.intervals, points.tau
    )
    steps = np.diff(phase.breakpoints)[points.intervals]
    add(points.intervals, points.tau, points.weights * steps * of_terms)
    for rows in iterate.transcription.rows.phases[index].path:
        if rows.constraint not in hamiltonian.paths:
            continue
        constraint = iterate.transcription.constraints[index][rows.constraint]
        _, of_paths = hamiltonian.slopes_by_time(
            evaluator, iterate.trajectory, costates, rows.intervals, rows.tau
        )
        masses = iterate.determined_row_multipliers[rows.rows]
        masses = masses * iterate.scales.objective / constraint.scale
        slopes = of_paths[:, hamiltonian.paths.index(rows.constraint)]
        add(rows.intervals, rows.tau, masses * slopes)
    return np.cumsum(whole) - whole + mean, float(whole.sum())


def gains_by_means(
    means: Array, steps: Array, stretches: Integers, acting: Flags, changes: Flags
) -> Array:
    """What other breakpoints gain inside of arcs and at their ends, time not in the phase, (N,).

    Parameters
    ----------
    means, steps, stretches : (N,)
        As of `shift_gains`.
    acting, changes : (N,)
        Intervals in which a path acts, and in which the active set changes.
    """
    arcs = acting & ~changes
    inside = with_ends(shift_gains(means, steps, stretches, arcs), steps, acting, arcs)
    return np.maximum(inside, junction_gains(np.diff(means), steps, stretches, acting & changes))


def junction_gains(jumps: Array, steps: Array, stretches: Integers, ends: Flags) -> Array:
    """What moving the ends of arcs by their shorter interval gains, half to each side, (N,).

    The difference of the Hamiltonian falls by the square on the way to where the arc ends, which is
    half an interval away in the mean. That makes a sixth of it, and a quarter counts.

    Parameters
    ----------
    jumps : (N - 1,)
        Differences of the Hamiltonian at the inner breakpoints.
    steps, stretches : (N,)
        As of `shift_gains`.
    ends : (N,)
        Intervals in which a path acts and the active set changes.
    """
    beside = (ends[1:] | ends[:-1]) & (np.diff(stretches) == 0)
    shorter = np.minimum(steps[1:], steps[:-1])
    half = np.where(beside, 0.125 * np.abs(jumps) * shorter, 0.0)
    return np.asarray(np.append(half, 0.0) + np.append(0.0, half))


def with_ends(gains: Array, steps: Array, acting: Flags, arcs: Flags) -> Array:
    """Gains inside of arcs continued to the ends of these arcs, (N,).

    Parameters
    ----------
    gains, steps, arcs : (N,)
        As of `shift_gains`.
    acting : (N,)
        Intervals in which a path acts.
    """
    continued = gains.copy()
    for end in np.flatnonzero(acting & ~arcs):
        for beside in (end - 1, end + 1, end - 2, end + 2):
            if not 0 <= beside < arcs.size or not (arcs[beside] and gains[beside] > 0.0):
                continue
            if acting[min(end, beside) : max(end, beside)].all():
                continued[end] = gains[beside] * (steps[end] / steps[beside]) ** 3
                break
    return continued


def shift_gains(means: Array, steps: Array, stretches: Integers, arcs: Flags) -> Array:
    """What moving breakpoints by their shorter interval gains, half to each interval beside, (N,).

    Parameters
    ----------
    means : (N,)
        Interval means of the Hamiltonian.
    steps : (N,)
        Durations of the intervals [s].
    stretches : (N,)
        Numbers of the stretches between known instants, across which the Hamiltonian may jump.
    arcs : (N,)
        Intervals that count.
    """
    inside = arcs[1:] & arcs[:-1] & (np.diff(stretches) == 0)
    shorter = np.minimum(steps[1:], steps[:-1])
    half = np.where(inside, 0.5 * np.abs(np.diff(means)) * shorter, 0.0)
    return np.asarray(np.append(half, 0.0) + np.append(0.0, half))


def stretches_of(iterate: Iterate, phase: PhaseTrajectory) -> Integers:
    """Number of the stretch between known instants of each interval, (N,)."""
    instants = iterate.problem.instants[phase.name]
    middle = 0.5 * (phase.breakpoints[:-1] + phase.breakpoints[1:])
    return np.searchsorted(np.array(instants, dtype=float), middle)
