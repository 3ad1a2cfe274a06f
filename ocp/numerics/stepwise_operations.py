"""Operations of expressions whose results are constant piece by piece: comparisons, signs, floors.

Where such a result changes, the expressions may jump.  The derivative of the result is zero on both
sides, so nothing that is built on derivatives sees the jump.  A remainder has a quotient of the
kind: ``fmod(a, b) = a - n b`` with a whole number n.  ``copysign`` has the sign of its second
argument.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca

from ocp.numerics.expression_graph import ExpressionGraph, Replacement, graph_of

_STEPWISE = {"lt", "le", "eq", "ne", "sign", "floor", "ceil"}
_REMAINDERS = {"fmod", "remainder"}
_ALL = _STEPWISE | _REMAINDERS | {"copysign"}


@dataclass(frozen=True, eq=False, repr=False)
class StepwiseOperations:
    """Expressions with the results of their stepwise operations as inputs of their own.

    Attributes
    ----------
    results : tuple of SX
        The results as expressions of the symbols, in an order in which they can be evaluated.
    function : casadi.Function
        ``(symbols (n,), results (r,)) -> expressions``.
    """

    results: tuple[ca.SX, ...]
    function: ca.Function


def stepwise_operations(
    expressions: Sequence[ca.SX], symbols: Sequence[ca.SX]
) -> StepwiseOperations | None:
    """The stepwise operations of scalar expressions, or None where there are none."""
    # most expressions have none, which is seen without building their graphs
    function = ca.Function("expressions", list(symbols), [ca.vertcat(*expressions)])
    codes = {getattr(ca, f"OP_{name.upper()}") for name in _ALL}
    if codes.isdisjoint(function.instruction_id(k) for k in range(function.n_instructions())):
        return None

    graph = graph_of(expressions, symbols)
    named = {i: one.operation for i, one in enumerate(graph.instructions)}
    places = [i for i, name in named.items() if name in _ALL]
    results = _results(graph, places, symbols)

    held = [ca.SX.sym(f"result_{i}") for i in range(len(places))]
    values = graph.rebuilt(
        symbols, {i: _with_held(named[i], own) for i, own in zip(places, held, strict=True)}
    )
    inputs = [ca.vertcat(*symbols, ca.SX(0, 1)), ca.vertcat(*held)]
    return StepwiseOperations(
        results, ca.Function("held", inputs, [ca.densify(ca.vertcat(*values))])
    )


def _results(
    graph: ExpressionGraph, places: Sequence[int], symbols: Sequence[ca.SX]
) -> tuple[ca.SX, ...]:
    """What changes of the stepwise operations at some places of a graph.

    The graph is rebuilt once for all of them. A rebuild for each takes far longer than the graph
    itself where there are many, and they would share none of their parts.
    """
    of = [(place, *graph.instructions[place].operands) for place in places]
    flat = tuple(number for each in of for number in each)
    values = iter(ExpressionGraph(graph.instructions, flat).rebuilt(symbols))
    return tuple(
        _result(graph.instructions[place].operation, [next(values) for _ in each])
        for place, each in zip(places, of, strict=True)
    )


def _result(operation: str, values: Sequence[ca.SX]) -> ca.SX:
    """The result of a stepwise operation, the whole number of a remainder, or a sign.

    Parameters
    ----------
    values : sequence of SX
        What the operation gives, and then its operands.
    """
    found, *operands = values
    if operation in _REMAINDERS:
        return ca.floor((operands[0] - found) / operands[1] + 0.5)
    if operation == "copysign":
        return ca.sign(operands[1])
    return found


def _with_held(name: str, held: ca.SX) -> Replacement:
    """An operation with its stepwise result, its quotient or its sign given."""
    if name in _REMAINDERS:
        return lambda operands: operands[0] - held * operands[1]
    if name == "copysign":
        return lambda operands: held * ca.fabs(operands[0])
    return lambda _: held
