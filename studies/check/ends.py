"""Speed and acceleration at the ends of a profile, as its rows alone tell them for certain.

A spline through the rows needs conditions at its ends, so that what it has there is in part a
choice. A polynomial through as few rows next to an end needs none. How far its derivative may be
from that of the motion follows from how fast the motion can change, which the caps say: a motion
without a limit on its jerk can have any acceleration at the first row. Rows further apart are less
spoiled by their digits and leave more room for change: the distance that leaves least open counts.

No convergence of such polynomials says more. A motion that starts from rest, with a jerk within
its cap, and soon goes on evenly makes them agree on the acceleration that it has afterwards.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ocp.arrays import Array
from studies.common.result import Criterion, at_most, outcome


@dataclass(frozen=True)
class Most:
    """The most that a derivative of the motion is taken to be.

    Attributes
    ----------
    name, unit : of the derivative.
    order : of the derivative.
    value : [rad/s^order].
    """

    name: str
    unit: str
    order: int
    value: float

    def __str__(self) -> str:
        return f"the {self.name} is at most {self.value:.3g} {self.unit}"


@dataclass(frozen=True)
class EndRate:
    """A derivative at an end, as the rows tell it.

    Attributes
    ----------
    value : [rad/s^order].
    wrong : by how much it may be wrong at most, in the same unit.
    given : the limit on a higher derivative that this takes for granted.
    """

    value: float
    wrong: float
    given: Most

    def exceeds(self, limit: float) -> bool:
        """Whether the true derivative is beyond a limit."""
        return abs(self.value) - self.wrong > limit


def end_rate(
    time: Array, values: Array, wrong: Array, order: int, given: tuple[Most, ...]
) -> EndRate:
    r"""A derivative of rows at the first one; for the end, give the rows backwards.

    The polynomial p of degree k - 1 goes through k rows at times :math:`t_0 \dots t_{k-1}`, evenly
    apart in number. At the outermost of them, with :math:`\omega(t) = \prod_j (t - t_j)`,

    .. math:: f^{(m)}(t_0) - p^{(m)}(t_0) = f^{(k)}(\xi)\, \omega^{(m)}(t_0) / k!

    for some time between them, as the Peano kernel of that error has one sign. The values of rows
    that are wrong add the sum of their sizes times those of their weights in p. Both bounds are
    attained.

    Parameters
    ----------
    time, values, wrong : (m,)
        And by how much each value may be wrong.
    order : int
        Of the derivative, 1 or 2.
    given : of at least one derivative of a higher order than that; lower ones tell nothing.
    """
    found = [
        rate
        for most in given
        if most.order > order
        for rate in _at_distances(time, values, wrong, order, most)
    ]
    return min(found, key=lambda rate: rate.wrong)


def _at_distances(
    time: Array, values: Array, wrong: Array, order: int, most: Most
) -> Iterator[EndRate]:
    """The same by every row next to the end, every second one, every fourth one and so on."""
    k, distance = most.order, 1
    while (k - 1) * distance < time.size:
        place = distance * np.arange(k)
        length = time[place[-1]] - time[0]  # backwards it is negative
        u = (time[place] - time[0]) / length
        scale = math.factorial(order) / length**order
        weights = np.linalg.inv(np.vander(u, increasing=True))[order] * scale
        # of the product of all t - t_j, by its coefficients
        slope = np.poly(u)[::-1][order] * scale * length**k
        # equal parts of all values are no motion, and cost digits
        value = float(weights @ (values[place] - values[0]))
        by_digits = float(np.abs(weights) @ wrong[place])
        yield EndRate(value, most.value * abs(slope) / math.factorial(k) + by_digits, most)
        distance *= 2


def at_rest(name: str, unit: str, drawn: float, rate: EndRate, limit: float) -> Criterion:
    """The criterion that a derivative is zero at an end.

    Parameters
    ----------
    drawn : of the curve through the rows, which has passed if it is within the limit.
    rate : as the rows tell it.
    """
    size = abs(rate.value)
    told = f"{size:.3g} +- {rate.wrong:.2g} {unit} if {rate.given}"
    if rate.exceeds(limit):
        taken = ", although the smoothed curve is at rest" if drawn <= limit else ""
        sentence = f"{outcome(False)}: {name} {told} (limit {limit:.3g}{taken})"
        return Criterion(name, unit, size, limit, False, sentence)
    if drawn <= limit:
        return at_most(name, unit, drawn, limit)
    why = f"the rows tell {told}"
    sentence = f"{outcome(True, False)}: {name} {drawn:.3g} {unit} (limit {limit:.3g}, {why})"
    return Criterion(name, unit, drawn, limit, True, sentence, decided=False)
