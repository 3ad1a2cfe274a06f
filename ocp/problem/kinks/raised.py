"""Kinks of minimised integrals, stated as limits of controls of their own.

The integral of ``|u|``, the fuel of a thruster, of ``max(0, F v)``, the energy of a drive that
feeds nothing back, or of ``|x - r|``, the distance from a path, is least with a motion that rests
on the kink for a while. There a solver of smooth problems finds no slope that vanishes. To minimise
the integral of ``max(a, b)`` is the same as to minimise that of a control s with ``s >= a`` and
``s >= b``, and that has no kink (see `ocp.problem.kinks.epigraph`).

It is the same where nothing is gained by a larger s: where the kinked term is added to an integral
of the objective, or of a bound from above, with a factor of numbers and constants, or of time, that
has the sign of a cost. Kinks of time alone are left: they are at known instants.

The size of a vector of controls is stated in the same way, where its typical value is known (see
`ocp.problem.kinks.vector_sizes`).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import casadi as ca

from ocp.numerics.expression_graph import ExpressionGraph, graph_of
from ocp.numerics.linearity import is_linear
from ocp.problem.bounds import Bound
from ocp.problem.display import text_of, unit_of
from ocp.problem.functionals import Integral
from ocp.problem.kinks.choices import with_larger_ones
from ocp.problem.kinks.costs import LONGEST_NAME, costly, sides_of, unlike
from ocp.problem.kinks.epigraph import Epigraph, VectorSize, epigraphs, with_limits
from ocp.problem.kinks.signal_factors import with_signals_inside
from ocp.problem.kinks.time_factors import constant_value
from ocp.problem.kinks.vector_sizes import SizeOfVector, sizes_of_vectors
from ocp.problem.phase import Phase, kept_alive
from ocp.problem.symbols import (
    Constant,
    Control,
    Piecewise,
    Signal,
    is_limited,
    is_number,
    resolve,
)

# Kinks of states in one integral. Of more, as in a sum over many levels, a motion crosses the most.
_MOST_CROSSED = 8


@dataclass(frozen=True, eq=False, repr=False)
class Raised:
    """What a statement becomes.

    Attributes
    ----------
    phases : tuple of Phase
        With the new limits.
    integrals : mapping of Integral to Integral
        What each integral that had such kinks is replaced by.
    """

    phases: tuple[Phase, ...]
    integrals: Mapping[Integral, Integral]

    def of(self, expression: ca.SX) -> ca.SX:
        """An expression of functionals with those that replace them."""
        old = ca.vertcat(*[integral.symbol for integral in self.integrals])
        new = ca.vertcat(*[integral.symbol for integral in self.integrals.values()])
        return ca.substitute(expression, old, new)


def with_raised_kinks(
    phases: Sequence[Phase],
    integrals: Sequence[Integral],
    objective: ca.SX,
    constraints: Sequence[Bound],
    names: Iterable[str] = (),
) -> Raised | None:
    """Phases and integrals without the kinks that only cost; None where there are none.

    Parameters
    ----------
    integrals : sequence of Integral
        All in use.
    objective : SX
        What is minimised.
    constraints : sequence of Bound
        Of the numbers of the whole motion.
    names : iterable of str
        Of other things, which no new control shall have.
    """
    taken = [symbol.name for phase in phases for symbol in phase.symbols]
    controls = _Controls([*names, *taken])
    replaced = dict[Integral, Integral]()
    for integral in integrals:
        sign = _sign_of_cost(integral, objective, constraints)
        phase = next(phase for phase in phases if phase.name == integral.phase)
        expression = _without_kinks(integral, phase, sign, controls) if sign else None
        if expression is not None:
            symbols = resolve(expression, integral.name)
            piece = ((integral.phase, expression),)
            replaced[integral] = replace(integral, pieces=piece, symbols=symbols)
    if not replaced:
        return None

    limited = tuple(_limited(phase, replaced.values()) for phase in phases)
    for integral in replaced.values():
        own = next(phase for phase in limited if phase.name == integral.phase)
        integral.remember_phases([own.dynamics])
        kept_alive(integral, [own])
    return Raised(limited, replaced)


def _sign_of_cost(integral: Integral, objective: ca.SX, constraints: Sequence[Bound]) -> int:
    """The sign with which an integral costs wherever it stands; 0 where there is none."""
    found = {_sign_of_weight(integral, objective)} - {None}
    for bound in constraints:
        sign = _sign_of_weight(integral, bound.expression)
        if sign is not None:
            above, below = is_limited(-math.inf, bound.upper), is_limited(bound.lower, math.inf)
            found.add(0 if above and below else sign if above else -sign)
    return (found.pop() or 0) if len(found) == 1 else 0


def _sign_of_weight(integral: Integral, expression: ca.SX) -> int | None:
    """Of a constant weight of an integral, 0 where it is none, None where there is no integral."""
    if not ca.depends_on(expression, integral.symbol):
        return None
    weight = ca.densify(ca.jacobian(expression, integral.symbol))
    symbols = resolve(weight, "a weight")
    constant = all(isinstance(symbol, Constant) for symbol in symbols)
    return (
        _sign(constant_value(weight)) if constant and is_linear(expression, integral.symbol) else 0
    )


def _limited(phase: Phase, integrals: Iterable[Integral]) -> Phase:
    """A phase with the limits of the controls that its integrals have in place of kinks.

    What was made from it lives as long as it does.
    """
    own = [integral for integral in integrals if integral.phase == phase.name]
    if not own:
        return phase
    controls = [control for integral in own for control in epigraphs(integral.symbols)]
    limited = replace(phase, bounds=with_limits(phase.bounds, controls))
    for functional in phase._functionals:
        kept_alive(functional, [limited])
    return limited


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
    made: dict[tuple[object, ...], Epigraph] = field(default_factory=dict)

    def above(self, kink: _Kink) -> Epigraph:
        """A control that is nowhere below the sides of a kink, or a size."""
        symbols = ca.symvar(kink.whole)
        key = (*(s.element_hash() for s in symbols), graph_of([kink.whole], symbols))
        if key not in self.made:
            name = unlike(text_of(kink.whole, LONGEST_NAME), self.names)
            self.names.append(name)
            self.made[key] = _made(kink, name)
        return self.made[key]


@dataclass(frozen=True, eq=False, repr=False)
class _Kink:
    """The larger of some sides, the negative of the lesser, or the size of a vector.

    Attributes
    ----------
    place, sign : int
        In the graph of the integrand, and 1 or -1.
    whole : SX
        What is the largest.
    sides : sequence of SX
        None of a size.
    crossed : bool
        Whether motions cross it, as it depends on no control.
    size : SizeOfVector or None
    """

    place: int
    sign: int
    whole: ca.SX
    sides: Sequence[ca.SX]
    crossed: bool
    size: SizeOfVector | None = None


def _made(kink: _Kink, name: str) -> Epigraph:
    """The control that takes the place of a kink."""
    # it is no control of the plant: however coarse these are, it follows its sides
    shape: Piecewise = "automatic"
    whole, size = kink.whole, kink.size
    if size is not None:
        scale = size.typical
        return VectorSize(
            name, size.unit, 0.0, scale=scale, piecewise=shape, largest=whole, square=size.square
        )
    least = max((float(side) for side in kink.sides if side.is_constant()), default=-math.inf)
    unit = unit_of(whole) or "1"
    return Epigraph(name, unit, least, piecewise=shape, sides=tuple(kink.sides), largest=whole)


def _without_kinks(
    integral: Integral, phase: Phase, sign: int, controls: _Controls
) -> ca.SX | None:
    """The integrand with a control in place of each kink that only costs; None if it has none."""
    symbols = resolve(integral.expression, integral.name)
    bare = [symbol.symbol for symbol in symbols]
    signals = [i for i, symbol in enumerate(symbols) if isinstance(symbol, Signal)]
    positive = [i for i in signals if _is_never_negative(symbols[i])]
    larger = with_larger_ones(integral.expression, bare, positive)
    graph = graph_of([with_signals_inside(larger, bare, signals, positive)], bare)
    kinks = list[_Kink]()
    vectors = sizes_of_vectors(graph, symbols, phase.bounds)
    for place, own in costly(graph, symbols, phase, sign, vectors):
        if place in vectors:
            (whole,) = ExpressionGraph(graph.instructions, (place,)).rebuilt(bare)
            kinks.append(_Kink(place, own, whole, (), False, vectors[place]))
            continue
        found = list(sides_of(graph, place, own))
        places = (place, *(side for side, _ in found))
        whole, *parts = ExpressionGraph(graph.instructions, places).rebuilt(bare)
        sides = [above * part for part, (_, above) in zip(parts, found, strict=True)]
        of = resolve(whole, integral.name)
        if any(isinstance(s, Signal) for s in of):
            crossed = not any(isinstance(s, Control) for s in of)
            kinks.append(_Kink(place, own, own * whole, sides, crossed))

    few = sum(kink.crossed for kink in kinks) <= _MOST_CROSSED
    instead = {
        kink.place: kink.sign * controls.above(kink).symbol
        for kink in kinks
        if few or not kink.crossed
    }
    if not instead:
        return None

    made = {place: (lambda _, new=new: new) for place, new in instead.items()}
    return graph.rebuilt(bare, made)[0]


def _is_never_negative(signal: Signal) -> bool:
    """Whether a limit keeps a signal from being negative."""
    return is_number(signal.lower) and bool(signal.lower >= 0)


def _sign(value: float) -> int:
    return (value > 0) - (value < 0)
