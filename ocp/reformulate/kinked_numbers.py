"""Kinks of numbers of the whole motion that are minimised, as limits of unknowns of their own.

``3 |x_end - 1|``, the price of missing a point, or ``max(x_end, 1 - x_end)``, is often least on the
kink. To minimise ``max(a, b)`` is the same as to minimise an unknown t with ``t >= a`` and ``t >=
b``, which has no kink (the epigraph form: Boyd and Vandenberghe, "Convex Optimization", section
4.1.3). It is the same if nothing is gained by a larger t: if the kinked term is added to what is
minimised, with a factor of numbers and constants that has the sign of a cost. Other kinks stay.

Kinks of integrands become controls, see `ocp.reformulate.kinked_costs`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import casadi as ca

from ocp.numerics.expression_graph import ExpressionGraph, graph_of
from ocp.problem.bounds import Bound
from ocp.problem.functionals import Functional
from ocp.problem.problem import Problem
from ocp.problem.symbols import Unknown, resolve
from ocp.problem.texts import text_of, unit_of
from ocp.reformulate.costs import LONGEST_NAME, costly, sides_of, unlike
from ocp.reformulate.reformulation import Restated, may_have_kinks, taken_names, with_statement


@dataclass(frozen=True)
class KinkedNumbers:
    """Unknowns in place of the kinks of an objective that only cost."""

    def apply(self, problem: Problem) -> Restated | None:
        """The problem without such kinks; None where it has none."""
        if not may_have_kinks(problem.objective):
            return None
        taken, limits = taken_names(problem), list[Bound]()
        objective, made = _without_kinks(problem.objective, taken)
        if not made:
            return None

        # a side may have a kink of its own, which costs if it makes the largest larger
        waiting, largest = list(_with_sides(made)), {n: whole for n, (whole, _) in made.items()}
        while waiting:
            number, side = waiting.pop()
            if side.is_constant():
                continue
            smooth, further = _without_kinks(side, taken)
            waiting += _with_sides(further)
            name = unlike(f"{number.name}, lower limit", taken)
            taken.append(name)
            limits.append(Bound(name, number - smooth, number.unit, lower=0.0, of_cost=True))
        bounds = (*problem.bounds, *limits)
        return Restated(with_statement(problem, objective, bounds=bounds), forth=largest)


# By the unknown in its place: a kinked expression, and its sides
_Made = Mapping[Unknown, tuple[ca.SX, list[ca.SX]]]


def _with_sides(made: _Made) -> Iterator[tuple[Unknown, ca.SX]]:
    """Each unknown with each of its sides."""
    return ((number, side) for number, (_, sides) in made.items() for side in sides)


def _without_kinks(expression: ca.SX, taken: list[str]) -> tuple[ca.SX, _Made]:
    """An expression with unknowns in place of kinks, and what these stand for.

    The names of the unknowns are added to those that are taken.
    """
    symbols = resolve(expression, "the objective")
    bare = [symbol.symbol for symbol in symbols]
    graph = graph_of([expression], bare)
    instead, made = dict[int, ca.SX](), dict[Unknown, tuple[ca.SX, list[ca.SX]]]()
    for place, own in costly(graph, symbols, None, 1):
        found = list(sides_of(graph, place, own))
        places = (place, *(side for side, _ in found))
        whole, *parts = ExpressionGraph(graph.instructions, places).rebuilt(bare)
        of = resolve(whole, "the objective")
        if not any(isinstance(symbol, (Functional, Unknown)) for symbol in of):
            continue
        sides = [above * part for part, (_, above) in zip(parts, found, strict=True)]
        name = unlike(text_of(own * whole, LONGEST_NAME), taken)
        taken.append(name)
        least = max((float(side) for side in sides if side.is_constant()), default=-math.inf)
        number = Unknown(name, unit_of(whole) or "1", least)
        made[number], instead[place] = (own * whole, sides), own * number.symbol
    return graph.rebuilt(bare, instead)[0], made
