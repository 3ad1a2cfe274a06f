"""Whether a problem has one optimum only: linear rates, and nothing that curves the wrong way.

A convex problem has no local optimum beside the global one. Rates and equations have to be linear,
what is minimised convex, and upper limits are set to convex expressions, lower ones to concave
ones. Only linear and quadratic expressions are taken for convex. What is convex otherwise gets a
few more starts than it needs.
"""

from __future__ import annotations

from collections.abc import Iterator

import casadi as ca
import numpy as np

from ocp.numerics.polynomial_expressions import curves_upwards, is_linear, is_quadratic
from ocp.problem.bounds import Bound
from ocp.problem.functionals import AnyFunctional, Peak
from ocp.problem.parameters import Parameters
from ocp.problem.phase import Phase
from ocp.problem.problem import Problem
from ocp.problem.symbols import TIME, Between, Constant, Time, is_number, resolve

Interval = tuple[float, float]

# Instants of a phase at which a quadratic function that changes with time is looked at
_INSTANTS = 20


def seems_convex(problem: Problem, parameters: Parameters) -> bool:
    """Whether a problem has one optimum only, as far as is seen, at values of its constants.

    With a free time it may have several: the duration of a phase multiplies its rates.
    """
    if any(isinstance(time, Between) for p in problem.phases for time in (p.start, p.end)):
        return False
    return _has_linear_rates(problem) and all(
        _is_convex(expression, times, parameters)
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


def _is_convex(expression: ca.SX, times: Interval, parameters: Parameters) -> bool:
    """Whether an expression is linear, or quadratic and curved upwards at all instants looked at.

    Parameters
    ----------
    times : (first, last) at which it is looked at [s].
    """
    symbols = resolve(expression, "an expression")
    free = [s.symbol for s in symbols if not isinstance(s, (Constant, Time))]
    known = [s for s in symbols if isinstance(s, Constant)]
    variables, constants = ca.vertcat(*free), ca.vertcat(*[s.symbol for s in known], ca.SX(0, 1))
    if not free or is_linear(expression, variables):
        return True
    if not is_quadratic(expression, variables):
        return False

    second = ca.densify(ca.hessian(expression, variables)[0])
    curvature = ca.Function("curvature", [constants, TIME.symbol], [second])
    values = [parameters.values[s.name] for s in known]
    instants = np.linspace(*times, _INSTANTS)
    return curves_upwards(np.array([np.array(curvature(values, time)) for time in instants]))
