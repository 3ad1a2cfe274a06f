"""What happens between the collocation points: peaks, path constraints, dynamics."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ocp.continuous import Continuous
from ocp.evaluate import Evaluator
from ocp.guess import evaluate_limit
from ocp.schemes import scheme
from ocp.terms import Functional
from ocp.trajectory import Trajectory

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
_POINTS_PER_DEGREE = 6
_ZOOMS = 5


@dataclass(frozen=True)
class Extremes:
    """The largest value of an expression in each interval.

    Attributes
    ----------
    values, tau : (N,) the value and the local time at which it is taken.
    """

    values: Array
    tau: Array


def maxima(function: Callable[[Integers, Array], Array], intervals: int, degree: int) -> Extremes:
    """Largest value in every interval by dense sampling and repeated zooming in.

    `function` takes intervals and local times, (m,) each, and returns (m,) values; where it
    rides a limit it has a bump between any two of its `degree` points, so the samples are several
    times denser than these.
    """
    everyone, count = np.arange(intervals), _POINTS_PER_DEGREE * degree + 9
    grid = 0.5 - 0.5 * np.cos(np.pi * np.arange(count) / (count - 1))
    tau = np.broadcast_to(grid, (intervals, count))
    best, at = np.full(intervals, -np.inf), np.zeros(intervals)
    for _ in range(_ZOOMS):
        k = np.repeat(everyone, tau.shape[1])
        values = function(k, tau.ravel()).reshape(tau.shape)
        values = np.where(np.isfinite(values), values, np.inf)
        i = np.argmax(values, axis=1)
        top = values[everyone, i]
        better = top > best
        best, at = np.where(better, top, best), np.where(better, tau[everyone, i], at)
        low = tau[everyone, np.maximum(i - 1, 0)]
        high = tau[everyone, np.minimum(i + 1, tau.shape[1] - 1)]
        tau = low[:, None] + np.linspace(0.0, 1.0, 9) * (high - low)[:, None]
    return Extremes(best, at)


def constraint_excess(
    evaluator: Evaluator, trajectory: Trajectory, phase: str, constraint: Continuous,
    peaks: dict[Functional, float],
) -> Extremes:  # fmt: skip
    """How far a continuous constraint is exceeded in each interval, relative to its size.

    The size is the largest of its limits and of its values on the trajectory.
    """
    lower = evaluate_limit(constraint.lower, trajectory.constants)
    upper = evaluate_limit(constraint.upper, trajectory.constants)
    if constraint.peak is not None:
        upper = peaks[constraint.peak]

    largest = max((abs(v) for v in (lower, upper) if np.isfinite(v)), default=0.0)

    def excess(intervals: Integers, tau: Array) -> Array:
        nonlocal largest
        values = (
            constraint.sign
            * evaluator.values(trajectory, phase, [constraint.expression], intervals, tau).ravel()
        )
        largest = max(largest, float(np.abs(values[np.isfinite(values)]).max(initial=0.0)))
        return np.asarray(np.maximum(values - upper, lower - values))

    own = trajectory.phase(phase)
    found = maxima(excess, len(own.breakpoints) - 1, int(own.degrees.max()))
    return Extremes(found.values / (largest or 1.0), found.tau)


def equation_error(
    evaluator: Evaluator, trajectory: Trajectory, phase: str, equations: Sequence[Continuous]
) -> Array:
    """How far equations are off in each interval relative to their scales, the largest, (N,)."""
    own = trajectory.phase(phase)
    worst = np.zeros(len(own.breakpoints) - 1)
    for equation in equations:
        limit = evaluate_limit(equation.upper, trajectory.constants)

        def off(k: Integers, tau: Array, e: Any = equation.expression, at: float = limit) -> Array:
            return np.abs(evaluator.values(trajectory, phase, [e], k, tau).ravel() - at)

        found = maxima(off, worst.size, int(own.degrees.max()))
        worst = np.maximum(worst, found.values / equation.scale)
    return worst


def dense_peak(evaluator: Evaluator, trajectory: Trajectory, functional: Functional) -> float:
    """A peak evaluated between the points, over all its phases."""
    best = -np.inf
    for name, expression in functional.pieces:

        def value(k: Integers, tau: Array, n: str = name, e: Any = expression) -> Array:
            found = evaluator.values(trajectory, n, [e], k, tau).ravel()
            return np.abs(found) if functional.absolute else found

        own = trajectory.phase(name)
        found = maxima(value, len(own.breakpoints) - 1, int(own.degrees.max()))
        best = max(best, float(found.values.max()))
    return best


def dynamics_error(
    evaluator: Evaluator, trajectory: Trajectory, phase: str, sizes: Sequence[float]
) -> Array:
    """Integrated residual of the dynamics in each interval relative to the states' sizes, (N,).

    The residual ``|x' - f|`` of the collocation polynomial is integrated by Gauss quadrature of
    one point more than the degree (Betts, "Practical Methods for Optimal Control", sec. 4.7).
    """
    own = trajectory.phase(phase)
    nodes, weights = np.polynomial.legendre.leggauss(int(own.degrees.max()) + 2)
    count = len(own.breakpoints) - 1
    k, tau = np.repeat(np.arange(count), nodes.size), np.tile(0.5 * (nodes + 1.0), count)
    rates = list(evaluator.phase_of(phase).dynamics.values())
    given = evaluator.values(trajectory, phase, rates, k, tau)
    residual = np.abs(own.rates(k, tau) - given) / np.asarray(sizes)
    steps = np.diff(own.breakpoints)
    summed = np.einsum("kqs,q->ks", residual.reshape(count, nodes.size, -1), 0.5 * weights)
    error = (summed * steps[:, None]).max(axis=1)
    return np.where(np.isfinite(error), error, np.inf)


def quadrature_error(
    evaluator: Evaluator, trajectory: Trajectory, integrals: Sequence[Functional],
    phase: str, sizes: Sequence[float],
) -> Array:  # fmt: skip
    """Error of the scheme's quadrature in each interval relative to the integrals' sizes, (N,).

    The reference is Gauss quadrature of three points more than the degree; `sizes` may be
    exceeded by the integrals themselves, which then are their sizes.
    """
    own = trajectory.phase(phase)
    integrands = [f.pieces[0][1] for f in integrals]
    missed, totals = np.zeros((len(own.degrees), len(integrands))), np.zeros((len(integrands), 1))
    for piece in own.pieces if integrands else ():
        method, reference = scheme(own.scheme, piece.degree), scheme("gauss", piece.degree + 3)
        mine, better = (
            np.einsum("kqi,q->ki", evaluator.values(
                trajectory, phase, integrands, np.repeat(piece.intervals, m.degree),
                np.tile(m.points, piece.intervals.size)).reshape(-1, m.degree, len(integrands)),
                m.weights)
            for m in (method, reference)
        )  # fmt: skip
        width = np.diff(own.breakpoints)[piece.intervals, None]
        missed[piece.intervals], totals = (mine - better) * width, totals + better.T @ width
    error = (np.abs(missed) / np.maximum(sizes, np.abs(totals.ravel()))).max(axis=1, initial=0.0)
    return np.where(np.isfinite(error), error, np.inf)
