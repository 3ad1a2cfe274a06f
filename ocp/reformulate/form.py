"""What is solved in place of a problem, and the motions of both.

Signals that one of both lacks are sampled by the expressions that the reformulations give, and are
polynomials of degree 8 in each interval then: as the replay has its states, and closer than any
collocation.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from ocp.errors import StatementError
from ocp.mesh.dense_integral import dense_integral
from ocp.mesh.trajectory import Evaluator, PhaseTrajectory, SignalGroup, SignalKind, Trajectory
from ocp.numerics.piecewise_polynomial import Lagrange, Piece, PiecewisePolynomial
from ocp.problem.functionals import Integral, Peak
from ocp.problem.parameters import Parameters, parameters_of
from ocp.problem.problem import Problem, without_repeated_warnings
from ocp.problem.symbols import (
    Algebraic,
    Constant,
    Control,
    Signal,
    State,
    Symbol,
    resolve,
    scalar,
)
from ocp.reformulate.reformulation import Reformulation, Restated, substituted

# Of an interval, at which signals are sampled
_NODES = np.linspace(0.0, 1.0, 9)

_KINDS: Mapping[SignalKind, type[Signal]] = {
    "state": State,
    "control": Control,
    "algebraic": Algebraic,
}


@dataclass(frozen=True, eq=False, repr=False)
class Form:
    """A problem as it was stated, and the one that is solved in its place.

    Attributes
    ----------
    statement, problem : Problem
        The same object where there is nothing to reformulate.
    back, forth : mapping of Symbol to SX
        As of `Restated`, from and to the statement.
    passes : tuple of str
        The reformulations that were asked for.
    """

    statement: Problem
    problem: Problem
    back: Mapping[Symbol, ca.SX] = field(default_factory=dict)
    forth: Mapping[Symbol, ca.SX] = field(default_factory=dict)
    passes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"Form({self.problem!r})"

    @property
    def is_statement(self) -> bool:
        """Whether the problem is solved as it was stated."""
        return self.problem is self.statement

    @property
    def integrals(self) -> tuple[Integral, ...]:
        """Those of the statement that the problem has others for."""
        stated = (f for f in self.statement.functionals if isinstance(f, Integral))
        return tuple(f for f in stated if f in self.back)

    def then(self, restated: Restated) -> Form:
        """With one more reformulation."""
        new, before = restated.problem, set(_symbols(self.statement))
        back = {s: substituted(e, restated.back) for s, e in self.back.items()}
        back |= {s: scalar(e, s.name) for s, e in restated.back.items() if s in before}
        forth = {s: substituted(e, self.forth) for s, e in restated.forth.items()}
        return replace(self, problem=new, back=back, forth={**self.forth, **forth})

    def parameters(self, changed: Mapping[Constant, float] | None = None) -> Parameters:
        """The constants, those that are changed at their new values, and the limits there."""
        return parameters_of(self.problem, changed)

    def stated(self, motion: Trajectory) -> Trajectory:
        """A motion of the problem as one of the statement."""
        if self.is_statement:
            return motion
        source, target = Evaluator(self.problem), self.statement
        known = motion.peaks_of(self.problem)
        peaks = tuple(source.number(motion, self.back.get(p, p), known) for p in target.peaks)
        return replace(_converted(source, target, self.back, motion), peaks=peaks)

    def solved(self, guess: Trajectory) -> Trajectory:
        """A motion of the statement as one of the problem; what the one lacks, both may lack."""
        if self.is_statement:
            return guess
        numbers = {*guess.unknowns, *guess.constants}
        if any(
            s.name not in numbers for s in (*self.statement.unknowns, *self.statement.constants)
        ):
            return guess
        instead = {
            symbol: expression
            for symbol, expression in self.forth.items()
            if not any(isinstance(s, Peak) for s in resolve(expression, symbol.name))
        }
        source = Evaluator(self.statement)
        known = _converted(source, self.statement, {}, guess)
        return _converted(source, self.problem, instead, known)

    def objective(self, motion: Trajectory, evaluator: Evaluator) -> float:
        """The objective of the statement on a motion of it, with integrals as they were stated.

        Parameters
        ----------
        evaluator : Evaluator
            Of the statement.
        """
        known: dict[Any, float] = dict(motion.peaks_of(self.statement))
        known |= {f: dense_integral(evaluator, motion, f) for f in self.integrals}
        value = evaluator.number(motion, self.statement.objective, known)
        return self.statement.sense * value


@lru_cache(maxsize=16)
def reformulated(problem: Problem, reformulations: tuple[Reformulation, ...]) -> Form:
    """What to solve in place of a problem.

    Raises
    ------
    StatementError
        When a reformulation gives no way back.
    """
    form = Form(problem, problem, passes=tuple(map(repr, reformulations)))
    for each in reformulations:
        with without_repeated_warnings():
            restated = each.apply(form.problem)
        if restated is not None:
            form = form.then(restated)
            _check_way_back(form, each)
    return form


def _check_way_back(form: Form, last: Reformulation) -> None:
    """StatementError unless motions of the problem are motions of the statement."""
    names = [[phase.name for phase in problem.phases] for problem in (form.statement, form.problem)]
    missing = [f"the phases {', '.join(names[0])}"] if names[0] != names[1] else []
    for phase in form.statement.phases if not missing else ():
        known = {signal.name for signal in form.problem.signals[phase.name]}
        signals = form.statement.signals[phase.name]
        missing += [f"'{s.name}'" for s in signals if s.name not in known and s not in form.back]
    unknowns = {unknown.name for unknown in form.problem.unknowns}
    gone = [u for u in form.statement.unknowns if u.name not in unknowns]
    without = [p for p in form.statement.peaks if p not in set(form.problem.peaks)]
    missing += [f"'{s.name}'" for s in (*gone, *without) if s not in form.back]
    if missing:
        raise StatementError(
            f"the reformulation {last!r} of problem '{form.statement.name}' does not convert "
            f"{missing[0]} back; give it as an expression of the new symbols, in back= of its "
            "Restated"
        )


def _symbols(problem: Problem) -> Iterator[Symbol]:
    yield from problem.symbols
    yield from problem.functionals


def _converted(
    source: Evaluator, target: Problem, instead: Mapping[Symbol, ca.SX], motion: Trajectory
) -> Trajectory:
    """A motion of one problem as one of another.

    Parameters
    ----------
    source : Evaluator
        Of the problem whose motion it is.
    instead : mapping of Symbol to SX
        Signals and unknowns of the other one by symbols of this one.
    """
    names = {phase.name for phase in target.phases}
    phases = tuple(
        _converted_phase(source, target.signals[phase.name], instead, motion, phase)
        for phase in motion.phases
        if phase.name in names
    )
    unknowns = {
        u.name: source.number(motion, instead[u], {}) if u in instead else motion.unknowns[u.name]
        for u in target.unknowns
        if u in instead or u.name in motion.unknowns
    }
    constants = {c.name: motion.constants.get(c.name, c.value) for c in target.constants}
    return Trajectory(phases, unknowns, constants)


def _converted_phase(
    source: Evaluator,
    signals: Iterable[Signal],
    instead: Mapping[Symbol, ca.SX],
    motion: Trajectory,
    phase: PhaseTrajectory,
) -> PhaseTrajectory:
    """A phase of a motion with the signals of the other problem."""
    groups, wanted, degrees = list[SignalGroup](), list(signals), phase.degrees
    symbols = {signal.name: signal.symbol for signal in source.problem.signals[phase.name]}
    for kind, of in _KINDS.items():
        own = [signal for signal in wanted if isinstance(signal, of)]
        sampled = {s: instead[s] for s in own if s in instead and _is_known(instead[s], phase)}
        kept = {s.name for s in own if s not in sampled and s.name in phase.signals}
        if kind == "state" and sampled:
            # the states of a phase are one group
            sampled = {
                s: sampled[s] if s in sampled else symbols[s.name]
                for s in own
                if s in sampled or s.name in kept
            }
            kept = set()
        groups += _kept(phase, kind, kept)
        if sampled:
            groups.append(_sampled(source, motion, phase, kind, sampled))
            # the degree tells those who look between the points how densely to look
            degrees = np.maximum(degrees, _NODES.size - 1)
    return replace(phase, groups=tuple(groups), degrees=degrees)


def _is_known(expression: ca.SX, phase: PhaseTrajectory) -> bool:
    """Whether a phase of a motion has all signals of an expression."""
    symbols = resolve(expression, "an expression")
    return all(s.name in phase.signals for s in symbols if isinstance(s, Signal))


def _kept(phase: PhaseTrajectory, kind: SignalKind, names: set[str]) -> Iterator[SignalGroup]:
    """Groups of signals of a kind without those of other names."""
    for group in phase.groups:
        places = [i for i, name in enumerate(group.names) if name in names]
        if group.kind == kind and places:
            whole = len(places) == len(group.names)
            kept = tuple(group.names[i] for i in places)
            polynomial = group.polynomial if whole else group.polynomial.part(places)
            yield SignalGroup(kind, kept, polynomial)


def _sampled(
    source: Evaluator,
    motion: Trajectory,
    phase: PhaseTrajectory,
    kind: SignalKind,
    expressions: Mapping[Signal, ca.SX],
) -> SignalGroup:
    """Expressions along a phase of a motion, as signals."""
    count = phase.intervals
    k, tau = np.repeat(np.arange(count), _NODES.size), np.tile(_NODES, count)
    values = source.values(motion, phase.name, list(expressions.values()), k, tau)
    values = values.reshape(count, _NODES.size, len(expressions))
    piece = Piece(np.arange(count), Lagrange(tuple(_NODES.tolist())), values)
    names = tuple(signal.name for signal in expressions)
    return SignalGroup(kind, names, PiecewisePolynomial(phase.breakpoints, (piece,)))
