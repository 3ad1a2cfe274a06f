"""What happens between the collocation points: peaks, path constraints, dynamics."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ocp.mesh.evaluation import Evaluator
from ocp.mesh.initial_guess import evaluate_limit
from ocp.mesh.trajectory import Trajectory
from ocp.numerics.schemes import scheme
from ocp.problem.terms import Functional
from ocp.transcription.path_constraints import Continuous

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
_POINTS_PER_DEGREE = 6
_ZOOMS = 5


@dataclass(frozen=True, eq=False)
class Extremes:
    """The largest value of an expression in each interval.

    Attributes
    ----------
    values, tau : (N,) the value and the local time at which it is taken.
    """

    values: Array
    tau: Array


def dense_grid(degree: int) -> Array:
    """Local times of dense sampling.

    Where a function rides a limit it has a bump between any two of its `degree` points, so the
    samples are several times denser than these.
    """
    count = _POINTS_PER_DEGREE * degree + 9
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * np.arange(count) / (count - 1)))


def maxima(
    function: Callable[[Integers, Array], Array], values: Array, grid: Array,
    level: float = np.inf,
) -> Extremes:  # fmt: skip
    """Largest value in every interval from dense samples, by repeated zooming in.

    Parameters
    ----------
    function : takes intervals and local times, (m,) each, and returns (m,) values.
    values : (N, m) the function at the local times `grid` (m,) of all intervals.
    level : what lies below it and below the largest value of all needs no zoom.
    """
    tau = np.broadcast_to(grid, values.shape)
    best, at = np.full(len(values), -np.inf), np.zeros(len(values))
    k = np.arange(len(values))
    for zoom in range(_ZOOMS):
        if zoom:
            values = function(np.repeat(k, tau.shape[1]), tau.ravel()).reshape(tau.shape)
        values = np.where(np.isfinite(values), values, np.inf)
        i, row = np.argmax(values, axis=1), np.arange(k.size)
        left, right = np.maximum(i - 1, 0), np.minimum(i + 1, tau.shape[1] - 1)
        top = values[row, i]
        better = top > best[k]
        best[k], at[k] = np.where(better, top, best[k]), np.where(better, tau[row, i], at[k])
        # a smooth function rises above its samples by less than they differ
        reach = np.where(np.isfinite(top), 2.0 * top, np.nan) - np.minimum(
            values[row, left], values[row, right])  # fmt: skip
        near = reach >= min(level, best.max())
        if not near.any():
            break
        low, high = tau[row, left][near, None], tau[row, right][near, None]
        k, tau = k[near], low + np.linspace(0.0, 1.0, 9) * (high - low)
    return Extremes(best, at)


def constraint_excess(
    evaluator: Evaluator, trajectory: Trajectory, phase: str, constraints: Sequence[Continuous],
    peaks: dict[Functional, float],
) -> list[Extremes]:  # fmt: skip
    """How far continuous constraints are exceeded in each interval, relative to their sizes.

    The size is the largest of its limits and of its values on the trajectory.  Values are exact
    where a constraint is exceeded or about to be, and where it is closest to that.
    """
    return [
        _excess(evaluator, trajectory, phase, c, peaks, values, grid)
        for c, (values, grid) in zip(constraints, _sampled(
            evaluator, trajectory, phase, [c.expression for c in constraints]), strict=True)
    ]  # fmt: skip


def _sampled(
    evaluator: Evaluator, trajectory: Trajectory, phase: str, expressions: Sequence[Any]
) -> list[tuple[Array, Array]]:
    """Values (N, m) and local times (m,) of expressions on a dense grid, all at once."""
    own = trajectory.phase(phase)
    grid, count = dense_grid(int(own.degrees.max())), len(own.breakpoints) - 1
    k, tau = np.repeat(np.arange(count), grid.size), np.tile(grid, count)
    values = evaluator.values(trajectory, phase, expressions, k, tau)
    return [(column.reshape(count, -1), grid) for column in values.T]


def _excess(
    evaluator: Evaluator, trajectory: Trajectory, phase: str, constraint: Continuous,
    peaks: dict[Functional, float], samples: Array, grid: Array,
) -> Extremes:  # fmt: skip
    """Excess of one constraint from its dense samples (N, m)."""
    lower = evaluate_limit(constraint.lower, trajectory.constants)
    upper = evaluate_limit(constraint.upper, trajectory.constants)
    if constraint.peak is not None:
        upper = peaks[constraint.peak]
    largest = max((abs(v) for v in (lower, upper) if np.isfinite(v)), default=0.0)

    def over(values: Array) -> Array:
        nonlocal largest
        largest = max(largest, float(np.abs(values[np.isfinite(values)]).max(initial=0.0)))
        signed = constraint.sign * values
        return np.asarray(np.maximum(signed - upper, lower - signed))

    def excess(intervals: Integers, tau: Array) -> Array:
        return over(
            evaluator.values(trajectory, phase, [constraint.expression], intervals, tau).ravel()
        )

    found = maxima(excess, over(samples), grid, level=0.0)
    return Extremes(found.values / (largest or 1.0), found.tau)


def equation_error(
    evaluator: Evaluator, trajectory: Trajectory, phase: str, equations: Sequence[Continuous]
) -> Array:
    """How far equations are off in each interval relative to their scales, the largest, (N,)."""
    worst = np.zeros(len(trajectory.phase(phase).breakpoints) - 1)
    sampled = _sampled(evaluator, trajectory, phase, [e.expression for e in equations])
    for equation, (samples, grid) in zip(equations, sampled, strict=True):
        limit = evaluate_limit(equation.upper, trajectory.constants)

        def off(k: Integers, tau: Array, e: Any = equation.expression, at: float = limit) -> Array:
            return np.abs(evaluator.values(trajectory, phase, [e], k, tau).ravel() - at)

        found = maxima(off, np.abs(samples - limit), grid, level=-np.inf)
        worst = np.maximum(worst, found.values / equation.scale)
    return worst


def dense_peak(evaluator: Evaluator, trajectory: Trajectory, functional: Functional) -> float:
    """A peak evaluated between the points, over all its phases."""
    best = -np.inf
    for name, expression in functional.pieces:

        def value(k: Integers, tau: Array, n: str = name, e: Any = expression) -> Array:
            found = evaluator.values(trajectory, n, [e], k, tau).ravel()
            return np.abs(found) if functional.absolute else found

        ((samples, grid),) = _sampled(evaluator, trajectory, name, [expression])
        found = maxima(value, np.abs(samples) if functional.absolute else samples, grid)
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
