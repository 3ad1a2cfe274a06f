"""Samples of a motion that are nowhere far apart, however long its intervals are.

A gust, a bump of the road or a resonance may be far narrower than an interval. The points of a mesh
then see the values on both sides only, and the motion holds to the last digit for a problem without
it. So what is no low polynomial of time is looked at some thousand times in each phase.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ocp.arrays import Array, Integers
from ocp.mesh.trajectory import Evaluator, PhaseTrajectory, Trajectory
from ocp.numerics.polynomial_expressions import polynomial_degree
from ocp.numerics.schemes import Gauss
from ocp.problem.symbols import TIME

# Panels of a phase, at least, each with so many Gauss points
_PANELS = 1000
_OF_PANEL = 4

# Panels of an interval, at least. Where none is as long as that, a mesh is as fine as the samples,
# and has seen all that they see.
_LEAST = 2

# Degree up to which a polynomial hides nothing between the points, and the operations of an
# expression up to which it is worth to look whether it is one
_SMOOTH = 8
_SHORT = 1000

# Times what the points of an interval tell, up to which dense samples are the same thing once more.
# What is less than the last number is rounding.
_MORE = 3.0
_NOTHING = 1e-9


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
    def of(cls, motion: PhaseTrajectory) -> DenseSamples | None:
        """Those of a phase; None where its own points are as dense."""
        shares = np.diff(motion.fractions)
        if shares.max() * _PANELS < _LEAST:
            return None
        counts = np.maximum(np.ceil(shares * _PANELS).astype(np.int64), _LEAST)
        starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
        intervals = np.repeat(np.arange(motion.intervals), counts)
        width, rule = 1.0 / counts[intervals], Gauss().at(_OF_PANEL)
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
        """Integrals over each interval of what has values (..., P, q), (..., N).

        What is not a number counts as nothing: the points have told it.
        """
        finite = np.where(np.isfinite(values), values, 0.0)
        return np.asarray(
            np.add.reduceat((finite * self.seconds).sum(axis=-1), self.starts, axis=-1)
        )

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


def is_rough(evaluator: Evaluator, phase: str, expression: ca.SX) -> bool:
    """Whether an expression may hide something between points: it is no low polynomial of time."""

    def found() -> bool:
        if ca.n_nodes(expression) > _SHORT:
            return True
        signals = evaluator.problem.signals[phase]
        of_time = [*(signal.symbol for signal in signals), TIME.symbol]
        degree = polynomial_degree(expression, of_time, [1] * len(of_time))
        return degree is None or degree > _SMOOTH

    return evaluator.once(("rough", phase, expression.element_hash()), found)


def is_unseen(densely: Array, at_points: Array) -> Array:
    """Whether what the points of intervals tell (N,) misses most of what is there (N,)."""
    return np.asarray(densely > _MORE * np.maximum(at_points, 0.0) + _NOTHING)
