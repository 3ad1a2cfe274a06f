"""Steps of quotients along a motion, where a divisor vanishes.

``x / fabs(x)`` is a sign, and ``atan(y / x)`` jumps by half a turn. No operation in them is
constant piece by piece. So the values at several distances on both sides of the zero are compared:
beside a step they stay on each side what they are, beside a pole they grow, and where the quotient
is smooth, as ``sin(x) / x`` is, they meet.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ocp.arrays import Array, Integers
from ocp.mesh.trajectory import PhaseTrajectory
from ocp.numerics.columnwise import columnwise

# expressions (k,), times (m,) [s] -> their values (m, k)
Values = Callable[[tuple[ca.SX, ...], Array], Array]

# A step of less than this part of the largest value along the motion is none.
LEAST_STEP = 1e-6

# Instants of an interval at which a motion is looked at, off its ends: there a motion that begins
# at rest has a speed of zero, whose sign is neither.
_INSTANTS = 8

# A divisor vanishes where it is less than this part of its largest value, at one of the lowest
# samples. A sample that is beside a zero is at most a third of the larger one of its neighbours, if
# the divisor goes to zero in a straight line.
_VANISHED = 1e-6
_LOW = 0.75

# Sections of the time between samples to a zero, by the golden section, to rounding
_GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)
_SECTIONS = 75

# Distances from a zero at which a quotient is looked at, parts of the phase, and part of the step
# by which it may change on one side from the first to the last.
_ASIDE = (1e-8, 3e-9, 1e-9)
_STEADY = 0.1

# Part of the phase at its ends in which no zero counts: a motion that begins at rest has a speed of
# zero there, and comes from nowhere.
_AT_ENDS = 1e-6


@dataclass(frozen=True)
class QuotientStep:
    """A step of an expression where a divisor vanishes.

    Attributes
    ----------
    divisor : SX
    time : float
        [s]
    column : int
        Number of the expression.
    size : float
        Of the step, relative to the largest value of the expression along the motion.
    """

    divisor: ca.SX
    time: float
    column: int
    size: float


def quotient_steps(
    divisors: tuple[ca.SX, ...],
    expressions: tuple[ca.SX, ...],
    symbols: tuple[ca.SX, ...],
    motion: PhaseTrajectory,
    values: Values,
) -> Iterator[QuotientStep]:
    """At each zero of a divisor inside a phase the largest step of an expression, if one steps.

    Parameters
    ----------
    divisors, expressions : tuple of SX
    symbols : tuple of SX
        What the expressions depend on.
    motion : PhaseTrajectory
    values : callable
        Of expressions along the phase.
    """
    zeros, numbers = _zeros(divisors, motion, values)
    if not zeros.size:
        return

    sampled = np.abs(values(expressions, instants_of(motion)[1]))
    sizes = np.where(np.isfinite(sampled), sampled, 0.0).max(axis=0)
    distances = np.array(_ASIDE)[:, None] * (motion.end - motion.start)
    stacked = ca.densify(ca.vertcat(*expressions))
    function = ca.Function("expressions", [ca.vertcat(*symbols)], [stacked])
    for number in np.unique(numbers).tolist():
        at = zeros[numbers == number]
        own = np.array([ca.depends_on(divisors[number], symbol) for symbol in symbols])

        # what the divisor depends on is that of each side, and all else that of one instant: a
        # control may jump there
        one = values(symbols, at)
        left, right = (
            np.array(
                [
                    columnwise(function, np.where(own, values(symbols, beside), one))[0]
                    for beside in at + sign * distances
                ]
            )
            for sign in (-1.0, 1.0)
        )
        with np.errstate(invalid="ignore"):  # at a pole
            steps = np.abs(right[-1] - left[-1])
            changes = np.maximum(np.abs(left[0] - left[-1]), np.abs(right[0] - right[-1]))
        steps = np.where(changes < _STEADY * steps, steps, 0.0)
        relative = steps / np.where(sizes > 0, sizes, 1.0)
        for time, parts in zip(at, relative, strict=True):
            column = int(np.argmax(parts))
            if parts[column] > LEAST_STEP:
                yield QuotientStep(divisors[number], float(time), column, float(parts[column]))


def instants_of(motion: PhaseTrajectory) -> tuple[Integers, Array]:
    """Intervals (m,) and times (m,) [s] at which a motion is looked at."""
    k = np.repeat(np.arange(motion.intervals), _INSTANTS)
    tau = np.tile((np.arange(_INSTANTS) + 0.5) / _INSTANTS, motion.intervals)
    return k, motion.breakpoints[k] + tau * np.diff(motion.breakpoints)[k]


def _zeros(
    divisors: tuple[ca.SX, ...], motion: PhaseTrajectory, values: Values
) -> tuple[Array, Integers]:
    """Times (m,) inside a phase at which divisors vanish, and the numbers of these (m,)."""
    times = np.concatenate([[motion.start], instants_of(motion)[1], [motion.end]])
    found = values(divisors, times)
    low, high, numbers = _brackets(times, found)
    rows = np.arange(numbers.size)
    if not rows.size:
        return low, numbers

    def sizes_at(at: Array) -> Array:
        return np.asarray(np.abs(values(divisors, at))[rows, numbers])

    for _ in range(_SECTIONS):
        first, second = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
        left = sizes_at(first) < sizes_at(second)
        low, high = np.where(left, low, first), np.where(left, second, high)

    zeros = 0.5 * (low + high)
    largest = np.where(np.isfinite(found), np.abs(found), 0.0).max(axis=0)
    inside = np.minimum(zeros - motion.start, motion.end - zeros)
    vanished = sizes_at(zeros) <= _VANISHED * largest[numbers]
    vanished &= inside > _AT_ENDS * (motion.end - motion.start)
    return zeros[vanished], numbers[vanished]


def _brackets(times: Array, found: Array) -> tuple[Array, Array, Integers]:
    """Brackets of possible zeros, and the numbers of the divisors, (m,) each.

    Parameters
    ----------
    times : (n,)
    found : (n, k)
        Divisors there.
    """
    sizes = np.abs(found)
    larger, lesser = np.maximum(sizes[:-2], sizes[2:]), np.minimum(sizes[:-2], sizes[2:])
    lowest = np.zeros(sizes.shape, dtype=bool)
    lowest[1:-1] = (sizes[1:-1] <= lesser) & (sizes[1:-1] < _LOW * larger)
    lowest[0] = sizes[0] < _LOW * sizes[1]
    lowest[-1] = sizes[-1] < _LOW * sizes[-2]

    places, numbers = np.nonzero(lowest)
    before, crossing = np.nonzero(found[1:] * found[:-1] < 0)
    low = times[np.concatenate([np.maximum(places - 1, 0), before])]
    high = times[np.concatenate([np.minimum(places + 1, len(times) - 1), before + 1])]
    return low, high, np.concatenate([numbers, crossing])
