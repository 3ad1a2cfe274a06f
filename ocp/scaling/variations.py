"""How far expressions move around a guess when what they depend on moves by its size."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from ocp.mesh.initial_guess import InitialGuess
from ocp.problem.functionals import Functional
from ocp.problem.parameters import Parameters
from ocp.problem.phase import Phase
from ocp.problem.problem import Problem
from ocp.problem.symbols import TIME, Signal, Symbol

# of a phase, at which a guess is looked at
FRACTIONS = np.linspace(0.0, 1.0, 17)

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
        return float(finite[worst]), f"moves so far with '{self.symbols[worst].name}'"

    @property
    def size(self) -> tuple[float, str]:
        """The value, or the largest move where that is far more, in words."""
        move, reason = self.largest
        return (
            (self.value, "value at the guess") if self.value > _A_VALUE * move else (move, reason)
        )

    def moving(self, size: float = 0.0) -> set[Symbol]:
        """What moves the expression by more than next to nothing of its size.

        Parameters
        ----------
        size : float
            Of the expression, if that is more than its value and its moves say.
        """
        least = NOTHING * max(size, self.value, largest_finite(self.moves))
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
            moved[i] += _STEP * sizes[symbol.name]
            tables.append(moved)
        self.points = np.hstack(tables)
        self.times = np.tile(own.start + FRACTIONS * self.duration, len(tables))
        self.constants = ca.vertcat(*[c.symbol for c in problem.constants], ca.SX(0, 1))
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
