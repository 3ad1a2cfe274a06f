"""Kinks of an expression that are only added to it, each with the sign by which it costs."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence

from ocp.numerics.expression_graph import ExpressionGraph
from ocp.problem.phase import Phase
from ocp.problem.symbols import Symbol
from ocp.reformulate.time_factors import sign_of_factor

# Characters of an expression that is a name as well; a longer one is named by its symbols
LONGEST_NAME = 60

# Operations that the larger or the lesser of some numbers is made of
_LARGER, _LESSER, _MODULUS, _NEGATIVE = "fmax", "fmin", "fabs", "neg"


def unlike(name: str, others: Sequence[str]) -> str:
    """The name, with a number where there is one like it already."""
    numbered, count = name, 1
    while numbered in others:
        count += 1
        numbered = f"{name} ({count})"
    return numbered


def sides_of(graph: ExpressionGraph, place: int, sign: int) -> Iterator[tuple[int, int]]:
    """Places and signs of the expressions of which one, times a sign, is the largest."""
    name, operands = graph.instructions[place].operation, graph.instructions[place].operands
    if name == (_LARGER if sign > 0 else _LESSER):
        for operand in operands:
            yield from sides_of(graph, operand, sign)
    elif name == _NEGATIVE:
        yield from sides_of(graph, operands[0], -sign)
    elif name == _MODULUS and sign > 0:
        yield from ((operands[0], 1), (operands[0], -1))
    else:
        yield place, sign


def costly(
    graph: ExpressionGraph,
    symbols: Sequence[Symbol],
    phase: Phase | None,
    of_whole: int,
    vectors: Collection[int] = (),
) -> Iterator[tuple[int, int]]:
    """Places of larger or lesser ones that are only added, with the sign by which they cost.

    Sizes of vectors, whose places are given, are among them.
    """
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
        if sign and is_choice and len(list(sides_of(graph, place, sign))) > 1:
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
    """The sign of a factor, see `sign_of_factor`."""
    bare = [symbol.symbol for symbol in symbols]
    (factor,) = ExpressionGraph(graph.instructions, (place,)).rebuilt(bare)
    return sign_of_factor(factor, phase)
