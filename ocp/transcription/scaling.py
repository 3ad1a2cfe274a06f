"""Automatic scaling: typical sizes of signals, rows and the objective.

A signal's size comes from its statement, else from its guess and boundary values, else from its
bounds, else along the dynamics (a derivative is about the size of its state over the duration).
An expression's size is how far it moves when its signals move by their sizes around the guess.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, field, replace
from typing import Any, assert_never

import casadi as ca
import numpy as np

from ocp.arrays import Array
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
from ocp.problem.phase import Phase
from ocp.problem.problem import Problem
from ocp.problem.symbols import Signal, Symbol
from ocp.transcription.variations import (
    FRACTIONS,
    NOTHING,
    Probe,
    boundary_variation,
    largest_finite,
)

_OFF = 3.0  # factor from which on a solved objective replaces the size taken from the guess
_FALL = 1e-3  # of its size, to which the objective's falls by a solved value of zero
# Factor by which a size may be more than a signal has in a motion. Limits of plus and minus 1e4
# around motions of one were tried on 75 problems, and hid no optimum; those of 1e6 did.
ROOMY = 1e4
# Part of a limit from which on a motion counts as one that comes up to it, between the instants at
# which it is looked at
_UP_TO = 0.9
_SOLVED = "value on an earlier mesh"
_GUESS = "guess"
BOUNDS = "bounds"
GUESSED_NUMBER = "guess, or middle of its bounds"
STATED = "stated"
NOTHING_KNOWN = "nothing known"
_LONGEST = "longest duration of a phase in the guess"


@dataclass(frozen=True, repr=False)
class Scales:
    """Typical sizes, in the units of the statement.

    Attributes
    ----------
    signals, unknowns, functionals : size by name (functionals by object).
    bounds : size by (phase name or "", bound name).
    time : typical duration [s].
    objective : size of the objective.
    reasons : where each size comes from, by kind and the key above.
    """

    signals: Mapping[str, float]
    unknowns: Mapping[str, float]
    bounds: Mapping[tuple[str, str], float]
    functionals: Mapping[Functional, float]
    time: float
    objective: float
    reasons: Mapping[tuple[str, Any], str] = field(default_factory=dict)

    def __repr__(self) -> str:
        return (
            f"Scales({len(self.signals)} signals, {len(self.bounds)} bounds; objective "
            f"{self.objective:.4g}, time {self.time:.4g} s)"
        )


def scales_of(
    problem: Problem,
    guess: InitialGuess,
    parameters: Parameters,
    mute: Set[str] = frozenset(),
) -> Scales:
    """Scales of a problem around a guess.

    A guess of next to nothing, which moves next to nothing, is no size: what a solver leaves of
    zero in a motion would make its unknown so large that no tolerance sees its slope.

    Parameters
    ----------
    mute : set of str
        Signals and unknowns, by name, of which neither a stated size nor their limits say how large
        they are. They still have no size beyond their limits.
    """
    scales = _scales_around(problem, guess, parameters, mute, frozenset())
    nothing = _next_to_nothing(problem, guess, parameters, mute, scales)
    return _scales_around(problem, guess, parameters, mute, nothing) if nothing else scales


def _scales_around(
    problem: Problem,
    guess: InitialGuess,
    parameters: Parameters,
    mute: Set[str],
    unsaid: Set[str],
) -> Scales:
    """Scales around a guess that says nothing of some signals and unknowns, `unsaid` by name."""
    signals, why = _signal_scales(problem, guess, parameters, mute, unsaid)
    reasons: dict[tuple[str, Any], str] = {("signal", name): text for name, text in why.items()}
    unknowns, why = _unknown_scales(problem, guess, parameters, mute, unsaid)
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


def variations_of(
    problem: Problem,
    phase: str,
    expressions: Sequence[ca.SX],
    guess: InitialGuess,
    scales: Scales,
    parameters: Parameters,
) -> Array:
    """How far scalar expressions of a phase move with a signal or unknown around a guess, (k,)."""
    sizes = {**scales.signals, **scales.unknowns}
    probe = Probe(problem, problem.phase(phase), guess, sizes, parameters)
    return np.array([_chosen(None, *probe.variation(e).largest)[0] for e in expressions])


def oversized(scales: Scales, objective: float) -> bool:
    """Whether the objective's size is many times a solved value, and was not stated."""
    return not stated_objective(scales) and _OFF * abs(objective) < scales.objective


def vanishes(scales: Scales, motion: InitialGuess) -> bool:
    """Whether all signals of a motion are zero, next to their sizes: it has no sizes of its own."""
    return all(
        largest_finite(values) <= NOTHING * scales.signals[name]
        for phase in motion.phases.values()
        for name, values in phase.at_fractions(FRACTIONS).items()
    )


