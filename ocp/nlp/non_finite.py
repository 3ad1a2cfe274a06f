"""Where a problem is NaN or infinite: which expression, when, and at what values."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import casadi as ca
import numpy as np

from ocp.arrays import Array, Integers
from ocp.mesh.trajectory import Evaluator, PhaseTrajectory, Trajectory
from ocp.numerics.expression_graph import operands_of
from ocp.problem.display import with_unit
from ocp.problem.functionals import Functional, Integral, pieces_over
from ocp.problem.problem import Problem
from ocp.problem.symbols import Symbol, Time, resolve
from ocp.problem.texts import SHORT

_FOR_SIZES = (
    "; a square root has no derivative at zero: for a root of controls in a cost, give the "
    "controls limits or a scale=, and the engine replaces the root by a separate control; in a "
    "limit, use the square, as in ax**2 + ay**2 <= 1; elsewhere, add a small number under the root"
)


def non_finite_value(problem: Problem, trajectory: Trajectory) -> str:
    """The first expression that is not finite along a trajectory, in words; "" if all are.

    Values come before derivatives, and phases before the numbers of the whole motion.
    """
    evaluator, peaks = Evaluator(problem), trajectory.peaks_of(problem)
    for derivative in (False, True):
        for phase, what, expression in _stated(problem):
            symbols = resolve(expression, what)
            if derivative and not symbols:
                continue

            entries = _slopes(expression, symbols) if derivative else [expression]
            if not phase:
                number = partial(evaluator.number, trajectory, known=peaks)
                found = next((e for e in entries if not np.isfinite(number(e))), None)
                when = ""
            else:
                motion = trajectory.phase(phase)
                intervals, tau = _points(motion)
                values = evaluator.values(trajectory, phase, entries, intervals, tau)
                bad = np.argwhere(~np.isfinite(values))
                if not bad.size:
                    continue
                point, entry = (int(i) for i in bad[0])
                at, found = (intervals[[point]], tau[[point]]), entries[entry]
                number = partial(_number_at, evaluator, trajectory, phase, at)
                when = f" at {evaluator.times(motion, *at)[0]:.3g} s"

            if found is not None:
                text = _sentence(found, symbols, number, when, derivative=derivative)
                of_zero = phase and derivative and _is_root_of_zero(expression, number)
                return f"{what} {text}{_FOR_SIZES if of_zero else ''}"
    return ""


def _number_at(
    evaluator: Evaluator,
    trajectory: Trajectory,
    phase: str,
    at: tuple[Integers, Array],
    part: ca.SX | Symbol,
) -> float:
    """The value of a part at one point of a phase."""
    return float(evaluator.values(trajectory, phase, [part], *at)[0, 0])


def _slopes(expression: ca.SX, symbols: tuple[Symbol, ...]) -> list[ca.SX]:
    """The derivatives of an expression by its symbols."""
    return ca.vertsplit(ca.gradient(expression, ca.vertcat(*[s.symbol for s in symbols])))


def _sentence(
    found: ca.SX,
    symbols: tuple[Symbol, ...],
    number: Callable[[Any], float],
    when: str,
    *,
    derivative: bool,
) -> str:
    """What is not finite, when, in which part, and at what values."""
    part = _culprit(found, number)
    arguments = [_value(s, number(s)) for s in symbols if not isinstance(s, Time)]
    has = "has a derivative that is" if derivative else "is"
    inside = f" (in {part})" if part else ""
    where = f", where {', '.join(arguments)}" if arguments else ""
    return f"{has} NaN or infinite{when}{inside}{where}"


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


def _stated(problem: Problem) -> Iterator[tuple[str, str, ca.SX]]:
    """Phase, name in messages, and what is evaluated along it, or once if the phase is ""."""
    for phase in problem.phases:
        name, inside = phase.name, f"in phase '{phase.name}'"
        for state, rate in phase.dynamics.items():
            yield name, f"the derivative of '{state.name}' {inside}", rate
        for bound in phase.bounds:
            yield name, f"'{bound.name}' {inside}", bound.expression
        for functional, expression in pieces_over((*problem.integrals[name], *problem.peaks), name):
            what = "integrand of" if isinstance(functional, Integral) else "peak"
            yield name, f"the {what} '{functional.name}' {inside}", expression
    yield "", "the objective", problem.objective
    for row in problem.boundary_constraints:
        yield "", f"'{row.name}'", row.expression


def _culprit(expression: ca.SX, number: Callable[[ca.SX], float]) -> str:
    """The innermost part of an expression that is not finite although its arguments are."""
    while True:
        worse = [
            p for p in operands_of(expression) if not p.is_symbolic() and not np.isfinite(number(p))
        ]
        if not worse:
            text = str(expression)
            return text if len(text) <= SHORT else ""
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
