"""Automatic scaling: typical sizes of signals, rows and the objective.

A signal's size comes from its statement, else from its guess and boundary values, else from its
bounds, else along the dynamics (a derivative is about the size of its state over the duration).
An expression's size is how far it moves when its signals move by their sizes around the guess.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence, Set
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
from ocp.problem.symbols import TIME, Signal, Symbol

_FRACTIONS = np.linspace(0.0, 1.0, 17)  # of a phase, at which a guess is looked at
_STEP = 0.5  # of a signal's size, by which it is moved to see how far an expression moves
_OFF = 3.0  # factor from which on a solved objective replaces the size taken from the guess
_FALL = 1e-3  # of its size, to which the objective's falls by a solved value of zero
_NOTHING = 1e-4  # of its size, up to which a signal is what a solver leaves of zero
_SOLVED = "value on an earlier mesh"
_GUESS = "guess"
_GUESSED_NUMBER = "guess, or middle of its bounds"
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


def scales_of(problem: Problem, guess: InitialGuess, parameters: Parameters) -> Scales:
    """Scales of a problem around a guess.

    A guess of next to nothing, which moves next to nothing, is no size: what a solver leaves of
    zero in a motion would make its unknown so large that no tolerance sees its slope.
    """
    scales = _scales_of(problem, guess, parameters, frozenset())
    unsaid = frozenset(name for names in _guessed(scales) for name in names)
    if not unsaid:
        return scales
    without = _scales_of(problem, guess, parameters, unsaid)
    tiny = {
        name
        for sizes, others in (
            (scales.signals, without.signals),
            (scales.unknowns, without.unknowns),
        )
        for name in unsaid & sizes.keys()
        if sizes[name] < _NOTHING * others[name]
    }
    nothing = frozenset(tiny - _moving_something(problem, guess, parameters, scales, tiny))
    return _scales_of(problem, guess, parameters, nothing) if nothing else scales


def _guessed(scales: Scales) -> Iterator[list[str]]:
    """Names of the signals and unknowns whose sizes are those of a guess."""
    for kind, reason in (("signal", _GUESS), ("unknown", _GUESSED_NUMBER)):
        yield [key for (of, key), why in scales.reasons.items() if of == kind and why == reason]


def _scales_of(
    problem: Problem, guess: InitialGuess, parameters: Parameters, unsaid: frozenset[str]
) -> Scales:
    """Scales around a guess that says nothing of some signals and unknowns."""
    signals, why = _signal_scales(problem, guess, parameters, unsaid)
    reasons: dict[tuple[str, Any], str] = {("signal", name): text for name, text in why.items()}

    unknowns = {}
    for u in problem.unknowns:
        size = 0.0 if u.name in unsaid else _size(guess.unknowns[u.name])
        limits = _size(parameters.unknown_limits[u.name]) if u.name in unsaid else 0.0
        size, where = (limits, "bounds") if limits > 0 else (size, _GUESSED_NUMBER)
        unknowns[u.name], reasons["unknown", u.name] = _chosen(u.scale, size, where)

    duration = max(phase.end - phase.start for phase in guess.phases.values())
    reasons["time", ""] = _LONGEST

    # how far the expressions of each phase move around the guess
    probes = {
        phase.name: _Probe(problem, phase, guess, signals, unknowns, parameters)
        for phase in problem.phases
    }
    bounds = {}
    for phase in problem.phases:
        for b in phase.bounds:
            key = phase.name, b.name
            size, reason = probes[phase.name].variation(b.expression)
            bounds[key], reasons["bound", key] = _chosen(b.scale, size, reason)

    functionals: dict[Functional, float] = {}
    for f in problem.functionals:
        size, reason = _functional_size(f, probes, duration)
        functionals[f], reasons["number", f] = _chosen(f.scale, size, reason)

    # numbers of the whole motion move with their functionals and unknowns
    def moved(expression: ca.SX, symbols: Sequence[Symbol]) -> tuple[float, str]:
        return _boundary_variation(expression, symbols, functionals, unknowns, parameters)

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
    probe = _Probe(
        problem, problem.phase(phase), guess, scales.signals, scales.unknowns, parameters
    )
    return np.array([_chosen(None, *probe.variation(e))[0] for e in expressions])


def oversized(scales: Scales, objective: float) -> bool:
    """Whether the objective's size is many times a solved value, and was not stated."""
    stated = scales.reasons.get(("objective", "")) == "stated"
    return not stated and _OFF * abs(objective) < scales.objective


