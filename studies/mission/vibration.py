"""What an opening ring does to the arm that carries it, while it opens and after it has stopped."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from models.laws import BetweenRests, Law
from models.ring_on_arm import RingOnArm, arm_motion
from ocp.arrays import Array
from studies.truss.config import DEPLOYED

PERIODS = 3.0  # of the slowest mode that are followed after the ring has stopped
SAMPLES = 1001  # while the ring opens


@dataclass(frozen=True, eq=False)
class ArmResponse:
    """The arm under its ring.

    Attributes
    ----------
    times : (m,) from the ring's start, and beyond its end [s].
    tip : (m,) displacement of the tip across the arm [m].
    peak : largest while the ring moves [m].
    amplitude : largest afterwards [m].
    energy : that is left in arm and ring [J].
    """

    times: Array
    tip: Array
    peak: float
    amplitude: float
    energy: float


def arm_response(model: RingOnArm, law: Law) -> ArmResponse:
    """What a law of the ring does to the arm."""
    after = PERIODS / float(model.frequencies(DEPLOYED)[0])
    moved = arm_motion(model, BetweenRests(law, after=after))
    step = law.duration / (SAMPLES - 1)
    beyond = law.duration + np.arange(1, math.floor(after / step) + 1) * step
    times = np.concatenate([np.linspace(0.0, law.duration, SAMPLES), beyond])

    _, tip = moved.tip(times)
    stopped = times >= law.duration
    end = np.ravel(moved.at(law.duration))  # q and v where the ring has opened
    return ArmResponse(
        times,
        tip,
        float(np.abs(tip[~stopped]).max()),
        float(np.abs(tip[stopped]).max()),
        float(model.residual_energy(end[:4], end[4:])),
    )
