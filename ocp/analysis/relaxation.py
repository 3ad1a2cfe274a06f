"""The smallest relaxation of a problem that no motion meets.

The statement is rewritten.  Signals and unknowns lose their limits, which become bounds.  Every
named limit gets slacks that may not be negative, and their sum, each in units of the size of what
it relaxes, is minimised: with this L1 penalty few limits give way rather than all a little.
Dynamics, links, times and equations along a phase stay as they are.  The names are those of
`ocp.analysis.sensitivity`.
"""

from __future__ import annotations

import math
import time as clock
from collections.abc import Collection, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import casadi as ca
import numpy as np

from ocp.analysis.limit_names import LimitNames, end_name, has_limit, phase_name
from ocp.errors import SolveFailed, StatementError
from ocp.keywords import checked_keywords
from ocp.mesh.initial_guess import InitialGuess, initial_guess
from ocp.mesh.trajectory import Trajectory
from ocp.optimality.active_set import path_multiplier_sums
from ocp.optimality.number_steps import nearest_step
from ocp.problem.bounds import Bound
from ocp.problem.functionals import Functional
from ocp.problem.parameters import Parameters, parameters_of
from ocp.problem.phase import Phase, kept_alive
from ocp.problem.problem import Problem
from ocp.problem.symbols import Control, Signal, Symbol, Unknown, is_limited, resolve
from ocp.progress import Progress
from ocp.refinement.estimates.motion_errors import MotionErrors
from ocp.refinement.estimates.narrow_features import narrow_features
from ocp.refinement.policies.adaptive_mesh import AdaptiveMesh
from ocp.refinement.policies.policy import FixedMesh
from ocp.scaling.automatic import scales_of
from ocp.scaling.scales import Scales
from ocp.settings import Settings
from ocp.solution.solution import Solution
from ocp.solve import check_arguments, solve

Side = Literal["lower", "upper"]

# One mesh, and controls that are constant in its intervals, where limits as rows hold between the
# points too: a motion that minimises nothing but slacks has no shape of its own to resolve.
_SETTINGS = Settings(intervals=40, refinement=FixedMesh())

# Of their sizes: what states and limits may be off by between the points of that mesh
_CLOSE = 1e-3

# Part of its size, below which a slack is the solver's tolerance.
_NOTHING = 1e-6

# More weight from slack to slack, so that one of several equals gives way.
_TIE = 1e-3

# Price of a control's mean square in its size, without which nothing determines the motion.
_PRICE = 1e-7

# Times as strongly as an earlier phase, with which a later one has to need a limit to be named.
_MORE = 10.0

_GUESS_SAMPLES = 201  # of a phase, by which the guess is handed on
_SAMPLES = 2001  # of an interval, among which the instant is looked for that needs the relaxation


