"""Known times at which the expressions of a phase step or bend: breakpoints of every mesh.

A tariff, an eclipse or a gate changes the dynamics at a time that is known beforehand. No
polynomial follows that, so an interval must end there. Such times are stated, or read off the
expressions: a comparison of time with a number (as in ``if_else``, ``pw_const`` and ``pw_lin``), a
sign, an absolute value, a smallest or a largest value changes where its two sides are equal, and a
quotient may step where its divisor vanishes. Only what is linear in time is read, so that every
change is found exactly. A time that depends on a `Constant` is not, because a mesh serves for all
values of the constants.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import casadi as ca
import numpy as np

from ocp.arrays import Array
from ocp.errors import StatementError
from ocp.numerics.expression_graph import Instruction, graph_of
from ocp.problem.symbols import TIME, is_real

# A table of more steps than this is taken as it is: its values are close to a smooth curve, and a
# mesh of so many intervals would cost more than it gains.
_MOST = 100

# Of the times' size: within this of a step, a point belongs to the interval that it is in. It is
# some times what rounding makes of a breakpoint on its way through fractions of the phase.
_BESIDE = 64 * float(np.finfo(float).eps)

# operations that change where their operands are equal, and where their operand is zero
_OF_TWO = {"lt", "le", "eq", "ne", "fmin", "fmax"}
_OF_ONE = {"sign", "fabs"}

_Line = tuple[float, float]  # slope by time, and value at time zero


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

    lines: list[_Line | None] = []
    found: set[float] = set()
    for instruction in graph.instructions:
        operands = [lines[i] for i in instruction.operands if instruction.operation != "symbol"]
        for line in _compared(instruction, operands):
            if line[0] != 0.0 and start < -line[1] / line[0] < end:
                found.add(-line[1] / line[0])
        lines.append(_line(instruction, operands, clock))
    return tuple(sorted(found)) if len(found) <= _MOST else ()


def _compared(instruction: Instruction, operands: Sequence[_Line | None]) -> Iterator[_Line]:
    """What an operation compares with zero, if it is linear in time."""
    name = instruction.operation
    if name in _OF_ONE and operands[0] is not None:
        yield operands[0]
    if name == "inv" and operands[0] is not None:
        yield operands[0]
    if name == "div" and operands[1] is not None:
        yield operands[1]
    if name in _OF_TWO:
        first, second = operands
        if first is not None and second is not None:
            yield first[0] - second[0], first[1] - second[1]


def _line(instruction: Instruction, operands: Sequence[_Line | None], clock: int) -> _Line | None:
    """The result of an operation as a line in time, None if it is none."""
    name = instruction.operation
    if name == "number":
        return 0.0, instruction.number
    if name == "symbol":
        return (1.0, 0.0) if instruction.operands[0] == clock else None

    known = [line for line in operands if line is not None]
    if len(known) < len(operands) or instruction.function is not None:
        return None
    slopes, values = zip(*known, strict=True)
    if name == "neg":
        return -slopes[0], -values[0]
    if name == "twice":
        return 2 * slopes[0], 2 * values[0]
    if name == "add":
        return slopes[0] + slopes[1], values[0] + values[1]
    if name == "sub":
        return slopes[0] - slopes[1], values[0] - values[1]
    if name == "mul" and 0.0 in slopes:
        return slopes[0] * values[1] + slopes[1] * values[0], values[0] * values[1]
    if name == "div" and slopes[1] == 0.0 and values[1] != 0.0:
        return slopes[0] / values[1], values[0] / values[1]
    return None


def within(times: Array, left: Array, right: Array) -> Array:
    """Times moved by rounding into the open interval between `left` and `right`.

    An expression that steps at a breakpoint then has, at both ends of an interval, the value that
    it has inside.
    """
    reach = _BESIDE * np.maximum(np.abs(left), np.abs(right))
    return np.asarray(np.clip(times, left + reach, right - reach))


def checked_breakpoints(given: Any, phase: str, start: Any, end: Any) -> tuple[float, ...]:
    """The stated breakpoints of a phase in order.

    Raises
    ------
    StatementError
        When one is no number or lies outside, or a time of the phase is free.
    """
    try:
        times = tuple(given)
    except TypeError:
        times = (given,)
    if not times:
        return ()

    if not (is_real(start) and is_real(end)):
        raise StatementError(
            f"the breakpoints of phase '{phase}' need fixed times, but it has a free one; split "
            "the phase there, and link the parts by joined(first, second)"
        )
    for time in times:
        if not (is_real(time) and math.isfinite(time) and start <= time <= end):
            raise StatementError(
                f"the breakpoint {time!r} of phase '{phase}' is no time between its start {start} "
                f"and its end {end} s; give numbers of seconds inside, such as breakpoints=[2.0]"
            )
    return tuple(sorted({float(time) for time in times}))
