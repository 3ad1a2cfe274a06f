"""Typical sizes of signals, unknowns and expressions.

They come from a statement, a guess, limits or the dynamics.

By a limit that signals share, as ``fx^2 + fy^2 <= 400^2``, each is as large as it may be while the
others are zero.

An expression has the size by which it moves around a guess when what it depends on moves by its
own. A signal that the guess tells moves by its size where it is largest, and elsewhere by as much
less as it is smaller there.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np

from ocp.arrays import Array
from ocp.mesh.initial_guess import FRACTIONS, InitialGuess
from ocp.problem.functionals import Functional
from ocp.problem.parameters import Interval, Parameters
from ocp.problem.phase import Phase
from ocp.problem.problem import Problem
from ocp.problem.symbols import TIME, Constant, Signal, Symbol, Unknown, column_of

# of its size, up to which a signal or a change is what a solver leaves of zero
NOTHING = 1e-4

# Of its size, by which a symbol is moved. A small step would give the slope at the guess, which is
# often zero there, as that of the square of a signal at rest.
_STEP = 0.5

# Part of its variation that a value at the guess has to exceed to be a size.
_A_VALUE = 0.01


def largest_finite(values: Any) -> float:
    """Largest finite absolute value, 0 if there is none."""
    magnitudes = np.abs(np.asarray(values, dtype=float))
    finite = magnitudes[np.isfinite(magnitudes)]
    return float(finite.max()) if finite.size else 0.0


@dataclass(frozen=True, eq=False)
class Variation:
    """What an expression is at a guess, and how far each symbol moves it.

    Attributes
    ----------
    value : float
        Its largest finite absolute value at the guess.
    symbols : sequence of Symbol
    moves : sequence of float
        How far the expression moves when each symbol moves by its size. May be infinite.
    """

    value: float
    symbols: Sequence[Symbol]
    moves: Sequence[float]

    @property
    def largest(self) -> tuple[float, str]:
        """The largest finite move with the symbol that makes it, in words; 0 without any."""
        finite = np.where(np.isfinite(self.moves), self.moves, 0.0)
        if not finite.any():
            return 0.0, ""
        worst = int(np.argmax(finite))
        return float(finite[worst]), f"changes by this amount with '{self.symbols[worst].name}'"

    @property
    def size(self) -> tuple[float, str]:
        """The value, or the largest move where that is far more, in words."""
        move, reason = self.largest
        return (
            (self.value, "value at the guess") if self.value > _A_VALUE * move else (move, reason)
        )

    def moving(self, size: float = 0.0) -> set[Symbol]:
        """What moves the expression by more than next to nothing of its size, or of a given one."""
        least = NOTHING * max(self.value, largest_finite(self.moves), size)
        pairs = zip(self.symbols, self.moves, strict=True)
        return {symbol for symbol, move in pairs if move > least}


class Probe:
    """Evaluates expressions of one phase around its guess.

    Parameters
    ----------
    sizes : mapping of name to float
        Of the signals and the unknowns, which they are moved by.
    """

    def __init__(
        self,
        problem: Problem,
        phase: Phase,
        guess: InitialGuess,
        sizes: Mapping[str, float],
        parameters: Parameters,
    ) -> None:
        own = guess.phases[phase.name]
        values = own.at_fractions(FRACTIONS)
        self.duration = own.end - own.start
        self.symbols: list[Symbol] = [*problem.signals[phase.name], *problem.unknowns]
        centre = np.array(
            [
                values[s.name]
                if isinstance(s, Signal)
                else np.full(FRACTIONS.size, guess.unknowns[s.name])
                for s in self.symbols
            ]
        )

        # the guess itself, then the guess with one symbol moved after the other
        tables = [centre]
        for i, symbol in enumerate(self.symbols):
            moved = centre.copy()
            moved[i] += _STEP * sizes[symbol.name] * _shape(centre[i])
            tables.append(moved)
        self.points = np.hstack(tables)
        self.times = np.tile(own.start + FRACTIONS * self.duration, len(tables))
        self.constants = column_of(problem.constants)
        self.values = parameters.vector

    def variation(self, expression: ca.SX) -> Variation:
        """How far each signal and unknown moves a scalar expression of the phase."""
        symbols = ca.vertcat(*[s.symbol for s in self.symbols])
        function = ca.Function("probe", [symbols, TIME.symbol, self.constants], [expression])
        out = function(self.points, self.times[None, :], self.values)
        values = out.full().reshape(-1, FRACTIONS.size)
        # an infinite value at the guess, such as the logarithm of zero, is left out
        with np.errstate(invalid="ignore"):
            moves = [largest_finite((moved - values[0]) / _STEP) for moved in values[1:]]
        return Variation(largest_finite(values[0]), self.symbols, moves)


def _shape(values: Array) -> Array:
    """Moduli of a signal in a guess as parts of the largest, (n,); ones where all are zero.

    A control with a pole is large at one instant only. Moved by that size all along, it would make
    an integral of 0.1 one of 1e16, next to which no tolerance sees its value.
    """
    largest = largest_finite(values)
    return np.abs(values) / largest if largest > 0 else np.ones_like(values)


def boundary_variation(
    expression: ca.SX,
    symbols: Sequence[Symbol],
    functionals: Mapping[Functional, float],
    unknowns: Mapping[str, float],
    parameters: Parameters,
) -> Variation:
    """How far functionals and unknowns move an expression of numbers, all of them of their sizes.

    Parameters
    ----------
    symbols : sequence of Symbol
        On which the expression depends. Constants among them do not move.
    functionals : mapping of Functional to float
    unknowns : mapping of name to float
        Sizes.
    """

    def size_of(symbol: Symbol) -> float:
        if isinstance(symbol, Functional):
            return functionals[symbol]
        return (unknowns if symbol.name in unknowns else parameters.values)[symbol.name]

    function = ca.Function("boundary", [s.symbol for s in symbols], [expression])
    centre = [size_of(symbol) for symbol in symbols]
    base, moving, moves = float(function(*centre)), [], []
    for i, symbol in enumerate(symbols):
        if isinstance(symbol, Functional) or symbol.name in unknowns:
            shifted = list(centre)
            shifted[i] *= 1.0 + _STEP
            moving.append(symbol)
            moves.append(abs(float(function(*shifted)) - base) / _STEP)
    return Variation(largest_finite(base), moving, moves)


# Values that a signal is given, from small to large. What lies between the two beside a limit is
# looked at as finely, until they are within 1e-5.
_COUNT, _SMALLEST, _LARGEST, _TIMES = 49, 1e-12, 1e12, 4


def sizes_by_joint_limits(
    problem: Problem, unsized: Set[str], parameters: Parameters
) -> dict[str, float]:
    """Sizes by bounds of phases on signals alone, the largest of several.

    Parameters
    ----------
    unsized : set of str
        Names of the signals. A bound that depends on any other symbol tells nothing.
    """
    sizes = dict[str, float]()
    constants = column_of(problem.constants)
    bounds = [(phase.name, bound) for phase in problem.phases for bound in phase.bounds]
    for phase, bound in bounds:
        signals = [s for s in bound.symbols if not isinstance(s, Constant)]
        if not {s.name for s in signals} <= unsized:
            continue
        together = ca.vertcat(*[s.symbol for s in signals])
        function = ca.Function("joint", [together, constants], [bound.expression])
        limits = [v for v in parameters.bound_limits[phase, bound.name] if np.isfinite(v)]
        for signal, way in zip(signals, np.eye(len(signals)), strict=True):
            ends = [
                _end(function, sign * way, parameters.vector, limit)
                for sign in (1.0, -1.0)
                for limit in limits
            ]
            sizes[signal.name] = max(sizes.get(signal.name, 0.0), largest_finite(ends))
    return {name: size for name, size in sizes.items() if size > 0}


def _end(function: ca.Function, way: Array, constants: Array, limit: float) -> float:
    """How far it is from zero along a way to where an expression has its limit; 0 if nowhere."""
    low, high = _SMALLEST, _LARGEST
    for _ in range(_TIMES):
        lengths = np.geomspace(low, high, _COUNT)
        above = function(np.outer(way, lengths), constants).full()[0] > limit
        changes = np.flatnonzero(above[1:] != above[:-1])
        if not changes.size:
            return 0.0
        low, high = lengths[changes[0]], lengths[changes[0] + 1]
    return float(high)


STATED = "stated"
GUESS = "guess"
GUESSED_NUMBER = "guess, or middle of its bounds"
BOUNDS = "bounds"
NOTHING_KNOWN = "no information"


@dataclass(frozen=True, eq=False)
class SizeSources:
    """What tells how large signals and unknowns are.

    Attributes
    ----------
    problem : Problem
    guess : InitialGuess
    parameters : Parameters
        Limits and end values.
    without_limits : set of str
        Names of which neither a stated size nor the limits tell how large they are. The limits
        still cap their sizes.
    without_guess : set of str
        Names of which the guess does not tell how large they are.
    """

    problem: Problem
    guess: InitialGuess
    parameters: Parameters
    without_limits: Set[str] = field(default_factory=frozenset)
    without_guess: Set[str] = field(default_factory=frozenset)

    def of_signal(
        self, signal: Signal, phase: Phase, guess: Mapping[str, Array]
    ) -> tuple[float, str]:
        """Size of a signal by what a phase says of it alone, with the reason; 0 if nothing is.

        Parameters
        ----------
        guess : mapping of str to (m,)
            Of all signals of the phase, at any times.
        """
        if signal.scale is not None and signal.name not in self.without_limits:
            return signal.scale, STATED
        guessed = self._guessed(signal.name, guess)
        of_ends = largest_end_value(signal, phase, self.parameters)
        if max(guessed, of_ends) > 0:
            return (guessed, GUESS) if guessed > of_ends else (of_ends, "boundary values")
        if signal.name in self.without_limits:
            return 0.0, ""
        return self._limit(signal.name), BOUNDS

    def of_unknown(self, unknown: Unknown) -> tuple[float, str]:
        """Size of an unknown with the reason; 0 if nothing is said of it."""
        by_limits = unknown.name not in self.without_limits
        if unknown.scale is not None and by_limits:
            return unknown.scale, STATED
        guessed = self._guessed(unknown.name, self.guess.unknowns)
        if unknown.name in self.without_guess and by_limits:
            return self._limit(unknown.name), BOUNDS
        return guessed, GUESSED_NUMBER

    def capped(self, name: str, size: float) -> float:
        """A size, cut to the largest limit where this does not tell it."""
        limit = self._limit(name) if name in self.without_limits else 0.0
        return min(size, limit or math.inf)

    def _guessed(self, name: str, values: Mapping[str, Array | float]) -> float:
        return 0.0 if name in self.without_guess else largest_finite(values[name])

    def _limit(self, name: str) -> float:
        return largest_finite(limits_of(name, self.parameters))


def signal_sizes(sources: SizeSources) -> tuple[dict[str, float], dict[str, str]]:
    """Sizes of all signals, with reasons; a signal of several phases has its largest."""
    problem, sizes, reasons = sources.problem, dict[str, float](), dict[str, str]()
    for phase in problem.phases:
        guess = sources.guess.phases[phase.name].at_fractions(FRACTIONS)
        for signal in problem.signals[phase.name]:
            size, reason = sources.of_signal(signal, phase, guess)
            if size > sizes.get(signal.name, 0.0):
                sizes[signal.name], reasons[signal.name] = size, reason

    unsized = {s.name for phase in problem.phases for s in problem.signals[phase.name]}
    unsized -= sizes.keys() | sources.without_limits
    joint = sizes_by_joint_limits(problem, unsized, sources.parameters)
    sizes, reasons = sizes | joint, reasons | dict.fromkeys(joint, BOUNDS)

    for phase in problem.phases:
        of_guess = sources.guess.phases[phase.name]
        _along_dynamics(phase, of_guess.end - of_guess.start, sizes, reasons)

    for phase in problem.phases:
        for signal in problem.signals[phase.name]:
            if signal.name not in sizes:
                sizes[signal.name], reasons[signal.name] = 1.0, NOTHING_KNOWN
    return {name: sources.capped(name, size) for name, size in sizes.items()}, reasons


def unknown_sizes(sources: SizeSources) -> tuple[dict[str, float], dict[str, str]]:
    """Sizes of all unknowns, with reasons."""
    sizes, reasons = dict[str, float](), dict[str, str]()
    for unknown in sources.problem.unknowns:
        size, reason = size_or_one(*sources.of_unknown(unknown))
        sizes[unknown.name], reasons[unknown.name] = sources.capped(unknown.name, size), reason
    return sizes, reasons


def size_or_one(size: float, reason: str) -> tuple[float, str]:
    """A size with its reason; 1 where nothing is known."""
    if size > 0 and math.isfinite(size):
        return size, reason
    return 1.0, NOTHING_KNOWN


def limits_of(name: str, parameters: Parameters) -> Interval:
    """Limits of a signal or an unknown."""
    own = parameters.signal_limits
    return own[name] if name in own else parameters.unknown_limits[name]


def largest_end_value(signal: Signal, phase: Phase, parameters: Parameters) -> float:
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
    phase: Phase, duration: float, sizes: dict[str, float], reasons: dict[str, str]
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
            if state in sizes and rate not in sizes:
                sizes[rate] = 2.0 * sizes[state] / duration
                reasons[rate] = f"'{state}' over the duration"
    for _ in links:
        for state, rate in links:
            if rate in sizes and state not in sizes:
                sizes[state] = 0.5 * sizes[rate] * duration
                reasons[state] = f"'{rate}' times the duration"
