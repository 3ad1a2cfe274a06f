"""The statement of a problem with a slack for each limit that may give way.

Signals and unknowns lose their limits, which become bounds. The sum of all slacks, each in units of
the size of what it relaxes, is minimised.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import casadi as ca
import numpy as np

from ocp.errors import StatementError
from ocp.mesh.initial_guess import InitialGuess
from ocp.problem.bounds import Bound
from ocp.problem.functionals import Functional
from ocp.problem.phase import Phase, kept_alive
from ocp.problem.problem import Problem
from ocp.problem.symbols import Control, Signal, Symbol, Unknown, is_limited, resolve
from ocp.scaling.scales import Scales

Side = Literal["lower", "upper"]

# More weight from slack to slack, so that one of several equals gives way.
_TIE = 1e-3

# Price of a control's mean square in its size, without which nothing determines the motion.
_PRICE = 1e-7

_GUESS_SAMPLES = 201  # of a phase, by which the guess is handed on


@dataclass(frozen=True, eq=False, repr=False)
class LimitSlack:
    """The unknown that moves one limit, and where.

    Attributes
    ----------
    path : expressions by phase, for a limit along phases.
    end : phase and index of the breakpoint, for a boundary value.
    """

    name: str
    side: Side
    limit: Any
    unit: str
    size: float
    unknown: Unknown
    path: dict[str, Any] = field(default_factory=dict)
    end: tuple[str, int] | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Loosening:
    """A statement on its way to one with slacks.

    Attributes
    ----------
    kept : names of limits that stay.
    together : names of bounds that have one slack for all phases.
    renamed : symbols without limits for those with.
    slacks : by name and side of the limit.
    """

    problem: Problem
    scales: Scales
    start: InitialGuess
    kept: Collection[str]
    together: Collection[str]
    renamed: dict[Any, Any] = field(default_factory=dict)
    slacks: dict[tuple[str, Side], LimitSlack] = field(default_factory=dict)

    def statement(self) -> Problem:
        """The rewritten problem; StatementError if nothing in it may give way."""
        problem = self.problem
        for symbol in problem.symbols:
            if isinstance(symbol, (Signal, Unknown)) and symbol.name not in self.kept:
                self.renamed[symbol] = self._unlimited(symbol)

        phases, bounds = {}, list[Bound]()
        for phase in problem.phases:
            phases[phase.name] = self._phase(phase)
            bounds += self._boundary_values(phase, phases[phase.name])
        for functional in problem.functionals:
            self.renamed[functional] = self._functional(functional, phases)

        for bound in problem.bounds:
            rewritten = replace(bound, expression=self._rewritten(bound.expression))
            bounds += self._loosened(rewritten, bound.scale or self.scales.bounds["", bound.name])
        for unknown in problem.unknowns:
            if unknown in self.renamed and has_limit(unknown):
                bounds += self._loosened(
                    self._own_bound(unknown), self.scales.unknowns[unknown.name]
                )
        links = [replace(b, expression=self._rewritten(b.expression)) for b in problem.links]

        if not self.slacks:
            raise StatementError(f"all limits of '{problem.name}' are in keep; remove at least one")
        cost = sum(
            (1.0 + _TIE * i) * s.unknown / s.size
            for i, s in enumerate(reversed(self.slacks.values()))
        )
        return Problem(
            problem.name,
            list(phases.values()),
            minimise=cost + self._effort(phases.values()),
            bounds=bounds,
            links=links,
        )

    def _unlimited(self, symbol: Signal | Unknown) -> Symbol:
        """The same symbol without limits."""
        if isinstance(symbol, Unknown):
            return Unknown(
                symbol.name,
                symbol.unit,
                guess=self.start.unknowns[symbol.name],
                scale=self.scales.unknowns[symbol.name],
            )
        scale = self.scales.signals[symbol.name]
        if isinstance(symbol, Control):
            return Control(symbol.name, symbol.unit, scale=scale, piecewise="constant")
        return type(symbol)(symbol.name, symbol.unit, scale=scale)

    def _rewritten(self, expression: Any) -> ca.SX:
        """An expression of the symbols that took the place of those with limits."""
        old = ca.vertcat(*[s.symbol for s in self.renamed], ca.SX(0, 1))
        new = ca.vertcat(*[s.symbol for s in self.renamed.values()], ca.SX(0, 1))
        return ca.substitute(ca.SX(expression), old, new)

    def _own_bound(self, symbol: Signal | Unknown) -> Bound:
        """The limits of a symbol as a bound of what took its place."""
        return Bound(symbol.name, self.renamed[symbol], symbol.unit, symbol.lower, symbol.upper)

    def _loosened(
        self, bound: Bound, size: float, phase: str = "", end: tuple[str, int] | None = None
    ) -> Iterator[Bound]:
        """The bound of a rewritten expression with a slack for each finite side."""
        if bound.name in self.kept:
            yield bound
            return

        moved = bound.expression
        sides: tuple[tuple[Side, Any, float], ...]
        sides = ("lower", bound.lower, 1.0), ("upper", bound.upper, -1.0)
        for side, limit, sign in sides:
            if not is_limited(limit):
                continue

            # the slack is noted with the phases in which it is looked for
            slack = self._slack(bound, side, limit, size, end)
            if phase:
                slack.path[phase] = bound.expression

            step = sign * slack.unknown
            moved = moved + step
            if not bound.is_equation:
                lower, upper = (limit, math.inf) if side == "lower" else (-math.inf, limit)
                yield Bound(
                    f"{bound.name} {side}",
                    bound.expression + step,
                    bound.unit,
                    lower=lower,
                    upper=upper,
                    scale=size,
                )

        # an equation stays one, with a slack to either side
        if bound.is_equation:
            yield replace(bound, expression=moved, scale=size)

    def _slack(
        self, bound: Bound, side: Side, limit: Any, size: float, end: tuple[str, int] | None
    ) -> LimitSlack:
        """The slack of one side of a limit, the same one wherever the limit has that name."""
        key = bound.name, side
        if key not in self.slacks:
            name = f"slack of {bound.name} {side}"
            unknown = Unknown(name, bound.unit, lower=0.0, guess=0.0, scale=size)
            self.slacks[key] = LimitSlack(
                bound.name, side, limit, bound.unit, size, unknown, end=end
            )
        return self.slacks[key]

    def _phase(self, phase: Phase) -> Phase:
        """A phase whose limits have slacks; of its boundary values only those to keep."""
        renamed, bounds = self.renamed, list[Bound]()
        for bound in phase.bounds:
            rewritten = replace(bound, expression=self._rewritten(bound.expression))
            if bound.is_equation:
                bounds.append(rewritten)
                continue
            size = bound.scale or self.scales.bounds[phase.name, bound.name]
            single = phase_name(phase, bound)
            name = bound.name if bound.name in self.together else single
            bounds += self._loosened(replace(rewritten, name=name), size, phase.name)

        signals = self.problem.signals[phase.name]
        for signal in signals:
            if signal in renamed and has_limit(signal):
                size = self.scales.signals[signal.name]
                bounds += self._loosened(self._own_bound(signal), size, phase.name)

        initial, final = (
            {
                renamed.get(state, state): value
                for state, value in values.items()
                if end_name(phase, state, what) in self.kept
            }
            for what, values in (("initial", phase.initial), ("final", phase.final))
        )
        guess = self.start.phases[phase.name]
        fractions = np.linspace(0.0, 1.0, _GUESS_SAMPLES)
        times = guess.start + fractions * (guess.end - guess.start)
        values = guess.at_fractions(fractions)
        return Phase(
            phase.name,
            {renamed.get(s, s): self._rewritten(rate) for s, rate in phase.dynamics.items()},
            initial=initial,
            final=final,
            start=phase.start,
            end=phase.end,
            bounds=bounds,
            guess={renamed.get(s, s): (times, values[s.name]) for s in signals},
            breakpoints=phase.breakpoints,
        )

    def _boundary_values(self, phase: Phase, rewritten: Phase) -> Iterator[Bound]:
        """Boundary values as bounds of the problem."""
        for what, values, value_at, end in (
            ("initial", phase.initial, rewritten.at_start, 0),
            ("final", phase.final, rewritten.at_end, -1),
        ):
            for state, value in values.items():
                name = end_name(phase, state, what)
                if name not in self.kept:
                    lower, upper = value if isinstance(value, tuple) else (value, value)
                    expression = value_at(self.renamed.get(state, state))
                    bound = Bound(name, expression, state.unit, lower, upper)
                    size = self.scales.signals[state.name]
                    yield from self._loosened(bound, size, end=(phase.name, end))

    def _functional(self, functional: Functional, phases: Mapping[str, Phase]) -> Functional:
        """The functional of the rewritten phases."""
        pieces = tuple((name, self._rewritten(e)) for name, e in functional.pieces)
        symbols = dict.fromkeys(s for _, e in pieces for s in resolve(e, functional.name))
        rewritten = replace(functional, pieces=pieces, symbols=tuple(symbols))
        return kept_alive(rewritten, [phases[functional.phase]])

    def _effort(self, phases: Collection[Phase]) -> ca.SX:
        """A very small price of the controls."""
        total = ca.SX(0)
        for phase in phases:
            for control in (s for s in phase.guess if isinstance(s, Control)):
                size = self.scales.signals[control.name]
                total += _PRICE * phase.integral((control / size) ** 2) / self.scales.time
        return total


class LimitNames:
    """The names of all limits of a problem that may give way.

    Attributes
    ----------
    names : of single limits.
    common : names of bounds, which stand for those of all phases.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        limited = (Signal, Unknown)
        self.names = {s.name for s in problem.symbols if isinstance(s, limited) and has_limit(s)}
        self.names |= {b.name for b in problem.bounds}

        self._of_phases: dict[str, set[str]] = {}
        for phase in problem.phases:
            for bound in phase.bounds:
                if not bound.is_equation:
                    name = phase_name(phase, bound)
                    self._of_phases.setdefault(bound.name, set()).add(name)
                    self.names.add(name)
            for what, values in (("initial", phase.initial), ("final", phase.final)):
                self.names |= {end_name(phase, state, what) for state in values}
        self.common = frozenset(self._of_phases) - self.names

    def each(self, names: Collection[str]) -> set[str]:
        """Names of single limits for names that may stand for several."""
        return {single for name in names for single in self._single(name)}

    def _single(self, name: str) -> set[str]:
        return self._of_phases[name] if name in self.common else {name}

    def check(self, names: Collection[str]) -> None:
        """StatementError unless there are limits of these names."""
        for name in names:
            if name not in self.names and name not in self.common:
                listed = ", ".join(f"'{n}'" for n in sorted(self.names))
                raise StatementError(
                    f"'{self.problem.name}' has no limit '{name}'; its limits are {listed}"
                )


def has_limit(symbol: Signal | Unknown) -> bool:
    """Whether a signal or an unknown is limited."""
    return is_limited(symbol.lower, symbol.upper)


def phase_name(phase: Phase, bound: Bound) -> str:
    """The name of a bound of a phase."""
    return f"{phase.name}: {bound.name}"


def end_name(phase: Phase, state: Symbol, what: str) -> str:
    """The name of an "initial" or "final" value."""
    return f"{phase.name}: {state.name} {what}"
