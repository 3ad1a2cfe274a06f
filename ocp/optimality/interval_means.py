"""Means over the intervals of what is known at the collocation points, by their own weights."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocp.arrays import Array, Integers
from ocp.transcription.columns import PhaseColumns


@dataclass(frozen=True, eq=False, repr=False)
class CollocationPoints:
    """All collocation points of a phase of `count` intervals, (m,) each."""

    intervals: Integers
    tau: Array
    weights: Array
    count: int

    def means(self, values: Array) -> Array:
        """Means over each interval of values (m, ...) at the points, (N, ...)."""
        means = np.zeros((self.count, *values.shape[1:]))
        np.add.at(means, self.intervals, (self.weights * values.T).T)
        return means


def collocation_points(columns: PhaseColumns) -> CollocationPoints:
    """The collocation points of a phase, group by group."""
    intervals, tau, weights = [], [], []
    for group in columns.groups:
        rule, count = group.collocation, group.intervals.size
        intervals.append(np.repeat(group.intervals, rule.degree))
        tau.append(np.tile(rule.points, count))
        weights.append(np.tile(rule.weights, count))
    return CollocationPoints(
        np.concatenate(intervals), np.concatenate(tau), np.concatenate(weights), columns.intervals
    )
