"""Kinks of numbers of the whole motion that are minimised, as limits of unknowns of their own.

``3 |x_end - 1|``, the price of missing a point, or ``max(x_end, 1 - x_end)``, is often least on the
kink. To minimise ``max(a, b)`` is the same as to minimise an unknown t with ``t >= a`` and ``t >=
b``, which has no kink (the epigraph form: Boyd and Vandenberghe, "Convex Optimization", section
4.1.3). It is the same if nothing is gained by a larger t: if the kinked term is added to what is
minimised, with a factor of numbers and constants that has the sign of a cost. Other kinks stay.

Kinks of integrands become controls, see `ocp.problem.kinks.raised`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import casadi as ca

from ocp.numerics.expression_graph import ExpressionGraph, graph_of
from ocp.problem.bounds import Bound
from ocp.problem.display import text_of, unit_of
from ocp.problem.functionals import Functional
from ocp.problem.kinks.choices import with_larger_ones
from ocp.problem.kinks.costs import LONGEST_NAME, costly, sides_of, unlike
from ocp.problem.symbols import Symbol, Unknown, resolve


@dataclass(frozen=True, eq=False, repr=False)
class RaisedNumber(Unknown):
    """An unknown that is not below its sides.

    Attributes
    ----------
    largest : SX
        The largest of its sides, as it was stated [unit].
    """

    largest: ca.SX = field(default_factory=lambda: ca.SX(-math.inf))


@dataclass(frozen=True, eq=False, repr=False)
class RaisedEnds:
    """What an objective becomes.

    Attributes
    ----------
    objective : SX
        With an unknown in place of each kink that only costs.
    limits : tuple of Bound
        That hold these unknowns above their sides.
    """

    objective: ca.SX
    limits: tuple[Bound, ...]


def with_raised_ends(objective: ca.SX, names: Iterable[str]) -> RaisedEnds | None:
    """An objective without the kinks that only cost; None if it has none.

    Parameters
    ----------
    objective : SX
        What is minimised, of functionals, unknowns and constants.
    names : iterable of str
        Of other things, which no new unknown shall have.
    """
    taken, limits = [*names], list[Bound]()
    raised, made = _raised(objective, 1, taken)
    if not made:
        return None

    # a side may have a kink of its own, which costs if it makes the largest larger
    waiting = [(number, side) for number, sides in made.items() for side in sides]
    while waiting:
        number, side = waiting.pop()
        if side.is_constant():
            continue
        smooth, further = _raised(side, 1, taken)
        waiting += [(n, s) for n, sides in further.items() for s in sides]
        name = unlike(f"{number.name}, lower limit", taken)
        taken.append(name)
        limits.append(Bound(name, number.symbol - smooth, number.unit, lower=0.0))
    return RaisedEnds(raised, tuple(limits))


def without_raised_numbers(expression: ca.SX) -> ca.SX:
    """An expression with the kinks whose place unknowns took."""
    numbers = [s for s in resolve(expression, "an expression") if isinstance(s, RaisedNumber)]
    old = ca.vertcat(*[number.symbol for number in numbers], ca.SX(0, 1))
    new = ca.vertcat(*[number.largest for number in numbers], ca.SX(0, 1))
    return ca.substitute(expression, old, new)


def _raised(
    expression: ca.SX, sign: int, taken: list[str]
) -> tuple[ca.SX, Mapping[RaisedNumber, list[ca.SX]]]:
    """An expression with unknowns in place of kinks, and the sides of each of these.

    The names of the unknowns are added to those that are taken.
    """
    symbols = resolve(expression, "the objective")
    bare = [symbol.symbol for symbol in symbols]
    graph = graph_of([with_larger_ones(expression, bare)], bare)
    instead, made = dict[int, ca.SX](), dict[RaisedNumber, list[ca.SX]]()
    for place, own in costly(graph, symbols, None, sign):
        found = list(sides_of(graph, place, own))
        places = (place, *(side for side, _ in found))
        whole, *parts = ExpressionGraph(graph.instructions, places).rebuilt(bare)
        if not any(_varies(symbol) for symbol in resolve(whole, "the objective")):
            continue
        sides = [above * part for part, (_, above) in zip(parts, found, strict=True)]
        name = unlike(text_of(own * whole, LONGEST_NAME), taken)
        taken.append(name)
        least = max((float(side) for side in sides if side.is_constant()), default=-math.inf)
        number = RaisedNumber(name, unit_of(whole) or "1", least, largest=own * whole)
        made[number], instead[place] = sides, own * number.symbol

    replaced = {place: (lambda _, new=new: new) for place, new in instead.items()}
    return graph.rebuilt(bare, replaced)[0], made


def _varies(symbol: Symbol) -> bool:
    return isinstance(symbol, (Functional, Unknown))
