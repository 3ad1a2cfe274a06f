"""Operations of expressions that bend or step: moduli, the larger of two, comparisons, floors.

A comparison may choose between two values that meet where it changes, as `if_else` does. That is a
kink, too, unless the expression steps there.

On each side of a kink an expression is smooth, and goes on smoothly beyond the kink. So a side can
be given instead of found: ``fabs(x)`` is then x or -x, whatever the sign of x.

The results of comparisons, signs and floors are constant piece by piece. Where such a result
changes, the expressions may jump. The derivative of the result is zero on both sides, so nothing
that is built on derivatives sees the jump. Remainders and ``copysign`` are written by these.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import casadi as ca

from ocp.numerics.expression_graph import (
    ExpressionGraph,
    Instruction,
    Replacement,
    graph_of,
    operations_of,
)

_STEPWISE = {"lt", "le", "eq", "ne", "sign", "floor", "ceil"}

# operations of two operands that step, by those above
_BY_STEPS: dict[str, Callable[[ca.SX, ca.SX], ca.SX]] = {
    "fmod": lambda a, b: a - b * ca.sign(a / b) * ca.floor(ca.fabs(a / b)),
    "remainder": lambda a, b: a - b * ca.floor(a / b + 0.5),
    "copysign": lambda a, b: ca.fabs(a) * ca.sign(b),
}


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
    if operations_of(*expressions).isdisjoint(_STEPWISE | _BY_STEPS.keys()):
        return None

    graph = graph_of(expressions, symbols)
    by_steps: dict[int, Replacement] = {
        place: partial(_by_steps, one.operation)
        for place, one in enumerate(graph.instructions)
        if one.operation in _BY_STEPS
    }
    if by_steps:
        graph = graph_of(graph.rebuilt(symbols, by_steps), symbols)

    instructions = graph.instructions
    places = [i for i, one in enumerate(instructions) if one.operation in _STEPWISE]
    results = ExpressionGraph(instructions, tuple(places)).rebuilt(symbols)
    held = [ca.SX.sym(f"result_{i}") for i in range(len(places))]
    values = graph.rebuilt(symbols, dict(zip(places, held, strict=True)))
    inputs = [ca.vertcat(*symbols, ca.SX(0, 1)), ca.vertcat(*held, ca.SX(0, 1))]
    function = ca.Function("held", inputs, [ca.densify(ca.vertcat(*values))])
    return StepwiseOperations(tuple(results), function)


def _by_steps(operation: str, operands: Sequence[ca.SX]) -> ca.SX:
    return _BY_STEPS[operation](*operands)


_KINKED = ("fabs", "fmin", "fmax")

# operations that change where their operand is zero, and where their two operands are equal
_ALL = {"fabs", "sign", "fmin", "fmax", "lt", "le"}

_Key = tuple[int, ...]


def may_have_kinks(*expressions: ca.SX) -> bool:
    """Whether scalar expressions have an operation with a kink; a root has one at zero."""
    return not operations_of(*expressions).isdisjoint({*_KINKED, "sqrt", "hypot"})


def kinked_operations(expression: ca.SX) -> list[str]:
    """CasADi's names of the operations of an expression that have a kink, in order."""
    found = operations_of(expression)
    return [name for name in _KINKED if name in found]


@dataclass(frozen=True, eq=False, repr=False)
class KinkSurfaces:
    """Where expressions may have kinks.

    Attributes
    ----------
    values : tuple of SX
        What is zero at a kink, each once: an operand, or the difference of two that are compared.
    keys : tuple of tuple of int
        What tells them apart, whichever expression they are found in.
    """

    values: tuple[ca.SX, ...]
    keys: tuple[_Key, ...]

    @classmethod
    def of(cls, expressions: Sequence[ca.SX]) -> KinkSurfaces:
        """Those of scalar expressions. Where one of these steps instead is for others to say."""
        symbols = ca.symvar(ca.vertcat(*expressions, ca.SX(0, 1)))
        if operations_of(*expressions).isdisjoint(_ALL):
            return cls((), ())

        graph = graph_of(expressions, symbols)
        at = _places_of_kinks(graph, symbols)
        once = {key: graph.instructions[place] for place, key in at.items()}
        places = tuple(operand for instruction in once.values() for operand in instruction.operands)
        operands = iter(ExpressionGraph(graph.instructions, places).rebuilt(symbols))
        values = [
            next(operands) if len(key) == 1 else next(operands) - next(operands) for key in once
        ]
        return cls(tuple(values), tuple(once))

    def only(self, wanted: Sequence[bool]) -> KinkSurfaces:
        """Some of them, one flag each."""
        kept = [i for i, flag in enumerate(wanted) if flag]
        return KinkSurfaces(tuple(self.values[i] for i in kept), tuple(self.keys[i] for i in kept))

    def with_sides(self, expressions: Sequence[ca.SX], sides: ca.SX) -> list[ca.SX]:
        """Scalar expressions with the sides of these surfaces given.

        Parameters
        ----------
        sides : SX (k,)
            One number for each surface: 1 and -1 are its sides, and with 0 its own sign decides.
        """
        symbols = ca.symvar(ca.vertcat(*expressions, ca.SX(0, 1)))
        graph = graph_of(expressions, symbols)
        number = {key: i for i, key in enumerate(self.keys)}
        instead = {
            place: _with_side(graph.instructions[place].operation, sides[number[key]])
            for place, key in _places_of_kinks(graph, symbols).items()
            if key in number
        }
        return graph.rebuilt(symbols, instead)


def _places_of_kinks(graph: ExpressionGraph, symbols: Sequence[ca.SX]) -> dict[int, _Key]:
    """Places of the instructions that may make a kink, and what tells their surfaces apart."""
    keys: list[int] = []
    for instruction in graph.instructions:
        keys.append(_key(instruction, keys, symbols))
    return {
        place: tuple(keys[i] for i in instruction.operands)
        for place, instruction in enumerate(graph.instructions)
        if instruction.operation in _ALL
    }


def _key(instruction: Instruction, keys: Sequence[int], symbols: Sequence[ca.SX]) -> int:
    """A number for an operation on what was numbered before, the same in all graphs."""
    if instruction.operation == "symbol":
        return hash(("symbol", symbols[instruction.operands[0]].element_hash()))
    called = instruction.function.__hash__() if instruction.function is not None else 0
    operands = tuple(keys[i] for i in instruction.operands)
    return hash((instruction.operation, operands, instruction.number, called, instruction.output))


def _with_side(name: str, side: ca.SX) -> Replacement:
    """An operation whose surface has a given side, unless that is zero."""

    def replaced(operands: list[ca.SX]) -> ca.SX:
        first, second = operands[0], operands[-1]
        match name:
            case "fabs":
                found, given = ca.fabs(first), side * first
            case "sign":
                found, given = ca.sign(first), side
            case "fmin":
                found, given = ca.fmin(first, second), ca.if_else(side > 0, second, first)
            case "fmax":
                found, given = ca.fmax(first, second), ca.if_else(side > 0, first, second)
            case "lt":
                found, given = first < second, side < 0
            case _:
                found, given = first <= second, side < 0
        return ca.if_else(side == 0, found, given)

    return replaced
