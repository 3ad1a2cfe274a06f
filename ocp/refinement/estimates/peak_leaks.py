"""What it costs to raise peaks to what a motion has between its points, by their multipliers."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ocp.numerics.interval_maxima import Extremes
from ocp.optimality.iterate import Iterate
from ocp.problem.functionals import Peak
from ocp.refinement.estimates.excess_price import prices
from ocp.refinement.estimates.promised_gain import CERTIFIED_GAIN


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
