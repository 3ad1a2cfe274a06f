"""Where a solve starts: the guess, the times of its phases, and the mesh that can carry it.

The guess is the user's, or another trajectory, seen the same way.

Where a free time states no guess, the middle of its limits serves. Middles of phases that follow
each other need not be in order: three phases that meet anywhere between 0 and 5 s would all meet
at 2.5 s, and end at 1 s. Times without a guess are then spread evenly between the others.

A uniform mesh cannot carry a guess that waits for a long time and then moves within a few
intervals: between the points of the mesh the motion is lost, and the solver starts from something
else. There the intervals share out the way that the guess goes, in time and in its states.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from numbers import Real
from typing import Any, Protocol

import numpy as np

from ocp.arrays import ROUNDING, Array
from ocp.errors import StatementError
from ocp.mesh.mesh import PhaseMesh, distinct
from ocp.mesh.trajectory import PhaseTrajectory, Trajectory
from ocp.problem.instants import SAMPLES
from ocp.problem.parameters import Interval, Parameters
from ocp.problem.phase import Phase
from ocp.problem.problem import Problem
from ocp.problem.symbols import Between, ByFraction, Signal, State

# A guess that strays further from straight lines between the points, relative to its range, is one
# that the mesh cannot carry: a uniform mesh, and one that follows it.
_LOST = 0.1
_KEPT = 0.02
_TIMES_AS_MANY = (1, 2, 4)
_EVENLY = np.linspace(0.0, 1.0, SAMPLES)


def following(mesh: PhaseMesh, guess: PhaseGuess, states: Sequence[str]) -> PhaseMesh:
    """The mesh, or one of the same degree that carries the guess better.

    Parameters
    ----------
    mesh : PhaseMesh
        A uniform one.
    guess : PhaseGuess
    states : sequence of str
        Names of the signals that the mesh has to carry.
    """
    # states that move, relative to their ranges
    values = guess.at_fractions(_EVENLY)
    lines = [values[name] / np.ptp(values[name]) for name in states if np.ptp(values[name]) > 0.0]
    if _strays(mesh, lines) <= _LOST:
        return mesh

    # half of the intervals follow time, the others the states
    way = np.abs(np.diff(lines, axis=1)).sum(axis=0)
    passed = _EVENLY + np.concatenate([[0.0], np.cumsum(way) / way.sum()])
    for times in _TIMES_AS_MANY:
        shares = np.linspace(0.0, passed[-1], times * mesh.intervals + 1)
        points = np.interp(shares, passed, _EVENLY)
        points[-1] = 1.0
        finer = PhaseMesh(points, mesh.degrees[:1])
        if _strays(finer, lines) <= _KEPT:
            break
    return finer


def _strays(mesh: PhaseMesh, lines: Iterable[Array]) -> float:
    """How far the states are from straight lines between as many points as the mesh has."""
    degree = int(mesh.degrees[0])
    steps = np.diff(mesh.breakpoints)[:, None] * np.arange(degree) / degree
    points = np.append((mesh.breakpoints[:-1, None] + steps).ravel(), 1.0)
    strays = [np.interp(_EVENLY, points, np.interp(points, _EVENLY, line)) - line for line in lines]
    return max((float(np.abs(stray).max()) for stray in strays), default=0.0)


Ends = tuple[float, float]
Time = float | Between

# Factor by which drawn times are stretched or shortened at most, and the same of the part that
# a phase has of all.
_FASTER = 2.0
_SHARES = 4.0
_SHORTEST = 1e-6  # of the longest duration, that a phase keeps


def guessed_times(phases: Sequence[Phase]) -> dict[str, Ends]:
    """Initial and final time of each phase by name, where a solver starts [s]."""
    times: dict[str, Ends] = {}
    for chain in _chains(phases):
        stated = [chain[0].start, *(phase.end for phase in chain)]
        values = _in_order(stated)
        times |= {p.name: ends for p, ends in zip(chain, itertools.pairwise(values), strict=True)}
    return times


def knots_of(times: Mapping[str, Ends]) -> Array:
    """All times at which a phase begins or ends, in order."""
    return distinct(np.array([value for ends in times.values() for value in ends]))


def drawn_times(
    phases: Sequence[Phase], guessed: Mapping[str, Ends], random: np.random.Generator
) -> dict[str, Ends]:
    """Times about guessed ones, with other parts for each phase; known times stay.

    A free last time is guessed ones stretched, or anywhere within its limits, every other time. A
    free first time is anywhere within its limits as often, where both are finite.
    """
    knots = knots_of(guessed)
    stretch = float(np.exp(random.uniform(-1.0, 1.0) * np.log(_FASTER)))
    first = _anywhere(phases[0].start, float(knots[0]), random)
    end = first + stretch * float(knots[-1] - knots[0])
    last = _anywhere(phases[-1].end, end, random)
    weights = np.ones(knots.size - 1)
    if weights.size > 1:
        weights = np.exp(random.uniform(-1.0, 1.0, weights.size) * np.log(_SHARES))

    # known times stay, and what is between two of these has other parts
    known = {
        value
        for phase in phases
        for time, value in zip((phase.start, phase.end), guessed[phase.name], strict=True)
        if not isinstance(time, Between)
    }
    targets, stays = knots.copy(), np.array([float(knot) in known for knot in knots])
    targets[[0, -1]] = np.where(stays[[0, -1]], knots[[0, -1]], [first, last])
    held = stays | np.isin(np.arange(knots.size), [0, knots.size - 1])
    passed = np.concatenate([[0.0], np.cumsum(np.diff(knots) * weights)])
    moved = np.interp(passed, passed[held], np.maximum.accumulate(targets[held]))
    by_knot = dict(zip(knots.tolist(), moved.tolist(), strict=True))
    shortest = _SHORTEST * float(knots[-1] - knots[0])
    return {phase.name: _ends(phase, guessed[phase.name], by_knot, shortest) for phase in phases}


def _anywhere(time: Time, otherwise: float, random: np.random.Generator) -> float:
    """A free time anywhere within finite limits, every other time, else what is given."""
    if not isinstance(time, Between) or not math.isfinite(time.upper - time.lower):
        return otherwise
    drawn, coin = random.uniform(time.lower, time.upper), random.random()
    return float(drawn) if coin < 0.5 else otherwise


def meet_freely(phases: Sequence[Phase]) -> bool:
    """Whether a phase begins at a free time after another one."""
    return any(isinstance(phase.start, Between) for phase in phases[1:])


def _ends(phase: Phase, ends: Ends, moved: Mapping[float, float], shortest: float) -> Ends:
    """Moved times of a phase within its limits, the last one after the first one."""
    start, end = (
        min(max(moved[value], time.lower), time.upper) if isinstance(time, Between) else value
        for time, value in zip((phase.start, phase.end), ends, strict=True)
    )
    return start, max(end, start + shortest)


def _chains(phases: Sequence[Phase]) -> Iterator[list[Phase]]:
    """Phases in runs in which each begins when the one before it ends."""
    chain = list(phases[:1])
    for before, phase in itertools.pairwise(phases):
        if before.end != phase.start:
            yield chain
            chain = []
        chain.append(phase)
    yield chain


def _in_order(stated: Sequence[Time]) -> list[float]:
    """Guesses of times that follow each other; those that say nothing make room for the others."""
    values = [time.start if isinstance(time, Between) else float(time) for time in stated]
    if all(a < b for a, b in itertools.pairwise(values)):
        return values
    says = [not isinstance(time, Between) or time.guess is not None for time in stated]
    said = [value for value, one in zip(values, says, strict=True) if one]
    first, last = stated[0], stated[-1]
    if not says[0] and isinstance(first, Between) and said and values[0] >= said[0]:
        values[0] = 0.5 * (first.lower + said[0])
    if not says[-1] and isinstance(last, Between) and said and values[-1] <= said[-1]:
        values[-1] = 0.5 * (said[-1] + last.upper)

    anchors = [0, *(k for k in range(1, len(values) - 1) if says[k]), len(values) - 1]
    spread = np.interp(np.arange(len(values)), anchors, [values[k] for k in anchors])
    return [
        min(max(float(value), time.lower), time.upper) if isinstance(time, Between) else value
        for time, value in zip(stated, spread.tolist(), strict=True)
    ]


# Fractions of a phase at which a guess is looked at
FRACTIONS = np.linspace(0.0, 1.0, 17)


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

    unknowns = _guessed_unknowns(problem, parameters)
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
        values = guess.at_fractions(FRACTIONS)
        for state in guess.phase.states:
            line = np.interp(FRACTIONS, FRACTIONS[[0, -1]], values[state.name][[0, -1]])
            if np.abs(values[state.name] - line).max() > ROUNDING * np.abs(line).max():
                return False
    return True


def guess_by_lines(problem: Problem, parameters: Parameters) -> InitialGuess:
    """The guess of a problem whose phases state none: its times and unknowns are kept."""
    phases = _stated_guesses(problem, parameters, left_aside=True)
    return InitialGuess(phases, _guessed_unknowns(problem, parameters))


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
            state.name: _nearest_to(value, parameters.signal_limits[state.name])
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
    return bool(np.ptp(guess.at_fractions(FRACTIONS)[state.name]) == 0.0)


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
            limits = self.parameters.signal_limits[signal.name]
            return self.before.get(signal.name, _nearest_to(0.0, limits))
        return (first if first is not None else last, last if last is not None else first)

    def _ends(self, signal: Signal) -> tuple[float | None, float | None]:
        """Boundary values of a signal, None where it has none."""
        key = self.phase.name, signal.name
        values = self.parameters.initial_values.get(key), self.parameters.final_values.get(key)
        first, last = (_mean(limits) if limits is not None else None for limits in values)
        return first, last


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


def _mean(limits: Interval) -> float | None:
    """The mean of finite limits, a boundary value where they are one; None if there is none."""
    finite = [limit for limit in limits if math.isfinite(limit)]
    return sum(finite) / len(finite) if finite else None


def _guessed_unknowns(problem: Problem, parameters: Parameters) -> dict[str, float]:
    """The stated guess of each unknown, else the middle of its bounds."""
    guessed = {}
    for unknown in problem.unknowns:
        lower, upper = parameters.unknown_limits[unknown.name]
        middle = 0.5 * (lower + upper)
        if unknown.guess is not None:
            guessed[unknown.name] = float(unknown.guess)
        else:
            bounded = math.isfinite(upper - lower)
            guessed[unknown.name] = middle if bounded else _nearest_to(0.0, (lower, upper))
    return guessed


def _nearest_to(value: float, limits: Interval) -> float:
    """The number within limits that is nearest to a value."""
    return float(min(max(value, limits[0]), limits[1]))


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