def goes_somewhere(problem: Problem, parameters: Parameters) -> bool:
    """Whether a state is given an end value other than zero: its motion is small at most, not zero.

    However large the sizes are next to it.
    """
    return any(_largest_end_value(s, p, parameters) > 0 for p in problem.phases for s in p.states)


def stated_objective(scales: Scales) -> bool:
    """Whether the objective's size was stated."""
    return scales.reasons.get(("objective", "")) == STATED


def variation_of_objective(problem: Problem, scales: Scales, parameters: Parameters) -> float:
    """How far the objective moves with what it depends on, whatever size was stated of it."""
    symbols = problem.objective_symbols
    sizes = scales.functionals, scales.unknowns
    return boundary_variation(problem.objective, symbols, *sizes, parameters).largest[0]


def near_limits(limits: Sequence[float], typical: float) -> list[float]:
    """Absolute values of the finite limits of something that a motion with such a value may feel.

    A limit of plus and minus 1e6, written for none, says nothing of how large something is.
    """
    finite = [abs(limit) for limit in limits if math.isfinite(limit)]
    return [limit for limit in finite if limit <= ROOMY * typical]


def resized(scales: Scales, objective: float, least: float) -> Scales:
    """Scales with the objective's size taken from a solved value, where it was far off.

    Tolerances of the solver are relative to the scaled objective: where the guess, or a loose limit
    in place of one, costs many times the optimum, they would leave controls undetermined that cost
    little. A stated size stays. One that was taken from a value before is lowered only.

    Parameters
    ----------
    least : the size around the solved motion. A best value may be 0: by such values the size falls
        to a thousandth once, and no further than to this one.
    """
    reason, size = scales.reasons.get(("objective", "")), scales.objective
    again = reason == _SOLVED
    found = max(abs(objective), min(least, size if again else _FALL * size))
    near = size / _OFF <= found <= _OFF * size
    if reason == STATED or near or (again and found > size) or not math.isfinite(found):
        return scales
    return replace(scales, objective=found, reasons={**scales.reasons, ("objective", ""): _SOLVED})


def _chosen(stated: float | None, size: float, reason: str) -> tuple[float, str]:
    """A stated size, else one that was derived, else 1; with its reason."""
    if stated is not None:
        return stated, STATED
    if size > 0 and math.isfinite(size):
        return size, reason
    return 1.0, NOTHING_KNOWN


def _signal_scales(
    problem: Problem,
    guess: InitialGuess,
    parameters: Parameters,
    mute: Set[str],
    unsaid: Set[str],
) -> tuple[dict[str, float], dict[str, str]]:
    """Sizes of all signals, with reasons; a signal of several phases has its largest."""
    scales: dict[str, float] = {}
    reasons: dict[str, str] = {}
    for phase in problem.phases:
        values = guess.phases[phase.name].at_fractions(FRACTIONS)
        for signal in problem.signals[phase.name]:
            guessed = np.zeros(1) if signal.name in unsaid else values[signal.name]
            size, reason = _own_scale(signal, phase, guessed, parameters, signal.name in mute)
            if size > scales.get(signal.name, 0.0):
                scales[signal.name], reasons[signal.name] = size, reason

    for phase in problem.phases:
        duration = guess.phases[phase.name].end - guess.phases[phase.name].start
        _along_dynamics(phase, duration, scales, reasons)

    for phase in problem.phases:
        for signal in problem.signals[phase.name]:
            if signal.name not in scales:
                scales[signal.name], reasons[signal.name] = 1.0, NOTHING_KNOWN
    for name in mute & scales.keys():
        limit = largest_finite(parameters.signal_limits[name])
        scales[name] = min(scales[name], limit or math.inf)
    return scales, reasons


def _unknown_scales(
    problem: Problem,
    guess: InitialGuess,
    parameters: Parameters,
    mute: Set[str],
    unsaid: Set[str],
) -> tuple[dict[str, float], dict[str, str]]:
    """Sizes of all unknowns, with reasons."""
    scales: dict[str, float] = {}
    reasons: dict[str, str] = {}
    for u in problem.unknowns:
        guessed = 0.0 if u.name in unsaid else largest_finite(guess.unknowns[u.name])
        of_limits = largest_finite(parameters.unknown_limits[u.name])
        quiet = u.name in mute
        size, where = guessed, GUESSED_NUMBER
        if u.name in unsaid and of_limits > 0 and not quiet:
            size, where = of_limits, BOUNDS
        size, reasons[u.name] = _chosen(None if quiet else u.scale, size, where)
        scales[u.name] = min(size, of_limits or math.inf) if quiet else size
    return scales, reasons


