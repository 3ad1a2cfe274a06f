"""Sizes of vectors of controls in an expression, such as of the thrust of a gimballed engine.

Where all components are zero, a size has no derivative. Motions rest there: a thruster coasts. The
size of a vector that depends on states as well is none of these: it need not vanish with the
controls, and where it does not, it is smooth.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ocp.numerics.expression_graph import ExpressionGraph, Instruction
from ocp.numerics.polynomial_expressions import is_linear
from ocp.problem.bounds import Bound
from ocp.problem.symbols import Constant, Control, Symbol, column_of, declared_value, resolve
from ocp.problem.texts import unit_of

# Of its typical value: what keeps the limit of a size smooth at zero. A size is too small by half
# of it at most. Where a motion is at its typical size for a two-thousandth of the time, and at rest
# for all else, the objective is off by what a certificate allows.
_ROUNDED = 1e-8

# Of expressions that are held against each other: a sum of a few squares
_DEPTH = 8


@dataclass(frozen=True, eq=False, repr=False)
class SizeOfVector:
    """The size of a vector of controls.

    Attributes
    ----------
    square : SX
        Of the size [unit^2].
    typical : float
        What the size may reach [unit].
    unit : str
    """

    square: ca.SX
    typical: float
    unit: str

    def room_above(self, control: ca.SX) -> ca.SX:
        """What is not negative if a control s, which is not negative, is no less than the size.

        It is ``s - |a|^2 / (s + e)``. Of the ways to state this cone it is the one that is convex
        and has bounded slopes (Benson and Vanderbei, "Solving problems with semidefinite and
        related constraints using interior-point methods for nonlinear programming", Mathematical
        Programming 95, 2003). The least such s is ``sqrt(|a|^2 + (e/2)^2) - e/2``. It is zero where
        a is, and elsewhere below the size by less than ``e/2``.
        """
        return control - self.square / (control + _ROUNDED * self.typical)


def sizes_of_vectors(
    graph: ExpressionGraph, symbols: Sequence[Symbol], bounds: Sequence[Bound]
) -> Mapping[int, SizeOfVector]:
    """Those in a graph of an expression whose typical value its statement tells, by their places.

    Parameters
    ----------
    symbols : sequence of Symbol
        Of the graph.
    bounds : sequence of Bound
        Of the phase.
    """
    found = {}
    bare = [symbol.symbol for symbol in symbols]
    for place, instruction in enumerate(graph.instructions):
        parts = list(_components(graph, instruction))
        places = [part for part in parts if part is not None]
        if not parts or len(places) < len(parts):
            continue

        components = ExpressionGraph(graph.instructions, tuple(places)).rebuilt(bare)
        square = of_components = ca.sumsqr(ca.vertcat(*components))
        if instruction.operation == "sqrt":
            (square,) = ExpressionGraph(graph.instructions, instruction.operands).rebuilt(bare)
        typical = _typical(square, bounds)
        if typical is not None:
            # a factor beside the squares may convert the unit
            units = {unit_of(component) or "1" for component in components}
            plain = len(units) == 1 and ca.is_equal(square, of_components, _DEPTH)
            found[place] = SizeOfVector(square, typical, units.pop() if plain else "1")
    return found


def _components(graph: ExpressionGraph, instruction: Instruction) -> Iterator[int | None]:
    """Places of the components of a vector by its size; a None where it is no size of any."""
    if instruction.operation == "hypot":
        yield from instruction.operands
    elif instruction.operation == "sqrt":
        yield from _squared(graph, instruction.operands[0])


def _squared(graph: ExpressionGraph, place: int) -> Iterator[int | None]:
    """Places of what an expression is the sum of squares of; a None where it is no such sum."""
    instruction = graph.instructions[place]
    operands = instruction.operands
    match instruction.operation:
        case "sq":
            yield operands[0]
        case "mul" if operands[0] == operands[1]:
            yield operands[0]
        case "add":
            for operand in operands:
                yield from _squared(graph, operand)
        case "twice":
            yield from _squared(graph, operands[0])
        case "mul" if _is_positive(graph, operands[0]):
            yield from _squared(graph, operands[1])
        case "mul" | "div" if _is_positive(graph, operands[1]):
            yield from _squared(graph, operands[0])
        case _:
            yield None


def _is_positive(graph: ExpressionGraph, place: int) -> bool:
    instruction = graph.instructions[place]
    return instruction.operation == "number" and instruction.number > 0.0


def _typical(square: ca.SX, bounds: Iterable[Bound]) -> float | None:
    """What a size may reach by its square; None where it is none of controls, or nothing tells."""
    symbols = resolve(square, "a square")
    controls = [symbol for symbol in symbols if isinstance(symbol, Control)]
    if not controls or not all(isinstance(symbol, (Control, Constant)) for symbol in symbols):
        return None
    bare = column_of(controls)
    slopes = ca.gradient(square, bare)
    at_rest = ca.substitute(ca.vertcat(square, slopes), bare, ca.DM.zeros(bare.shape))
    if not is_linear(slopes, bare) or not ca.simplify(at_rest).is_zero():
        return None

    found = [_by_limits_of(controls, square), *(_by_bound(b, square) for b in bounds)]
    known = [size for size in found if size is not None and 0.0 < size < math.inf]
    return min(known, default=None)


def _by_limits_of(controls: Sequence[Control], square: ca.SX) -> float | None:
    """What a size is where one control after the other is as large as it may be."""
    sizes = np.array([_largest(control) for control in controls])
    if not np.all(np.isfinite(sizes)):
        return None
    bare = column_of(controls)
    alone = [declared_value(ca.substitute(square, bare, ca.DM(row))) for row in np.diag(sizes)]
    return math.sqrt(sum(value for value in alone if value is not None))


def _largest(control: Control) -> float:
    """The stated size of a control, else of its limits, else infinity."""
    if control.scale is not None:
        return control.scale
    limits = [declared_value(limit) for limit in (control.lower, control.upper)]
    return max(math.inf if limit is None else abs(limit) for limit in limits)


def _by_bound(bound: Bound, square: ca.SX) -> float | None:
    """The largest size by a bound of its own, or of its square; None if the bound is another."""
    limit = declared_value(bound.upper)
    if limit is None or not 0.0 < limit < math.inf:
        return None
    if ca.is_equal(bound.expression, square, _DEPTH):
        return math.sqrt(limit)
    return limit if ca.is_equal(bound.expression, ca.sqrt(square), _DEPTH) else None
