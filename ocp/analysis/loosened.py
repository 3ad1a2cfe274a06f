"""A statement whose named limits may give way: slacks in place of limits.

See `ocp.analysis.relaxation`.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import casadi as ca
import numpy as np

from ocp.mesh.initial_guess import Start, signals_of
from ocp.problem.statement import Phase, Problem
from ocp.problem.symbols import Control, Signal, Symbol, Unknown, is_number, resolve
from ocp.problem.terms import Bound, Functional
from ocp.transcription.scaling import Scales

Side = Literal["lower", "upper"]
_PRICE = 1e-7  # of the mean square of a control in its size


@dataclass(frozen=True, eq=False)
class Slack:
    """The unknown that moves one limit, and where: pieces of path, or one of a phase's ends."""

    name: str
    side: Side
    limit: Any
    unit: str
    size: float
    unknown: Unknown
    path: dict[str, Any] = field(default_factory=dict)
    end: tuple[str, int] | None = None


@dataclass(frozen=True, eq=False)
class Elastic:
    """A statement being rewritten: symbols without limits for those with, and slacks."""

    scales: Scales
    keep: Collection[str]
    renamed: dict[Symbol, Symbol] = field(default_factory=dict)
    slacks: dict[tuple[str, Side], Slack] = field(default_factory=dict)

    def rewritten(self, expression: Any) -> Any:
        """An expression of the symbols that took the place of those with limits."""
        old = ca.vertcat(*[s.symbol for s in self.renamed], ca.SX(0, 1))
        new = ca.vertcat(*[s.symbol for s in self.renamed.values()], ca.SX(0, 1))
        return ca.substitute(ca.SX(expression), old, new)

    def loosened(
        self, bound: Bound, size: float, phase: str = "", end: tuple[str, int] | None = None
    ) -> Iterator[Bound]:
        """The bound of a rewritten expression with a slack for each finite side."""
        if bound.name in self.keep:
            yield bound
            return
        moved = bound.expression
        sides: tuple[tuple[Side, Any, float], ...]
        sides = ("lower", bound.lower, 1.0), ("upper", bound.upper, -1.0)
        for side, limit, sign in sides:
            if is_number(limit) and math.isinf(limit):
                continue
            name = f"slack of {bound.name} {side}"
            unknown = Unknown(name, bound.unit, lower=0.0, guess=0.0, scale=size)
            slack = self.slacks.setdefault(
                (bound.name, side),
                Slack(bound.name, side, limit, bound.unit, size, unknown, end=end),
            )
            if phase:
                slack.path[phase] = bound.expression
            moved = moved + sign * slack.unknown
            if not bound.is_equation:
                yield Bound(f"{bound.name} {side}", bound.expression + sign * slack.unknown,
                            bound.unit, **{side: limit}, scale=size)  # fmt: skip
        if bound.is_equation:
            yield replace(bound, expression=moved, scale=size)


@dataclass(frozen=True, eq=False)
class Loosened:
    """The parts of the rewritten statement."""

    phases: list[Phase]
    bounds: list[Bound]
    links: list[Bound]


def loosened(problem: Problem, elastic: Elastic, start: Start) -> Loosened:
    """The statement with slacks in place of hard limits."""
    scales = elastic.scales
    bounds: list[Bound] = []
    for symbol in problem.symbols:
        if isinstance(symbol, (Signal, Unknown)) and symbol.name not in elastic.keep:
            elastic.renamed[symbol] = _unlimited(symbol, scales, start)
    phases = []
    for phase in problem.phases:
        made = _phase(problem, phase, elastic, start)
        bounds += _ends(phase, made, elastic)
        phases.append(made)
    named = {phase.name: phase for phase in phases}
    for f in problem.functionals:
        elastic.renamed[f] = _functional(f, elastic, named)
    for b in problem.bounds:
        own = replace(b, expression=elastic.rewritten(b.expression))
        bounds += elastic.loosened(own, b.scale or scales.bounds["", b.name])
    for u in problem.unknowns:
        if u in elastic.renamed and is_limited(u):
            own = Bound(u.name, elastic.renamed[u], u.unit, u.lower, u.upper)
            bounds += elastic.loosened(own, scales.unknowns[u.name])
    links = [replace(b, expression=elastic.rewritten(b.expression)) for b in problem.links]
    return Loosened(phases, bounds, links)


