"""Where a problem is NaN or infinite: which expression, when, and at what values."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.mesh.evaluation import Evaluator
from ocp.mesh.trajectory import PhaseTrajectory, Trajectory
from ocp.numerics.schemes import scheme
from ocp.problem.statement import Phase, Problem
from ocp.problem.symbols import Symbol, Time, resolve
from ocp.problem.terms import Functional

Array = NDArray[np.float64]
_LONGEST = 60  # letters of an expression in a message


def undefined(problem: Problem, trajectory: Trajectory) -> str:
    """The first expression that is not finite along a trajectory, in words; "" if all are."""
    evaluator = Evaluator(problem)
    for derivative in (False, True):
        for phase in problem.phases:
            own = trajectory.phase(phase.name)
            k, tau = _points(own)
            for what, expression in _expressions(problem, phase):
                found = _first(evaluator, trajectory, phase, expression, k, tau, derivative)
                if found:
                    return f"{what} in phase '{phase.name}' {found}"
        found = _terminal(problem, trajectory, evaluator, derivative)
        if found:
            return found
    return ""


def _points(own: PhaseTrajectory) -> tuple[NDArray[np.int64], Array]:
    """Both ends and all collocation points of a phase, in order."""
    k, tau = [np.array([0, len(own.breakpoints) - 2])], [np.array([0.0, 1.0])]
    for piece in own.pieces:
        points = scheme(own.scheme, piece.degree).points
        k.append(np.repeat(piece.intervals, points.size))
        tau.append(np.tile(points, piece.intervals.size))
    intervals, local = np.concatenate(k), np.concatenate(tau)
    order = np.lexsort((local, intervals))
    return intervals[order], local[order]


def _expressions(problem: Problem, phase: Phase) -> Iterator[tuple[str, ca.SX]]:
    for state, rate in phase.dynamics.items():
        yield f"the derivative of '{state.name}'", rate
    for bound in phase.bounds:
        yield f"'{bound.name}'", bound.expression
    for f in problem.functionals:
        for name, expression in f.pieces if f.kind in ("integral", "peak") else ():
            if name == phase.name:
                yield (
                    f"the {'integrand of' if f.kind == 'integral' else 'peak'} '{f.name}'",
                    expression,
                )


def _first(
    evaluator: Evaluator, trajectory: Trajectory, phase: Phase, expression: ca.SX,
    k: NDArray[np.int64], tau: Array, derivative: bool,
) -> str:  # fmt: skip
    """The first point at which an expression (or its derivative) is not finite, in words."""
    symbols = resolve(expression, "an expression")

    def values(what: list[Any], where: slice = slice(None)) -> Array:
        return evaluator.values(trajectory, phase.name, what, k[where], tau[where])

    wanted = _gradient(expression, symbols) if derivative else [expression]
    bad = np.argwhere(~np.isfinite(values(wanted))) if wanted else np.empty((0, 2))
    if not bad.size:
        return ""
    n, entry = (int(i) for i in bad[0])
    here, own = slice(n, n + 1), trajectory.phase(phase.name)
    time = own.breakpoints[k[n]] + tau[n] * np.diff(own.breakpoints)[k[n]]
    culprit = _culprit(wanted[entry], lambda e: float(values([e], here)[0, 0]))
    known = [s for s in symbols if not isinstance(s, Time)]
    at = [_value(s, float(values([s], here)[0, 0])) for s in known]
    return _words(derivative, culprit, f" at {time:.3g} s", at)


def _terminal(
    problem: Problem, trajectory: Trajectory, evaluator: Evaluator, derivative: bool
) -> str:
    """The objective, a bound or a link that is not finite, in words."""
    peaks = dict(zip([f for f in problem.functionals if f.kind == "peak"], trajectory.peaks,
                     strict=True))  # fmt: skip
    stated = [("the objective", problem.objective)]
    stated += [(f"'{b.name}'", b.expression) for b in (*problem.bounds, *problem.links)]
    for what, expression in stated:
        symbols = resolve(expression, what)

        def number(e: Any) -> float:
            return evaluator.number(trajectory, e, peaks)

        for entry in _gradient(expression, symbols) if derivative else [expression]:
            if not np.isfinite(number(entry)):
                at = [_value(s, number(s)) for s in symbols]
                return f"{what} {_words(derivative, _culprit(entry, number), '', at)}"
    return ""


def _gradient(expression: ca.SX, symbols: tuple[Symbol, ...]) -> list[ca.SX]:
    slopes = ca.gradient(expression, ca.vertcat(*[s.symbol for s in symbols], ca.SX(0, 1)))
    return [slopes[i] for i in range(slopes.shape[0])]


def _culprit(expression: ca.SX, number: Callable[[ca.SX], float]) -> str:
    """The innermost part of an expression that is not finite although its arguments are."""
    while True:
        parts = [expression.dep(i) for i in range(expression.n_dep())]
        worse = [p for p in parts if not p.is_symbolic() and not np.isfinite(number(p))]
        if not worse:
            text = str(expression)
            return text if len(text) <= _LONGEST else ""
        expression = worse[0]


def _value(symbol: Symbol, value: float) -> str:
    unit = "" if symbol.unit in ("", "1") else f" {symbol.unit}"
    name = symbol.name if not isinstance(symbol, Functional) else f"'{symbol.name}'"
    return f"{name} = {value:.4g}{unit}"


def _words(derivative: bool, culprit: str, when: str, at: list[str]) -> str:
    what = "has a derivative that is NaN or infinite" if derivative else "is NaN or infinite"
    part = f" (in {culprit})" if culprit else ""
    where = f", where {', '.join(at)}" if at else ""
    return f"{what}{when}{part}{where}"
