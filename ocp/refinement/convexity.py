"""Whether a problem can be expected to have one optimum only: linear rates, and nothing concave.

A convex problem has no local optimum beside the global one. Rates and equations have to be linear,
what is minimised convex, and upper limits are set to convex expressions, lower ones to concave
ones. Curvatures are looked at in random points, so that a problem may pass that is not convex. One
that does not pass is not.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import casadi as ca
import numpy as np

from ocp.numerics.polynomial_expressions import is_linear
from ocp.problem.bounds import Bound
from ocp.problem.functionals import AnyFunctional, Peak
from ocp.problem.parameters import Parameters
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

# Random points at which curvatures are looked at: within all limits, and within each of these
# distances from zero. What is convex near zero may not be so where the motion goes.
_POINTS = 8
_REACHES = (math.inf, 0.1, 0.3, 1.0, 3.0, 10.0, 1e2, 1e3, 1e4)
# part of the largest curvature that is rounding
_ROUNDING = 1e-9


def seems_convex(problem: Problem, parameters: Parameters) -> bool:
    """Whether nothing tells that a problem may have several optima at values of its constants.

    A free time does: the duration of a phase multiplies its rates.
    """
    if any(isinstance(time, Between) for p in problem.phases for time in (p.start, p.end)):
        return False
    return _has_linear_rates(problem) and not any(
        _is_concave(expression, times, parameters)
        for expression, times in _curved(problem, parameters)
    )


def _has_linear_rates(problem: Problem) -> bool:
    """Whether all rates and all equations along the motion are linear in signals and unknowns."""
    unknowns = [unknown.symbol for unknown in problem.unknowns]
    for phase in problem.phases:
        equations = [bound.expression for bound in phase.bounds if bound.is_equation]
        signals = [signal.symbol for signal in problem.signals[phase.name]]
        rates = ca.vertcat(*phase.dynamics.values(), *equations)
        if not is_linear(rates, ca.vertcat(*signals, *unknowns)):
            return False
    return True


def _curved(problem: Problem, parameters: Parameters) -> Iterator[tuple[ca.SX, Interval]]:
    """What has to be convex, and when: what is minimised, and limited sides of bounds and links."""
    of_problem = (side for bound in problem.boundary_constraints for side in _sides(bound))
    for expression in (problem.objective, *of_problem):
        yield expression, (0.0, 0.0)
        for functional in problem.functionals:
            if ca.depends_on(expression, functional.symbol):
                yield from _pieces(problem, expression, functional, parameters)

    for phase in problem.phases:
        for bound in phase.bounds:
            yield from ((side, _times(phase)) for side in _sides(bound))


def _pieces(
    problem: Problem, expression: ca.SX, functional: AnyFunctional, parameters: Parameters
) -> Iterator[tuple[ca.SX, Interval]]:
    """What of a functional has to be convex, so that an expression of it can be."""
    # the largest absolute value of a linear expression is convex, and others seldom are not
    if isinstance(functional, Peak) and functional.absolute:
        return
    constants = ca.vertcat(*[constant.symbol for constant in problem.constants], ca.SX(0, 1))
    slope = ca.substitute(
        ca.jacobian(expression, functional.symbol), constants, ca.DM(parameters.vector)
    )

    # by a slope of either sign what is convex may become concave
    slope = ca.simplify(slope)
    weights = [float(slope)] if slope.is_constant() else [1.0, -1.0]
    for name, piece in functional.pieces:
        times = _times(problem.phase(name))
        yield from ((weight * piece, times) for weight in weights)


def _times(phase: Phase) -> Interval:
    """Initial and final time of a phase, the guessed ones where they are free [s]."""
    start, end = (
        time.start if isinstance(time, Between) else float(time)
        for time in (phase.start, phase.end)
    )
    return start, end


def _sides(bound: Bound) -> Iterator[ca.SX]:
    """The expression of a bound, with a sign for each side that has a limit."""
    for sign, limit in ((1.0, bound.upper), (-1.0, bound.lower)):
        if not (is_number(limit) and np.isinf(limit)):
            yield sign * bound.expression


def _is_concave(expression: ca.SX, times: Interval, parameters: Parameters) -> bool:
    """Whether an expression curves downwards in some direction at one of a few random points.

    Parameters
    ----------
    times : (first, last) at which it is looked at [s].
    """
    symbols = resolve(expression, "an expression")
    free = [s for s in symbols if not isinstance(s, (Constant, Time))]
    known = [s for s in symbols if isinstance(s, (Constant, Time))]
    variables, numbers = (ca.vertcat(*[s.symbol for s in p], ca.SX(0, 1)) for p in (free, known))
    if not free or is_linear(expression, variables):
        return False
    second = ca.densify(ca.hessian(expression, variables)[0])
    both = ca.Function("both", [variables, numbers], [expression, second])
    random = np.random.default_rng(0)
    for reach in np.repeat(_REACHES, _POINTS):
        one, other = (
            np.array([_drawn(s, times, reach, random, parameters) for s in free]) for _ in range(2)
        )
        at = [_drawn(s, times, reach, random, parameters) for s in known]
        value, curvature = both(one, at)
        curvature = np.array(curvature)
        if np.isfinite(curvature).all():
            eigenvalues = np.linalg.eigvalsh(curvature)
            if eigenvalues[0] < -_ROUNDING * np.abs(eigenvalues).max():
                return True
        # a kink has no curvature: the middle of a chord tells
        ends = float(value), float(both(other, at)[0])
        middle = float(both(0.5 * (one + other), at)[0])
        if middle > 0.5 * sum(ends) + _ROUNDING * (abs(middle) + max(map(abs, ends))):
            return True
    return False


def _drawn(
    symbol: Symbol,
    times: Interval,
    reach: float,
    random: np.random.Generator,
    parameters: Parameters,
) -> float:
    """A random value that a symbol may have, within a reach of zero or of the limit next to it."""
    if isinstance(symbol, Constant):
        return parameters.values[symbol.name]
    if isinstance(symbol, Time):
        return float(random.uniform(*times))
    low, high = -math.inf, math.inf
    if isinstance(symbol, (Signal, Unknown)):
        low, high = (
            float(limit) if is_number(limit) else side
            for limit, side in ((symbol.lower, low), (symbol.upper, high))
        )
    nearest = min(max(0.0, low), high)
    low, high = max(low, nearest - reach), min(high, nearest + reach)
    # without any reach a side without a limit leaves what is not far from zero and the other limit
    first = low if math.isfinite(low) else min(-1.0, high - 1.0)
    last = high if math.isfinite(high) else max(1.0, low + 1.0)
    return float(random.uniform(first, last))
