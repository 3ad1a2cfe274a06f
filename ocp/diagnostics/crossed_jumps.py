"""Jumps of a statement's expressions that a motion goes over."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ocp.mesh.mesh import MIDPOINTS
from ocp.mesh.trajectory import Evaluator, Trajectory
from ocp.problem.discontinuities import Discontinuity


def crossed_jumps(trajectory: Trajectory, evaluator: Evaluator) -> Iterator[Discontinuity]:
    """The jumps whose cause has more than one value along the motion of their phase."""
    for found in evaluator.problem.discontinuities:
        if not found.phase:
            continue
        motion = trajectory.phase(found.phase)
        k = np.repeat(np.arange(motion.intervals), MIDPOINTS.size)
        tau = np.tile(MIDPOINTS, motion.intervals)
        if np.ptp(evaluator.values(trajectory, found.phase, [found.cause], k, tau)) > 0.0:
            yield found
