"""What expressions divide by.

Where a divisor vanishes a quotient may step, as ``x / fabs(x)`` and ``atan(y / x)`` do.  It may be
smooth there as well, as ``sin(x) / x`` is: only its values on both sides tell.
"""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from ocp.numerics.expression_graph import ExpressionGraph, Instruction, graph_of

# a tangent is a quotient whose divisor is the cosine
_DIVIDING = {ca.OP_DIV, ca.OP_INV, ca.OP_POW, ca.OP_CONSTPOW, ca.OP_TAN}


def divisors(expressions: Sequence[ca.SX], symbols: Sequence[ca.SX]) -> tuple[ca.SX, ...]:
    """What scalar expressions divide by, each once, without numbers.

    Parameters
    ----------
    symbols : sequence of SX
        All symbols that the expressions depend on.
    """
    # many expressions divide by nothing, which is seen without building their graphs
    function = ca.Function("expressions", list(symbols), [ca.vertcat(*expressions)])
    codes = {function.instruction_id(k) for k in range(function.n_instructions())}
    if codes.isdisjoint(_DIVIDING):
        return ()

    graph = graph_of(expressions, symbols)
    found: dict[tuple[int, str], None] = {}
    for instruction in graph.instructions:
        place = _divisor(instruction, graph)
        if place is not None and graph.instructions[place].operation != "number":
            found[place, instruction.operation] = None
    values = ExpressionGraph(graph.instructions, tuple(place for place, _ in found)).rebuilt(
        symbols
    )
    every = (
        ca.cos(value) if name == "tan" else value
        for value, (_, name) in zip(values, found, strict=True)
    )
    once = {value.element_hash(): value for value in every}
    return tuple(once.values())


def _divisor(instruction: Instruction, graph: ExpressionGraph) -> int | None:
    """The place of what an operation divides by; None if it divides by nothing."""
    match instruction.operation:
        case "div":
            return instruction.operands[1]
        case "inv" | "tan":
            return instruction.operands[0]
        case "pow" | "constpow":
            base, exponent = instruction.operands
            power = graph.instructions[exponent]
            return base if power.operation == "number" and power.number < 0 else None
    return None
