"""The smallest relaxation of a problem that no motion meets.

Every named limit gets slacks that may not be negative, and their sum, each in units of the size of
what it relaxes, is minimised: with this L1 penalty few limits give way rather than all a little.
Dynamics, links, times and equations along a phase stay as they are.  The names are those of
`ocp.sensitivity`.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import casadi as ca
import numpy as np

from ocp.errors import StatementError
from ocp.guess import Start, evaluate_limit, signals_of, start_of
from ocp.scaling import Scales, scales_of
from ocp.settings import Settings
from ocp.solution import Solution
from ocp.solve import solve
from ocp.statement import Phase, Problem
from ocp.symbols import Control, Signal, Symbol, Unknown, is_number, resolve
from ocp.terms import Bound, Functional

# one mesh, and controls that are constant in its intervals, where limits as rows hold between the
# points too: a motion that minimises nothing but slacks has no shape of its own to resolve
_SETTINGS = Settings(intervals=40, refine=False)
Side = Literal["lower", "upper"]
_NOTHING = 1e-6  # of its size, below which a slack is the solver's tolerance
_TIE = 1e-3  # more weight from slack to slack, so that one of several equals gives way
_PRICE = 1e-7  # of the mean square of a control in its size
_SAMPLES = 2001


@dataclass(frozen=True)
class Relaxed:
    """One limit that has to give way.

    Attributes
    ----------
    name, side : of the limit.
    phase, time : where the motion found makes use of it; "" and None for a number of all of it.
    limit, needed : as stated, and as it would have to be, in `unit`.
    """

    name: str
    side: Side
    phase: str
    time: float | None
    unit: str
    limit: float
    needed: float

    @property
    def amount(self) -> float:
        """By how much the limit would have to move."""
        return abs(self.needed - self.limit)

    def __str__(self) -> str:
        unit = "" if self.unit in ("", "1") else f" {self.unit}"
        where = f" (used in phase '{self.phase}' at {self.time:.4g} s)" if self.phase else ""
        return (f"'{self.name}' from {self.limit:.6g} to {self.needed:.6g}{unit}, by "
                f"{self.amount:.4g}{unit}{where}")  # fmt: skip


@dataclass(frozen=True)
class Relaxation:
    """What to relax, the least in sum, and a motion that then meets everything.

    Attributes
    ----------
    items : limits that have to give way, the largest part of its size first; none if feasible.
    total : weighted sum of the relaxations, each as a part of the size of what it relaxes.  Of
        several that are equal to a part in a thousand the first stated gives way.
    solution : a motion of the relaxed problem, which minimises the relaxation and nothing else;
        its signals go by name.
    """

    problem: str
    items: tuple[Relaxed, ...]
    total: float
    solution: Solution

    def __str__(self) -> str:
        if not self.items:
            return f"'{self.problem}' can be met as it is stated"
        listed = "; ".join(str(item) for item in self.items)
        doubt = "; ".join(self.solution.verification.reasons)
        return (f"'{self.problem}' can be met if these limits are changed: {listed}"
                f"{f' (not verified: {doubt})' if doubt else ''}")  # fmt: skip


@dataclass(frozen=True)
class _Slack:
    """The unknown that moves one limit, and where: pieces of path, or one of a phase's ends."""

    name: str
    side: Side
    limit: Any
    unit: str
    size: float
    unknown: Unknown
    path: dict[str, Any] = field(default_factory=dict)
    end: tuple[str, int] | None = None


@dataclass(frozen=True)
class _Elastic:
    """A statement being rewritten: symbols without limits for those with, and slacks."""

    scales: Scales
    keep: Collection[str]
    renamed: dict[Symbol, Symbol] = field(default_factory=dict)
    slacks: dict[tuple[str, Side], _Slack] = field(default_factory=dict)

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
                _Slack(bound.name, side, limit, bound.unit, size, unknown, end=end),
            )
            if phase:
                slack.path[phase] = bound.expression
            moved = moved + sign * slack.unknown
            if not bound.is_equation:
                yield Bound(f"{bound.name} {side}", bound.expression + sign * slack.unknown,
                            bound.unit, **{side: limit}, scale=size)  # fmt: skip
        if bound.is_equation:
            yield replace(bound, expression=moved, scale=size)


