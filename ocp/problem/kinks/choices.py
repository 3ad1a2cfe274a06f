"""Choices between two values that meet where they change over: the larger or the lesser of them.

``if_else(P > 0, P, 0)`` is ``fmax(P, 0)``. In this form a kink that only costs becomes a control
(see `ocp.problem.kinks.raised`).

A choice by ``g > 0`` between a and b is ``fmax(a, b)`` where ``a - b = m g`` with a positive number
m, and ``fmin(a, b)`` with a negative one. The number may come with a signal that is never negative.
That is tested at random points. Of smooth expressions it then holds everywhere.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ocp.numerics.expression_graph import ExpressionGraph, graph_of

# Points at which values are held against each other, how many of them have to tell, and to how
# many digits
_POINTS, _TELLING, _ALIKE = 24, 6, 1e-9

_COMPARISONS = {"lt", "le"}
_STEPPING = {"sign", "eq", "ne", "floor", "ceil", "fmod", "remainder", "copysign", "call"}
_NOT_SMOOTH = _COMPARISONS | _STEPPING | {"fabs", "fmin", "fmax", "if_else_zero"}


@dataclass(frozen=True)
class _Term:
    """What is added where one expression is less than another, and nothing elsewhere.

    Attributes
    ----------
    less, more : int
        Places of what is compared.
    value : int
        Place of what is added.
    """

    less: int
    more: int
    value: int


def with_larger_ones(
    expression: ca.SX, symbols: Sequence[ca.SX], never_negative: Iterable[int] = ()
) -> ca.SX:
    """A scalar expression in which such choices are the larger or the lesser of two values.

    Parameters
    ----------
    symbols : sequence of SX
        All that it depends on.
    never_negative : iterable of int
        Which of them are never negative.
    """
    graph = graph_of([expression], symbols)
    if all(instruction.operation not in _COMPARISONS for instruction in graph.instructions):
        return expression
    factors = [ca.SX(1), *(symbols[i] for i in never_negative)]
    written = dict[int, ca.SX]()
    for place in range(len(graph.instructions)):
        choice = _choice(graph, place)
        larger = _larger(graph, symbols, factors, *choice) if choice else None
        if larger is not None:
            written[place] = larger
    instead = {place: (lambda _, value=value: value) for place, value in written.items()}
    return graph.rebuilt(symbols, instead)[0]


def _choice(graph: ExpressionGraph, place: int) -> tuple[_Term, int | None] | None:
    """A term, and the place of what is added where that is not; None if it is no choice.

    The second one is None where nothing is added instead.
    """
    instruction = graph.instructions[place]
    if instruction.operation != "add":
        term = _term(graph, place)
        return None if term is None else (term, None)
    one, other = (_term(graph, operand) for operand in instruction.operands)
    if one is None or other is None or (one.less, one.more) != (other.more, other.less):
        return None
    return one, other.value


def _term(graph: ExpressionGraph, place: int) -> _Term | None:
    """A value times a comparison, if an instruction is that."""
    instruction = graph.instructions[place]
    match instruction.operation:
        case "if_else_zero":
            pairs = [instruction.operands]
        case "mul":
            pairs = [instruction.operands, instruction.operands[::-1]]
        case _:
            return None
    for condition, value in pairs:
        compared, swapped = graph.instructions[condition], False
        while compared.operation == "not":
            compared, swapped = graph.instructions[compared.operands[0]], not swapped
        if compared.operation in _COMPARISONS:
            less, more = compared.operands[:: -1 if swapped else 1]
            return _Term(less, more, value)
    return None


def _larger(
    graph: ExpressionGraph,
    symbols: Sequence[ca.SX],
    factors: Sequence[ca.SX],
    term: _Term,
    other: int | None,
) -> ca.SX | None:
    """The larger or the lesser of both values of a choice, if it is one of these.

    Parameters
    ----------
    factors : sequence of SX
        What the numbers may come with.
    """
    places = (term.value, term.less, term.more, *([] if other is None else [other]))
    first, less, more, *rest = ExpressionGraph(graph.instructions, places).rebuilt(symbols)
    second = rest[0] if rest else ca.SX(0)
    numbers = (_constant_factor(first - second, factor * (more - less)) for factor in factors)
    number = next(filter(None, numbers), None)
    if number is None:
        return None
    return ca.fmax(first, second) if number > 0 else ca.fmin(first, second)


def _constant_factor(expression: ca.SX, of: ca.SX) -> float | None:
    """The number that an expression is a multiple of another one by; None if it is no multiple."""
    symbols = ca.symvar(ca.vertcat(expression, of))
    graph = graph_of([expression, of], symbols)
    if any(instruction.operation in _NOT_SMOOTH for instruction in graph.instructions):
        return None

    # of both signs and several sizes, as roots and logarithms are real for some of them only
    random = np.random.default_rng(0)
    points = random.normal(size=(len(symbols), _POINTS)) * np.exp(random.normal(size=_POINTS))
    points[:, ::2] = np.abs(points[:, ::2])
    function = ca.Function("both", symbols, [expression, of])
    values, sizes = np.array(function.call([ca.DM(row).T for row in points]))[:, 0]
    telling = np.isfinite(values) & np.isfinite(sizes) & (sizes != 0.0)
    factors = values[telling] / sizes[telling]
    if factors.size < _TELLING or np.ptp(factors) > _ALIKE * np.abs(factors).max():
        return None
    return float(np.median(factors))
