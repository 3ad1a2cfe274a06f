"""Where a problem is NaN or infinite: which expression, when, and at what values."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from ocp.arrays import Array, Integers
from ocp.mesh.trajectory import Evaluator, PhaseTrajectory, Trajectory
from ocp.numerics.expression_graph import operands_of
from ocp.problem.display import with_unit
from ocp.problem.functionals import Functional, Integral, pieces_over
from ocp.problem.phase import Phase
from ocp.problem.problem import Problem
from ocp.problem.symbols import Symbol, Time, resolve

_LONGEST = 60  # letters of an expression in a message

_FOR_SIZES = (
    "; a square root has no derivative at zero: of controls in a cost, give the controls limits or "
    "a scale=, and the size becomes a control of its own; of a limit, state its square, as in "
    "ax**2 + ay**2 <= 1; elsewhere add a small number under the root"
)


def non_finite_value(problem: Problem, trajectory: Trajectory) -> str:
    """The first expression that is not finite along a trajectory, in words; "" if all are.

    Values come before derivatives, and phases before the numbers of the whole motion.
    """
    for derivative in (False, True):
        search = _Inspection(problem, trajectory, Evaluator(problem), derivative)
        for phase in problem.phases:
            if sentence := search.along_phase(phase):
                return sentence
        if sentence := search.of_numbers():
            return sentence
    return ""


@dataclass(frozen=True, eq=False, repr=False)
class _Inspection:
    """Looks for a value that is not finite, or for such a derivative."""

    problem: Problem
    trajectory: Trajectory
    evaluator: Evaluator
    derivative: bool

    def along_phase(self, phase: Phase) -> str:
        """The first expression of a phase that is not finite, in words."""
        intervals, tau = _points(self.trajectory.phase(phase.name))
        for what, expression in _expressions(self.problem, phase):
            if place := self._first(phase, expression, intervals, tau):
                return f"{what} in phase '{phase.name}' {place}"
        return ""

    def _first(self, phase: Phase, expression: ca.SX, intervals: Integers, tau: Array) -> str:
        """The first of some points at which an expression is not finite, in words."""
        symbols = resolve(expression, "an expression")
        entries = self._entries(expression, symbols)
        if not entries:
            return ""
        motion = self.trajectory.phase(phase.name)
        values = self.evaluator.values(self.trajectory, phase.name, entries, intervals, tau)
        bad = np.argwhere(~np.isfinite(values))
        if not bad.size:
            return ""

        point, entry = (int(i) for i in bad[0])
        interval, local = intervals[[point]], tau[[point]]

        def number(part: Any) -> float:
            value = self.evaluator.values(self.trajectory, phase.name, [part], interval, local)
            return float(value[0, 0])

        remedy = _FOR_SIZES if self.derivative and _is_root_of_zero(expression, number) else ""

        steps = np.diff(motion.breakpoints)[interval]
        time = float((motion.breakpoints[interval] + local * steps)[0])
        arguments = [_value(s, number(s)) for s in symbols if not isinstance(s, Time)]
        words = self._words(_culprit(entries[entry], number), f" at {time:.3g} s", arguments)
        return words + remedy

    def of_numbers(self) -> str:
        """The objective, a bound or a link that is not finite, in words."""
        peaks = self.trajectory.peaks_of(self.problem)

        def number(part: Any) -> float:
            return self.evaluator.number(self.trajectory, part, peaks)

        stated = [("the objective", self.problem.objective)]
        stated += [(f"'{b.name}'", b.expression) for b in self.problem.boundary_constraints]
        for what, expression in stated:
            symbols = resolve(expression, what)
            for entry in self._entries(expression, symbols):
                if not np.isfinite(number(entry)):
                    arguments = [_value(s, number(s)) for s in symbols]
                    return f"{what} {self._words(_culprit(entry, number), '', arguments)}"
        return ""

    def _entries(self, expression: ca.SX, symbols: tuple[Symbol, ...]) -> list[ca.SX]:
        """The expression, or its derivatives with respect to its symbols."""
        if not self.derivative:
            return [expression]
        slopes = ca.gradient(expression, ca.vertcat(*[s.symbol for s in symbols], ca.SX(0, 1)))
        return [slopes[i] for i in range(slopes.shape[0])]

    def _words(self, culprit: str, when: str, arguments: list[str]) -> str:
        what = "is NaN or infinite"
        if self.derivative:
            what = "has a derivative that is NaN or infinite"
        part = f" (in {culprit})" if culprit else ""
        where = f", where {', '.join(arguments)}" if arguments else ""
        return f"{what}{when}{part}{where}"


def _points(motion: PhaseTrajectory) -> tuple[Integers, Array]:
    """Intervals and local times of both ends and all collocation points of a phase, in order."""
    intervals, tau = [np.array([0, motion.intervals - 1])], [np.array([0.0, 1.0])]
    for degree in sorted(set(motion.degrees.tolist())):
        here = np.flatnonzero(motion.degrees == degree)
        points = motion.scheme.at(degree).points
        intervals.append(np.repeat(here, points.size))
        tau.append(np.tile(points, here.size))

    k, local = np.concatenate(intervals), np.concatenate(tau)
    in_time = np.lexsort((local, k))
    return k[in_time], local[in_time]


def _expressions(problem: Problem, phase: Phase) -> Iterator[tuple[str, ca.SX]]:
    """What is evaluated along a phase, with its name in messages."""
    for state, rate in phase.dynamics.items():
        yield f"the derivative of '{state.name}'", rate
    for bound in phase.bounds:
        yield f"'{bound.name}'", bound.expression
    along = (*problem.integrals[phase.name], *problem.peaks)
    for functional, expression in pieces_over(along, phase.name):
        what = "integrand of" if isinstance(functional, Integral) else "peak"
        yield f"the {what} '{functional.name}'", expression


def _culprit(expression: ca.SX, number: Callable[[ca.SX], float]) -> str:
    """The innermost part of an expression that is not finite although its arguments are."""
    while True:
        worse = [
            p for p in operands_of(expression) if not p.is_symbolic() and not np.isfinite(number(p))
        ]
        if not worse:
            text = str(expression)
            return text if len(text) <= _LONGEST else ""
        expression = worse[0]


def _is_root_of_zero(expression: ca.SX, number: Callable[[ca.SX], float]) -> bool:
    """Whether a square root in an expression, or a `hypot`, is zero."""
    parts, seen = [expression], set[int]()
    while parts:
        part = parts.pop()
        if part.element_hash() in seen:
            continue
        seen.add(part.element_hash())
        is_root = not part.is_leaf() and part.op() in (ca.OP_SQRT, ca.OP_HYPOT)
        if is_root and number(part) == 0.0:
            return True
        parts += [operand for operand in operands_of(part) if not operand.is_symbolic()]
    return False


def _value(symbol: Symbol, value: float) -> str:
    name = f"'{symbol.name}'" if isinstance(symbol, Functional) else symbol.name
    return with_unit(f"{name} = {value:.4g}", symbol.unit)