def relaxed(
    problem: Problem, *, keep: Collection[str] = (), weights: Mapping[str, float] | None = None,
    settings: Settings | None = None,
) -> Relaxation:  # fmt: skip
    """The smallest relaxation of a problem's limits that some motion meets.

    Parameters
    ----------
    keep : names of limits that must not give way, without "lower" or "upper": ``"x"`` for the
        bounds of a signal or unknown, ``"landing"`` for a bound of the problem,
        ``"flight: power"`` for one of a phase, ``"flight: x initial"`` for a boundary value.
    weights : of a limit's relaxation, by the same names; 1 where nothing is said.

    Raises
    ------
    StatementError
        When `keep` or `weights` name something else.
    SolveFailed
        When dynamics, links, equations, times and the limits kept contradict each other.
    """
    weights = weights or {}
    _check(problem, [*keep, *weights])
    constants = {c.name: float(c.value) for c in problem.constants}
    start = start_of(problem, constants)
    elastic = _Elastic(scales_of(problem, start, constants), keep)
    statement = _rewritten(problem, elastic, start)
    slacks = list(elastic.slacks.values())
    cost = sum(
        (weights.get(s.name, 1.0) * (1.0 + _TIE * i) * s.unknown / s.size
         for i, s in enumerate(reversed(slacks))), _effort(statement, elastic))  # fmt: skip
    if not slacks:
        raise StatementError(f"no limit of '{problem.name}' may give way; name fewer to keep")
    solution = solve(
        Problem(problem.name, statement.phases, minimise=cost, bounds=statement.bounds,
                links=statement.links), settings=settings or _SETTINGS)  # fmt: skip
    moved = {s.unknown: solution.value(s.unknown) for s in slacks}
    given = [s for s in slacks if moved[s.unknown] > _NOTHING * s.size]
    given.sort(key=lambda s: -moved[s.unknown] / s.size)
    items = tuple(_item(s, moved[s.unknown], solution, constants) for s in given)
    total = sum(weights.get(s.name, 1.0) * moved[s.unknown] / s.size for s in given)
    return Relaxation(problem.name, items, total, solution)


@dataclass(frozen=True)
class _Statement:
    phases: list[Phase]
    bounds: list[Bound]
    links: list[Bound]


def _rewritten(problem: Problem, elastic: _Elastic, start: Start) -> _Statement:
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
        if u in elastic.renamed and _is_limited(u):
            own = Bound(u.name, elastic.renamed[u], u.unit, u.lower, u.upper)
            bounds += elastic.loosened(own, scales.unknowns[u.name])
    links = [replace(b, expression=elastic.rewritten(b.expression)) for b in problem.links]
    return _Statement(phases, bounds, links)


def _effort(statement: _Statement, elastic: _Elastic) -> ca.SX:
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


def _is_limited(symbol: Any) -> bool:
    return not all(is_number(v) and math.isinf(v) for v in (symbol.lower, symbol.upper))


def _phase(problem: Problem, phase: Phase, elastic: _Elastic, start: Start) -> Phase:
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
        if s in renamed and _is_limited(s):
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


def _ends(phase: Phase, made: Phase, elastic: _Elastic) -> Iterator[Bound]:
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


def _functional(f: Functional, elastic: _Elastic, phases: Mapping[str, Phase]) -> Functional:
    pieces = tuple((name, elastic.rewritten(e)) for name, e in f.pieces)
    symbols = tuple(dict.fromkeys(s for _, e in pieces for s in resolve(e, f.name)))
    made = Functional(f.name, f.unit, f.kind, pieces, f.at, f.absolute, symbols)
    phases[pieces[0][0]]._functionals.append(made)
    return made


def _check(problem: Problem, names: Collection[str]) -> None:
    """StatementError unless there are limits of these names."""
    known = {s.name for s in problem.symbols if hasattr(s, "lower") and _is_limited(s)}
    known |= {b.name for b in problem.bounds}
    for phase in problem.phases:
        known |= {f"{phase.name}: {b.name}" for b in phase.bounds if not b.is_equation}
        for what, values in (("initial", phase.initial), ("final", phase.final)):
            known |= {f"{phase.name}: {state.name} {what}" for state in values}
    for name in names:
        if name not in known:
            listed = ", ".join(f"'{n}'" for n in sorted(known))
            raise StatementError(f"'{problem.name}' has no limit '{name}'; its limits are {listed}")


def _item(
    slack: _Slack, amount: float, solution: Solution, constants: Mapping[str, float]
) -> Relaxed:
    limit = evaluate_limit(slack.limit, constants)
    sign = 1.0 if slack.side == "upper" else -1.0
    phase, time = "", None
    if slack.end is not None:
        phase = slack.end[0]
        time = float(solution.trajectory.phase(phase).breakpoints[slack.end[1]])
    highest = -math.inf
    for name, expression in slack.path.items():
        own = solution.trajectory.phase(name)
        times = np.linspace(own.start, own.end, _SAMPLES)
        values = sign * solution.sample(expression, times, name)
        if values.max() > highest:
            highest, phase, time = values.max(), name, float(times[np.argmax(values)])
    return Relaxed(slack.name, slack.side, phase, time, slack.unit, limit, limit + sign * amount)
