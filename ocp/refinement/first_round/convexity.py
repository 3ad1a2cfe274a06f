"""Whether a problem can be expected to have one optimum only: linear rates, and nothing concave.

A convex problem has no local optimum beside the global one. Rates and equations have to be linear,
what is minimised convex, and upper limits are set to convex expressions, lower ones to concave
ones. Curvatures are looked at in random points, so that a problem may pass that is not convex. One
that does not pass is not.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import casadi as ca
import numpy as np

from ocp.problem.bounds import Bound
from ocp.problem.functionals import Peak
from ocp.problem.problem import Problem
from ocp.problem.symbols import Between, Constant, Time, is_number, resolve

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
    return _has_linear_rates(problem) and not any(map(_is_concave, _curved(problem)))


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


def _curved(problem: Problem) -> Iterator[ca.SX]:
    """What has to be convex: objective, functionals by their weights, limited sides of bounds."""
    symbols = [symbol.symbol for symbol in problem.objective_symbols]
    yield problem.objective
    for functional in problem.functionals:
        if not ca.depends_on(problem.objective, functional.symbol):
            continue
        weight = ca.jacobian(problem.objective, functional.symbol)
        for _, expression in functional.pieces:
            # the largest absolute value of a linear expression is convex, and others seldom are not
            if not (isinstance(functional, Peak) and functional.absolute):
                yield ca.substitute(weight, ca.vertcat(*symbols), _ones(symbols)) * expression

    bounds = [bound for phase in problem.phases for bound in phase.bounds]
    for bound in (*bounds, *problem.boundary_constraints):
        yield from _sides(bound)


def _ones(symbols: Sequence[ca.SX]) -> ca.SX:
    return ca.SX.ones(len(symbols), 1)


def _sides(bound: Bound) -> Iterator[ca.SX]:
    """The expression of a bound, with a sign for each side that has a limit."""
    for sign, limit in ((1.0, bound.upper), (-1.0, bound.lower)):
        if not (is_number(limit) and np.isinf(limit)):
            yield sign * bound.expression


def _is_concave(expression: ca.SX) -> bool:
    """Whether an expression curves downwards in some direction at one of a few random points."""
    symbols = resolve(expression, "an expression")
    free = [s.symbol for s in symbols if not isinstance(s, (Constant, Time))]
    known = [s.symbol for s in symbols if isinstance(s, (Constant, Time))]
    variables, numbers = ca.vertcat(*free, ca.SX(0, 1)), ca.vertcat(*known, ca.SX(0, 1))
    if not free or ca.is_linear(expression, variables):
        return False
    second = ca.densify(ca.hessian(expression, variables)[0])
    hessian = ca.Function("hessian", [variables, numbers], [second])
    random = np.random.default_rng(0)
    for _ in range(_POINTS):
        values = (random.uniform(-1.0, 1.0, len(part)) for part in (free, known))
        curvature = np.array(hessian(*values))
        if np.isfinite(curvature).all():
            eigenvalues = np.linalg.eigvalsh(curvature)
            if eigenvalues[0] < -_ROUNDING * np.abs(eigenvalues).max():
                return True
    return False
