"""What an excess over a limit is worth, by the limit's multipliers.

A small part of a limit's size may be a large part of what the objective has to pay for it: a floor
of 0.1 mm below a motion over 10 m decides on the whole effort, and a millionth of 10 m is a tenth
of it. To first order an excess brings its multiplier times itself.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ocp.arrays import Array
from ocp.numerics.interval_maxima import Extremes
from ocp.optimality.active_set import path_multiplier_sums
from ocp.optimality.iterate import Iterate
from ocp.refinement.accuracy import Accuracy

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
