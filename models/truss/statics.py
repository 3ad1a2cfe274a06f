"""The peak of the static rope force U'/f, the ridge that every slow deployment has to cross."""

from __future__ import annotations

import math
from typing import NamedTuple

import casadi as ca

from models.peaks import dense_peak
from models.truss.dynamics import static_force
from models.truss.parameters import TrussParameters


class StaticPeak(NamedTuple):
    """Greatest static motor force on each rope [N] and the angle where it is needed [rad]."""

    angle: float
    force: float


def static_peak(parameters: TrussParameters) -> StaticPeak:
    """Maximum of U'/f from stowed to open, at the truss's own pulley friction."""
    peak = dense_peak(
        lambda alpha: static_force(parameters, ca.DM(alpha)).full().ravel(),
        parameters.stowed_angle,
        math.pi / 2,
        breakpoints=(parameters.net_angle,),
    )
    return StaticPeak(angle=peak.where, force=peak.value)
