"""How far a motion is off between its points: dynamics, constraints and peaks.

Nothing here asks how the motion was found, nor what a finer mesh would gain.

A gust, a bump of the road or a resonance may be far narrower than an interval. The points of a mesh
then see the values on both sides only, and the motion holds to the last digit for a problem without
it. So a phase with what is no low polynomial of time is looked at some thousand times.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from ocp.arrays import Array, Integers
from ocp.mesh.algebraic_equations import with_solved_algebraics
from ocp.mesh.dense_integral import PANELS
from ocp.mesh.trajectory import Evaluator, PhaseTrajectory, Trajectory
from ocp.numerics.piecewise_polynomial import Extremes, dense_grid, maxima
from ocp.numerics.polynomial_expressions import polynomial_degree
from ocp.numerics.schemes import Collocation, Gauss
from ocp.problem.functionals import Peak
from ocp.problem.parameters import Parameters
from ocp.problem.symbols import TIME
from ocp.transcription.path_constraints import PathConstraint
from ocp.transcription.transcribe import Transcription

# Where something may be narrow: panels in each interval at least, and Gauss points of each
_OF_INTERVAL = 2
_OF_PANEL = 4

# Degree up to which a polynomial hides nothing between the points, and the operations of an
# expression up to which it is worth to look whether it is one
_SMOOTH = 8
_SHORT = 1000


@dataclass(frozen=True, eq=False, repr=False)
class DenseSamples:
    """Samples of one phase, in panels that divide its intervals.

    Attributes
    ----------
    motion : PhaseTrajectory
    starts : (N,)
        Number of the first panel of each interval.
    intervals : (P,)
        Of the panels.
    tau : (P, q)
        Local times of the samples.
    seconds : (P, q)
        Their weights [s].
    """

    motion: PhaseTrajectory
    starts: Integers
    intervals: Integers
    tau: Array
    seconds: Array

    @classmethod
    def of(cls, motion: PhaseTrajectory, *, narrow: bool) -> DenseSamples:
        """Those of a phase; two more than its degree in each interval if it hides nothing."""
        counts, rule = (
            np.ones(motion.intervals, np.int64),
            Gauss().at(int(motion.degrees.max()) + 2),
        )
        if narrow:
            shares = np.diff(motion.fractions) * PANELS
            counts, rule = np.ceil(shares).astype(np.int64), Gauss().at(_OF_PANEL)
            counts = np.maximum(counts, _OF_INTERVAL)
        starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
        intervals = np.repeat(np.arange(motion.intervals), counts)
        width = 1.0 / counts[intervals]
        left = (np.arange(intervals.size) - starts[intervals]) * width
        tau = left[:, None] + width[:, None] * rule.points
        seconds = (np.diff(motion.breakpoints)[intervals] * width)[:, None] * rule.weights
        return cls(motion, starts, intervals, tau, seconds)

    @property
    def places(self) -> tuple[Integers, Array]:
        """Intervals and local times of all samples, (P q,) each."""
        return np.repeat(self.intervals, self.tau.shape[1]), self.tau.ravel()

    def values(
        self, evaluator: Evaluator, trajectory: Trajectory, expressions: Sequence[ca.SX]
    ) -> Array:
        """Expressions at the samples, (n, P, q)."""
        found = evaluator.values(trajectory, self.motion.name, expressions, *self.places)
        return found.T.reshape(len(expressions), *self.tau.shape)

    def integrals(self, values: Array) -> Array:
        """Integrals over each interval of what has values (n, P, q), (n, N)."""
        of_panels = (values * self.seconds).sum(axis=2)
        return np.asarray(np.add.reduceat(of_panels, self.starts, axis=1))

    def farthest(self, values: Array) -> Array:
        """The largest integral of values (n, P, q) from the start of each interval on, (n, N).

        That is over all samples and ends of panels; infinite where a value is.
        """
        rule = Gauss().at(self.tau.shape[1])
        finite = np.isfinite(values)
        values = np.where(finite, values, 0.0)

        # from the start of the phase to that of each panel, then from that of its interval
        of_panels = (values * self.seconds).sum(axis=2)
        before = np.cumsum(of_panels, axis=1) - of_panels
        before -= before[:, self.starts][:, self.intervals]
        inside = (values * (self.seconds / rule.weights)) @ np.linalg.inv(rule.derivative[:, 1:]).T
        at_samples = np.abs(before[:, :, None] + inside).max(axis=2)
        farthest = np.maximum(at_samples, np.abs(before + of_panels))
        farthest = np.where(finite.all(axis=2), farthest, np.inf)
        return np.asarray(np.maximum.reduceat(farthest, self.starts, axis=1))

    def largest(self, values: Array) -> tuple[Array, Array]:
        """The largest of values (P, q) in each interval, and its local time, (N,) each."""
        finite = np.where(np.isfinite(values), values, -np.inf)
        highest, at = finite.max(axis=1), finite.argmax(axis=1)
        most = np.maximum.reduceat(highest, self.starts)
        # the first panel of each interval that has it
        panels = np.flatnonzero(highest == most[self.intervals])[::-1]
        first = np.empty(self.starts.size, dtype=np.int64)
        first[self.intervals[panels]] = panels
        return most, self.tau[first, at[first]]


def may_hide_features(evaluator: Evaluator, phase: str, expression: ca.SX) -> bool:
    """Whether an expression may hide something between points: it is no low polynomial of time."""

    def found() -> bool:
        if ca.n_nodes(expression) > _SHORT:
            return True
        signals = evaluator.problem.signals[phase]
        of_time = [*(signal.symbol for signal in signals), TIME.symbol]
        degree = polynomial_degree(expression, of_time, [1] * len(of_time))
        return degree is None or degree > _SMOOTH

    return evaluator.once(("narrow", phase, expression.element_hash()), found)


# Samples of a peak over all intervals of a phase, at most
_MOST_SAMPLES = 2e5


@dataclass(frozen=True, eq=False, repr=False)
class MotionErrors:
    """How far a motion is off between its points, whether it is a solution or its replay.

    Attributes
    ----------
    transcription : Transcription
        What the motion is held to: dynamics, constraints, scales.
    trajectory : Trajectory
        The motion. Its algebraic variables solve their equations between the points, too.
    evaluator : Evaluator
        Of the problem.
    parameters : Parameters
        Values of the problem's constants.
    """

    transcription: Transcription
    trajectory: Trajectory
    evaluator: Evaluator
    parameters: Parameters

    def __post_init__(self) -> None:
        solved = with_solved_algebraics(self.trajectory, self.evaluator)
        object.__setattr__(self, "trajectory", solved)

    @cached_property
    def limits(self) -> tuple[tuple[tuple[float, float], ...], ...]:
        """Lower and upper limit of each path constraint of each phase, at the motion's peaks."""
        peaks = self.trajectory.peaks_of(self.transcription.problem)
        return tuple(
            tuple(constraint.limits(self.parameters, peaks) for constraint in constraints)
            for constraints in self.transcription.constraints
        )

    @cached_property
    def excess(self) -> tuple[tuple[Extremes, ...], ...]:
        """How far the constraints of each phase are exceeded in each interval, relative.

        One `Extremes` a path constraint, minus infinity for equations. Values are exact where a
        constraint is exceeded or about to be.
        """
        return tuple(
            self._excess_of_phase(*of_phase)
            for of_phase in zip(
                self.trajectory.phases,
                self.transcription.constraints,
                self.limits,
                self._samples,
                strict=True,
            )
        )

    @cached_property
    def dynamics(self) -> tuple[Array, ...]:
        """Errors of dynamics, integrals and equations in each interval of each phase, (N,) each."""
        return tuple(
            np.maximum.reduce(
                [self._dynamics_error(k), self._quadrature_error(k), self._equation_error(k)]
            )
            for k in range(len(self.trajectory.phases))
        )

    @cached_property
    def _samples(self) -> tuple[DenseSamples, ...]:
        """Samples of each phase, dense ones where something may be narrow."""
        problem, found = self.transcription.problem, []
        for index, motion in enumerate(self.trajectory.phases):
            expressions = [
                *problem.phases[index].dynamics.values(),
                *(f.expression for f in problem.integrals[motion.name]),
                *(c.expression for c in self.transcription.constraints[index]),
            ]
            narrow = any(may_hide_features(self.evaluator, motion.name, e) for e in expressions)
            found.append(DenseSamples.of(motion, narrow=narrow))
        return tuple(found)

    @property
    def worst_excess(self) -> float:
        """Largest excess of a path constraint, relative; 0 where there is none.

        Limits that only hold a cost above its kink do not count: the objective as it was stated
        does.
        """
        pairs = zip(self.transcription.constraints, self.excess, strict=True)
        values = [
            float(extremes.values.max())
            for constraints, of_phase in pairs
            for constraint, extremes in zip(constraints, of_phase, strict=True)
            if not constraint.of_cost
        ]
        return max(values, default=0.0)

    @property
    def worst_dynamics(self) -> float:
        """Largest error of dynamics, integrals and equations in an interval, relative."""
        return max(float(errors.max()) for errors in self.dynamics)

    def _excess_of_phase(
        self,
        motion: PhaseTrajectory,
        constraints: Sequence[PathConstraint],
        limits: Sequence[tuple[float, float]],
        dense: DenseSamples,
    ) -> tuple[Extremes, ...]:
        limited = [c.expression for c in constraints if not c.is_equation]
        on_grid = _samples(self.evaluator, self.trajectory, motion, limited)
        # all at once: expressions share most of what they are made of
        hides = [may_hide_features(self.evaluator, motion.name, e) for e in limited]
        hiding = [e for e, hidden in zip(limited, hides, strict=True) if hidden]
        found = iter(dense.values(self.evaluator, self.trajectory, hiding))
        densely = [next(found) if hidden else None for hidden in hides]

        samples = iter(zip(on_grid, densely, strict=True))
        nothing = Extremes(np.full(motion.intervals, -np.inf), np.full(motion.intervals, 0.5))
        return tuple(
            nothing if c.is_equation else self._excess_of(motion, c, between, *next(samples), dense)
            for c, between in zip(constraints, limits, strict=True)
        )

    def _excess_of(
        self,
        motion: PhaseTrajectory,
        constraint: PathConstraint,
        limits: tuple[float, float],
        samples: Array,
        every: Array | None,
        dense: DenseSamples,
    ) -> Extremes:
        """Excess of one constraint from its values on the dense grid, (N, m).

        Where it may hide something, its values at the dense samples (P, q) count as well.
        """
        lower, upper = limits
        largest = 0.0

        def beyond(values: Array) -> Array:
            signed = constraint.sign * values
            return np.asarray(np.maximum(signed - upper, lower - signed))

        def sampled(values: Array) -> Array:
            nonlocal largest
            largest = max(largest, float(np.abs(values[np.isfinite(values)]).max(initial=0.0)))
            return beyond(values)

        def at(intervals: Integers, tau: Array) -> Array:
            return sampled(self._values(motion, constraint.expression, intervals, tau))

        extremes = maxima(at, sampled(samples), _grid(motion), level=0.0)
        size = constraint.size(limits, largest)
        seen, tau = extremes.values / size, extremes.tau
        if every is not None:
            most, where = dense.largest(beyond(every) / size)
            seen, tau = np.maximum(seen, most), np.where(most > seen, where, tau)
        return Extremes(seen, tau, size)

    def _equation_error(self, index: int) -> Array:
        """How far equations are off in each interval, the largest relative to its scale, (N,)."""
        samples, constraints = self._samples[index], self.transcription.constraints[index]
        worst = np.zeros(samples.motion.intervals)
        for c, (_, wanted) in zip(constraints, self.limits[index], strict=True):
            if c.is_equation:
                (values,) = samples.values(self.evaluator, self.trajectory, [c.expression])
                off, _ = samples.largest(_finite_or_infinite(np.abs(values - wanted)))
                worst = np.maximum(worst, off / c.scale)
        return worst

    def _dynamics_error(self, index: int) -> Array:
        """How far the integrated residual of the dynamics goes, by the sizes of the states, (N,).

        The residual ``x' - f`` of the collocation polynomial (Betts, "Practical Methods for Optimal
        Control", sec. 4.7) is integrated from the start of the interval on. To first order that is
        what the dynamics differ by from there (Enright, J. Comput. Appl. Math. 125, 2000). The
        residual swings about zero, so that its size tells several times as much.
        """
        samples = self._samples[index]
        rates = list(self.transcription.problem.phases[index].dynamics.values())
        states = samples.motion.states
        sizes = np.array([self.transcription.scales.signals[name] for name in states])
        stated = samples.values(self.evaluator, self.trajectory, rates)
        own = samples.motion.rates(*samples.places).T.reshape(stated.shape)
        error = samples.farthest((own - stated) / sizes[:, None, None])
        return np.asarray(error.max(axis=0))

    def _quadrature_error(self, index: int) -> Array:
        """Error of the scheme's quadrature relative to the sizes of the integrals, (N,).

        The size of an integral is its own value where that is more than its scale.
        """
        samples, motion = self._samples[index], self._samples[index].motion
        integrals = list(self.transcription.problem.integrals[motion.name])
        if not integrals:
            return np.zeros(motion.intervals)
        expressions = [f.expression for f in integrals]
        reference = samples.integrals(samples.values(self.evaluator, self.trajectory, expressions))
        by_scheme = np.empty_like(reference)
        for degree in sorted(set(motion.degrees.tolist())):
            here = np.flatnonzero(motion.degrees == degree)
            means = self._integrated(motion, expressions, here, motion.scheme.at(degree))
            by_scheme[:, here] = means.T * np.diff(motion.breakpoints)[here]

        sizes = [self.transcription.scales.functionals[f] for f in integrals]
        relative = np.maximum(sizes, np.abs(reference.sum(axis=1)))
        return _finite_or_infinite((np.abs(by_scheme - reference) / relative[:, None]).max(axis=0))

    def _integrated(
        self,
        motion: PhaseTrajectory,
        expressions: list[Any],
        intervals: Integers,
        rule: Collocation,
    ) -> Array:
        """Means of expressions over intervals (m,) by a quadrature rule, (m, n)."""
        k, tau = np.repeat(intervals, rule.degree), np.tile(rule.points, intervals.size)
        values = self.evaluator.values(self.trajectory, motion.name, expressions, k, tau)
        values = values.reshape(intervals.size, rule.degree, len(expressions))
        return np.asarray(np.einsum("kqi,q->ki", values, rule.weights))

    def _values(
        self, motion: PhaseTrajectory, expression: Any, intervals: Integers, tau: Array
    ) -> Array:
        values = self.evaluator.values(self.trajectory, motion.name, [expression], intervals, tau)
        return values.ravel()


