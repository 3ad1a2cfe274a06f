"""The minimum principle along a solved phase: what the Hamiltonian does there.

At an optimum the Hamiltonian is constant where time does not enter. Its slope by the controls,
``H_u + sum mu c_u``, vanishes, or presses a control against its bound (Bryson and Ho, "Applied
Optimal Control", ch. 2 and 3).

Integrals over an interval use the points and weights of the collocation, where the costates are
given. For a control that is constant in an interval, the interval mean of the slope must vanish.

Where the active set changes, because a control jumps or a limit is met or left, costates jump or
bend inside an interval. Polynomials follow that to first order only, so that the principle is
judged strictly in all other intervals.

Where a path constraint, a peak or a state's bound acts, multipliers are masses at points, and
costates jump there, too. The principle is judged there by what moving breakpoints may gain
(`ocp.estimates.constrained_arcs`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ocp.arrays import Array, Flags, Integers
from ocp.estimates.constrained_arcs import (
    CollocationPoints,
    active_set_changes,
    changes_by_time,
    collocation_points,
    gains_by_means,
    stretches_of,
)
from ocp.mesh.trajectory import Evaluator, PhaseTrajectory
from ocp.optimality.active_set import (
    AT,
    LEFT,
    LEFT_TOGETHER,
    share_at_limit,
)
from ocp.optimality.hamiltonian import Hamiltonian, HamiltonianValues, hamiltonian_of
from ocp.optimality.iterate import Iterate
from ocp.optimality.multipliers import PhaseCostates


@dataclass(frozen=True, eq=False, repr=False)
class MinimumPrinciple:
    """What the Hamiltonian of one phase does, in numbers.

    Attributes
    ----------
    name : str
        Of the phase.
    autonomous : bool
        Whether time does not enter the phase, so that the Hamiltonian is constant.
    mean : float
        Of the Hamiltonian over the phase [unit of the objective / s].
    ends : (2,)
        Its values before the first and behind the last instant, by those of the first and last
        interval. A limit or peak that depends on time may act at an end by a whole mass, as a peak
        does that is attained there. Then the Hamiltonian jumps at that instant.
    size : float
        Root mean square over time of ``|L| + sum |lambda_i f_i|``, to which the following are
        relative. In a phase that does not matter it is a small part of the objective's rate: the
        costates there are the solver's rounding.
    sizes : (N,)
        Size of the terms in each interval, relative to `size`, and one where it is less. In stiff
        kinetics it may be hundreds, and the errors are as much larger there.
    drift : float
        Mean over time of how far its interval means are from their own mean. At instants that
        `Phase.at` names it may jump, so that each stretch between them has a mean of its own.
    means : (N,)
        Its interval means, relative to `size`.
    kept : (N,)
        Its interval means less what time alone has changed them by, relative to `size`. At an
        optimum they are equal in each stretch, be the phase autonomous or not.
    steps : (N,)
        Durations of the intervals [s].
    stretches : (N,)
        Number of the stretch between known instants of each interval.
    slopes : (N, n_u)
        Interval means of its slope by the controls, projected on the controls' bounds, relative to
        the mean size of the terms that make them up.
    mean_slope : float
        Largest mean over time of ``|slopes|``.
    changes : (N,)
        Intervals that hold a change of the active set or are next to one.
    acting : (N,)
        Intervals in which a path constraint, a peak or a state's bound acts.
    """

    name: str
    autonomous: bool
    mean: float
    ends: tuple[float, float]
    size: float
    sizes: Array
    drift: float
    means: Array
    kept: Array
    steps: Array
    stretches: Integers
    slopes: Array
    mean_slope: float
    changes: Flags
    acting: Flags

    @property
    def slope_between_changes(self) -> float:
        """Largest of ``|slopes|`` in intervals that are not at a change of the active set."""
        return float(np.abs(self.slopes[~self.changes]).max(initial=0.0))

    @property
    def drift_between_changes(self) -> float:
        """Largest difference of two interval means in a run without changes, where no path acts.

        It is relative to the larger one of their `sizes`.
        """
        strict = ~self.changes & ~self.acting
        runs = (np.cumsum(~strict) + self.stretches * (strict.size + 1))[strict]
        means, sizes = self.means[strict], self.sizes[strict]
        return max(
            (
                _largest_difference(means[runs == run], sizes[runs == run])
                for run in set(runs.tolist())
            ),
            default=0.0,
        )

    @property
    def gain_on_arcs(self) -> float:
        """Estimated gain by moving breakpoints where a path acts [unit of the objective]."""
        gains = gains_by_means(self.kept, self.steps, self.stretches, self.acting, self.changes)
        return self.size * float(gains.sum())


def minimum_principle(
    iterate: Iterate, evaluator: Evaluator, costates: PhaseCostates, index: int, acting: Flags
) -> MinimumPrinciple:
    """Evaluate the Hamiltonian of phase number `index`.

    Parameters
    ----------
    costates : PhaseCostates
        Of the phase; what is tested, together with the iterate.
    acting : (N,)
        In which intervals a path constraint, a peak or a state's bound acts.
    """
    hamiltonian = hamiltonian_of(evaluator, iterate.transcription, index)
    tested = _TestedPhase(iterate, index, evaluator, hamiltonian, costates)
    phase, steps = tested.phase, np.diff(tested.phase.breakpoints)
    duration = steps.sum()

    # at the collocation points, and as means over the intervals
    points = collocation_points(iterate.transcription.columns.phases[index])
    values = tested.values(points.intervals, points.tau)
    means = points.means(values.value)
    # of squares: a mean is no typical size where a long rest lies between a start and an end
    sizes = points.means(np.abs(values.terms)).sum(axis=1)
    least = iterate.negligible_rate(index)
    size = max(math.sqrt(float(sizes**2 @ steps / duration)), least)
    slopes = _projected(tested, *_slopes(tested, points, values))

    by_time, until_end = np.zeros(phase.intervals), 0.0
    if not hamiltonian.autonomous:
        by_time, until_end = changes_by_time(iterate, evaluator, costates, index)
    kept = means - by_time
    stretches = stretches_of(iterate, phase)
    drift = float(np.abs(means - _means_of_stretches(means, steps, stretches)) @ steps / duration)
    return MinimumPrinciple(
        name=phase.name,
        autonomous=hamiltonian.autonomous,
        mean=float(means @ steps / duration),
        ends=(float(kept[0]), float(kept[-1] + until_end)),
        size=size,
        sizes=np.maximum(sizes / size, 1.0),
        drift=drift / size,
        means=means / size,
        kept=kept / size,
        steps=steps,
        stretches=stretches,
        slopes=slopes,
        mean_slope=float((np.abs(slopes).T @ steps).max(initial=0.0) / duration),
        changes=active_set_changes(iterate, index),
        acting=acting,
    )


def _largest_difference(means: Array, sizes: Array) -> float:
    """Largest ``|m_i - m_j| / max(s_i, s_j)`` over all pairs."""
    return float((np.abs(means[:, None] - means) / np.maximum(sizes[:, None], sizes)).max())


@dataclass(frozen=True, eq=False, repr=False)
class _TestedPhase:
    """A phase with its Hamiltonian and the costates under test."""

    iterate: Iterate
    index: int
    evaluator: Evaluator
    hamiltonian: Hamiltonian
    costates: PhaseCostates

    @property
    def phase(self) -> PhaseTrajectory:
        """The phase of the trajectory."""
        return self.iterate.trajectory.phases[self.index]

    def values(self, intervals: Integers, tau: Array) -> HamiltonianValues:
        """The Hamiltonian at local times of intervals, both (m,)."""
        trajectory = self.iterate.trajectory
        return self.hamiltonian.along(self.evaluator, trajectory, self.costates, intervals, tau)


def _slopes(
    tested: _TestedPhase, points: CollocationPoints, values: HamiltonianValues
) -> tuple[Array, Array]:
    """Interval means of ``H_u + sum mu c_u`` relative to the mean size of its terms.

    Parameters
    ----------
    points, values
        The collocation points, and the Hamiltonian there.

    Returns
    -------
    slopes : (N, n_u)
    typical : (n_u,)
        What they are relative to [unit of the objective / s / unit of the control].
    """
    iterate, steps = tested.iterate, np.diff(tested.phase.breakpoints)
    slopes, sizes = points.means(values.slope), points.means(values.slope_size)

    # multipliers of path constraints are masses at points: divided by the step, interval means
    for path in iterate.transcription.rows.phases[tested.index].path:
        constraint = iterate.transcription.constraints[tested.index][path.constraint]
        if not constraint.sampled:
            continue
        masses = iterate.row_multipliers[path.rows] * iterate.scales.objective / constraint.scale
        number = tested.hamiltonian.paths.index(path.constraint)
        by_control = tested.values(path.intervals, path.tau).path_slope[:, number]
        share = (masses / steps[path.intervals])[:, None] * by_control
        np.add.at(slopes, path.intervals, share)
        np.add.at(sizes, path.intervals, np.abs(share))

    duration = steps.sum()
    of_controls = [iterate.scales.signals[c.name] for c in tested.hamiltonian.controls]
    least = iterate.negligible_rate(tested.index) / np.array(of_controls)
    typical = np.maximum(sizes.T @ steps / duration, least)
    return np.asarray(slopes / typical), np.asarray(typical)


def _projected(tested: _TestedPhase, slopes: Array, typical: Array) -> Array:
    """Zero where a control touches the bound against which the slope presses it.

    Off the bounds it is balanced by what the solver's barrier leaves of their multipliers, which
    is the more, the closer the control is to a bound, and the narrower the interval.

    Parameters
    ----------
    slopes : (N, n_u)
        Relative to the typical size of each control's terms.
    typical : (n_u,)
        That size [unit of the objective / s / unit of the control].
    """
    iterate, left = tested.iterate, _left_by_barrier(tested)
    projected = slopes + left / typical
    for j, control in enumerate(tested.hamiltonian.controls):
        margin = AT * iterate.scales.signals[control.name]
        polynomial = tested.phase.polynomial(control.name)
        at_lower, at_upper = (
            share_at_limit(polynomial, limit, margin) > 0.0
            for limit in iterate.parameters.signal_limits[control.name]
        )
        projected[at_lower | at_upper, j] = slopes[at_lower | at_upper, j]
        pressed = (at_lower & (slopes[:, j] > 0)) | (at_upper & (slopes[:, j] < 0))
        projected[pressed, j] = 0.0
    return projected


def _left_by_barrier(tested: _TestedPhase) -> Array:
    """Multipliers of the controls' bounds that a barrier explains, as interval means, (N, n_u).

    In the unit of the objective by second and by the unit of the control.
    """
    iterate, steps = tested.iterate, np.diff(tested.phase.breakpoints)
    columns, names = iterate.transcription.columns, [c.name for c in tested.hamiltonian.controls]
    lower, upper = iterate.limits.columns
    left = np.zeros((steps.size, len(names)))

    own = [
        (names.index(signal.name), intervals, ids)
        for signal, intervals, ids in columns.phases[tested.index].coefficients
        if signal.name in names
    ]
    found = list[tuple[Array, Array]]()
    for _, _, ids in own:
        multipliers, x = iterate.bound_multipliers[ids], iterate.x[ids]
        distances = np.where(multipliers > 0, upper[ids] - x, x - lower[ids])
        pushing = np.isfinite(distances) & (multipliers != 0)
        products = np.abs(multipliers * np.where(pushing, distances, 0.0))
        found.append((np.where(pushing, multipliers, 0.0), products))

    together = sum(float(products.sum()) for _, products in found) * iterate.scales.objective
    most = np.inf if together <= LEFT_TOGETHER * iterate.objective_size else LEFT
    for (number, intervals, ids), (multipliers, products) in zip(own, found, strict=True):
        explained = np.where(products <= most, multipliers / columns.sizes[ids], 0.0)
        masses = explained.sum(axis=1) * iterate.scales.objective
        left[intervals, number] = masses / steps[intervals]
    return left


def _means_of_stretches(means: Array, steps: Array, stretches: Integers) -> Array:
    """Mean over the stretch that each interval is in, (N,)."""
    total, length = np.bincount(stretches, means * steps), np.bincount(stretches, steps)
    return np.asarray((total / np.where(length > 0, length, 1.0))[stretches])
