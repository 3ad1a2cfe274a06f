"""Panels that divide the intervals of a motion, each with a few Gauss points: dense samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocp.arrays import Array, Integers
from ocp.mesh.trajectory import PhaseTrajectory
from ocp.numerics.schemes import Gauss

# Samples of all phases together, and of one panel of an interval. Long expressions are sampled
# less: so many operations in all take some hundredths of a second.
_SAMPLES = 4000
OF_PANEL = 4
_OPERATIONS = 1e7

# Panels of an interval, at least. Where none is as long as that, a mesh is as fine as the samples,
# and has seen all that they see.
_LEAST = 2

# Part of what is off in an interval that lies outside of the feature, at most, on each side
_OUTSIDE = 0.01


def panels_of_phase(motions: tuple[PhaseTrajectory, ...], operations: int) -> int:
    """About how many panels a phase may have, or 0 where so few would tell nothing.

    Parameters
    ----------
    motions : tuple of PhaseTrajectory
        Of all phases.
    operations : int
        Of the longest expressions of a phase.
    """
    samples = min(_SAMPLES, _OPERATIONS / max(1, operations))
    panels = int(samples // (OF_PANEL * len(motions)))
    longest = max(float(np.diff(motion.fractions).max()) for motion in motions)
    return panels if longest * panels >= _LEAST else 0


@dataclass(frozen=True, eq=False, repr=False)
class DensePanels:
    """Panels of one phase.

    Attributes
    ----------
    motion : PhaseTrajectory
    starts : (N,)
        Number of the first panel of each interval.
    intervals : (P,)
        Of the panels.
    left, width : (P,)
        In local time.
    """

    motion: PhaseTrajectory
    starts: Integers
    intervals: Integers
    left: Array
    width: Array

    @classmethod
    def of(cls, motion: PhaseTrajectory, panels: int) -> DensePanels:
        """About so many panels, which are as long as each other."""
        shares = np.diff(motion.fractions)
        counts = np.maximum(np.ceil(shares * panels).astype(np.int64), _LEAST)
        starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
        intervals = np.repeat(np.arange(motion.intervals), counts)
        number = np.arange(intervals.size) - starts[intervals]
        width = 1.0 / counts[intervals]
        return cls(motion, starts, intervals, number * width, width)

    @property
    def tau(self) -> Array:
        """Local times of the samples, (P, q)."""
        return np.asarray(self.left[:, None] + self.width[:, None] * Gauss().at(OF_PANEL).points)

    @property
    def seconds(self) -> Array:
        """Weights of the samples [s], (P, q)."""
        panels = np.diff(self.motion.breakpoints)[self.intervals] * self.width
        return np.asarray(panels[:, None] * Gauss().at(OF_PANEL).weights)

    def in_all(self, by_panel: Array) -> Array:
        """Sums over the panels of each interval, (..., P) to (..., N)."""
        return np.asarray(np.add.reduceat(by_panel, self.starts, axis=-1))

    def span(self, k: int, off: Array) -> tuple[float, float]:
        """Where nearly all of what is off in interval `k` is, with a panel on each side.

        Parameters
        ----------
        off : (P,)
            In the panels.

        Returns
        -------
        first, last : float
            Fractions of the phase.
        """
        own = np.flatnonzero(self.intervals == k)
        shares = np.cumsum(off[own]) / off[own].sum()
        first = int(own[int(np.searchsorted(shares, _OUTSIDE))])
        last = int(own[min(int(np.searchsorted(shares, 1.0 - _OUTSIDE)), own.size - 1)])
        start, size = self.motion.fractions[k], np.diff(self.motion.fractions)[k]
        beside = self.width[first]
        return (
            max(float(start + (self.left[first] - beside) * size), 0.0),
            min(float(start + (self.left[last] + 2 * beside) * size), 1.0),
        )


def finite(values: Array) -> Array:
    """What is not a number counts as nothing: the points have told it."""
    return np.where(np.isfinite(values), values, 0.0)
