"""What an excess over a limit is worth, and what it costs to raise peaks by theirs.

A small part of a limit's size may be a large part of what the objective has to pay for it: a floor
of 0.1 mm below a motion over 10 m decides on the whole effort, and a millionth of 10 m is a tenth
of it. To first order an excess brings its multiplier times itself. A peak is a limit that may be
raised to what the motion has between its points, which costs as much.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ocp.accuracy import Accuracy
from ocp.arrays import Array
from ocp.estimates.promised_gain import CERTIFIED_GAIN
from ocp.numerics.interval_maxima import Extremes
from ocp.optimality.active_set import path_multiplier_sums
from ocp.optimality.iterate import Iterate
from ocp.problem.functionals import Peak

# Of the tolerance on the objective: what excesses of costs over their kinks may take of it
_LEFT_OUT = 0.2

# An excess counts this many times at most. Beyond that it is the solver's own tolerance.
_MOST = 1e3


def prices(iterate: Iterate, index: int, excess: tuple[Extremes, ...]) -> list[Array]:
    """What an excess of the whole size of each path constraint is worth, of the objective, (N,)."""
    sums = path_multiplier_sums(iterate, index)
    unit = iterate.scales.objective / iterate.objective_size
    count = iterate.trajectory.phases[index].intervals
    return [
        sums.get(number, np.zeros(count)) * (extremes.size / constraint.scale) * unit
        for number, (constraint, extremes) in enumerate(
            zip(iterate.transcription.constraints[index], excess, strict=True)
        )
    ]


def worth_of_excess(iterate: Iterate, excess: Sequence[tuple[Extremes, ...]]) -> float:
    """What the excess of all limits is worth at most, relative to the objective.

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


def weighted_by_worth(
    iterate: Iterate, index: int, excess: tuple[Extremes, ...], accuracy: Accuracy
) -> tuple[Extremes, ...]:
    """Excesses that count more where their part of the objective would exceed its tolerance."""
    allowed = accuracy.objective / accuracy.path
    counted = []
    for price, extremes in zip(prices(iterate, index, excess), excess, strict=True):
        factor = float(np.clip(price.sum() / allowed, 1.0, _MOST))
        counted.append(Extremes(extremes.values * factor, extremes.tau, extremes.size / factor))
    return tuple(counted)


def without_small_costs(
    iterate: Iterate, index: int, excess: tuple[Extremes, ...], tolerance: float
) -> tuple[Extremes, ...]:
    """Excesses without those of limits that hold a cost above its kink, as far as they cost little.

    There a cost is too small by the excess, for as long as it lasts. What is left out is worth a
    part of the tolerance on the objective together.
    """
    constraints = iterate.transcription.constraints[index]
    numbers = [i for i, constraint in enumerate(constraints) if constraint.of_cost]
    if not numbers:
        return excess

    # a larger control costs the same all along, be its multiplier at this limit or at another one
    steps = np.diff(iterate.trajectory.phases[index].breakpoints)
    of_sizes = prices(iterate, index, excess)
    dearest = [float((of_sizes[number] / steps).max()) for number in numbers]
    leaks = np.array([np.maximum(excess[number].values, 0.0) for number in numbers])
    worth = leaks * np.array(dearest)[:, None] * steps

    order = np.argsort(worth, axis=None)
    small = np.zeros(worth.size, dtype=bool)
    small[order] = np.cumsum(worth.ravel()[order]) <= _LEFT_OUT * tolerance
    counted = list(excess)
    for number, left_out in zip(numbers, small.reshape(worth.shape), strict=True):
        own = excess[number]
        values = np.where(left_out, np.minimum(own.values, 0.0), own.values)
        counted[number] = Extremes(values, own.tau, own.size)
    return tuple(counted)


def is_affordable(cost: float, promised: float) -> bool:
    """Whether peaks may be raised at a cost, beside what finer controls promise; both relative.

    It may be as much as they promise. Where a certificate allows that promise, both together have
    to be what it allows.
    """
    return cost <= (promised if promised > CERTIFIED_GAIN else CERTIFIED_GAIN - promised)


def cost_of_raising(
    iterate: Iterate, excess: Sequence[tuple[Extremes, ...]], tolerance: float
) -> float:
    """What raised peaks cost of the objective to first order; infinite where more than peaks leaks.

    Zero where nothing leaks.

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
                leak = worst * extremes.size if worst > tolerance else 0.0
                # the whole peak is raised, on both its sides and in all its phases
                above[peak] = max(above.get(peak, 0.0), leak)
                dear[peak] = dear.get(peak, 0.0) + float(price.sum()) / extremes.size
    return sum(above[peak] * dear[peak] for peak in above)
