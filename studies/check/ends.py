"""Speed and acceleration at the ends of a profile with exact rows, and how sure they are.

A spline through the rows needs conditions at its ends, so that what it has there is in part a
choice. Polynomials through the rows next to an end need none. If those of rising degree converge,
a few of the last steps between them are more than what is left of the error. If they do not, more
happens between two rows than these tell, such as a start from rest, and nothing is decided. Rows
further apart are less spoiled by their digits: of all distances that converge the one that leaves
the least open counts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ocp.arrays import Array
from studies.common.result import Criterion, at_most, outcome

DEGREES = (2, 3, 4, 5)  # of the polynomials; the last one gives the value
# of the last step over the larger one before, above which they do not converge: a start from rest
# within the first row leaves 0.6 or more, and below a half all later steps sum up to the last one
CONVERGES = 0.5
STEPS = 3.0  # of the last size that may be left: a switch between two rows can feign convergence


@dataclass(frozen=True)
class EndRate:
    """A derivative at an end, as the rows tell it.

    Attributes
    ----------
    value : [rad/s^order].
    wrong : by how much it may be wrong, in the same unit: digits for certain, interpolation as it
        is estimated; infinite where the rows are too far apart to tell.
    """

    value: float
    wrong: float

    def exceeds(self, limit: float) -> bool:
        """Whether the true derivative is beyond a limit."""
        return abs(self.value) - self.wrong > limit


def end_rate(time: Array, values: Array, wrong: Array, order: int) -> EndRate:
    """A derivative of exact rows at the first one; for the end, give the rows backwards.

    Parameters
    ----------
    time, values, wrong : (m,)
        With m >= 6, and by how much each value may be wrong.
    order : int
        Of the derivative, 1 or 2.
    """
    best = _at_distance(time, values, wrong, order, 1)
    distance = 2
    while math.isfinite(best.wrong) and DEGREES[-1] * distance < time.size:
        rate = _at_distance(time, values, wrong, order, distance)
        if not math.isfinite(rate.wrong):
            break
        best = min(best, rate, key=lambda one: one.wrong)
        distance *= 2
    return best


def _at_distance(time: Array, values: Array, wrong: Array, order: int, distance: int) -> EndRate:
    """The same by every so many rows."""
    estimates, digits = [], []
    for degree in DEGREES:
        place = distance * np.arange(degree + 1)
        length = time[place[-1]] - time[0]  # backwards it is negative
        powers = np.vander((time[place] - time[0]) / length, increasing=True)
        weights = np.linalg.inv(powers)[order] * math.factorial(order) / length**order
        # equal parts of all values are no motion, and cost digits
        estimates.append(float(weights @ (values[place] - values[0])))
        digits.append(float(np.abs(weights) @ wrong[place]))

    *before, last = np.abs(np.diff(estimates)).tolist()
    by_digits = digits[-1]
    if last > max(CONVERGES * max(before), digits[-2] + by_digits):
        return EndRate(estimates[-1], math.inf)
    return EndRate(estimates[-1], STEPS * last + by_digits)


def at_rest(name: str, unit: str, drawn: float, rate: EndRate, limit: float) -> Criterion:
    """The criterion that a derivative is zero at an end.

    Parameters
    ----------
    drawn : of the curve through the rows, which has passed if it is within the limit.
    rate : what the rows tell of it.
    """
    size = abs(rate.value)
    told = f"{size:.3g} +- {rate.wrong:.2g} {unit}"
    if rate.exceeds(limit):
        taken = ", though the curve is drawn at rest" if drawn <= limit else ""
        sentence = f"{outcome(False)}: {name} {told} (limit {limit:.3g}{taken})"
        return Criterion(name, unit, size, limit, False, sentence)
    if drawn <= limit:
        return at_most(name, unit, drawn, limit)
    why = f"the rows tell {told}" if math.isfinite(rate.wrong) else "the rows are too far apart"
    sentence = f"{outcome(True, False)}: {name} {drawn:.3g} {unit} (limit {limit:.3g}, {why})"
    return Criterion(name, unit, drawn, limit, True, sentence, decided=False)
