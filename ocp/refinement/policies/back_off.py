"""Back-off: limits that hold between the points because the points keep inside them.

A violation that is held at one point moves to the side, and points chase it for many meshes where a
motion rides its limit. A back-off moves the limit at all points of the interval by what is exceeded
between them. It costs the objective something, and is kept only where that does not count.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ocp.accuracy import Accuracy
from ocp.arrays import Array, Flags, Integers
from ocp.estimates.error_estimate import NARROW, PhaseErrors
from ocp.estimates.estimated_gain import scaled_costs, unit_costs
from ocp.optimality.active_set import STRONGLY_ACTIVE, path_multiplier_sums
from ocp.optimality.iterate import Iterate
from ocp.refinement.solved_mesh import SolvedMesh
from ocp.transcription.path_constraints import PathConstraint

# A violation is removed by a back-off only below this part of the constraint's size, with so much
# to spare, and where all back-offs together cost at most this part of the tolerance on the
# objective. In a narrow interval it may be larger: beside a pole of the control nothing else
# removes it.
_LARGEST_BACK_OFF = 1e-3
_LARGEST_BACK_OFF_IF_NARROW = 0.3
_AMPLE = 1.02
_BACK_OFF_COST = 0.5

# Nor above this part of what lies between the two limits.
_SHARE = 0.25

# The bound of a state is given up to a back-off only in an interval below this part of a phase that
# holds more added points than this: most of its violations go by a few points or by a cut, which
# cost nothing.
_SHORT = 1e-2
_TRIED = 3


def chosen_back_offs(last: SolvedMesh, accuracy: Accuracy, closed: float) -> list[dict[int, Array]]:
    """Further back-offs that remove violations at a cost that the objective does not notice.

    To first order a back-off costs its product with the multipliers of the limit. Those of earlier
    rounds are counted. Of the new ones the cheapest are taken, as far as what is allowed goes. One
    that turns out dearer counts as a gain of finer controls: the interval is cut, and loses it.

    Parameters
    ----------
    closed : float
        Relative excess from which on it is removed.

    Returns
    -------
    list of dict of int to (N,)
        By phase and number of the path constraint [unit of the constraint].
    """
    iterate = last.iterate
    wanted, costs = [], []
    before = 0.0

    for index, errors in enumerate(last.errors.phases):
        sums = path_multiplier_sums(iterate, index)
        of_unit = unit_costs(iterate.transcription.constraints[index], sums)
        excess, intervals = errors.excess, iterate.mesh.phases[index].intervals
        of_phase = {
            number: np.where(exceeded, _AMPLE * excess[number].values, 0.0) * excess[number].size
            for number, exceeded in _closable(iterate, index, errors, sums, closed).items()
        }
        wanted.append(of_phase)
        costs.append({number: of_unit[number] * of_phase[number] for number in of_phase})
        before += float(scaled_costs(of_unit, iterate.mesh.back_off[index], intervals).sum())

    allowed = _BACK_OFF_COST * accuracy.objective
    allowed *= iterate.objective_size / iterate.scales.objective
    dearest = _dearest(costs, allowed - before)
    return [
        {
            number: np.where(cost[number] <= dearest, back_off, 0.0)
            for number, back_off in of_phase.items()
        }
        for of_phase, cost in zip(wanted, costs, strict=True)
    ]


def _dearest(costs: Sequence[Mapping[int, Array]], left: float) -> float:
    """Cost of a single back-off up to which all together cost no more than what is left."""
    each = [cost for of_phase in costs for cost in of_phase.values()]
    rising = np.sort(np.concatenate([*each, np.zeros(0)]))
    within = rising[np.cumsum(rising) <= left]
    return float(within[-1]) if within.size else -1.0


def _closable(
    iterate: Iterate,
    index: int,
    errors: PhaseErrors,
    sums: Mapping[int, Array],
    least: float,
) -> dict[int, Flags]:
    """Where a limit of a phase is exceeded and a back-off would help, by path constraint, (N,).

    Parameters
    ----------
    sums : mapping of int to (N,)
        Of the multipliers, by path constraint.
    least : float
        Relative excess from which on it counts.
    """
    widths = np.diff(iterate.trajectory.phases[index].fractions)
    narrow, short = widths < NARROW, widths < _SHORT
    largest_back_off = np.where(narrow, _LARGEST_BACK_OFF_IF_NARROW, _LARGEST_BACK_OFF)
    largest = max((float(of_one.max()) for of_one in sums.values()), default=0.0)

    closable = {}
    for number, constraint in enumerate(iterate.transcription.constraints[index]):
        excess = errors.excess[number].values
        exceeded = (excess > least) & (excess < largest_back_off)
        if constraint.of_controls or number not in sums or not exceeded.any():
            continue

        # elsewhere points are tried first
        points = _points(iterate, index, number)
        tried = points > 0 if constraint.sampled else short & (points > _TRIED)
        exceeded &= narrow | tried
        exceeded &= _AMPLE * excess * errors.excess[number].size < _SHARE * _range(
            constraint, iterate
        )
        # where a limit is not strongly active its multipliers tell no cost
        closable[number] = exceeded & (sums[number] > STRONGLY_ACTIVE * largest)
    return closable


def _points(iterate: Iterate, index: int, constraint: int) -> Integers:
    """Points that were added for a constraint in each interval of a phase, (N,)."""
    counts = np.zeros(iterate.mesh.phases[index].intervals, dtype=np.int64)
    for points in iterate.mesh.extra[index]:
        if points.constraint == constraint:
            np.add.at(counts, points.intervals, 1)
    return counts


def _range(constraint: PathConstraint, iterate: Iterate) -> float:
    """What lies between the two limits of a constraint; infinite where there is but one."""
    if constraint.peak is not None:
        return math.inf
    lower, upper = constraint.limits(iterate.parameters, {})
    return upper - lower


def without_closed(
    errors: PhaseErrors, back_off: Mapping[int, Array], tolerance: float
) -> PhaseErrors:
    """The errors but for the violations that back-offs remove."""
    if not back_off:
        return errors
    excess = tuple(
        replace(entry, values=np.where(back_off[number] > 0, -np.inf, entry.values))
        if number in back_off
        else entry
        for number, entry in enumerate(errors.excess)
    )
    exceeded = np.any([entry.values > tolerance for entry in excess], axis=0)
    return replace(
        errors, excess=excess, crowded=errors.crowded & exceeded, coarse=errors.coarse & exceeded
    )