def effort(statement: Loosened, elastic: Elastic) -> ca.SX:
    """A very small price of the controls, without which nothing determines the motion."""
    total = ca.SX(0)
    for phase in statement.phases:
        controls = [s for s in phase.guess if isinstance(s, Control)]
        for control in controls:
            size = elastic.scales.signals[control.name]
            total += _PRICE * phase.integral((control / size) ** 2) / elastic.scales.time
    return total


def _unlimited(symbol: Signal | Unknown, scales: Scales, start: Start) -> Symbol:
    """The same symbol without limits."""
    if isinstance(symbol, Unknown):
        guess, scale = start.unknowns[symbol.name], scales.unknowns[symbol.name]
        return Unknown(symbol.name, symbol.unit, guess=guess, scale=scale)
    scale = scales.signals[symbol.name]
    if isinstance(symbol, Control):
        return Control(symbol.name, symbol.unit, scale=scale, shape="constant")
    return type(symbol)(symbol.name, symbol.unit, scale=scale)


def is_limited(symbol: Any) -> bool:
    """Whether a signal or unknown has a limit."""
    return not all(is_number(v) and math.isinf(v) for v in (symbol.lower, symbol.upper))


def _phase(problem: Problem, phase: Phase, elastic: Elastic, start: Start) -> Phase:
    """A phase whose limits have slacks; of its boundary values only those to keep."""
    renamed, scales, bounds = elastic.renamed, elastic.scales, []
    signals = signals_of(problem, phase)
    for b in phase.bounds:
        own = replace(b, expression=elastic.rewritten(b.expression))
        if b.is_equation:
            bounds.append(own)
            continue
        size = b.scale or scales.bounds[phase.name, b.name]
        bounds += elastic.loosened(replace(own, name=f"{phase.name}: {b.name}"), size, phase.name)
    for s in signals:
        if s in renamed and is_limited(s):
            own = Bound(s.name, renamed[s], s.unit, s.lower, s.upper)
            bounds += elastic.loosened(own, scales.signals[s.name], phase.name)
    held = [
        {renamed.get(s, s): v for s, v in values.items()
         if f"{phase.name}: {s.name} {what}" in elastic.keep}
        for what, values in (("initial", phase.initial), ("final", phase.final))
    ]  # fmt: skip
    fractions = np.linspace(0.0, 1.0, 201)
    own_start = start.phases[phase.name]
    times = own_start.start + fractions * (own_start.end - own_start.start)
    table = own_start.at_fractions(fractions)
    return Phase(
        phase.name, {renamed.get(s, s): elastic.rewritten(e) for s, e in phase.dynamics.items()},
        held[0], held[1], phase.start, phase.end, bounds,
        {renamed.get(s, s): (times, table[s.name]) for s in signals},
    )  # fmt: skip


def _ends(phase: Phase, made: Phase, elastic: Elastic) -> Iterator[Bound]:
    """Boundary values as bounds of the problem."""
    for what, values, at, end in (("initial", phase.initial, made.at_start, 0),
                                  ("final", phase.final, made.at_end, -1)):  # fmt: skip
        for state, value in values.items():
            name = f"{phase.name}: {state.name} {what}"
            if name not in elastic.keep:
                low, high = value if isinstance(value, tuple) else (value, value)
                own = Bound(name, at(elastic.renamed.get(state, state)), state.unit, low, high)
                size = elastic.scales.signals[state.name]
                yield from elastic.loosened(own, size, end=(phase.name, end))


def _functional(f: Functional, elastic: Elastic, phases: Mapping[str, Phase]) -> Functional:
    pieces = tuple((name, elastic.rewritten(e)) for name, e in f.pieces)
    symbols = tuple(dict.fromkeys(s for _, e in pieces for s in resolve(e, f.name)))
    made = Functional(f.name, f.unit, f.kind, pieces, f.at, f.absolute, symbols)
    phases[pieces[0][0]]._functionals.append(made)
    return made
