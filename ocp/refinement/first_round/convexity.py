"""Whether a problem can be expected to have one optimum only: linear rates, and nothing concave.

A convex problem has no local optimum beside the global one. Rates and equations have to be linear,
what is minimised convex, and upper limits are set to convex expressions, lower ones to concave
ones. Curvatures are looked at in random points, so that a problem may pass that is not convex. One
that does not pass is not.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import casadi as ca
import numpy as np

from ocp.problem.bounds import Bound
from ocp.problem.functionals import Peak
from ocp.problem.phase import Phase
from ocp.problem.problem import Problem
from ocp.problem.symbols import (
    Between,
    Constant,
    Signal,
    Symbol,
    Time,
    Unknown,
    is_number,
    resolve,
)

Interval = tuple[float, float]

# Random points at which curvatures are looked at, and the part of the largest one that is rounding.
_POINTS = 8
_ROUNDING = 1e-9


def seems_convex(problem: Problem) -> bool:
    """Whether nothing tells that a problem may have several optima.

    A free time of one phase alone does not count: least times of linear systems have one optimum.
    Where phases meet at a free time, their durations multiply their rates.
    """
    free = any(isinstance(time, Between) for p in problem.phases for time in (p.start, p.end))
    if len(problem.phases) > 1 and free:
        return False
    return _has_linear_rates(problem) and not any(
        _is_concave(expression, times) for expression, times in _curved(problem)
    )


def _has_linear_rates(problem: Problem) -> bool:
    """Whether all rates and all equations along the motion are linear in signals and unknowns."""
    unknowns = [unknown.symbol for unknown in problem.unknowns]
    for phase in problem.phases:
        equations = [bound.expression for bound in phase.bounds if bound.is_equation]
        signals = [signal.symbol for signal in problem.signals[phase.name]]
        rates = ca.vertcat(*phase.dynamics.values(), *equations)
        if not ca.is_linear(rates, ca.vertcat(*signals, *unknowns)):
            return False
    return True


def _curved(problem: Problem) -> Iterator[tuple[ca.SX, Interval]]:
    """What has to be convex, and when: the objective, its functionals, limited sides of bounds."""
    symbols = [symbol.symbol for symbol in problem.objective_symbols]
    yield problem.objective, (0.0, 0.0)
    for functional in problem.functionals:
        if not ca.depends_on(problem.objective, functional.symbol):
            continue
        weight = ca.jacobian(problem.objective, functional.symbol)
        for name, expression in functional.pieces:
            # the largest absolute value of a linear expression is convex, and others seldom are not
            if not (isinstance(functional, Peak) and functional.absolute):
                weighted = ca.substitute(weight, ca.vertcat(*symbols), _ones(symbols)) * expression
                yield weighted, _times(problem.phase(name))

    for phase in problem.phases:
        for bound in phase.bounds:
            yield from ((side, _times(phase)) for side in _sides(bound))
    for bound in problem.boundary_constraints:
        yield from ((side, (0.0, 0.0)) for side in _sides(bound))


def _times(phase: Phase) -> Interval:
    """Initial and final time of a phase, the guessed ones where they are free [s]."""
    start, end = (
        time.start if isinstance(time, Between) else float(time)
        for time in (phase.start, phase.end)
    )
    return start, end


def _ones(symbols: Sequence[ca.SX]) -> ca.SX:
    return ca.SX.ones(len(symbols), 1)


def _sides(bound: Bound) -> Iterator[ca.SX]:
    """The expression of a bound, with a sign for each side that has a limit."""
    for sign, limit in ((1.0, bound.upper), (-1.0, bound.lower)):
        if not (is_number(limit) and np.isinf(limit)):
            yield sign * bound.expression


def _is_concave(expression: ca.SX, times: Interval) -> bool:
    """Whether an expression curves downwards in some direction at one of a few random points.

    Parameters
    ----------
    times : (first, last) at which it is looked at [s].
    """
    symbols = resolve(expression, "an expression")
    free = [s for s in symbols if not isinstance(s, (Constant, Time))]
    known = [s for s in symbols if isinstance(s, (Constant, Time))]
    variables, numbers = (ca.vertcat(*[s.symbol for s in p], ca.SX(0, 1)) for p in (free, known))
    if not free or ca.is_linear(expression, variables):
        return False
    second = ca.densify(ca.hessian(expression, variables)[0])
    hessian = ca.Function("hessian", [variables, numbers], [second])
    random = np.random.default_rng(0)
    for _ in range(_POINTS):
        values = ([_drawn(s, times, random) for s in part] for part in (free, known))
        curvature = np.array(hessian(*values))
        if np.isfinite(curvature).all():
            eigenvalues = np.linalg.eigvalsh(curvature)
            if eigenvalues[0] < -_ROUNDING * np.abs(eigenvalues).max():
                return True
    return False


def _drawn(symbol: Symbol, times: Interval, random: np.random.Generator) -> float:
    """A random value that a symbol may have, not far from zero where its limits leave that open."""
    if isinstance(symbol, Constant):
        return float(symbol.value)
    if isinstance(symbol, Time):
        return float(random.uniform(*times))
    low, high = -math.inf, math.inf
    if isinstance(symbol, (Signal, Unknown)):
        low, high = (
            float(limit) if is_number(limit) else side
            for limit, side in ((symbol.lower, low), (symbol.upper, high))
        )
    # a side without a limit leaves what is not far from zero and from the other limit
    first = low if math.isfinite(low) else min(-1.0, high - 1.0)
    last = high if math.isfinite(high) else max(1.0, low + 1.0)
    return float(random.uniform(first, last))
