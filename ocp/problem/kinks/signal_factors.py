"""Kinks times what is never negative, with that factor inside.

``fmax(0, F)*v`` is ``fmax(0, F*v)`` where a limit keeps v from being negative. In the second form a
kink that only costs becomes a control (see `ocp.problem.kinks.raised`). In the first one it would
have no value where v is zero.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import casadi as ca

from ocp.numerics.expression_graph import ExpressionGraph, Instruction, graph_of

_CHOICES = {"fmax", "fmin", "fabs"}

# Operations whose result is never negative: for all operands, and for such operands
_NEVER_NEGATIVE = {"sq", "exp", "sqrt", "fabs"}
_PASSES_ON = {"add", "mul", "div", "twice", "inv"}


@dataclass(frozen=True, eq=False)
class _Choice:
    """The larger or the lesser of two values."""

    first: ca.SX
    second: ca.SX
    is_larger: bool

    def times(self, factor: ca.SX) -> _Choice:
        """Times what is never negative."""
        return _Choice(self.first * factor, self.second * factor, self.is_larger)

    def scaled(self, number: float) -> _Choice:
        """Times a number, a negative one of which swaps the larger and the lesser."""
        return _Choice(number * self.first, number * self.second, self.is_larger == (number >= 0.0))

    def is_of(self, signals: ca.SX) -> bool:
        """Whether it depends on signals. Kinks of time alone are at known instants."""
        return bool(ca.depends_on(ca.vertcat(self.first, self.second), signals))

    @property
    def expression(self) -> ca.SX:
        """As CasADi has it."""
        return (ca.fmax if self.is_larger else ca.fmin)(self.first, self.second)


def with_signals_inside(
    expression: ca.SX,
    symbols: Sequence[ca.SX],
    signals: Collection[int],
    never_negative: Collection[int],
) -> ca.SX:
    """A scalar expression in which such factors stand inside the larger or the lesser of two.

    Factors of numbers and of time stay outside: they need no control of their own.

    Parameters
    ----------
    symbols : sequence of SX
        All that it depends on.
    signals, never_negative : collection of int
        Which of them are signals, and which are never negative.
    """
    graph = graph_of([expression], symbols)
    if all(instruction.operation not in _CHOICES for instruction in graph.instructions):
        return expression
    values = ExpressionGraph(graph.instructions, tuple(range(len(graph.instructions)))).rebuilt(
        symbols
    )
    positive = _never_negative(graph, never_negative)
    moving = ca.vertcat(*[symbols[i] for i in signals], ca.SX(0, 1))
    choices, written = dict[int, _Choice](), dict[int, ca.SX]()
    for place, instruction in enumerate(graph.instructions):
        made = _made(instruction, values, choices)
        for choice, factor in _factors(instruction, choices):
            value = 1 / values[factor] if instruction.operation == "div" else values[factor]
            if value.is_constant():
                made = choice.scaled(float(value))
            elif factor in positive and choice.is_of(moving) and ca.depends_on(value, moving):
                made = choice.times(value)
                written[place] = made.expression
        if made is not None:
            choices[place] = made
    instead = {place: (lambda _, value=value: value) for place, value in written.items()}
    return graph.rebuilt(symbols, instead)[0] if instead else expression


def _never_negative(graph: ExpressionGraph, symbols: Collection[int]) -> set[int]:
    """Places of results that are never negative."""
    places = set[int]()
    for place, instruction in enumerate(graph.instructions):
        match instruction.operation:
            case "symbol":
                known = instruction.operands[0] in symbols
            case "number":
                known = instruction.number >= 0.0
            case name if name in _NEVER_NEGATIVE:
                known = True
            case name:
                known = name in _PASSES_ON and places.issuperset(instruction.operands)
        if known:
            places.add(place)
    return places


def _made(
    instruction: Instruction, values: Sequence[ca.SX], choices: Mapping[int, _Choice]
) -> _Choice | None:
    """The choice that an instruction of one or two values is, products left out."""
    operands = instruction.operands
    match instruction.operation:
        case "fmax" | "fmin":
            first, second = (values[i] for i in operands)
            return _Choice(first, second, instruction.operation == "fmax")
        case "fabs":
            return _Choice(values[operands[0]], -values[operands[0]], True)
        case "neg" | "twice" if operands[0] in choices:
            return choices[operands[0]].scaled(-1.0 if instruction.operation == "neg" else 2.0)
    return None


def _factors(instruction: Instruction, choices: Mapping[int, _Choice]) -> list[tuple[_Choice, int]]:
    """A choice and the place of its factor, or divisor, where an instruction is their product."""
    match instruction.operation:
        case "mul":
            pairs = [instruction.operands, instruction.operands[::-1]]
        case "div":
            pairs = [instruction.operands]
        case _:
            return []
    return [(choices[choice], factor) for choice, factor in pairs if choice in choices]
