"""Rigorous bounds between the points, where a constraint is a polynomial of time.

In an interval all signals are polynomials of local time. An expression that only adds and
multiplies them is one too, of a known degree, and a polynomial lies between its least and largest
Bernstein coefficient. Halving the interval where the two are apart brings the bound as close to the
maximum as wanted (Farouki, "The Bernstein polynomial basis: a centennial retrospective", Computer
Aided Geometric Design 29, 2012).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ocp.arrays import Array, Integers
from ocp.mesh.evaluation import Evaluator
from ocp.mesh.trajectory import PhaseTrajectory, Trajectory
from ocp.numerics.piecewise_polynomial import Lagrange, to_bernstein
from ocp.numerics.polynomial_expressions import largest, polynomial_degree
from ocp.problem.functionals import Peak
from ocp.problem.symbols import TIME
from ocp.transcription.path_constraints import PathConstraint

# The change of basis amplifies round-off by about 2^degree: at 24, to 2e-9 of the largest value
_HIGHEST_DEGREE = 24

# Bound minus maximum, relative to the size of the constraint: far below any tolerance on a path
_CLOSE = 1e-10


@dataclass(frozen=True)
class Margin:
    """How far a path constraint is exceeded, relative to its size; negative if it is kept.

    Attributes
    ----------
    phase, name : str
    dense : float
        The largest value found by dense evaluation.
    rigorous : float or None
        A bound that no instant exceeds, round-off included. None where the expression is no
        polynomial of time, or one of a degree above 24.
    """

    phase: str
    name: str
    dense: float
    rigorous: float | None


def rigorous_excess(
    evaluator: Evaluator,
    trajectory: Trajectory,
    phase: str,
    constraint: PathConstraint,
    peaks: Mapping[Peak, float],
) -> float | None:
    """A bound on how far a constraint is exceeded in a phase, or None where there is none.

    It is relative to the size of the constraint: the largest of its limits and of its values on the
    trajectory. It is infinite where a value is not finite.

    Parameters
    ----------
    peaks : mapping of Peak to float
        Their values, which bound the constraints that belong to them.
    """
    motion = trajectory.phase(phase)
    parts = []
    for orders, intervals in _intervals_by_orders(motion).items():
        degree = _degree(evaluator, motion, constraint, orders)
        if degree is None or degree > _HIGHEST_DEGREE:
            return None
        nodes = _nodes(degree)
        values = _sampled(evaluator, trajectory, phase, constraint, intervals, nodes)
        parts.append((values, to_bernstein(Lagrange(tuple(nodes.tolist())))))

    largest_value = max(float(np.abs(values).max()) for values, _ in parts)
    if not math.isfinite(largest_value):
        return math.inf
    limits = constraint.limits(evaluator.parameters(trajectory), peaks)
    size = max([abs(limit) for limit in limits if math.isfinite(limit)] + [largest_value]) or 1.0

    worst = -math.inf
    for values, change in parts:
        # round-off of the coefficients
        noise = np.finfo(float).eps * np.abs(change).sum(axis=1).max() * largest_value
        for limit, sign in zip(limits, (-1.0, 1.0), strict=True):
            if math.isfinite(limit):
                bounds = largest(sign * (values @ change.T - limit), _CLOSE * size)
                worst = max(worst, float(bounds.max()) + noise)
    return float(worst / size)


def _intervals_by_orders(motion: PhaseTrajectory) -> dict[tuple[int, ...], Integers]:
    """Intervals (m,) in which the signals have the same orders, by the orders of each group."""
    table = np.column_stack([group.polynomial.orders for group in motion.groups])
    intervals: dict[tuple[int, ...], list[int]] = {}
    for number, orders in enumerate(table.tolist()):
        intervals.setdefault(tuple(orders), []).append(number)
    return {orders: np.array(numbers) for orders, numbers in intervals.items()}


def _degree(
    evaluator: Evaluator,
    motion: PhaseTrajectory,
    constraint: PathConstraint,
    orders: tuple[int, ...],
) -> int | None:
    """Degree of a constraint where the groups of signals have these orders."""
    symbols = {s.name: s.symbol for s in evaluator.problem.signals[motion.name]}
    names = motion.signals
    degrees = [
        order for group, order in zip(motion.groups, orders, strict=True) for _ in group.names
    ]
    polynomials = [*(symbols[name] for name in names), TIME.symbol]
    return polynomial_degree(constraint.expression, polynomials, [*degrees, 1])


def _nodes(degree: int) -> Array:
    """Extrema of Chebyshev's polynomial on [0, 1], shape (degree + 1,)."""
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * np.arange(degree + 1) / max(degree, 1)))


def _sampled(
    evaluator: Evaluator,
    trajectory: Trajectory,
    phase: str,
    constraint: PathConstraint,
    intervals: Integers,
    nodes: Array,
) -> Array:
    """Values of a constraint at local times of some intervals, shape (m, nodes)."""
    k, tau = np.repeat(intervals, nodes.size), np.tile(nodes, intervals.size)
    values = evaluator.values(trajectory, phase, [constraint.expression], k, tau)
    return np.asarray(constraint.sign * values.reshape(intervals.size, nodes.size))