def vanishes(scales: Scales, motion: InitialGuess) -> bool:
    """Whether all signals of a motion are zero, next to their sizes: it has no sizes of its own."""
    return all(
        _size(values) <= _NOTHING * scales.signals[name]
        for phase in motion.phases.values()
        for name, values in phase.at_fractions(_FRACTIONS).items()
    )


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
    if reason == "stated" or near or (again and found > size) or not math.isfinite(found):
        return scales
    return replace(scales, objective=found, reasons={**scales.reasons, ("objective", ""): _SOLVED})


def _chosen(stated: float | None, size: float, reason: str) -> tuple[float, str]:
    """A stated size, else one that was derived, else 1; with its reason."""
    if stated is not None:
        return stated, "stated"
    if size > 0 and math.isfinite(size):
        return size, reason
    return 1.0, "nothing known"


def _size(values: Any) -> float:
    """Largest finite absolute value, 0 if there is none."""
    magnitudes = np.abs(np.asarray(values, dtype=float))
    finite = magnitudes[np.isfinite(magnitudes)]
    return float(finite.max()) if finite.size else 0.0


def _signal_scales(
    problem: Problem, guess: InitialGuess, parameters: Parameters, unsaid: frozenset[str]
) -> tuple[dict[str, float], dict[str, str]]:
    """Sizes of all signals, with reasons; a signal of several phases has its largest."""
    scales: dict[str, float] = {}
    reasons: dict[str, str] = {}
    for phase in problem.phases:
        values = guess.phases[phase.name].at_fractions(_FRACTIONS)
        for signal in problem.signals[phase.name]:
            guessed = np.zeros(1) if signal.name in unsaid else values[signal.name]
            size, reason = _own_scale(signal, phase, guessed, parameters)
            if size > scales.get(signal.name, 0.0):
                scales[signal.name], reasons[signal.name] = size, reason

    for phase in problem.phases:
        duration = guess.phases[phase.name].end - guess.phases[phase.name].start
        _along_dynamics(phase, duration, scales, reasons)

    for phase in problem.phases:
        for signal in problem.signals[phase.name]:
            if signal.name not in scales:
                scales[signal.name], reasons[signal.name] = 1.0, "nothing known"
    return scales, reasons


def _own_scale(
    signal: Signal, phase: Phase, guess: Array, parameters: Parameters
) -> tuple[float, str]:
    """Size of a signal by what is said of it alone; 0 if nothing is."""
    if signal.scale is not None:
        return signal.scale, "stated"
    ends = (phase.initial, parameters.initial_values), (phase.final, parameters.final_values)
    numbers = [
        values[phase.name, signal.name][0]
        for stated, values in ends
        if signal in stated and not isinstance(stated[signal], tuple)
    ]
    if max(_size(guess), _size(numbers)) > 0:
        inner, outer = (_size(guess), _GUESS), (_size(numbers), "boundary values")
        return inner if inner[0] > outer[0] else outer
    size = _size(parameters.signal_limits[signal.name])
    return size, "bounds" if size > 0 else ""


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


class _Probe:
    """Evaluates expressions of one phase around its guess."""

    def __init__(
        self,
        problem: Problem,
        phase: Phase,
        guess: InitialGuess,
        scales: Mapping[str, float],
        unknowns: Mapping[str, float],
        parameters: Parameters,
    ) -> None:
        own = guess.phases[phase.name]
        values = own.at_fractions(_FRACTIONS)
        self.duration = own.end - own.start
        self.symbols: list[Symbol] = [*problem.signals[phase.name], *problem.unknowns]
        centre, sizes = [], []
        for s in self.symbols:
            if isinstance(s, Signal):
                centre.append(values[s.name])
                sizes.append(scales[s.name])
            else:
                centre.append(np.full(_FRACTIONS.size, guess.unknowns[s.name]))
                sizes.append(unknowns[s.name])

        # the guess itself, then the guess with one symbol moved after the other
        tables = [np.array(centre)]
        for i, size in enumerate(sizes):
            moved = np.array(centre)
            moved[i] += _STEP * size
            tables.append(moved)
        self.points = np.hstack(tables)
        self.times = np.tile(own.start + _FRACTIONS * self.duration, len(tables))
        self.constants = ca.vertcat(*[c.symbol for c in problem.constants], ca.SX(0, 1))
        self.values = parameters.vector

    def _evaluate(self, expression: ca.SX) -> Array:
        """The expression at the guess and at each moved one, (1 + symbols, fractions)."""
        symbols = ca.vertcat(*[s.symbol for s in self.symbols])
        function = ca.Function("probe", [symbols, TIME.symbol, self.constants], [expression])
        out = function(self.points, self.times[None, :], self.values)
        return out.full().reshape(-1, _FRACTIONS.size)

    def variation(self, expression: ca.SX) -> tuple[float, str]:
        """Largest change when one signal or unknown moves by its size, and which one."""
        values = self._evaluate(expression)
        # an infinite value at the guess, such as the logarithm of zero, is left out
        with np.errstate(invalid="ignore"):
            moves = [_size((moved - values[0]) / _STEP) for moved in values[1:]]
        if not any(moves):
            return 0.0, ""
        worst = int(np.argmax(moves))
        return moves[worst], f"moves so far with '{self.symbols[worst].name}'"

    def moving(self, expression: ca.SX, size: float = 0.0) -> set[str]:
        """Names of what moves an expression by more than next to nothing of its size."""
        values = self._evaluate(expression)
        with np.errstate(invalid="ignore"):
            moves = [_size((moved - values[0]) / _STEP) for moved in values[1:]]
        least = _NOTHING * max(size, _size(values[0]), *moves)
        return {s.name for s, move in zip(self.symbols, moves, strict=True) if move > least}

    def size(self, expression: ca.SX) -> tuple[float, str]:
        """Largest value at the guess, or the variation where that is next to nothing."""
        size, (variation, reason) = _size(self._evaluate(expression)[0]), self.variation(expression)
        return (size, "value at the guess") if size > 0.01 * variation else (variation, reason)


