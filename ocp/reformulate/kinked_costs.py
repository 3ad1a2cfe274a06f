"""Kinks that only cost, stated as limits of controls and unknowns of their own.

The integral of ``|u|``, the fuel of a thruster, of ``max(0, F v)``, the energy of a drive that
feeds nothing back, or of ``|x - r|``, the distance from a path, is least with a motion that rests
on the kink for a while. There a solver of smooth problems finds no slope that vanishes. To minimise
the integral of ``max(a, b)`` is the same as to minimise that of a control s with ``s >= a`` and
``s >= b``, and that has no kink (the epigraph form: Boyd and Vandenberghe, "Convex Optimization",
section 4.1.3).

It is the same where nothing is gained by a larger s: where the kinked term is added to an integral
of the objective, or of a bound from above, with a factor of numbers and constants, or of time, that
has the sign of a cost. Kinks of time alone are left: they are at known instants.

Kinks of numbers of the whole motion that are minimised, as in ``3 |x_end - 1|``, the price of
missing a point, become limits of unknowns in the same way.

The size of a vector of controls is the largest of infinitely many expressions. One curved limit
stands for all, where its typical value is known (see `ocp.reformulate.vector_sizes`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import casadi as ca

from ocp.numerics.expression_graph import graph_of
from ocp.numerics.kinks import may_have_kinks
from ocp.numerics.polynomial_expressions import is_linear
from ocp.problem.bounds import Bound
from ocp.problem.functionals import Functional, Integral
from ocp.problem.phase import Phase
from ocp.problem.problem import Problem
from ocp.problem.symbols import (
    Control,
    Signal,
    Unknown,
    declared_value,
    is_limited,
    resolve,
)
from ocp.problem.texts import text_of, unit_of
from ocp.reformulate.costs import (
    LONGEST_NAME,
    Kink,
    kinks_that_cost,
    unlike,
)
from ocp.reformulate.reformulation import (
    Restated,
    taken_names,
    with_functionals,
    with_limits,
    with_statement,
)
from ocp.reformulate.vector_sizes import SizeOfVector, sizes_of_vectors

# Kinks of states in one integral. Of more, as in a sum over many levels, a motion crosses the most.
_MOST_CROSSED = 8


@dataclass(frozen=True)
class KinkedCosts:
    """Controls in place of the kinks of integrals that only cost."""

    def apply(self, problem: Problem) -> Restated | None:
        """The problem without such kinks; None where it has none."""
        integrals = [f for f in problem.functionals if isinstance(f, Integral)]
        if not may_have_kinks(*(integral.expression for integral in integrals)):
            return None
        controls = _Controls(taken_names(problem))
        replaced, used = dict[Functional, Functional](), dict[str, list[_Above]]()
        for integral in integrals:
            phase = problem.phase(integral.phase)
            expression, above = _without_kinks(integral, phase, _sign(problem, integral), controls)
            if above:
                symbols = resolve(expression, integral.name)
                piece = ((integral.phase, expression),)
                replaced[integral] = replace(integral, pieces=piece, symbols=symbols)
                used.setdefault(phase.name, []).extend(above)
        if not replaced:
            return None

        phases = [_limited(phase, used.get(phase.name, ())) for phase in problem.phases]
        return Restated(
            with_functionals(problem, phases, replaced),
            back={old: new.symbol for old, new in replaced.items()},
            forth={above.control: above.largest for above in controls.made.values()},
        )


@dataclass(frozen=True, eq=False, repr=False)
class _Above:
    """A control that is nowhere below a kinked expression.

    Attributes
    ----------
    largest : SX
        The expression [unit of the control].
    limits : tuple of Bound
        That hold the control above it.
    """

    control: Control
    largest: ca.SX
    limits: tuple[Bound, ...]


def _limited(phase: Phase, above: Sequence[_Above]) -> Phase:
    """A phase with the limits of the controls that its integrals have in place of kinks."""
    if not above:
        return phase
    limits = [limit for each in above for limit in each.limits]
    return replace(phase, bounds=with_limits(phase.bounds, limits))


def _sign(problem: Problem, integral: Integral) -> int:
    """The sign with which an integral costs wherever it stands; 0 where there is none."""
    found = {_sign_of_weight(integral, problem.objective)} - {None}
    for bound in problem.boundary_constraints:
        sign = _sign_of_weight(integral, bound.expression)
        if sign is not None:
            above, below = is_limited(-math.inf, bound.upper), is_limited(bound.lower, math.inf)
            found.add(0 if above and below else sign if above else -sign)
    return (found.pop() or 0) if len(found) == 1 else 0


def _sign_of_weight(integral: Integral, expression: ca.SX) -> int | None:
    """Of a constant weight of an integral, 0 where it is none, None where there is no integral."""
    if not ca.depends_on(expression, integral.symbol):
        return None
    value = declared_value(ca.densify(ca.jacobian(expression, integral.symbol)))
    if value is None or not is_linear(expression, integral.symbol):
        return 0
    return (value > 0) - (value < 0)


@dataclass(frozen=True, eq=False, repr=False)
class _Controls:
    """The controls made so far, one for each expression.

    Attributes
    ----------
    names : list of str
        That are taken.
    made : dict
        By what the expression is.
    """

    names: list[str]
    made: dict[tuple[object, ...], _Above] = field(default_factory=dict)

    def above(self, kink: Kink, size: SizeOfVector | None) -> _Above:
        """A control that is nowhere below the sides of a kink, or a size."""
        symbols = ca.symvar(kink.largest)
        key = (*(s.element_hash() for s in symbols), graph_of([kink.largest], symbols))
        if key not in self.made:
            name = unlike(text_of(kink.largest, LONGEST_NAME), self.names)
            self.names.append(name)
            if size is None:
                self.made[key] = _above_sides(kink, name)
            else:
                self.made[key] = _above_size(kink.largest, size, name)
        return self.made[key]


def _above_sides(kink: Kink, name: str) -> _Above:
    """The control that takes the place of a kink."""
    # it is no control of the plant: however coarse these are, it follows its sides
    control = Control(name, unit_of(kink.largest) or "1", _least(kink), piecewise="automatic")
    limits = tuple(
        Bound(
            f"{name}, lower limit {number}", control - side, control.unit, lower=0.0, of_cost=True
        )
        for number, side in enumerate(kink.sides, start=1)
        if not side.is_constant()
    )
    return _Above(control, kink.largest, limits)


def _above_size(whole: ca.SX, size: SizeOfVector, name: str) -> _Above:
    """The control that takes the place of the size of a vector."""
    control = Control(name, size.unit, 0.0, scale=size.typical, piecewise="automatic")
    # it acts nearly everywhere, so that its values do not tell what an excess is a part of
    limit = Bound(
        f"{name}, size",
        size.room_above(control.symbol),
        control.unit,
        lower=0.0,
        scale=size.typical,
        of_cost=True,
    )
    return _Above(control, whole, (limit,))


def _without_kinks(
    integral: Integral, phase: Phase, sign: int, controls: _Controls
) -> tuple[ca.SX, list[_Above]]:
    """The integrand with a control in place of each kink that only costs, and these controls."""
    if not sign:
        return integral.expression, []
    symbols = resolve(integral.expression, integral.name)
    bare = [symbol.symbol for symbol in symbols]
    graph = graph_of([integral.expression], bare)
    vectors = sizes_of_vectors(graph, symbols, phase.bounds)
    kinks = [
        kink
        for kink in kinks_that_cost(graph, symbols, phase, sign, vectors)
        if any(isinstance(symbol, Signal) for symbol in kink.symbols)
    ]
    # motions cross those that depend on no control
    crossed = [not any(isinstance(s, Control) for s in kink.symbols) for kink in kinks]
    few = sum(crossed) <= _MOST_CROSSED
    raised = {
        kink: controls.above(kink, vectors.get(kink.place))
        for kink, may_be_crossed in zip(kinks, crossed, strict=True)
        if few or not may_be_crossed
    }
    instead = {kink.place: kink.sign * above.control for kink, above in raised.items()}
    (expression,) = graph.rebuilt(bare, instead)
    return expression, list(raised.values())


def _least(kink: Kink) -> float:
    """The largest of the sides that are numbers, which a control or unknown is nowhere below."""
    return max((float(side) for side in kink.sides if side.is_constant()), default=-math.inf)


@dataclass(frozen=True)
class KinkedNumbers:
    """Unknowns in place of the kinks of an objective that only cost."""

    def apply(self, problem: Problem) -> Restated | None:
        """The problem without such kinks; None where it has none."""
        if not may_have_kinks(problem.objective):
            return None
        taken, limits = taken_names(problem), list[Bound]()
        objective, made = _numbers_without_kinks(problem.objective, taken)
        if not made:
            return None

        # a side may have a kink of its own, which costs if it makes the largest larger
        largest = {number: kink.largest for number, kink in made.items()}
        waiting = [(number, side) for number, kink in made.items() for side in kink.sides]
        while waiting:
            number, side = waiting.pop()
            if side.is_constant():
                continue
            smooth, further = _numbers_without_kinks(side, taken)
            waiting += [(inner, own) for inner, kink in further.items() for own in kink.sides]
            name = unlike(f"{number.name}, lower limit", taken)
            taken.append(name)
            limits.append(Bound(name, number - smooth, number.unit, lower=0.0, of_cost=True))
        bounds = (*problem.bounds, *limits)
        return Restated(with_statement(problem, objective, bounds=bounds), forth=largest)


def _numbers_without_kinks(
    expression: ca.SX, taken: list[str]
) -> tuple[ca.SX, dict[Unknown, Kink]]:
    """An expression with unknowns in place of kinks, and what these stand for.

    The names of the unknowns are added to those that are taken.
    """
    symbols = resolve(expression, "the objective")
    bare = [symbol.symbol for symbol in symbols]
    graph = graph_of([expression], bare)
    instead, made = dict[int, ca.SX](), dict[Unknown, Kink]()
    for kink in kinks_that_cost(graph, symbols, None, 1):
        if any(isinstance(symbol, (Functional, Unknown)) for symbol in kink.symbols):
            name = unlike(text_of(kink.largest, LONGEST_NAME), taken)
            taken.append(name)
            number = Unknown(name, unit_of(kink.largest) or "1", _least(kink))
            made[number], instead[kink.place] = kink, kink.sign * number.symbol
    return graph.rebuilt(bare, instead)[0], made
