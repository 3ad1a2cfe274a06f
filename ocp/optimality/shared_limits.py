"""What controls that share limits can gain: ``u1 + u2 <= F``, or ``s >= u`` and ``s >= -u``.

A control alone may have no room where another one could make some. All together they gain at each
time, to first order, the value of a linear program: the most of ``-slope . step`` over all steps
within the room of each control and within the shared limits. Its dual bounds it: for any
multipliers of the shared limits the gain is no more than the multipliers times the slacks, and what
each control gains alone by its slope with the limits' parts added (Bertsimas and Tsitsiklis,
"Introduction to Linear Optimization", section 4.3). The best multipliers lie where as many of these
slopes vanish as limits act.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from ocp.arrays import Array


@dataclass(frozen=True, eq=False, repr=False)
class SharedLimit:
    """A limit of several controls at m times.

    Attributes
    ----------
    slopes : (m, n_u)
        Of what is limited by each control.
    to_lower, to_upper : (m,)
        From what is limited to its limits; infinite where there is none.
    """

    slopes: Array
    to_lower: Array
    to_upper: Array

    @property
    def held(self) -> list[int]:
        """Numbers of the controls that it holds."""
        return [int(j) for j in np.flatnonzero(self.slopes.any(axis=0))]

    def of(self, controls: Sequence[int]) -> SharedLimit:
        """The same one for some controls alone."""
        return replace(self, slopes=self.slopes[:, controls])


def limits_by_group(
    limits: Sequence[SharedLimit], count: int
) -> Iterator[tuple[list[int], list[SharedLimit]]]:
    """Controls that limits hold together, by number, each group with its limits of these controls.

    Every control is in one group, one that shares nothing in a group of its own.

    Parameters
    ----------
    count : int
        Of all controls.
    """
    groups = [{control} for control in range(count)]
    for limit in limits:
        held = set(limit.held)
        joined = [group for group in groups if group & held]
        groups = [group for group in groups if not group & held]
        if joined:
            groups.append(set().union(*joined))
    for group in groups:
        own = sorted(group)
        yield own, [limit.of(own) for limit in limits if set(limit.held) & group]


def traded_gain(slope: Array, room: tuple[Array, Array], limits: Sequence[SharedLimit]) -> Array:
    """What controls can gain at most, (m,); infinite where no limit is shared.

    It is the most that they gain where one limit acts at a time, or two that share a control.
    Where more act it is a bound.

    Parameters
    ----------
    slope : (m, n_u)
        Of what is minimised by each control.
    room : (m, n_u), (m, n_u)
        How far each control may move down and up.
    """

    def at_most(multipliers: Mapping[int, Array]) -> Array:
        bound, remaining = np.zeros(slope.shape[0]), slope
        for i, multiplier in multipliers.items():
            limit = limits[i]
            slack = np.maximum(np.where(multiplier > 0, limit.to_upper, limit.to_lower), 0.0)
            # a limit that is not there costs nothing where its multiplier is zero
            bound = bound + np.where(multiplier == 0.0, 0.0, np.abs(multiplier) * slack)
            remaining = remaining + multiplier[:, None] * limit.slopes
        gained = np.abs(remaining) * np.where(remaining > 0, *room)
        return np.asarray(bound + gained.sum(axis=1))

    least = np.full(slope.shape[0], np.inf)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for multipliers in _multipliers(slope, limits):
            least = np.fmin(least, at_most(multipliers))
    return least


def _multipliers(slope: Array, limits: Sequence[SharedLimit]) -> Iterator[dict[int, Array]]:
    """Multipliers (m,) of one limit or two, by number, with which as many slopes vanish."""
    for i, limit in enumerate(limits):
        for j in limit.held:
            yield {i: -slope[:, j] / limit.slopes[:, j]}

    for (i, first), (k, second) in combinations(enumerate(limits), 2):
        if not set(first.held) & set(second.held):
            continue
        one, other = first.slopes, second.slopes
        for j, n in combinations(sorted({*first.held, *second.held}), 2):
            # Cramer's rule
            determinant = one[:, j] * other[:, n] - one[:, n] * other[:, j]
            of_first = other[:, j] * slope[:, n] - other[:, n] * slope[:, j]
            of_second = one[:, n] * slope[:, j] - one[:, j] * slope[:, n]
            yield {i: of_first / determinant, k: of_second / determinant}
