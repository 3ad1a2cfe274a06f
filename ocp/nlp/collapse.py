"""Motions that take no time, because nothing in the statement needs any."""

from __future__ import annotations

import numpy as np

from ocp.arrays import Array
from ocp.errors import Collapsed
from ocp.mesh.trajectory import Trajectory
from ocp.transcription.transcribe import Transcription

# Of the typical duration: what lasts no longer has shrunk to the least duration. That is a
# thousandth of this (`ocp.transcription.blocks`), and the barrier of the solver keeps a little off.
VANISHED = 1e-6

# Of the typical duration: what a solver may have left when it fails on the way there
_NEARLY_VANISHED = 1e-3

# Typical sizes of the objective or an unknown beyond which it counts as unbounded
RUNAWAY = 1e7


def collapsed(
    transcription: Transcription, trajectory: Trajectory, failed: Array | None = None
) -> Collapsed | None:
    """The error of a motion that takes no time, or None.

    Parameters
    ----------
    failed : (n,)
        The scaled unknowns, if the solver failed there. It may have been on its way: little time is
        left, and the control that makes it so runs away.
    """
    duration = sum(float(np.ptp(phase.breakpoints)) for phase in trajectory.phases)
    share = duration / transcription.scales.time
    on_its_way = failed is not None and float(np.abs(failed).max(initial=0.0)) > RUNAWAY
    if share > (_NEARLY_VANISHED if on_its_way else VANISHED):
        return None
    return Collapsed(
        f"the motion of '{transcription.problem.name}' shrinks to {duration:.1e} s: nothing in "
        "the statement needs time; prescribe where the motion ends, bound what drives it, or state "
        "a least duration",
        trajectory,
    )
