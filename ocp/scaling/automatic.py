"""Automatic scaling: typical sizes of signals, rows and the objective.

A signal's size comes from its statement, else from its guess and boundary values, else from its
bounds, else along the dynamics (a derivative is about the size of its state over the duration). An
expression's size is how far it moves when its signals move by their sizes around the guess.

Guesses of next to nothing tell no size: what a solver leaves of zero in a motion would make its
unknown so large that no tolerance sees its slope.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import replace
from typing import Any, assert_never

import casadi as ca

from ocp.mesh.initial_guess import InitialGuess
from ocp.problem.functionals import (
    AnyFunctional,
    BoundaryValue,
    Functional,
    Integral,
    Peak,
    PhaseTime,
    PointValue,
)
from ocp.problem.parameters import Parameters
from ocp.problem.problem import Problem
from ocp.problem.symbols import Symbol
from ocp.scaling.scales import Scales
from ocp.scaling.symbol_sizes import (
    GUESS,
    GUESSED_NUMBER,
    NOTHING,
    STATED,
    Probe,
    SizeSources,
    boundary_variation,
    largest_finite,
    signal_sizes,
    size_or_one,
    unknown_sizes,
)

_LONGEST = "longest duration of a phase in the guess"


def scales_of(
    problem: Problem,
    guess: InitialGuess,
    parameters: Parameters,
    without_limits: Set[str] = frozenset(),
) -> Scales:
    """Scales of a problem around a guess.

    Parameters
    ----------
    without_limits : set of str
        Signals and unknowns, by name, of which neither a stated size nor their limits say how large
        they are. They still have no size beyond their limits.
    """
    sources = SizeSources(problem, guess, parameters, without_limits)
    scales = _scales_by(sources)
    negligible = _negligible_guesses(sources, scales)
    return _scales_by(replace(sources, without_guess=negligible)) if negligible else scales


def _negligible_guesses(sources: SizeSources, scales: Scales) -> Set[str]:
    """Signals and unknowns of which the guess says next to nothing, and that move nothing by it.

    A rate counts if its state moves something, and the objective does not: all of it may be as tiny
    as a guess.
    """
    problem, parameters = sources.problem, sources.parameters
    guessed = {n for n, _, why in scales.symbols_with_reasons if why in (GUESS, GUESSED_NUMBER)}
    without = replace(sources, without_guess=guessed)
    other_sizes = signal_sizes(without)[0] | unknown_sizes(without)[0]
    tiny = {name for name in guessed if scales.symbols[name] < NOTHING * other_sizes[name]}
    if not tiny:
        return tiny

    # what bounds and links of the whole motion move with, next to their limits
    sizes, limits = (scales.functionals, scales.unknowns), parameters.bound_limits
    numbers = {
        symbol
        for own in problem.boundary_constraints
        for symbol in boundary_variation(own.expression, own.symbols, *sizes, parameters).moving(
            largest_finite(limits["", own.name])
        )
    }
    tiny -= {symbol.name for symbol in numbers}
    pieces = [part for own in numbers if isinstance(own, Functional) for part in own.pieces]

    # bounds in phases, and rates next to those that their states need
    rates: list[tuple[str, set[str]]] = []
    for phase in problem.phases:
        probe = Probe(problem, phase, sources.guess, scales.symbols, parameters)

        def moving(expression: ca.SX, size: float, probe: Probe = probe) -> set[str]:
            return {symbol.name for symbol in probe.variation(expression).moving(size)}

        for bound in phase.bounds:
            tiny -= moving(bound.expression, largest_finite(limits[phase.name, bound.name]))
        for name, piece in pieces:
            tiny -= moving(piece, 0.0) if name == phase.name else set()
        for state, rate in phase.dynamics.items():
            own = scales.signals[state.name] / probe.duration if probe.duration > 0 else 0.0
            rates.append((state.name, moving(rate, own)))
    for _ in rates:
        tiny -= {name for state, names in rates if state not in tiny for name in names}
    return tiny


def _scales_by(sources: SizeSources) -> Scales:
    """Scales by what tells the sizes of signals and unknowns."""
    problem, guess, parameters = sources.problem, sources.guess, sources.parameters
    signals, why = signal_sizes(sources)
    reasons: dict[tuple[str, Any], str] = {("signal", name): text for name, text in why.items()}
    unknowns, why = unknown_sizes(sources)
    reasons |= {("unknown", name): text for name, text in why.items()}

    duration = max(phase.end - phase.start for phase in guess.phases.values())
    reasons["time", ""] = _LONGEST

    # how far the expressions of each phase move around the guess
    sizes = {**signals, **unknowns}
    probes = {
        phase.name: Probe(problem, phase, guess, sizes, parameters) for phase in problem.phases
    }
    bounds = {}
    for phase in problem.phases:
        for b in phase.bounds:
            key = phase.name, b.name
            size, reason = probes[phase.name].variation(b.expression).largest
            bounds[key], reasons["bound", key] = _chosen(b.scale, size, reason)

    functionals: dict[Functional, float] = {}
    for f in problem.functionals:
        size, reason = _functional_size(f, probes, duration)
        functionals[f], reasons["number", f] = _chosen(f.scale, size, reason)

    # numbers of the whole motion move with their functionals and unknowns
    def moved(expression: ca.SX, symbols: Sequence[Symbol]) -> tuple[float, str]:
        return boundary_variation(expression, symbols, functionals, unknowns, parameters).largest

    for b in problem.boundary_constraints:
        key = "", b.name
        bounds[key], reasons["bound", key] = _chosen(b.scale, *moved(b.expression, b.symbols))
    size, reason = moved(problem.objective, problem.objective_symbols)
    objective, reasons["objective", ""] = _chosen(problem.scale, size, reason)
    return Scales(signals, unknowns, bounds, functionals, duration, objective, reasons)


def variation_of_objective(problem: Problem, scales: Scales, parameters: Parameters) -> float:
    """How far the objective moves with what it depends on, whatever size was stated of it."""
    symbols = problem.objective_symbols
    sizes = scales.functionals, scales.unknowns
    return boundary_variation(problem.objective, symbols, *sizes, parameters).largest[0]


def _chosen(stated: float | None, size: float, reason: str) -> tuple[float, str]:
    """A stated size, else one that was derived, else 1; with its reason."""
    return (stated, STATED) if stated is not None else size_or_one(size, reason)


def _functional_size(
    functional: AnyFunctional, probes: Mapping[str, Probe], duration: float
) -> tuple[float, str]:
    """Typical size of a functional with its reason; `duration` is the longest of a phase."""
    match functional:
        case Integral():
            probe = probes[functional.phase]
            size, reason = probe.variation(functional.expression).size
            return size * probe.duration, f"{reason}, times the duration"
        case Peak():
            return max(probes[name].variation(e).size for name, e in functional.pieces)
        case BoundaryValue() | PointValue():
            return probes[functional.phase].variation(functional.expression).largest
        case PhaseTime():
            return duration, _LONGEST
        case _:
            assert_never(functional)
