"""Kinks of an expression that are only added to it, each with the sign by which it costs.

The sign is that of what a kinked term is multiplied by: numbers, constants, or a function of time
alone. A tariff, or a weight that grows with time, costs in the same sense all along a phase. Where
it is zero for a while a control above the kink would cost nothing and have no value, so only single
instants may be zero.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ocp.numerics.columnwise import columnwise
from ocp.numerics.expression_graph import ExpressionGraph
from ocp.problem.instants import stepping_times
from ocp.problem.phase import Phase, time_range
from ocp.problem.symbols import TIME, Symbol, declared_value, resolve

# Characters of an expression that is a name as well; a longer one is named by its symbols
LONGEST_NAME = 60

# Of a function of time over a phase; those between two steps come on top
_SAMPLES = 1001

# Operations that the larger or the lesser of some numbers is made of
_LARGER, _LESSER, _MODULUS, _NEGATIVE = "fmax", "fmin", "fabs", "neg"


def unlike(name: str, others: Sequence[str]) -> str:
    """The name, with a number where there is one like it already."""
    numbered, count = name, 1
    while numbered in others:
        count += 1
        numbered = f"{name} ({count})"
    return numbered


def _sides_of(graph: ExpressionGraph, place: int, sign: int) -> Iterator[tuple[int, int]]:
    """Places and signs of the expressions of which one, times a sign, is the largest."""
    name, operands = graph.instructions[place].operation, graph.instructions[place].operands
    if name == (_LARGER if sign > 0 else _LESSER):
        for operand in operands:
            yield from _sides_of(graph, operand, sign)
    elif name == _NEGATIVE:
        yield from _sides_of(graph, operands[0], -sign)
    elif name == _MODULUS and sign > 0:
        yield from ((operands[0], 1), (operands[0], -1))
    else:
        yield place, sign


@dataclass(frozen=True, eq=False, repr=False)
class Kink:
    """The larger of some sides, the negative of the lesser, or the size of a vector.

    Attributes
    ----------
    place, sign : int
        In the graph of the expression, and 1 or -1.
    largest : SX
        What is the largest of the sides.
    sides : sequence of SX
        None of a size.
    symbols : tuple of Symbol
        What it depends on.
    """

    place: int
    sign: int
    largest: ca.SX
    sides: Sequence[ca.SX]
    symbols: tuple[Symbol, ...]


def kinks_that_cost(
    graph: ExpressionGraph,
    symbols: Sequence[Symbol],
    phase: Phase | None,
    sign: int,
    vectors: Collection[int] = (),
) -> Iterator[Kink]:
    """Kinks of an expression that are only added to it, with the sign by which they cost.

    Parameters
    ----------
    phase : Phase or None
        Along which the expression is taken.
    sign : int
        By which the whole expression costs.
    vectors : collection of int
        Places of sizes of vectors, which are among the kinks.
    """
    for place, own in _costly(graph, symbols, phase, sign, vectors):
        found = [] if place in vectors else list(_sides_of(graph, place, own))
        places = (place, *(side for side, _ in found))
        whole, *parts = ExpressionGraph(graph.instructions, places).rebuilt(
            [symbol.symbol for symbol in symbols]
        )
        sides = [above * part for part, (_, above) in zip(parts, found, strict=True)]
        yield Kink(place, own, own * whole, sides, tuple(resolve(whole, "a kink")))


def _costly(
    graph: ExpressionGraph,
    symbols: Sequence[Symbol],
    phase: Phase | None,
    of_whole: int,
    vectors: Collection[int],
) -> Iterator[tuple[int, int]]:
    """Places of kinks that are only added, with the sign by which they cost."""
    signs = dict[int, set[int]]({graph.results[0]: {of_whole}})
    for place in reversed(range(len(graph.instructions))):
        found = signs.get(place, set())
        if not found:
            continue
        sign = next(iter(found)) if len(found) == 1 else 0
        if sign > 0 and place in vectors:
            yield place, sign
            continue
        is_choice = graph.instructions[place].operation in (_LARGER, _LESSER, _MODULUS)
        if sign and is_choice and len(list(_sides_of(graph, place, sign))) > 1:
            yield place, sign
            continue
        for operand, own in _passed_on(graph, symbols, phase, place, sign):
            signs.setdefault(operand, set()).add(own)


def _passed_on(
    graph: ExpressionGraph, symbols: Sequence[Symbol], phase: Phase | None, place: int, sign: int
) -> Iterable[tuple[int, int]]:
    """The operands of an instruction, each with the sign by which it costs; 0 for neither."""
    instruction = graph.instructions[place]
    if instruction.operation in ("symbol", "number"):
        return ()
    operands = instruction.operands
    match instruction.operation:
        case "add" | "twice":
            return [(operand, sign) for operand in operands]
        case "sub":
            return [(operands[0], sign), (operands[1], -sign)]
        case "neg":
            return [(operands[0], -sign)]
        case "mul" | "div":
            first, second = operands
            factor = _sign_of(graph, symbols, phase, second)
            if factor is not None:
                return [(first, sign * factor)]
            if instruction.operation == "mul":
                factor = _sign_of(graph, symbols, phase, first)
            if factor is not None:
                return [(second, sign * factor)]
    return [(operand, 0) for operand in operands]


def _sign_of(
    graph: ExpressionGraph, symbols: Sequence[Symbol], phase: Phase | None, place: int
) -> int | None:
    """1 or -1 if a factor has this sign, 0 if it has none, None if signals or unknowns are in it.

    Constants have the values that they are declared with. Of functions of time that hold constants,
    too, no sign is told: the times at which they change are not known. Factors of numbers of the
    whole motion are in no phase.
    """
    bare = [symbol.symbol for symbol in symbols]
    (factor,) = ExpressionGraph(graph.instructions, (place,)).rebuilt(bare)
    value = declared_value(factor)
    if value is not None:
        return int(np.sign(value))
    if phase is None or any(symbol is not TIME for symbol in resolve(factor, "a factor")):
        return None
    start, end = time_range(phase)
    if not (math.isfinite(start) and math.isfinite(end)):
        return None

    # at least one time between any two at which the factor steps or bends
    known = np.array([start, *stepping_times([factor], start, end), end])
    inner = np.linspace(start, end, _SAMPLES)[1:-1]
    times = np.union1d(inner, 0.5 * (known[:-1] + known[1:]))
    function = ca.Function("factor", [TIME.symbol], [ca.densify(factor)])
    values = columnwise(function, times[:, None])[0].ravel()
    vanishing = values == 0.0
    if not np.isfinite(values).all() or (vanishing[1:] & vanishing[:-1]).any():
        return 0
    signs = np.unique(np.sign(values[~vanishing]))
    return int(signs[0]) if signs.size == 1 else 0
