"""Guesses of next to nothing, which move next to nothing: they tell no size.

What a solver leaves of zero in a motion would make its unknown so large that no tolerance sees its
slope.
"""

from __future__ import annotations

import math
from collections.abc import Sequence, Set
from dataclasses import replace

import casadi as ca

from ocp.problem.functionals import (
    AnyFunctional,
    BoundaryValue,
    Functional,
    Integral,
    Peak,
    PointValue,
)
from ocp.scaling.scales import Scales
from ocp.scaling.symbol_sizes import (
    GUESS,
    GUESSED_NUMBER,
    SizeSources,
    limits_of,
    signal_sizes,
    unknown_sizes,
)
from ocp.scaling.variations import NOTHING, Probe, boundary_variation, largest_finite

# Part of a limit from which on a motion counts as one that comes up to it, between the instants at
# which it is looked at
_UP_TO = 0.9


def negligible_guesses(sources: SizeSources, scales: Scales) -> Set[str]:
    """Signals and unknowns of which the guess says next to nothing, and that move nothing by it.

    Parameters
    ----------
    scales : Scales
        By these sources.
    """
    guessed = {
        name for name, _, why in scales.symbols_with_reasons if why in (GUESS, GUESSED_NUMBER)
    }
    if not guessed:
        return guessed
    without = replace(sources, without_guess=guessed)
    other_sizes = signal_sizes(without)[0] | unknown_sizes(without)[0]

    def is_tiny(name: str, size: float) -> bool:
        # what comes up to a limit of its own is no nothing, however far the other limit is
        nearest = _nearest_limit(limits_of(name, sources.parameters))
        return size < NOTHING * other_sizes[name] and size < _UP_TO * nearest

    tiny = {name for name in guessed if is_tiny(name, scales.symbols[name])}
    return tiny - _moving_something(sources, scales, tiny)


def _nearest_limit(limits: Sequence[float]) -> float:
    """The smallest absolute value of limits that are not zero; infinite without any."""
    return min((abs(limit) for limit in limits if limit != 0), default=math.inf)


def _moving_something(sources: SizeSources, scales: Scales, tiny: Set[str]) -> set[str]:
    """Those of some signals and unknowns whose sizes move a constraint by more than nothing.

    A rate counts by its state over the duration, and only if the state is not tiny itself or moves
    something. The objective says nothing: all of it may be as tiny as a guess.
    """
    if not tiny:
        return set()
    problem, parameters = sources.problem, sources.parameters

    def names_moving(probe: Probe, expression: ca.SX, size: float = 0.0) -> set[str]:
        return {symbol.name for symbol in probe.variation(expression).moving(size)}

    functionals, found = _moving_boundary(sources, scales)
    rows: list[tuple[str | None, set[str]]] = []
    for phase in problem.phases:
        probe = Probe(problem, phase, sources.guess, scales.symbols, parameters)
        for state, rate in phase.dynamics.items():
            own = scales.signals[state.name] / probe.duration if probe.duration > 0 else 0.0
            rows.append((state.name, names_moving(probe, rate, own)))
        for bound in phase.bounds:
            limits = parameters.bound_limits[phase.name, bound.name]
            rows.append((None, names_moving(probe, bound.expression, largest_finite(limits))))
        pieces = [piece for functional in functionals for piece in _pieces(functional)]
        rows += [(None, names_moving(probe, own)) for where, own in pieces if where == phase.name]

    while True:
        real = [names for owner, names in rows if owner not in tiny or owner in found]
        reached = found.union(*real)
        if reached == found:
            return found & tiny
        found = reached


def _moving_boundary(sources: SizeSources, scales: Scales) -> tuple[set[AnyFunctional], set[str]]:
    """Functionals and names of unknowns that move the problem's bounds and links."""
    parameters = sources.parameters
    functionals, names = set[AnyFunctional](), set[str]()
    for bound in sources.problem.boundary_constraints:
        limits = parameters.bound_limits["", bound.name]
        moving = boundary_variation(
            bound.expression, bound.symbols, scales.functionals, scales.unknowns, parameters
        ).moving(largest_finite(limits))
        functionals |= {symbol for symbol in moving if isinstance(symbol, Functional)}
        names |= {symbol.name for symbol in moving if not isinstance(symbol, Functional)}
    return functionals, names


def _pieces(functional: AnyFunctional) -> Sequence[tuple[str, ca.SX]]:
    """The expressions of a functional, each with the name of its phase."""
    match functional:
        case Integral() | Peak():
            return functional.pieces
        case BoundaryValue() | PointValue():
            return [(functional.phase, functional.expression)]
        case _:
            return []
