"""Where expressions step along a line, such as the time of a motion or the values of a parameter.

Results of stepwise operations are looked at at many places of the line, and a change is enclosed by
ever shorter sections. With the symbols of one place and the results of both sides, what differs is
the step: a kink, where two comparisons change together, is none.

A quotient may step where its divisor vanishes. ``x / fabs(x)`` is a sign, and ``atan(y / x)`` jumps
by half a turn. No operation in them is constant piece by piece. So the values at several distances
on both sides of the zero are compared: beside a step they stay on each side what they are, beside a
pole they grow, and where the quotient is smooth, as ``sin(x) / x`` is, they meet.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ocp.arrays import Array, Flags, Integers
from ocp.numerics.columnwise import columnwise
from ocp.numerics.divisors import divisors
from ocp.numerics.stepwise_operations import StepwiseOperations, stepwise_operations

# expressions (k,), places on a line (m,) -> their values (m, k)
Values = Callable[[tuple[ca.SX, ...], Array], Array]

# A step of less than this part of the largest value along the line is none.
_LEAST_STEP = 1e-6

# The way between two places is divided, again and again, to rounding. As a call of the operations
# takes longer than a hundred of their values, there are several sections each time.
_SECTIONS, _DIVISIONS = 16, 13

# Part of the line by which the sides of a change are apart: comparisons that are meant to change
# together differ by rounding.
_BESIDE = 1e-9

# A divisor vanishes where it is less than this part of its largest value, at one of the lowest
# places. A place that is beside a zero is at most a third of the larger one of its neighbours, if
# the divisor goes to zero in a straight line.
_VANISHED = 1e-6
_LOW = 0.75

# Steps of the way between places to a zero, by the golden section, to rounding
_GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)
_STEPS_TO_ZERO = 75

# Distances from a zero at which a quotient is looked at, parts of the line, and part of the step by
# which it may change on one side from the first to the last.
_ASIDE = (1e-8, 3e-9, 1e-9)
_STEADY = 0.1

# Part of the line at its ends in which no zero counts: a motion that begins at rest has a speed of
# zero there, and comes from nowhere.
_AT_ENDS = 1e-6


@dataclass(frozen=True)
class FoundStep:
    """A step of an expression on a line.

    Attributes
    ----------
    place : float
    cause : SX
        The result that changes, or the divisor that vanishes.
    vanishes : bool
        Which of the two.
    column : int
        Number of the expression that steps most.
    size : float
        Of its step, relative to its largest value along the line.
    """

    place: float
    cause: ca.SX
    vanishes: bool
    column: int
    size: float


@dataclass(frozen=True, eq=False, repr=False)
class SteppingExpressions:
    """Expressions that may step.

    Attributes
    ----------
    expressions, symbols : tuple of SX
        They and what they depend on.
    operations : StepwiseOperations or None
    divisors : tuple of SX
    """

    expressions: tuple[ca.SX, ...]
    symbols: tuple[ca.SX, ...]
    operations: StepwiseOperations | None
    divisors: tuple[ca.SX, ...]

    @classmethod
    def of(cls, expressions: tuple[ca.SX, ...]) -> SteppingExpressions | None:
        """Scalar expressions, or None where none of them steps or divides."""
        symbols = tuple(ca.symvar(ca.vertcat(*expressions)))
        operations = stepwise_operations(expressions, symbols)
        divided = divisors(expressions, symbols)
        if operations is None and not divided:
            return None
        return cls(expressions, symbols, operations, divided)

    def along(
        self, places: Array, values: Values, line: ca.SX, jumps: tuple[ca.SX, Flags] | None = None
    ) -> Iterator[FoundStep]:
        """For each change on a line and each zero of a divisor the largest step.

        Parameters
        ----------
        places : (n,)
            Of the line, in order, its ends among them.
        values : callable
            Of expressions along the line.
        line : SX (k,)
            The symbols that change along the line.
        jumps : (SX, (n - 1,)), optional
            Symbols that may jump, and between which places. A result of them that changes there is
            no crossing.
        """
        if self.operations is not None:
            yield from self._changes(self.operations, places, values, line, jumps)
        varying = tuple(each for each in self.divisors if ca.depends_on(each, line))
        if varying:
            yield from self._zeros(varying, places, values)

    def _changes(
        self,
        operations: StepwiseOperations,
        places: Array,
        values: Values,
        line: ca.SX,
        jumps: tuple[ca.SX, Flags] | None,
    ) -> Iterator[FoundStep]:
        """Steps where the result of an operation changes, off the ends of the line."""
        inner = places[1:-1]
        results = values(operations.results, inner)
        changed = np.diff(results, axis=0) != 0
        for number, result in enumerate(operations.results):
            if not ca.depends_on(result, line):
                changed[:, number] = False
            elif jumps is not None and ca.depends_on(result, jumps[0]):
                changed[jumps[1][1:-1], number] = False
        rows, numbers = np.nonzero(changed)
        if not rows.size:
            return

        # each change is enclosed by the first section that ends with another result
        low, high, before = inner[rows], inner[rows + 1], results[rows, numbers]
        each, shares = np.arange(rows.size), np.linspace(0.0, 1.0, _SECTIONS + 1)
        for _ in range(_DIVISIONS):
            ends = low[:, None] + shares * (high - low)[:, None]
            ends[:, -1] = high
            found = values(operations.results, ends[:, 1:-1].ravel())
            found = found.reshape(rows.size, _SECTIONS - 1, -1)[each, :, numbers]
            other = np.column_stack([found != before[:, None], np.ones(rows.size, dtype=bool)])
            first = np.argmax(other, axis=1)
            low, high = ends[each, first], ends[each, first + 1]

        def held(symbols: Array, given: Array) -> Array:
            return columnwise(operations.function, symbols, given)[0]

        beside = _BESIDE * (places[-1] - places[0])
        at = values(self.symbols, low)
        left, right = (
            held(at, values(operations.results, side)) for side in (low - beside, high + beside)
        )
        sizes = _sizes(held(values(self.symbols, inner), results))
        causes = [operations.results[number] for number in numbers.tolist()]
        yield from _largest(high, causes, False, np.abs(right - left) / sizes)

    def _zeros(
        self, varying: tuple[ca.SX, ...], places: Array, values: Values
    ) -> Iterator[FoundStep]:
        """Steps where a divisor vanishes."""
        zeros, numbers = _zeros_of(varying, places, values)
        if not zeros.size:
            return
        sizes = _sizes(values(self.expressions, places[1:-1]))
        distances = np.array(_ASIDE) * (places[-1] - places[0])
        stacked = ca.densify(ca.vertcat(*self.expressions))
        function = ca.Function("expressions", [ca.vertcat(*self.symbols)], [stacked])
        for number in np.unique(numbers).tolist():
            at = zeros[numbers == number]
            own = np.array([ca.depends_on(varying[number], symbol) for symbol in self.symbols])

            # what the divisor depends on is that of each side, and all else that of one place: a
            # control may jump there
            one = values(self.symbols, at)
            left, right = (
                [
                    columnwise(function, np.where(own, values(self.symbols, at + far), one))[0]
                    for far in sign * distances
                ]
                for sign in (-1.0, 1.0)
            )
            with np.errstate(invalid="ignore"):  # at a pole
                steps = np.abs(right[-1] - left[-1])
                changes = np.maximum(np.abs(left[0] - left[-1]), np.abs(right[0] - right[-1]))
            steps = np.where(changes < _STEADY * steps, steps, 0.0)
            yield from _largest(at, [varying[number]] * at.size, True, steps / sizes)


def _sizes(values: Array) -> Array:
    """The largest values (k,) of expressions (m, k), 1 where these are zero."""
    sizes = np.where(np.isfinite(values), np.abs(values), 0.0).max(axis=0)
    return np.where(sizes > 0.0, sizes, 1.0)


def _largest(
    places: Array, causes: list[ca.SX], vanishes: bool, relative: Array
) -> Iterator[FoundStep]:
    """Of each row of relative steps (m, k) the largest, unless it is none."""
    for place, cause, parts in zip(places, causes, relative, strict=True):
        column = int(np.argmax(parts))
        if parts[column] > _LEAST_STEP:
            yield FoundStep(float(place), cause, vanishes, column, float(parts[column]))


def _zeros_of(divided: tuple[ca.SX, ...], places: Array, values: Values) -> tuple[Array, Integers]:
    """Places (m,) on a line at which divisors vanish, and the numbers of these (m,)."""
    found = values(divided, places)
    low, high, numbers = _brackets(places, found)
    rows = np.arange(numbers.size)
    if not rows.size:
        return low, numbers

    def sizes_at(at: Array) -> Array:
        return np.asarray(np.abs(values(divided, at))[rows, numbers])

    for _ in range(_STEPS_TO_ZERO):
        first, second = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
        left = sizes_at(first) < sizes_at(second)
        low, high = np.where(left, low, first), np.where(left, second, high)

    zeros = 0.5 * (low + high)
    vanished = sizes_at(zeros) <= _VANISHED * _sizes(found)[numbers]
    inside = np.minimum(zeros - places[0], places[-1] - zeros)
    vanished &= inside > _AT_ENDS * (places[-1] - places[0])
    return zeros[vanished], numbers[vanished]


def _brackets(places: Array, found: Array) -> tuple[Array, Array, Integers]:
    """Brackets of possible zeros, and the numbers of the divisors, (m,) each.

    Parameters
    ----------
    places : (n,)
    found : (n, k)
        Divisors there.
    """
    sizes = np.abs(found)
    larger, lesser = np.maximum(sizes[:-2], sizes[2:]), np.minimum(sizes[:-2], sizes[2:])
    lowest = np.zeros(sizes.shape, dtype=bool)
    lowest[1:-1] = (sizes[1:-1] <= lesser) & (sizes[1:-1] < _LOW * larger)
    lowest[0] = sizes[0] < _LOW * sizes[1]
    lowest[-1] = sizes[-1] < _LOW * sizes[-2]

    rows, numbers = np.nonzero(lowest)
    before, crossing = np.nonzero(found[1:] * found[:-1] < 0)
    low = places[np.concatenate([np.maximum(rows - 1, 0), before])]
    high = places[np.concatenate([np.minimum(rows + 1, len(places) - 1), before + 1])]
    return low, high, np.concatenate([numbers, crossing])
