"""Known times at which the expressions of a phase step or bend: breakpoints of every mesh.

A tariff, an eclipse or a gate changes the dynamics at a time that is known beforehand. No
polynomial follows that, so an interval must end there. Such times are stated, or read off the
expressions: a comparison of time with a number (as in ``if_else``, ``pw_const`` and ``pw_lin``), a
sign, an absolute value, a smallest or a largest value changes where its two sides are equal, and a
quotient may step where its divisor vanishes. What is compared is sampled over the phase, and each
change that the samples show is located to rounding. A time that depends on a `Constant` is not
read, because a mesh serves for all values of the constants.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import casadi as ca
import numpy as np

from ocp.arrays import Array
from ocp.errors import StatementError
from ocp.numerics.columnwise import columnwise, enclosed
from ocp.numerics.expression_graph import ExpressionGraph, Instruction, graph_of
from ocp.problem.symbols import TIME, is_real

# A table of more steps than this is taken as it is: its values are close to a smooth curve, and a
# mesh of so many intervals would cost more than it gains.
_MOST = 100

# Of the times' size: within this of a step, a point belongs to the interval that it is in. It is
# some times what rounding makes of a breakpoint on its way through fractions of the phase.
BESIDE = 64 * float(np.finfo(float).eps)

# operations that change where their operands are equal, and where their operand is zero
_OF_TWO = {"lt", "le", "eq", "ne", "fmin", "fmax"}
_OF_ONE = {"sign", "fabs", "inv"}

# those that change where a quotient is a whole number, or half of an odd one: what vanishes there,
# of the quotient times pi
_OF_WHOLE: dict[str, Callable[[ca.SX], ca.SX]] = {
    "floor": ca.sin,
    "ceil": ca.sin,
    "fmod": ca.sin,
    "remainder": ca.cos,
}

# Samples of a function of time over a phase
SAMPLES = 4001


def stepping_times(expressions: Iterable[ca.SX], start: float, end: float) -> tuple[float, ...]:
    """Times inside a phase at which expressions may step or bend, in order; none where too many.

    Parameters
    ----------
    expressions : iterable of SX
        Scalars of declared symbols.
    start, end : float
        Of the phase [s].
    """
    timed = [e for e in expressions if ca.depends_on(e, TIME.symbol)]
    if not timed:
        return ()
    symbols = ca.symvar(ca.vertcat(*timed))
    graph = graph_of(timed, symbols)
    clock = next(i for i, s in enumerate(symbols) if s.element_hash() == TIME.symbol.element_hash())

    of_time: list[bool] = []
    compared: list[tuple[str, tuple[int, ...]]] = []
    for instruction in graph.instructions:
        is_symbol = instruction.operation == "symbol"
        sides = _compared(instruction)
        if sides and all(of_time[i] for i in sides):
            compared.append((instruction.operation, sides))
        own = instruction.operands[0] == clock if is_symbol else instruction.function is None
        of_time.append(own and (is_symbol or all(of_time[i] for i in instruction.operands)))
    if not compared:
        return ()

    places = tuple(i for _, sides in compared for i in sides)
    values = iter(ExpressionGraph(graph.instructions, places).rebuilt(symbols))
    vanishing = [_vanishing(name, [next(values) for _ in sides]) for name, sides in compared]
    found = _crossings(vanishing, start, end)
    return found if len(found) <= _MOST else ()


def _compared(instruction: Instruction) -> tuple[int, ...]:
    """The operands that an operation compares with each other, or with zero; none if it does not.

    It changes where they are equal, or where the one operand is zero.
    """
    name = instruction.operation
    if name in _OF_TWO or name in _OF_ONE or name in _OF_WHOLE:
        return instruction.operands
    return instruction.operands[1:] if name == "div" else ()


def _vanishing(name: str, sides: Sequence[ca.SX]) -> ca.SX:
    """What changes its sign where an operation on the sides changes."""
    first, second = [*sides, ca.SX(1 if name in _OF_WHOLE else 0)][:2]
    if name in _OF_WHOLE:
        return _OF_WHOLE[name](math.pi * first / second)
    return first - second


def _crossings(functions: Sequence[ca.SX], start: float, end: float) -> tuple[float, ...]:
    """Times inside a phase at which functions of time alone change their signs, in order [s]."""
    function = ca.Function("compared", [TIME.symbol], [ca.densify(ca.vertcat(*functions))])

    def signs(times: Array) -> Array:
        return np.sign(columnwise(function, times)[0])

    times = np.linspace(start, end, SAMPLES)[:, None]
    found = signs(times)
    rows, numbers = np.nonzero(found[1:] != found[:-1])
    if numbers.size > 2 * _MOST:  # two changes where a sample is zero
        return ()
    changes = enclosed(signs, times[rows], times[rows + 1], numbers)[1].ravel()

    # of those that differ by rounding one
    kept, beside = [start], BESIDE * max(abs(start), abs(end))
    for time in np.sort(changes).tolist():
        if time - kept[-1] > beside and end - time > beside:
            kept.append(time)
    return tuple(kept[1:])


def within(times: Array, left: Array, right: Array) -> Array:
    """Times moved by rounding into the open interval between `left` and `right`.

    An expression that steps at a breakpoint then has, at both ends of an interval, the value that
    it has inside.
    """
    reach = BESIDE * np.maximum(np.abs(left), np.abs(right))
    return np.asarray(np.clip(times, left + reach, right - reach))


def checked_breakpoints(given: Any, phase: str, start: float, end: float) -> tuple[float, ...]:
    """The stated breakpoints of a phase in order.

    Parameters
    ----------
    start, end : float
        Between which the phase is at most [s].

    Raises
    ------
    StatementError
        When one is no number or lies outside.
    """
    try:
        times = tuple(given)
    except TypeError:
        times = (given,)
    for time in times:
        if not (is_real(time) and math.isfinite(time) and start <= time <= end):
            raise StatementError(
                f"the breakpoint {time!r} of phase '{phase}' is not between its start {start} and "
                f"its end {end} s; give times [s] inside the phase, such as breakpoints=[2.0]"
            )
    return tuple(sorted({float(time) for time in times}))
