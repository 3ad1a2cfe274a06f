"""Where a solve starts: the user's guess, or another trajectory, seen the same way."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ocp.errors import StatementError
from ocp.mesh.trajectory import Trajectory
from ocp.problem.statement import Phase, Problem
from ocp.problem.symbols import Algebraic, Between, Control, Signal, is_number, is_real

Array = NDArray[np.float64]


class PhaseStart(Protocol):
    """What a guess knows of one phase."""

    @property
    def start(self) -> float: ...

    @property
    def end(self) -> float: ...

    def at_fractions(self, fractions: Array) -> Mapping[str, Array]: ...


@dataclass(frozen=True, eq=False)
class StatedGuess:
    """The guess in the statement of a phase; a signal left out joins its boundary values."""

    phase: Phase
    signals: tuple[Signal, ...]
    constants: Mapping[str, float]

    @property
    def start(self) -> float:
        """Initial time [s]."""
        return _instant(self.phase.start)

    @property
    def end(self) -> float:
        """Final time [s]."""
        return max(_instant(self.phase.end), self.start + 1e-6 * (1.0 + abs(self.start)))

    def at_fractions(self, fractions: Array) -> Mapping[str, Array]:
        """Signals by name at fractions of the phase."""
        times = self.start + fractions * (self.end - self.start)
        return {s.name: self._values(s, fractions, times) for s in self.signals}

    def _values(self, signal: Signal, fractions: Array, times: Array) -> Array:
        given = self.phase.guess.get(signal, self._between_ends(signal))
        values = _evaluate(given, fractions, times, f"the guess of '{signal.name}'")
        if not np.all(np.isfinite(values)):
            raise StatementError(
                f"the guess of '{signal.name}' in phase '{self.phase.name}' is not finite at "
                f"{times[~np.isfinite(values)][0]:.6g} s; give finite values"
            )
        return values

    def _between_ends(self, signal: Signal) -> Any:
        first = _known(self.phase.initial.get(signal), self.constants)
        last = _known(self.phase.final.get(signal), self.constants)
        if first is None and last is None:
            return _inside(signal)
        return (first if first is not None else last, last if last is not None else first)


def _instant(value: float | Between) -> float:
    return value.start if isinstance(value, Between) else float(value)


def _known(value: Any, constants: Mapping[str, float]) -> float | None:
    if value is None:
        return None
    if isinstance(value, tuple):
        finite = [float(v) for v in value if is_number(v) and math.isfinite(v)]
        return sum(finite) / len(finite) if finite else None
    return evaluate_limit(value, constants)


def _inside(signal: Signal) -> float:
    lower = signal.lower if is_number(signal.lower) else -math.inf
    upper = signal.upper if is_number(signal.upper) else math.inf
    return float(min(max(0.0, lower), upper))


def _evaluate(given: Any, fractions: Array, times: Array, what: str) -> Array:
    if callable(given):
        return np.broadcast_to(np.asarray(given(times), dtype=float), times.shape).copy()
    try:
        if is_real(given):
            return np.full(times.shape, float(given))
        first, second = (np.asarray(part, dtype=float) for part in given)
    except (TypeError, ValueError) as error:
        raise StatementError(
            f"{what} is {given!r}; give a number, a pair (first, last), a function of time or a "
            "pair of arrays (times, values)"
        ) from error
    if first.ndim == 0 and second.ndim == 0:
        return np.asarray(first + fractions * (second - first))
    if first.shape != second.shape or np.any(np.diff(first) <= 0):
        raise StatementError(f"{what} needs as many values as times, and increasing times")
    return np.interp(times, first, second)


def evaluate_limit(value: Any, constants: Mapping[str, float]) -> float:
    """A bound or boundary value as a number."""
    if is_number(value):
        return float(value)
    import casadi as ca

    from ocp.problem.symbols import resolve, scalar

    sx = scalar(value, "a bound")
    symbols = resolve(sx, "a bound")
    function = ca.Function("limit", [s.symbol for s in symbols], [sx])
    return float(function(*[constants[s.name] for s in symbols]))


@dataclass(frozen=True, eq=False)
class Start:
    """A start for every phase and unknown of a problem."""

    phases: Mapping[str, PhaseStart]
    unknowns: Mapping[str, float]


def start_of(
    problem: Problem, constants: Mapping[str, float], guess: Trajectory | None = None
) -> Start:
    """The start that a problem states, overlaid by another trajectory where one is given."""
    known = {phase.name: phase for phase in guess.phases} if guess else {}
    phases: dict[str, PhaseStart] = {}
    for phase in problem.phases:
        signals = signals_of(problem, phase)
        stated = StatedGuess(phase, signals, constants)
        if phase.name in known:
            phases[phase.name] = _Overlay(stated, known[phase.name])
        else:
            phases[phase.name] = stated
    unknowns = {u.name: _unknown_start(u) for u in problem.unknowns}
    if guess:
        unknowns.update({k: v for k, v in guess.unknowns.items() if k in unknowns})
    return Start(phases, unknowns)


def signals_of(problem: Problem, phase: Phase) -> tuple[Signal, ...]:
    """States, controls and algebraic signals of a phase."""
    return (
        *phase.states,
        *problem.signals_of(phase, Control),
        *problem.signals_of(phase, Algebraic),
    )


def _unknown_start(unknown: Any) -> float:
    if unknown.guess is not None:
        return float(unknown.guess)
    lower = unknown.lower if is_number(unknown.lower) else -math.inf
    upper = unknown.upper if is_number(unknown.upper) else math.inf
    if math.isfinite(lower) and math.isfinite(upper):
        return 0.5 * (lower + upper)
    return float(min(max(0.0, lower), upper))


@dataclass(frozen=True, eq=False)
class _Overlay:
    stated: StatedGuess
    known: Any

    @property
    def start(self) -> float:
        return float(self.known.start)

    @property
    def end(self) -> float:
        return float(self.known.end)

    def at_fractions(self, fractions: Array) -> Mapping[str, Array]:
        return {**self.stated.at_fractions(fractions), **self.known.at_fractions(fractions)}