def _own_scale(
    signal: Signal, phase: Phase, guess: Array, parameters: Parameters, mute: bool
) -> tuple[float, str]:
    """Size of a signal by what is said of it alone; 0 if nothing is."""
    if signal.scale is not None and not mute:
        return signal.scale, STATED
    of_ends = _largest_end_value(signal, phase, parameters)
    if max(largest_finite(guess), of_ends) > 0:
        inner, outer = (largest_finite(guess), _GUESS), (of_ends, "boundary values")
        return inner if inner[0] > outer[0] else outer
    size = 0.0 if mute else largest_finite(parameters.signal_limits[signal.name])
    return size, BOUNDS if size > 0 else ""


def _largest_end_value(signal: Signal, phase: Phase, parameters: Parameters) -> float:
    """The largest absolute value that a signal is given at an end of a phase; 0 if none is."""
    ends = (phase.initial, parameters.initial_values), (phase.final, parameters.final_values)
    return largest_finite(
        [
            values[phase.name, signal.name][0]
            for stated, values in ends
            if signal in stated and not isinstance(stated[signal], tuple)
        ]
    )


def _along_dynamics(
    phase: Phase, duration: float, scales: dict[str, float], reasons: dict[str, str]
) -> None:
    """Pass sizes down and up where the rate of a state is another signal itself."""
    links = [
        (state.name, symbol.name)
        for state, rate in phase.dynamics.items()
        if rate.is_symbolic()
        for symbol in phase.rate_symbols[state]
        if isinstance(symbol, Signal)
    ]

    # a motion from rest to rest over a distance of 1 in a time of 1 has a mean speed of 1 and a
    # peak of about 2
    for _ in links:
        for state, rate in links:
            if state in scales and rate not in scales:
                scales[rate] = 2.0 * scales[state] / duration
                reasons[rate] = f"'{state}' over the duration"
    for _ in links:
        for state, rate in links:
            if rate in scales and state not in scales:
                scales[state] = 0.5 * scales[rate] * duration
                reasons[state] = f"'{rate}' times the duration"


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


def _next_to_nothing(
    problem: Problem,
    guess: InitialGuess,
    parameters: Parameters,
    mute: Set[str],
    scales: Scales,
) -> Set[str]:
    """Signals and unknowns of which the guess says next to nothing, and that move nothing by it."""
    sizes = {**scales.signals, **scales.unknowns}
    guessed = {
        name
        for (kind, name), why in scales.reasons.items()
        if (kind, why) in (("signal", _GUESS), ("unknown", GUESSED_NUMBER))
    }
    if not guessed:
        return guessed
    signals, _ = _signal_scales(problem, guess, parameters, mute, guessed)
    unknowns, _ = _unknown_scales(problem, guess, parameters, mute, guessed)
    without = {**signals, **unknowns}
    # what comes up to a limit of its own is no nothing, however far the other limit is
    limits = {**parameters.signal_limits, **parameters.unknown_limits}
    tiny = {
        name
        for name in guessed
        if sizes[name] < NOTHING * without[name]
        and sizes[name] < _UP_TO * _nearest_limit(limits[name])
    }
    return tiny - _moving_something(problem, guess, parameters, scales, tiny)


def _nearest_limit(limits: Sequence[float]) -> float:
    """The smallest absolute value of limits that are not zero; infinite without any."""
    return min((abs(limit) for limit in limits if limit != 0), default=math.inf)


def _moving_something(
    problem: Problem,
    guess: InitialGuess,
    parameters: Parameters,
    scales: Scales,
    tiny: Set[str],
) -> set[str]:
    """Those of some signals and unknowns whose sizes move a constraint by more than nothing.

    A rate counts by its state over the duration, and only if the state is not tiny itself or moves
    something. The objective says nothing: all of it may be as tiny as a guess.
    """
    if not tiny:
        return set()
    sizes = {**scales.signals, **scales.unknowns}

    def names_moving(probe: Probe, expression: ca.SX, size: float = 0.0) -> set[str]:
        return {symbol.name for symbol in probe.variation(expression).moving(size)}

    functionals, found = _moving_boundary(problem, parameters, scales)
    rows: list[tuple[str | None, set[str]]] = []
    for phase in problem.phases:
        probe = Probe(problem, phase, guess, sizes, parameters)
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


def _moving_boundary(
    problem: Problem, parameters: Parameters, scales: Scales
) -> tuple[set[AnyFunctional], set[str]]:
    """Functionals and names of unknowns that move the problem's bounds and links."""
    functionals, names = set[AnyFunctional](), set[str]()
    for bound in problem.boundary_constraints:
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
