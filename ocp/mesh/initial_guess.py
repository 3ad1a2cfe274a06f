"""Where a solve starts: the user's guess, or another trajectory, seen the same way."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from numbers import Real
from typing import Any, Protocol

import numpy as np

from ocp.arrays import Array
from ocp.errors import StatementError
from ocp.mesh.phase_times import guessed_times
from ocp.mesh.trajectory import PhaseTrajectory, Trajectory
from ocp.problem.parameters import Parameters
from ocp.problem.phase import Phase
from ocp.problem.problem import Problem
from ocp.problem.symbols import ByFraction, Signal, State, Unknown

# Fractions of a phase at which a guess is looked at, and the part of its size that it may leave a
# straight line by: rounding errors.
_LOOKED_AT = np.linspace(0.0, 1.0, 17)
_STRAIGHT = 1e-9


class PhaseGuess(Protocol):
    """What a guess knows of one phase."""

    @property
    def start(self) -> float: ...

    @property
    def end(self) -> float: ...

    def at_fractions(self, fractions: Array) -> Mapping[str, Array]: ...


@dataclass(frozen=True, eq=False, repr=False)
class InitialGuess:
    """A guess for every phase and unknown of a problem."""

    phases: Mapping[str, PhaseGuess]
    unknowns: Mapping[str, float]


def initial_guess(
    problem: Problem, parameters: Parameters, trajectory: Trajectory | None = None
) -> InitialGuess:
    """The guess that a problem states, overlaid by a trajectory where one is given.

    Raises
    ------
    StatementError
        Here or when it is evaluated, if a guess is not finite or has a wrong shape.
    """
    known = {phase.name: phase for phase in trajectory.phases} if trajectory else {}
    phases: dict[str, PhaseGuess] = {}
    for name, stated in _stated_guesses(problem, parameters).items():
        motion = known.get(name)
        if motion is None:
            phases[name] = stated
        else:
            lacking = tuple(s for s in stated.signals if s.name not in motion.signals)
            phases[name] = _Overlay(replace(stated, signals=lacking), motion)

    unknowns = {u.name: _unknown_guess(u) for u in problem.unknowns}
    if trajectory:
        unknowns |= {name: v for name, v in trajectory.unknowns.items() if name in unknowns}
    return InitialGuess(phases, unknowns)


def states_a_motion(problem: Problem, parameters: Parameters) -> bool:
    """Whether the guess of any phase knows something of its motion.

    A guess in which a state stays as it is, although it has to move between its boundary values,
    says no more of the motion than no guess does.
    """
    return any(
        guess.phase.guess and not any(_stays(guess, state) for state in guess.phase.states)
        for guess in _stated_guesses(problem, parameters).values()
    )


def states_only_lines(problem: Problem, parameters: Parameters) -> bool:
    """Whether all states run on straight lines in the guess of every phase."""
    for guess in _stated_guesses(problem, parameters).values():
        values = guess.at_fractions(_LOOKED_AT)
        for state in guess.phase.states:
            line = np.interp(_LOOKED_AT, _LOOKED_AT[[0, -1]], values[state.name][[0, -1]])
            if np.abs(values[state.name] - line).max() > _STRAIGHT * np.abs(line).max():
                return False
    return True


def guess_by_lines(problem: Problem, parameters: Parameters) -> InitialGuess:
    """The guess of a problem whose phases state none: its times and unknowns are kept."""
    phases = _stated_guesses(problem, parameters, left_aside=True)
    return InitialGuess(phases, {u.name: _unknown_guess(u) for u in problem.unknowns})


def _stated_guesses(
    problem: Problem, parameters: Parameters, *, left_aside: bool = False
) -> dict[str, StatedGuess]:
    """The guess in the statement of each phase, by name; see `StatedGuess`.

    A mass that the first phase states is about that of the next one. Guessed to be 0, its inverse
    would have no value there.
    """
    times = guessed_times(problem.phases)
    guesses: dict[str, StatedGuess] = {}
    for phase in problem.phases:
        signals, ends = problem.signals[phase.name], times[phase.name]
        guess = StatedGuess(phase, signals, parameters, ends, left_aside)
        before = {
            state.name: _nearest_to(value, state)
            for earlier in guesses.values()
            for state in phase.states
            if not guess.knows(state) and (value := earlier.value_at_end(state)) is not None
        }
        guesses[phase.name] = replace(guess, before=before)
    return guesses


def _stays(guess: StatedGuess, state: Signal) -> bool:
    """Whether a state with two different boundary values is guessed to be one number."""
    if state not in guess.phase.guess:
        return False
    key = guess.phase.name, state.name
    first = guess.parameters.initial_values.get(key)
    last = guess.parameters.final_values.get(key)
    if None in (first, last) or first == last:
        return False
    return bool(np.ptp(guess.at_fractions(_LOOKED_AT)[state.name]) == 0.0)


@dataclass(frozen=True, eq=False, repr=False)
class StatedGuess:
    """The guess in the statement of a phase; a signal left out joins its boundary values.

    A state without any has the value at the end of the last phase before in which it has one.

    Attributes
    ----------
    times : (float, float)
        Initial and final time, see `guessed_times` [s].
    left_aside : bool
        Whether all signals count as left out.
    before : mapping of name to float
        Values of states at the ends of phases before.
    """

    phase: Phase
    signals: tuple[Signal, ...]
    parameters: Parameters
    times: tuple[float, float]
    left_aside: bool = False
    before: Mapping[str, float] = field(default_factory=dict)

    @property
    def start(self) -> float:
        """Initial time [s]."""
        return self.times[0]

    @property
    def end(self) -> float:
        """Final time [s], a little after the start at least."""
        return max(self.times[1], self.start + 1e-6 * (1.0 + abs(self.start)))

    def at_fractions(self, fractions: Array) -> Mapping[str, Array]:
        """Signals by name at fractions of the phase."""
        times = self.start + fractions * (self.end - self.start)
        return {s.name: self._values(s, fractions, times) for s in self.signals}

    def knows(self, state: State) -> bool:
        """Whether there is a guess of a state, a boundary value, or a value in a phase before."""
        if state.name in self.before or (state in self.phase.guess and not self.left_aside):
            return True
        return any(value is not None for value in self._ends(state))

    def value_at_end(self, state: State) -> float | None:
        """The value of a state at the end; None where `knows` says that there is none."""
        if not self.knows(state):
            return None
        return float(self._values(state, np.ones(1), np.array([self.end]))[0])

    def _values(self, signal: Signal, fractions: Array, times: Array) -> Array:
        stated = {} if self.left_aside else self.phase.guess
        given = stated.get(signal, self._between_ends(signal))
        values = _evaluated(given, fractions, times, f"the guess of '{signal.name}'")
        if not np.all(np.isfinite(values)):
            raise StatementError(
                f"the guess of '{signal.name}' in phase '{self.phase.name}' is not finite at "
                f"{times[~np.isfinite(values)][0]:.6g} s; give finite values"
            )
        return values

    def _between_ends(self, signal: Signal) -> Any:
        """Boundary values of a signal that has any, else a value inside its bounds."""
        first, last = self._ends(signal)
        if first is None and last is None:
            return self.before.get(signal.name, _nearest_to(0.0, signal))
        return (first if first is not None else last, last if last is not None else first)

    def _ends(self, signal: Signal) -> tuple[float | None, float | None]:
        """Boundary values of a signal, None where it has none."""
        key = self.phase.name, signal.name
        initial, final = self.parameters.initial_values, self.parameters.final_values
        return (
            _boundary_value(self.phase.initial.get(signal), initial.get(key)),
            _boundary_value(self.phase.final.get(signal), final.get(key)),
        )


@dataclass(frozen=True, eq=False, repr=False)
class _Overlay:
    """A trajectory, and the stated guess of the signals that it lacks."""

    stated: StatedGuess
    known: PhaseTrajectory

    @property
    def start(self) -> float:
        return float(self.known.start)

    @property
    def end(self) -> float:
        return float(self.known.end)

    def at_fractions(self, fractions: Array) -> Mapping[str, Array]:
        return {**self.known.at_fractions(fractions), **self.stated.at_fractions(fractions)}


def _boundary_value(stated: Any, values: tuple[float, float] | None) -> float | None:
    """A boundary value, or the mean of its finite limits; None if there is none.

    Parameters
    ----------
    stated : number, expression or pair of these
    values : (lower, upper) at the values of the constants
    """
    if values is None:
        return None
    if isinstance(stated, tuple):
        finite = [float(v) for v in stated if isinstance(v, Real) and math.isfinite(v)]
        return sum(finite) / len(finite) if finite else None
    return values[0]


def _unknown_guess(unknown: Unknown) -> float:
    """The stated guess of an unknown, else the middle of its bounds."""
    if unknown.guess is not None:
        return float(unknown.guess)
    lower, upper = _numbers(unknown)
    if math.isfinite(lower) and math.isfinite(upper):
        return 0.5 * (lower + upper)
    return _nearest_to(0.0, unknown)


def _nearest_to(value: float, symbol: Signal | Unknown) -> float:
    """The number within the bounds of a symbol that is nearest to a value."""
    lower, upper = _numbers(symbol)
    return float(min(max(value, lower), upper))


def _numbers(symbol: Signal | Unknown) -> tuple[float, float]:
    """Bounds that are plain numbers; expressions of constants count as none."""
    lower = float(symbol.lower) if isinstance(symbol.lower, Real) else -math.inf
    upper = float(symbol.upper) if isinstance(symbol.upper, Real) else math.inf
    return lower, upper


def _evaluated(given: Any, fractions: Array, times: Array, what: str) -> Array:
    """A guess in any of the forms that a statement may give, at times (m,)."""
    if isinstance(given, ByFraction):
        return _evaluated(given.values, fractions, fractions, f"{what} by fraction")
    if callable(given):
        return _called(given, times, what)
    try:
        if isinstance(given, Real):
            return np.full(times.shape, float(given))
        first, second = (np.asarray(part, dtype=float) for part in given)
    except (TypeError, ValueError):
        raise StatementError(
            f"{what} is {given!r}; give a number, a pair (first, last), a function of time or a "
            "pair of arrays (times, values)"
        ) from None

    if first.ndim == 0 and second.ndim == 0:
        return np.asarray(first + fractions * (second - first))
    if first.shape != second.shape or first.ndim != 1:
        raise StatementError(
            f"{what} is a table of {first.size} times and {second.size} values; it needs as many "
            "values as times: give (times, values), two arrays of the same length"
        )
    if np.any(np.diff(first) <= 0):
        raise StatementError(
            f"{what} needs increasing times, but {_step_back(first)}; sort the table"
        )
    return np.interp(times, first, second)


def _step_back(times: Array) -> str:
    """The first time of a table that is not above the one before it."""
    place = int(np.argmax(np.diff(times) <= 0))
    return f"{times[place + 1]:.6g} s follows {times[place]:.6g} s"


def _called(function: Any, times: Array, what: str) -> Array:
    """The values of a guess that is a function of time."""
    try:
        values = np.asarray(function(times), dtype=float)
    except Exception as error:  # whatever the user's function may raise
        raise StatementError(
            f"{what} is a function that fails on an array of times ({type(error).__name__}: "
            f"{error}); write it with NumPy functions, which take arrays"
        ) from error
    if values.shape not in ((), times.shape):
        raise StatementError(
            f"{what} is a function that returns shape {values.shape} for times of shape "
            f"{times.shape}; return one value for each time"
        )
    return np.broadcast_to(values, times.shape).copy()
