"""Loss at the pulleys, summed pulley by pulley in NumPy, (28)-(29).

Symbols: T [N] tension; mu pulley friction; alpha [rad], omega [rad/s]; e' [m/rad].

Seen from the motor a rope runs, in each module, from slider to bar end (e), along two half
cross-bars (b, b) and from bar end to slider (e). Its far end is fixed, so the rope passes over
a pulley at the rate at which all segments beyond that pulley shorten.
"""

from __future__ import annotations

import math

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from models.truss.kinematics import slider_distance_slope
from models.truss.parameters import TrussParameters


def pulley_loss_by_sum(
    parameters: TrussParameters, angle: ArrayLike, speed: ArrayLike, tension: ArrayLike
) -> NDArray[np.float64]:
    """Power dissipated at the pulleys of both ropes [W], shape (m,).

    Parameters
    ----------
    angle, speed, tension : alpha [rad], omega [rad/s], T1 [N], shape (m,), omega >= 0.
    """
    alpha = np.atleast_1d(np.asarray(angle, dtype=float))
    slope = slider_distance_slope(parameters, ca.DM(alpha)).full().ravel()
    hauled = -slope * np.asarray(speed, dtype=float)  # by each sliding segment [m/s]
    wraps = (math.pi - alpha, math.pi - 2 * alpha, math.pi - alpha, math.pi + 0 * alpha)
    sliding = (1, 0, 0, 1)  # which of a module's segments change length
    beyond = 2 * parameters.modules * hauled
    here = np.asarray(tension, dtype=float) + 0 * alpha
    loss = np.zeros_like(alpha)
    for k in range(4 * parameters.modules - 1):
        beyond = beyond - sliding[k % 4] * hauled
        drop = -here * np.expm1(-parameters.pulley_friction * wraps[k % 4])
        loss += 2 * drop * beyond
        here = here - drop
    return loss
