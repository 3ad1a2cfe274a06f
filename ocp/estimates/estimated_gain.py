"""What finer controls gain, and the effect of violated limits, to first order.

A gain says something only of a control whose shape is not resolved yet.

A small part of a limit's size may be a large part of what the objective has to pay for it: a floor
of 0.1 mm below a motion over 10 m decides on the whole effort, and a millionth of 10 m is a tenth
of it. To first order an excess brings its multiplier times itself. A peak is a limit that may be
raised to what the motion has between its points, which costs as much.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import comb

import numpy as np

from ocp.accuracy import Accuracy
from ocp.arrays import Array, Flags, Integers
from ocp.estimates.switch_detection import control_samples, jumps_at
from ocp.mesh.mesh import PhaseMesh
from ocp.mesh.trajectory import Evaluator, PhaseTrajectory
from ocp.numerics.piecewise_polynomial import Extremes, PiecewisePolynomial
from ocp.optimality.active_set import (
    ACTING,
    CLOSE,
    STRONGLY_ACTIVE,
    path_multiplier_sums,
    saturated_constraints,
    share_at_limit,
)
from ocp.optimality.control_gains import gains
from ocp.optimality.iterate import Iterate
from ocp.problem.functionals import Peak
from ocp.transcription.path_constraints import PathConstraint

# Of the tolerance on the objective: what excesses of costs over their kinks may take of it
_LEFT_OUT = 0.2

# An excess counts this many times at most. Beyond that it is the solver's own tolerance.
_LARGEST_FACTOR = 1e3


def prices(iterate: Iterate, index: int, excess: tuple[Extremes, ...]) -> list[Array]:
    """Effect of an excess of the whole size of each path constraint, of the objective, (N,)."""
    sums = path_multiplier_sums(iterate, index)
    unit = iterate.scales.objective / iterate.objective_size
    count = iterate.trajectory.phases[index].intervals
    return [
        sums.get(number, np.zeros(count)) * (extremes.size / constraint.scale) * unit
        for number, (constraint, extremes) in enumerate(
            zip(iterate.transcription.constraints[index], excess, strict=True)
        )
    ]


def effect_of_excess(iterate: Iterate, excess: Sequence[tuple[Extremes, ...]]) -> float:
    """Effect of the excess of all limits, relative to the objective, at most.

    Parameters
    ----------
    excess : sequence of tuple of Extremes
        Of each phase, that of each path constraint in each interval.
    """
    return sum(
        float(price @ np.maximum(extremes.values, 0.0))
        for index, of_phase in enumerate(excess)
        for price, extremes in zip(prices(iterate, index, of_phase), of_phase, strict=True)
    )


def weighted_by_effect(
    iterate: Iterate, index: int, excess: tuple[Extremes, ...], accuracy: Accuracy
) -> tuple[Extremes, ...]:
    """Excesses that count more where their part of the objective would exceed its tolerance."""
    allowed = accuracy.objective / accuracy.path
    counted = []
    for price, extremes in zip(prices(iterate, index, excess), excess, strict=True):
        factor = float(np.clip(price.sum() / allowed, 1.0, _LARGEST_FACTOR))
        counted.append(Extremes(extremes.values * factor, extremes.tau, extremes.size / factor))
    return tuple(counted)


def without_small_costs(
    iterate: Iterate, index: int, excess: tuple[Extremes, ...], tolerance: float
) -> tuple[Extremes, ...]:
    """Excesses without those of limits that hold a cost above its kink, as far as they cost little.

    There a cost is too small by the excess, for as long as it lasts. What is left out
    changes the objective by a part of its tolerance, all together.
    """
    constraints = iterate.transcription.constraints[index]
    numbers = [i for i, constraint in enumerate(constraints) if constraint.of_cost]
    if not numbers:
        return excess

    # a larger control costs the same all along, be its multiplier at this limit or at another one
    steps = np.diff(iterate.trajectory.phases[index].breakpoints)
    of_sizes = prices(iterate, index, excess)
    dearest = [float((of_sizes[number] / steps).max()) for number in numbers]
    above = np.array([np.maximum(excess[number].values, 0.0) for number in numbers])
    effects = above * np.array(dearest)[:, None] * steps

    order = np.argsort(effects, axis=None)
    small = np.zeros(effects.size, dtype=bool)
    small[order] = np.cumsum(effects.ravel()[order]) <= _LEFT_OUT * tolerance
    counted = list(excess)
    for number, left_out in zip(numbers, small.reshape(effects.shape), strict=True):
        own = excess[number]
        values = np.where(left_out, np.minimum(own.values, 0.0), own.values)
        counted[number] = Extremes(values, own.tau, own.size)
    return tuple(counted)


def is_affordable(cost: float, gain: float) -> bool:
    """Whether peaks may be raised at a cost, next to the gain of finer controls; both relative.

    It may be as much as that gain. Where a certificate allows the gain, both together have
    to be what it allows.
    """
    return cost <= (gain if gain > CERTIFIED_GAIN else CERTIFIED_GAIN - gain)


def cost_of_raising(
    iterate: Iterate, excess: Sequence[tuple[Extremes, ...]], tolerance: float
) -> float:
    """What raised peaks cost of the objective to first order; infinite if a limit is exceeded, too.

    Zero where nothing is exceeded.

    Parameters
    ----------
    excess : sequence of tuple of Extremes
        Of each phase, that of each path constraint in each interval, relative.
    tolerance : float
        Relative excess up to which a constraint holds.
    """
    above: dict[Peak, float] = {}
    dear: dict[Peak, float] = {}
    for index, of_phase in enumerate(excess):
        constraints = iterate.transcription.constraints[index]
        of_sizes = prices(iterate, index, of_phase)
        for constraint, extremes, price in zip(constraints, of_phase, of_sizes, strict=True):
            worst, peak = float(extremes.values.max()), constraint.peak
            if peak is None and worst > tolerance:
                return math.inf
            if peak is not None:
                size = worst * extremes.size if worst > tolerance else 0.0
                # the whole peak is raised, on both its sides and in all its phases
                above[peak] = max(above.get(peak, 0.0), size)
                dear[peak] = dear.get(peak, 0.0) + float(price.sum()) / extremes.size
    return sum(above[peak] * dear[peak] for peak in above)


def control_errors(motion: PhaseTrajectory, mesh: PhaseMesh) -> Array:
    """Estimated error of each control's shape in each interval, relative to its range, (N, n_u).

    Of a constant or linear control it is what the next order would add, from the smaller of the
    differences to both neighbours: a level next to a jump is no error, a value between two levels
    is. Of a polynomial of a higher order it is its last Legendre coefficient.
    """
    errors = [error for _, error in _errors_by_control(motion, mesh)]
    return np.column_stack([np.zeros((mesh.intervals, 0)), *errors])


def parts_to_resolve(motion: PhaseTrajectory, mesh: PhaseMesh, allowed: float) -> Array:
    """In how many parts each interval is cut until its control shapes err by what is allowed, (N,).

    The error of a shape of order p falls with the power p + 1 of the width.
    """
    most = np.zeros(mesh.intervals)
    for orders, error in _errors_by_control(motion, mesh):
        most = np.maximum(most, (error / allowed) ** (1.0 / (orders + 1.0)))
    return most


def _errors_by_control(
    motion: PhaseTrajectory, mesh: PhaseMesh
) -> Iterator[tuple[Integers, Array]]:
    """Orders and estimated errors of each control, (N,) each; one that never varies has none."""
    # a breakpoint at which nothing jumps separates no levels
    mesh = replace(mesh, movable=tuple(i for i in mesh.movable if jumps_at(motion, i)))
    for name in motion.controls:
        size = float(np.ptp(control_samples(motion, name)[1]))
        control = motion.polynomial(name)
        if size == 0.0:
            yield control.orders, np.zeros(mesh.intervals)
            continue
        ends, width = control.ends()[:, :, 0], np.diff(control.breakpoints)
        level = 0.5 * (ends[:, 0] + ends[:, 1])
        slope = (ends[:, 1] - ends[:, 0]) / width

        # the error of a step is a quarter of the difference of levels, that of a line an eighth of
        # the difference of slopes times the width
        by_levels = _smaller_difference(level, mesh) / 4.0
        by_slopes = width * _smaller_difference(slope, mesh) / 8.0
        error = np.where(control.orders == 0, by_levels, by_slopes)
        error = np.where(control.orders > 1, _legendre_tail(control), error)
        yield control.orders, error / size


def saturated(motion: PhaseTrajectory, limits: Mapping[str, tuple[float, float]]) -> Flags:
    """Whether each control stays on one of its bounds or close to it in an interval, (N, n_u)."""
    on_bound = np.zeros((motion.intervals, len(motion.controls)), dtype=bool)
    for j, name in enumerate(motion.controls):
        margin = CLOSE * float(np.ptp(control_samples(motion, name)[1]))
        for limit in limits[name]:
            on_bound[:, j] |= share_at_limit(motion.polynomial(name), limit, margin) == 1.0
    return on_bound


def _smaller_difference(values: Array, mesh: PhaseMesh) -> Array:
    """Smaller of the differences to both neighbours, (N,); 0 beside a movable breakpoint."""
    at_breakpoints = np.concatenate([[np.inf], np.abs(np.diff(values)), [np.inf]])
    at_breakpoints[list(mesh.movable)] = 0.0
    smaller = np.minimum(at_breakpoints[:-1], at_breakpoints[1:])
    return np.where(np.isfinite(smaller), smaller, 0.0)


def _legendre_tail(control: PiecewisePolynomial) -> Array:
    """Size of the highest Legendre coefficient in each interval, (N,)."""
    orders = control.orders
    highest = np.take_along_axis(control.powers()[:, 0, :], orders[:, None], axis=1)[:, 0]
    # the leading coefficient of the Legendre polynomial on [0, 1]
    leading: Integers = np.array([comb(2 * order, order) for order in orders.tolist()])
    return np.abs(highest) / leading


def unit_costs(
    constraints: Sequence[PathConstraint], sums: Mapping[int, Array]
) -> dict[int, Array]:
    """What a unit of back-off costs in each interval of a phase, scaled.

    Parameters
    ----------
    sums : mapping of int to (N,)
        Of the scaled multipliers, by the number of the path constraint.

    Returns
    -------
    dict of int to (N,)
        By the same number [scaled objective per unit of the constraint].
    """
    return {number: sums[number] / constraints[number].scale for number in sums}


def scaled_costs(
    of_unit: Mapping[int, Array], back_off: Mapping[int, Array], intervals: int
) -> Array:
    """What the back-offs of a phase cost in each interval, in the scaled objective, (N,)."""
    cost = np.zeros(intervals)
    for number, distance in back_off.items():
        if number in of_unit:
            cost += of_unit[number] * distance
    return cost


def back_off_costs(iterate: Iterate, index: int) -> Array:
    """What the back-offs cost in each interval of phase number `index`, of the objective, (N,)."""
    mesh, back_off = iterate.mesh.phases[index], iterate.mesh.back_off[index]
    if not back_off:
        return np.zeros(mesh.intervals)
    constraints = iterate.transcription.constraints[index]
    of_unit = unit_costs(constraints, path_multiplier_sums(iterate, index))
    scaled = scaled_costs(of_unit, back_off, mesh.intervals)
    return scaled * (iterate.scales.objective / iterate.objective_size)


# part of a control's range that its shape may be off by before the control counts as rough: what a
# finer smooth control would gain is the square of it, a tenth of the tolerance on the objective
_SMOOTH = 3e-4


# Part of what an interval gains, which is most of it.
_MOST = 0.5

# Of the objective: the estimated gain of finer controls that a certificate allows. It is ten times
# the default of a solve, because the estimate is of first order, and often ten times too large.
CERTIFIED_GAIN = 1e-5


@dataclass(frozen=True, eq=False, repr=False)
class PhaseGains:
    """Estimated gain of finer controls in each interval of a phase, (N,) each.

    Attributes
    ----------
    anywhere : (N,)
        To gain, relative to the objective, wherever it is.
    counted : (N,)
        The part of it that says something, with `back_offs`. Where a control is smooth and a
        constraint acts, its gain is noise: multipliers of the constraint sit at points, so that
        the costates between them say little of the controls. Another control that is rough, or on
        its bound, makes it no less so.
    informative : (N,)
        Whether the gain of any control says something.
    back_offs : (N,)
        To gain from limits that are backed off, which finer intervals do without.
    parts : (N,)
        In how many a smooth control is resolved, a real number.
    at_end : (N,)
        Whether most of `anywhere` is to be gained behind the first of `costate_errors.PARTS`.
    """

    anywhere: Array
    counted: Array
    informative: Flags
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
        informative = _rough_controls(iterate, index) | free[:, None]
        return cls(
            anywhere,
            np.where(informative, of_controls.sum(axis=1), 0.0).sum(axis=1) + back_offs,
            np.asarray(free | informative.any(axis=1)),
            back_offs,
            parts,
            at_end=of_parts[:, 1:].sum(axis=1) > _MOST * anywhere,
        )


def estimated_gain(iterate: Iterate, evaluator: Evaluator, strongest: Sequence[Array]) -> float:
    """What finer controls could still gain, of the objective, the cost of back-offs included.

    Parameters
    ----------
    strongest : sequence of (N,)
        As of `ocp.optimality.active_set.strongest_multipliers`.
    """
    phases = [PhaseGains.of(iterate, evaluator, k, of_k) for k, of_k in enumerate(strongest)]
    return sum(float(phase.counted.sum()) for phase in phases)


def _rough_controls(iterate: Iterate, index: int) -> Flags:
    """Whether each control is not resolved, or stays on a bound that it should leave, (N, n_u)."""
    motion, mesh = iterate.trajectory.phases[index], iterate.mesh.phases[index]
    on_bound = saturated(motion, iterate.parameters.signal_limits)
    on_bound |= saturated_constraints(iterate, index)
    return (control_errors(motion, mesh) >= _SMOOTH) | on_bound