@dataclass(frozen=True)
class Relaxed:
    """One limit that has to give way.

    Attributes
    ----------
    name, side : str
        Of the limit.
    phase, time : str and float or None
        Where the motion needs it most [s]; "" and None for a number of the whole motion.
    unit : str
        Of the two numbers that follow.
    limit, needed : float
        As stated, and as it would have to be [unit].
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
        """By how much the limit would have to move [unit]."""
        return abs(self.needed - self.limit)

    def __str__(self) -> str:
        unit = "" if self.unit in ("", "1") else f" {self.unit}"
        where = f" (needed in phase '{self.phase}' at {self.time:.4g} s)" if self.phase else ""
        return (
            f"'{self.name}' from {self.limit:.6g} to {self.needed:.6g}{unit}, by "
            f"{self.amount:.4g}{unit}{where}"
        )


@dataclass(frozen=True, eq=False, repr=False)
class Relaxation:
    """What to relax, the least in sum, and a motion that then meets everything.

    Attributes
    ----------
    problem : str
    items : tuple of Relaxed
        Limits that have to give way, the largest part of its size first; none if feasible.
    total : float
        Weighted sum of the relaxations, each as a part of the size of what it relaxes.  Of
        several that are equal to a part in a thousand the last stated gives way, bounds of the
        problem before final values and these before initial ones.
    solution : Solution
        A motion of the relaxed problem, which minimises the relaxation and nothing else.  Its
        signals go by name.
    steps : str
        Where something steps by which less might have to give way, in words; empty where nothing
        does, or nothing has to.
    """

    problem: str
    items: tuple[Relaxed, ...]
    total: float
    solution: Solution
    steps: str = ""

    def __repr__(self) -> str:
        names = ", ".join(f"'{item.name}' {item.side}" for item in self.items)
        verb = "give" if len(self.items) > 1 else "gives"
        return f"Relaxation of '{self.problem}': {names or 'nothing'} {verb} way; print it"

    def __str__(self) -> str:
        reasons = "; ".join(self.solution.verification.reasons)
        doubt = f" (not verified: {reasons})" if reasons else ""
        if not self.items:
            return f"'{self.problem}' can be met as it is stated{doubt}"
        listed = "; ".join(str(item) for item in self.items)
        told = f"; {self.steps}" if self.steps else ""
        return f"'{self.problem}' can be met if these limits are changed: {listed}{doubt}{told}"


@checked_keywords()
def relaxed(
    problem: Problem,
    *,
    keep: Collection[str] = (),
    only: Collection[str] | None = None,
    weights: Mapping[str, float] | None = None,
    settings: Settings | None = None,
    guess: Solution | Trajectory | None = None,
    progress: Progress | bool | None = None,
) -> Relaxation:
    """The smallest relaxation of a problem's limits that some motion meets.

    A limit is named without "lower" or "upper": ``"x"`` for the bounds of a signal or unknown,
    ``"landing"`` for a bound of the problem, ``"flight: power"`` for one of a phase,
    ``"flight: x initial"`` for a boundary value.  ``"power"`` stands for the bounds of that name in
    all phases.

    Parameters
    ----------
    problem : Problem
    keep : collection of str
        Limits that must not give way.
    only : collection of str, optional
        The limits that may give way; all others are kept.  Bounds of several phases that are
        named together here move together: what they need is one limit for all of them.
    weights : mapping of str to number, optional
        Of a limit's relaxation; 1 where nothing is said.
    settings : Settings, optional
        By default 40 intervals that stay, which is good to about a thousandth of what is needed.
        Where the motion does not hold between their points, an adaptive mesh follows, within what
        is left of the seconds.
    guess, progress : optional
        As of `ocp.solve`.

    Raises
    ------
    StatementError
        When `keep`, `only` or `weights` name something else.
    SolveFailed
        When dynamics, links, equations, times and the limits kept contradict each other.
    """
    settings = settings or _SETTINGS
    check_arguments(problem, settings, guess, None)
    limits, weights = LimitNames(problem), weights or {}
    limits.check([*keep, *(only or ()), *weights])
    kept = limits.each(keep)
    if only is not None:
        kept |= limits.names - limits.each(only)
    together = frozenset(only or ()) & limits.common
    prices = {name: weights[given] for given in weights for name in (given, *limits.each([given]))}

    parameters = parameters_of(problem)
    start = initial_guess(problem, parameters)
    scales = scales_of(problem, start, parameters)
    loosening = _Loosening(problem, scales, start, kept, together)
    statement = loosening.statement(prices)
    slacks = list(loosening.slacks.values())

    trajectory = guess.trajectory if isinstance(guess, Solution) else guess
    begin = clock.monotonic()
    solution = solve(statement, settings=settings, guess=trajectory, progress=progress)
    left = math.inf if settings.seconds is None else settings.seconds - (clock.monotonic() - begin)
    if not _holds(solution) and not settings.refinement.adapts and left > 0.0:
        # what lies between the points of a mesh that stays would ask for nothing
        finer = replace(settings, refinement=AdaptiveMesh())
        if math.isfinite(left):
            finer = replace(finer, seconds=left)
        with suppress(SolveFailed):
            solution = solve(
                statement, settings=finer, guess=solution.trajectory, progress=progress
            )

    moved = {s.unknown: solution.value(s.unknown) for s in slacks}
    given_way = [s for s in slacks if moved[s.unknown] > _NOTHING * s.size]
    given_way.sort(key=lambda s: -moved[s.unknown] / s.size)
    items = tuple(_item(s, moved[s.unknown], solution, parameters) for s in given_way)
    total = sum(prices.get(s.name, 1.0) * moved[s.unknown] / s.size for s in given_way)
    of_motion = solution.kept_iterate, solution.evaluator
    steps = nearest_step(*of_motion, parameters.signal_limits) if items else ""
    return Relaxation(problem.name, items, total, solution, steps)


def _holds(solution: Solution) -> bool:
    """Whether a motion holds between its points as well as a mesh that stays is good for."""
    iterate, verification = solution.kept_iterate, solution.verification
    errors = MotionErrors(
        iterate.transcription, iterate.trajectory, solution.evaluator, iterate.parameters
    )
    missed = any(True for _ in narrow_features(errors, _CLOSE))
    return not missed and max(verification.excess, verification.miss) <= _CLOSE


@dataclass(frozen=True, eq=False, repr=False)
class _Slack:
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
class _Loosening:
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
    slacks: dict[tuple[str, Side], _Slack] = field(default_factory=dict)

    def statement(self, prices: Mapping[str, float]) -> Problem:
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
            raise StatementError(f"no limit of '{problem.name}' may give way; name fewer to keep")
        cost = sum(
            prices.get(s.name, 1.0) * (1.0 + _TIE * i) * s.unknown / s.size
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
            return Control(symbol.name, symbol.unit, scale=scale, shape="constant")
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
    ) -> _Slack:
        """The slack of one side of a limit, the same one wherever the limit has that name."""
        key = bound.name, side
        if key not in self.slacks:
            name = f"slack of {bound.name} {side}"
            unknown = Unknown(name, bound.unit, lower=0.0, guess=0.0, scale=size)
            self.slacks[key] = _Slack(bound.name, side, limit, bound.unit, size, unknown, end=end)
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


def _item(slack: _Slack, amount: float, solution: Solution, parameters: Parameters) -> Relaxed:
    """What a slack says, and where along the motion it is needed most."""
    sign = 1.0 if slack.side == "upper" else -1.0
    phase, time = "", None
    if slack.end is not None:
        phase = slack.end[0]
        time = float(solution.trajectory.phase(phase).breakpoints[slack.end[1]])

    pull = -math.inf
    for name, expression in slack.path.items():
        time_there, pull_there = _where_it_pulls(slack, expression, solution, name)
        # at an instant that two phases share, multipliers may be those of either
        if pull == -math.inf or pull_there > _MORE * pull:
            phase, time, pull = name, time_there, pull_there

    limit = parameters.limit(slack.limit)
    needed = limit + sign * amount
    return Relaxed(slack.name, slack.side, phase, time, slack.unit, limit, needed)


def _where_it_pulls(
    slack: _Slack, expression: Any, solution: Solution, name: str
) -> tuple[float, float]:
    """The time at which a phase needs the slack of a path limit most [s], and how strongly.

    Once a limit has moved, a motion goes up to it elsewhere as well. The multipliers tell where it
    has to.
    """
    iterate, motion = solution.kept_iterate, solution.trajectory.phase(name)
    index = [phase.name for phase in solution.trajectory.phases].index(name)
    names = [own.name for own in iterate.transcription.constraints[index]]
    sums = path_multiplier_sums(iterate, index)
    pulls = sums.get(names.index(f"{slack.name} {slack.side}"), np.zeros(motion.intervals))

    most = int(np.argmax(pulls))
    pulled = pulls[most] > 0.0
    first, last = motion.breakpoints[most : most + 2] if pulled else (motion.start, motion.end)
    times = np.linspace(first, last, _SAMPLES)
    values = solution.sample(expression, times, name)
    highest = np.argmax(values if slack.side == "upper" else -values)
    return float(times[highest]), float(pulls[most])
