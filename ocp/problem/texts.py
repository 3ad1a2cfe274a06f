"""Expressions as one writes them, and their units."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca

from ocp.numerics.expression_graph import LONGEST, ExpressionGraph, expression_text, graph_of
from ocp.problem.symbols import Symbol, resolve, scalar

# Characters of an expression within a sentence
SHORT = 60


def text_of(expression: Any, longest: int = LONGEST) -> str:
    """An expression as one writes it, values of the motion with what they are values of.

    Parameters
    ----------
    longest : int
        An expression of more characters is named by the symbols it depends on.
    """
    symbols = {s.symbol.element_hash(): s for s in resolve(expression, "an expression")}
    sx = scalar(expression, "an expression")

    def name_of(bare: ca.SX) -> str:
        symbol = symbols[bare.element_hash()]
        return symbol.text if sx.is_symbolic() or symbol.text == symbol.name else f"({symbol.text})"

    return expression_text(sx, name_of, longest)


def unit_of(expression: Any) -> str | None:
    """The unit of an expression; None if it is a number, "1" where its symbols do not tell.

    A product with a number does not tell: the number may convert the unit.
    """
    symbols = resolve(expression, "an expression")
    sx = scalar(expression, "an expression")
    graph = graph_of([sx], [symbol.symbol for symbol in symbols])
    return _unit_of(graph, [_symbol_unit(symbol) for symbol in symbols], graph.results[0])


def _symbol_unit(symbol: Symbol) -> str | None:
    return symbol.unit if symbol.value_of is None else unit_of(symbol.value_of)


def _unit_of(graph: ExpressionGraph, units: Sequence[str | None], position: int) -> str | None:
    """The unit of one instruction's result."""
    instruction = graph.instructions[position]
    operands = instruction.operands
    if instruction.operation == "number":
        return None
    if instruction.operation == "symbol":
        return units[operands[0]]
    if instruction.operation in ("neg", "fabs"):
        return _unit_of(graph, units, operands[0])
    if len(operands) == 1 or instruction.operation == "call":
        return "1"

    first, second = (_unit_of(graph, units, i) for i in operands)
    if instruction.operation in ("add", "sub", "fmin", "fmax", "hypot"):
        return first if second in (None, first) else second if first is None else "1"
    if instruction.operation in ("mul", "div") and second == "1" and first is not None:
        return first
    if instruction.operation == "mul" and first == "1" and second is not None:
        return second
    return "1"
