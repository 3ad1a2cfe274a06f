"""Operations of expressions whose derivative jumps: moduli, and the lesser or larger of two.

A comparison may choose between two values that meet where it changes, as `if_else` does. That is a
kink, too, unless the expression steps there.

On each side of a kink an expression is smooth, and goes on smoothly beyond the kink. So a side can
be given instead of found: ``fabs(x)`` is then x or -x, whatever the sign of x.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca

from ocp.numerics.expression_graph import ExpressionGraph, Instruction, Replacement, graph_of

_KINKED = {ca.OP_FABS: "fabs", ca.OP_FMIN: "fmin", ca.OP_FMAX: "fmax"}

# operations that change where their operand is zero, and where their two operands are equal
_OF_ONE = {"fabs", "sign"}
_OF_TWO = {"fmin", "fmax", "lt", "le"}
_ALL = _OF_ONE | _OF_TWO

_Key = tuple[int, ...]


def kinked_operations(expression: ca.SX) -> list[str]:
    """CasADi's names of the operations of an expression that have a kink, in order."""
    function = ca.Function("expression", ca.symvar(expression), [expression])
    codes = {function.instruction_id(k) for k in range(function.n_instructions())}
    return [name for code, name in _KINKED.items() if code in codes]


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
        # most expressions have none, which is seen without building their graphs
        function = ca.Function("expressions", symbols, [ca.vertcat(*expressions, ca.SX(0, 1))])
        codes = {getattr(ca, f"OP_{name.upper()}") for name in _ALL}
        if codes.isdisjoint(function.instruction_id(k) for k in range(function.n_instructions())):
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
