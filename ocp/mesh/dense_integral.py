"""Integrals along a motion of expressions that the mesh was not made for.

The mesh resolves what the problem states. Another expression may have a kink inside an interval, or
all of itself between the points. So intervals are divided into panels, and panels that do not agree
with their parts are cut in two again and again.
"""

from __future__ import annotations

import casadi as ca
import numpy as np

from ocp.arrays import Array, Integers
from ocp.mesh.trajectory import Evaluator, Trajectory
from ocp.numerics.schemes import Lobatto
from ocp.problem.functionals import Integral

# Panels of a phase at first, at least; fewer where so many operations would be exceeded
PANELS = 1000
_OPERATIONS = 1e7

# Points of Lobatto's rule in a panel. The ends are among them, so that no step hides there.
_OF_PANEL = 4

# Part of the integral of the modulus that panels may be off by together, and times they are cut
_TOLERANCE = 1e-10
_CUTS = 40

# Part of a panel before its cut. Not the half: for a step near the middle the points of a panel
# and of its halves all say that it is in the middle.
_FIRST = 0.382


def dense_integral(evaluator: Evaluator, trajectory: Trajectory, integral: Integral) -> float:
    """The integral of an expression over its phase [its unit times s]."""
    motion, rule = trajectory.phase(integral.phase), Lobatto().at(_OF_PANEL)
    lengths = np.diff(motion.breakpoints)

    def panels(k: Integers, left: Array, width: Array) -> tuple[Array, Array]:
        """Integrals over panels (m,) of intervals, and those of the modulus."""
        tau = left[:, None] + width[:, None] * rule.points
        values = evaluator.values(
            trajectory,
            integral.phase,
            [integral.expression],
            np.repeat(k, rule.degree),
            tau.ravel(),
        ).reshape(tau.shape)
        seconds = (width * lengths[k])[:, None] * rule.weights
        return (values * seconds).sum(axis=1), (np.abs(values) * seconds).sum(axis=1)

    nodes = ca.n_nodes(ca.SX(integral.expression))
    count = min(PANELS, _OPERATIONS / (rule.degree * nodes))
    counts = np.maximum(np.ceil(np.diff(motion.fractions) * count).astype(np.int64), 1)
    k = np.repeat(np.arange(motion.intervals), counts)
    width = 1.0 / counts[k]
    left = (np.arange(k.size) - np.repeat(np.cumsum(counts) - counts, counts)) * width
    whole, moduli = panels(k, left, width)
    total, allowed = 0.0, _TOLERANCE * float(moduli.sum())

    for _ in range(_CUTS):
        k, wide, left = np.repeat(k, 2), np.repeat(width, 2), np.repeat(left, 2)
        left = left + np.tile([0.0, _FIRST], width.size) * wide
        width = np.tile([_FIRST, 1.0 - _FIRST], width.size) * wide
        parts, _ = panels(k, left, width)
        pairs = parts.reshape(-1, 2).sum(axis=1)
        off = np.abs(pairs - whole) > allowed / PANELS
        total += float(pairs[~off].sum())
        open_ = np.repeat(off, 2)
        k, left, width, whole = k[open_], left[open_], width[open_], parts[open_]
        if not k.size:
            break
    return total + float(whole.sum())