def dense_peak(evaluator: Evaluator, trajectory: Trajectory, peak: Peak, samples: int = 0) -> float:
    """A peak evaluated between the points, over all its phases.

    Parameters
    ----------
    samples : int
        Of a phase, about, if that is more than what its intervals have.
    """
    highest = -np.inf
    for name, expression in peak.pieces:
        motion = trajectory.phase(name)

        def sized(values: Array) -> Array:
            return np.abs(values) if peak.absolute else values

        def sampled(
            intervals: Integers, tau: Array, name: str = name, expression: Any = expression
        ) -> Array:
            values = evaluator.values(trajectory, name, [expression], intervals, tau)
            return sized(values.ravel())

        # as many in each interval as the longest one takes
        grid = _grid(motion)
        count = min(samples * np.diff(motion.fractions).max(), _MOST_SAMPLES / motion.intervals)
        if count > grid.size:
            grid = np.linspace(0.0, 1.0, int(count))
        values = sampled(*_every_interval(motion, grid)).reshape(motion.intervals, -1)
        extremes = maxima(sampled, values, grid)
        highest = max(highest, float(extremes.values.max()))
    return highest


def _grid(motion: PhaseTrajectory) -> Array:
    return dense_grid(int(motion.degrees.max()))


def _every_interval(motion: PhaseTrajectory, tau: Array) -> tuple[Integers, Array]:
    """Local times (m,) in each interval: intervals and local times, (N m,) each."""
    intervals = np.repeat(np.arange(motion.intervals), tau.size)
    return intervals, np.tile(tau, motion.intervals)


def _samples(
    evaluator: Evaluator,
    trajectory: Trajectory,
    motion: PhaseTrajectory,
    expressions: Sequence[Any],
) -> list[Array]:
    """Values of expressions on the dense grid of every interval, all at once, (N, m) each."""
    intervals, tau = _every_interval(motion, _grid(motion))
    values = evaluator.values(trajectory, motion.name, expressions, intervals, tau)
    return [column.reshape(motion.intervals, -1) for column in values.T]


def _finite_or_infinite(error: Array) -> Array:
    """What is not a number counts as infinite."""
    return np.where(np.isfinite(error), error, np.inf)
