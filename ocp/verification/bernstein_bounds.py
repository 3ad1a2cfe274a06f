"""Rigorous bounds between the points, where a constraint is a polynomial of time.

In an interval states, polynomial controls and algebraic signals are polynomials of local time.  An
expression that only adds and multiplies them is one too, of a known degree, and a polynomial lies
between its least and largest Bernstein coefficient.  Halving the interval where the two are apart
brings the bound as close to the maximum as wanted (Farouki, "The Bernstein polynomial basis: a
centennial retrospective", Computer Aided Geometric Design 29, 2012).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.mesh.evaluation import Evaluator
from ocp.mesh.initial_guess import evaluate_limit, signals_of
from ocp.mesh.trajectory import PhaseTrajectory, Trajectory
from ocp.numerics.polynomials import largest, polynomial_degree
from ocp.numerics.schemes import bernstein
from ocp.problem.symbols import time
from ocp.problem.terms import Functional
from ocp.transcription.path_constraints import Continuous

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
_HIGHEST = 24  # degree; the change of basis amplifies round-off by about 2^degree
_CLOSE = 1e-10  # bound minus maximum, relative to the size of the constraint


@dataclass(frozen=True)
class Margin:
    """How far a continuous constraint is exceeded, relative to its size; negative if it is kept.

    Attributes
    ----------
    dense : the largest value found by dense evaluation.
    rigorous : a bound that no instant exceeds, round-off included; None where the expression is
        no polynomial of time (of a degree up to 24).
    """

    phase: str
    name: str
    dense: float
    rigorous: float | None


def rigorous_excess(
    evaluator: Evaluator, trajectory: Trajectory, phase: str, constraint: Continuous,
    peaks: dict[Functional, float],
) -> float | None:  # fmt: skip
    """A bound on how far a constraint is exceeded in a phase, relative to its size, or None.

    The size is the largest of its limits and of its values on the trajectory.
    """
    own = trajectory.phase(phase)
    lower, upper = (evaluate_limit(v, trajectory.constants)
                    for v in (constraint.lower, constraint.upper))  # fmt: skip
    if constraint.peak is not None:
        upper = peaks[constraint.peak]
    sampled = []
    for piece in own.pieces:
        degree = _degree(evaluator, own, constraint.expression, piece.degree)
        if degree is None or degree > _HIGHEST:
            return None
        sampled.append(
            (constraint.sign * _sampled(evaluator, trajectory, phase, constraint.expression,
                                        piece.intervals, degree), _change(degree))
        )  # fmt: skip
    largest_value = max(float(np.abs(values).max()) for values, _ in sampled)
    if not math.isfinite(largest_value):
        return math.inf
    size = max([abs(v) for v in (lower, upper) if math.isfinite(v)] + [largest_value]) or 1.0
    worst = -math.inf
    for values, change in sampled:
        noise = np.finfo(float).eps * np.abs(change).sum(axis=1).max() * largest_value
        for limit, sign in ((upper, 1.0), (lower, -1.0)):
            if math.isfinite(limit):
                found = largest(sign * (values @ change.T - limit), _CLOSE * size)
                worst = max(worst, float(found.max()) + noise)
    return float(worst / size)


def _degree(
    evaluator: Evaluator, own: PhaseTrajectory, expression: ca.SX, degree: int
) -> int | None:
    """Degree of an expression in the intervals of a degree of the state polynomials."""
    kinds = [(own.states, degree), (own.constant, 0), (own.linear, 1),
             (own.polynomial, degree - 1), (own.algebraics, degree - 1)]  # fmt: skip
    by_name = {name: of for names, of in kinds for name in names}
    signals = signals_of(evaluator.problem, evaluator.phase_of(own.name))
    symbols = [*(s.symbol for s in signals), time.symbol]
    return polynomial_degree(expression, symbols, [*(by_name[s.name] for s in signals), 1])


def _nodes(degree: int) -> Array:
    """Extrema of Chebyshev's polynomial on [0, 1], shape (degree + 1,)."""
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * np.arange(degree + 1) / max(degree, 1)))


def _change(degree: int) -> Array:
    """From values at the nodes to Bernstein coefficients, (degree + 1, degree + 1)."""
    return np.asarray(np.linalg.inv(bernstein(degree + 1, _nodes(degree))))


def _sampled(
    evaluator: Evaluator, trajectory: Trajectory, phase: str, expression: Any,
    intervals: Integers, degree: int,
) -> Array:  # fmt: skip
    """Values at the nodes of some intervals, shape (m, degree + 1)."""
    k, tau = np.repeat(intervals, degree + 1), np.tile(_nodes(degree), intervals.size)
    values = evaluator.values(trajectory, phase, [expression], k, tau)
    return np.asarray(values.reshape(intervals.size, degree + 1))
