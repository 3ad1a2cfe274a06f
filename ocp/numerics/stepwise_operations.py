"""Operations of expressions whose results are constant piece by piece: comparisons, signs, floors.

Where such a result changes, the expressions may step.  The derivative of the result is zero on both
sides, so nothing that is built on derivatives sees the step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca

from ocp.numerics.expression_graph import ExpressionGraph, Instruction, graph_of

_STEPWISE = {"lt", "le", "eq", "ne", "sign", "floor", "ceil"}


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
    codes = {getattr(ca, f"OP_{name.upper()}") for name in _STEPWISE}
    if codes.isdisjoint(function.instruction_id(k) for k in range(function.n_instructions())):
        return None

    graph = graph_of(expressions, symbols)
    places = [i for i, one in enumerate(graph.instructions) if one.operation in _STEPWISE]
    results = ExpressionGraph(graph.instructions, tuple(places)).rebuilt(symbols)
    held = [ca.SX.sym(f"result_{i}") for i in range(len(places))]
    instructions = list(graph.instructions)
    for number, place in enumerate(places):
        instructions[place] = Instruction("symbol", (len(symbols) + number,))
    values = ExpressionGraph(tuple(instructions), graph.results).rebuilt([*symbols, *held])
    inputs = [ca.vertcat(*symbols, ca.SX(0, 1)), ca.vertcat(*held)]
    return StepwiseOperations(
        tuple(results), ca.Function("held", inputs, [ca.densify(ca.vertcat(*values))])
    )
