"""Automatic scaling: typical sizes of signals, rows and the objective.

A signal's size comes from its statement, else from its guess and boundary values, else from its
bounds, else along the dynamics (a derivative is about the size of its state over the duration).
An expression's size is how far it moves when its signals move by their sizes around the guess.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.mesh.initial_guess import Start, evaluate_limit, signals_of
from ocp.problem.statement import Phase, Problem
from ocp.problem.symbols import Signal, Symbol, resolve, time
from ocp.problem.terms import Functional

Array = NDArray[np.float64]
_FRACTIONS = np.linspace(0.0, 1.0, 17)
_STEP = 0.5
_OFF = 3.0
_SOLVED = "value on an earlier mesh"


@dataclass(frozen=True)
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


def scales_of(problem: Problem, start: Start, constants: Mapping[str, float]) -> Scales:
    """Scales of a problem around a start."""
    signals, why = _signal_scales(problem, start, constants)
    reasons: dict[tuple[str, Any], str] = {("signal", name): text for name, text in why.items()}
    unknowns = {}
    for u in problem.unknowns:
        unknowns[u.name], reasons["unknown", u.name] = _chosen(
            u.scale, _size(start.unknowns[u.name]), "guess, or middle of its bounds")  # fmt: skip
    duration = max(s.end - s.start for s in start.phases.values())
    reasons["time", ""] = "longest duration of a phase in the guess"
    probe = {
        phase.name: _Probe(problem, phase, start, signals, unknowns, constants)
        for phase in problem.phases
    }
    bounds = {}
    for phase in problem.phases:
        for b in phase.bounds:
            key = phase.name, b.name
            bounds[key], reasons["bound", key] = _chosen(
                b.scale, *probe[phase.name].variation(b.expression))  # fmt: skip
    functionals = {}
    for f in problem.functionals:
        functionals[f], reasons["number", f] = _chosen(
            f.scale, *_functional_scale(f, probe, duration))  # fmt: skip
    for b in (*problem.bounds, *problem.links):
        bounds["", b.name], reasons["bound", ("", b.name)] = _chosen(
            b.scale, *_terminal_scale(b.expression, functionals, unknowns, constants))  # fmt: skip
    objective, reasons["objective", ""] = _chosen(
        problem.scale, *_terminal_scale(problem.objective, functionals, unknowns, constants)
    )
    return Scales(signals, unknowns, bounds, functionals, duration, objective, reasons)


def resized(scales: Scales, objective: float) -> Scales:
    """Scales with the objective's size taken from a solved value, where the guess's was far off.

    Tolerances of the solver are relative to the scaled objective: where the guess costs many times
    the optimum, they would leave controls undetermined that cost little.  A stated size stays, and
    so does one that has been taken from a value before.
    """
    reason = scales.reasons.get(("objective", ""))
    size = max(abs(objective), 1e-3 * scales.objective)
    near = scales.objective / _OFF <= size <= _OFF * scales.objective
    if reason in ("stated", _SOLVED) or near or not math.isfinite(size):
        return scales
    return replace(scales, objective=size, reasons={**scales.reasons, ("objective", ""): _SOLVED})


def _chosen(stated: float | None, found: float, reason: str) -> tuple[float, str]:
    """A stated size, else one that was found, else 1; with its reason."""
    if stated is not None:
        return stated, "stated"
    if found > 0 and math.isfinite(found):
        return found, reason
    return 1.0, "nothing known"


def _size(values: Any) -> float:
    finite = np.abs(np.asarray(values, dtype=float))
    finite = finite[np.isfinite(finite)]
    return float(finite.max()) if finite.size else 0.0


def _signal_scales(
    problem: Problem, start: Start, constants: Mapping[str, float]
) -> tuple[dict[str, float], dict[str, str]]:
    scales: dict[str, float] = {}
    reasons: dict[str, str] = {}
    for phase in problem.phases:
        values = start.phases[phase.name].at_fractions(_FRACTIONS)
        for signal in signals_of(problem, phase):
            size, reason = _own_scale(signal, phase, values[signal.name], constants)
            if size > scales.get(signal.name, 0.0):
                scales[signal.name], reasons[signal.name] = size, reason
    for phase in problem.phases:
        duration = start.phases[phase.name].end - start.phases[phase.name].start
        _along_dynamics(phase, duration, scales, reasons)
    for phase in problem.phases:
        for signal in signals_of(problem, phase):
            if signal.name not in scales:
                scales[signal.name], reasons[signal.name] = 1.0, "nothing known"
    return scales, reasons


def _own_scale(
    signal: Signal, phase: Phase, guess: Array, constants: Mapping[str, float]
) -> tuple[float, str]:
    if signal.scale is not None:
        return signal.scale, "stated"
    ends = [v.get(signal) for v in (phase.initial, phase.final)]
    numbers = [evaluate_limit(v, constants) for v in ends if v is not None and v is not False
               and not isinstance(v, tuple)]  # fmt: skip
    if max(_size(guess), _size(numbers)) > 0:
        inner, outer = (_size(guess), "guess"), (_size(numbers), "boundary values")
        return inner if inner[0] > outer[0] else outer
    limits = [evaluate_limit(v, constants) for v in (signal.lower, signal.upper)]
    size = _size(limits)
    return size, "bounds" if size > 0 else ""


def _along_dynamics(
    phase: Phase, duration: float, scales: dict[str, float], reasons: dict[str, str]
) -> None:
    """Pass sizes down and up chains of derivatives."""
    links = [
        (state.name, symbol.name)
        for state, rate in phase.dynamics.items()
        if rate.is_symbolic()
        for symbol in resolve(rate, "a derivative")
        if isinstance(symbol, Signal)
    ]
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
    """Evaluates expressions of one phase around its start."""

    def __init__(
        self, problem: Problem, phase: Phase, start: Start,
        scales: Mapping[str, float], unknowns: Mapping[str, float],
        constants: Mapping[str, float],
    ) -> None:  # fmt: skip
        own = start.phases[phase.name]
        values = own.at_fractions(_FRACTIONS)
        self.duration = own.end - own.start
        self.symbols: list[Symbol] = [*signals_of(problem, phase), *problem.unknowns]
        centre = [values[s.name] if isinstance(s, Signal)
                  else np.full(_FRACTIONS.size, start.unknowns[s.name])
                  for s in self.symbols]  # fmt: skip
        sizes = [scales[s.name] if isinstance(s, Signal) else unknowns[s.name]
                 for s in self.symbols]  # fmt: skip
        rows = [np.array(centre)]
        for i, size in enumerate(sizes):
            moved = np.array(centre)
            moved[i] += _STEP * size
            rows.append(moved)
        self.points = np.hstack(rows)
        self.times = np.tile(own.start + _FRACTIONS * self.duration, len(rows))
        self.constants = problem.constants
        self.values = [constants[c.name] for c in problem.constants]

    def _evaluate(self, expression: ca.SX) -> Array:
        inputs = [s.symbol for s in self.symbols]
        f = ca.Function(
            "probe", [ca.vertcat(*inputs), time.symbol, *[c.symbol for c in self.constants]],
            [expression],
        )  # fmt: skip
        out = f(self.points, self.times[None, :], *self.values)
        return out.full().reshape(-1, _FRACTIONS.size)

    def variation(self, expression: ca.SX) -> tuple[float, str]:
        """Largest change when one signal or unknown moves by its size, and which one."""
        values = self._evaluate(expression)
        moves = [_size((moved - values[0]) / _STEP) for moved in values[1:]]
        if not any(moves):
            return 0.0, ""
        worst = int(np.argmax(moves))
        return moves[worst], f"moves so far with '{self.symbols[worst].name}'"

    def size(self, expression: ca.SX) -> tuple[float, str]:
        """Largest value at the start, or the variation where that is next to nothing."""
        size, (variation, reason) = _size(self._evaluate(expression)[0]), self.variation(expression)
        return (size, "value at the guess") if size > 0.01 * variation else (variation, reason)


def _functional_scale(
    f: Functional, probes: Mapping[str, _Probe], duration: float
) -> tuple[float, str]:
    if f.kind in ("start time", "end time"):
        return duration, "longest duration of a phase in the guess"
    if f.kind == "integral":
        found = [(probes[n].size(e), probes[n].duration) for n, e in f.pieces]
        return max((size * span, f"{why}, times the duration") for (size, why), span in found)
    if f.kind == "peak":
        return max(probes[n].size(e) for n, e in f.pieces)
    return max(probes[n].variation(e) for n, e in f.pieces)


def _terminal_scale(
    expression: ca.SX,
    functionals: Mapping[Functional, float],
    unknowns: Mapping[str, float],
    constants: Mapping[str, float],
) -> tuple[float, str]:
    """How far a terminal expression moves when its numbers move by their sizes, and with which."""
    symbols = resolve(expression, "the objective")
    centre = [_terminal_value(s, functionals, unknowns, constants) for s in symbols]
    f = ca.Function("terminal", [s.symbol for s in symbols], [expression])
    base, moves = float(f(*centre)), []
    for i, symbol in enumerate(symbols):
        if isinstance(symbol, Functional) or symbol.name in unknowns:
            shifted = list(centre)
            shifted[i] *= 1.0 + _STEP
            change = abs(float(f(*shifted)) - base) / _STEP
            moves.append((change, f"moves so far with '{symbol.name}'"))
    return max([m for m in moves if math.isfinite(m[0])], default=(0.0, ""))


def _terminal_value(
    symbol: Symbol,
    functionals: Mapping[Functional, float],
    unknowns: Mapping[str, float],
    constants: Mapping[str, float],
) -> float:
    if isinstance(symbol, Functional):
        return functionals[symbol]
    return unknowns[symbol.name] if symbol.name in unknowns else constants[symbol.name]