def _functional_size(
    functional: AnyFunctional, probes: Mapping[str, _Probe], duration: float
) -> tuple[float, str]:
    """Typical size of a functional with its reason; `duration` is the longest of a phase."""
    match functional:
        case Integral():
            probe = probes[functional.phase]
            size, reason = probe.size(functional.expression)
            return size * probe.duration, f"{reason}, times the duration"
        case Peak():
            return max(probes[name].size(e) for name, e in functional.pieces)
        case BoundaryValue() | PointValue():
            return probes[functional.phase].variation(functional.expression)
        case PhaseTime():
            return duration, _LONGEST
        case _:
            assert_never(functional)


def _boundary_variation(
    expression: ca.SX,
    symbols: Sequence[Symbol],
    functionals: Mapping[Functional, float],
    unknowns: Mapping[str, float],
    parameters: Parameters,
) -> tuple[float, str]:
    """How far a boundary expression moves when its numbers move by their sizes, and with which."""
    _, moves = _boundary_moves(expression, symbols, functionals, unknowns, parameters)
    named = [(change, f"moves so far with '{symbol.name}'") for symbol, change in moves]
    return max([m for m in named if math.isfinite(m[0])], default=(0.0, ""))


def _boundary_moves(
    expression: ca.SX,
    symbols: Sequence[Symbol],
    functionals: Mapping[Functional, float],
    unknowns: Mapping[str, float],
    parameters: Parameters,
) -> tuple[float, list[tuple[Symbol, float]]]:
    """A boundary expression of numbers of their sizes, and how far each of them moves it."""
    centre = []
    for symbol in symbols:
        if isinstance(symbol, Functional):
            centre.append(functionals[symbol])
        elif symbol.name in unknowns:
            centre.append(unknowns[symbol.name])
        else:
            centre.append(parameters.values[symbol.name])

    function = ca.Function("boundary", [s.symbol for s in symbols], [expression])
    base, moves = float(function(*centre)), []
    for i, symbol in enumerate(symbols):
        if isinstance(symbol, Functional) or symbol.name in unknowns:
            shifted = list(centre)
            shifted[i] *= 1.0 + _STEP
            moves.append((symbol, abs(float(function(*shifted)) - base) / _STEP))
    return base, moves


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
    functionals, found = _moving_boundary(problem, parameters, scales)
    rows: list[tuple[str | None, set[str]]] = []
    for phase in problem.phases:
        probe = _Probe(problem, phase, guess, scales.signals, scales.unknowns, parameters)
        for state, rate in phase.dynamics.items():
            own = scales.signals[state.name] / probe.duration if probe.duration > 0 else 0.0
            rows.append((state.name, probe.moving(rate, own)))
        for bound in phase.bounds:
            limits = parameters.bound_limits[phase.name, bound.name]
            rows.append((None, probe.moving(bound.expression, _size(limits))))
        pieces = [piece for functional in functionals for piece in _pieces(functional)]
        rows += [(None, probe.moving(own)) for where, own in pieces if where == phase.name]

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
        base, moves = _boundary_moves(
            bound.expression, bound.symbols, scales.functionals, scales.unknowns, parameters
        )
        limits = parameters.bound_limits["", bound.name]
        least = _NOTHING * _size([base, *limits, *[change for _, change in moves]])
        moving = [symbol for symbol, change in moves if change > least]
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
