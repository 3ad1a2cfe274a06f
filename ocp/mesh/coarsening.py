"""Coarser meshes: neighbouring intervals merged wherever one polynomial does for all of them.

A mesh that was refined holds intervals that its motion no longer needs: bisection leaves a trail on
its way to a switch, and a uniform first mesh cuts long arcs in pieces. Breakpoints that a motion
needs are the ends of its arcs, and a few where an arc is curved.
"""

from __future__ import annotations

import numpy as np

from ocp.arrays import Array, Integers
from ocp.mesh.mesh import Mesh, PhaseMesh
from ocp.mesh.trajectory import PhaseTrajectory, Trajectory

# Samples of an interval: both ends, so that a jump between two intervals counts as one.
_SAMPLES = 0.5 - 0.5 * np.cos(np.pi * np.arange(5) / 4)

# Of the phase: constraints are imposed at the points of an interval, so none is longer than this.
_WIDEST = 0.2


def coarsened(trajectory: Trajectory, tolerance: float) -> Mesh:
    """The mesh of a motion without the breakpoints that its signals do not need.

    Parameters
    ----------
    trajectory : Trajectory
    tolerance : float
        Of the range of a signal, by which one polynomial may differ from those that it replaces.
        Controls keep the order that they have, states the degree of their interval.
    """
    return Mesh(tuple(_coarsened(motion, tolerance) for motion in trajectory.phases))


def _coarsened(motion: PhaseTrajectory, tolerance: float) -> PhaseMesh:
    signals = _sampled(motion)
    kept, degrees = [0], list[int]()
    while kept[-1] < motion.intervals:
        first = last = kept[-1]
        while last + 1 < motion.intervals and _is_one(motion, signals, first, last + 1, tolerance):
            last += 1
        kept.append(last + 1)
        degrees.append(int(motion.degrees[first : last + 1].max()))
    return PhaseMesh(motion.fractions[kept], np.array(degrees))


def _sampled(motion: PhaseTrajectory) -> list[tuple[Integers, Array]]:
    """Orders (N,) of each state and control, and its samples (N, m) relative to its range."""
    intervals = np.repeat(np.arange(motion.intervals), _SAMPLES.size)
    tau = np.tile(_SAMPLES, motion.intervals)
    sampled = []
    for name in (*motion.states, *motion.controls):
        polynomial = motion.polynomial(name)
        values = polynomial.value(intervals, tau).reshape(motion.intervals, -1)
        if (size := float(np.ptp(values))) > 0.0:
            sampled.append((polynomial.orders, values / size))
    return sampled


def _is_one(
    motion: PhaseTrajectory,
    signals: list[tuple[Integers, Array]],
    first: int,
    last: int,
    tolerance: float,
) -> bool:
    """Whether one polynomial a signal does for the intervals from the first to the last."""
    points, here = motion.fractions[first : last + 2], slice(first, last + 1)
    width = points[-1] - points[0]
    if width > _WIDEST:
        return False
    at = ((points[:-1, None] + np.diff(points)[:, None] * _SAMPLES) - points[0]) / width
    for orders, values in signals:
        basis = np.polynomial.legendre.legvander(2 * at.ravel() - 1, int(orders[here].max()))
        wanted = values[here].ravel()
        fitted = basis @ np.linalg.lstsq(basis, wanted, rcond=None)[0]
        if np.abs(fitted - wanted).max() > tolerance:
            return False
    return True
