"""Lower bounds on peaks of a deployment of the truss from rest to rest, without a jerk limit.

Both are infima: no motion with zero acceleration at its ends attains them.
"""

from __future__ import annotations

import math

from models.laws.bounds import least_peak_acceleration
from models.truss.inertia import total_mass
from models.truss.kinematics import ring_radius, rope_length
from models.truss.parameters import TrussParameters


def rope_travel(parameters: TrussParameters) -> float:
    """Length of one rope that a deployment hauls in [m]: 2 n (e(alpha0) - e(pi/2))."""
    stowed = rope_length(parameters, parameters.stowed_angle)
    return float(stowed - rope_length(parameters, math.pi / 2))


def least_peak_rope_acceleration(parameters: TrussParameters, duration: float) -> float:
    """Infimum of max |d^2L/dt^2| [m/s^2]: 8 n (e(alpha0) - e(pi/2)) / T^2."""
    return least_peak_acceleration(rope_travel(parameters), duration)


def least_peak_reaction(parameters: TrussParameters, duration: float) -> float:
    """Infimum of max |reaction| [N]: 4 M b (1 - sin(alpha0)) / (sin(pi/n) T^2)."""
    stowed = ring_radius(parameters, parameters.stowed_angle)
    stroke = ring_radius(parameters, math.pi / 2) - stowed
    return float(total_mass(parameters)) * least_peak_acceleration(stroke, duration)
