"""What a motion of the truss moves in all, and lower bounds on its peaks without a jerk limit.

The bounds are infima: no motion with zero acceleration at its ends attains them.
"""

from __future__ import annotations

from models.laws.bounds import least_peak_acceleration
from models.truss.inertia import total_mass
from models.truss.kinematics import ring_radius, rope_length
from models.truss.opening import Opening, whole_opening
from models.truss.parameters import TrussParameters


def rope_travel(parameters: TrussParameters, opening: Opening | None = None) -> float:
    """Length of one rope that is wound in [m]: 2 n (e(start) - e(end)), by default of it all."""
    ends = opening or whole_opening(parameters)
    return float(rope_length(parameters, ends.start) - rope_length(parameters, ends.end))


def centre_travel(parameters: TrussParameters, opening: Opening | None = None) -> float:
    """Way of the ring's centre from the fixed bar [m]: R(end) - R(start), by default of it all."""
    ends = opening or whole_opening(parameters)
    return float(ring_radius(parameters, ends.end) - ring_radius(parameters, ends.start))


def least_peak_rope_acceleration(parameters: TrussParameters, duration: float) -> float:
    """Infimum of max |d^2L/dt^2| [m/s^2]: 8 n (e(alpha0) - e(pi/2)) / T^2."""
    return least_peak_acceleration(rope_travel(parameters), duration)


def least_peak_reaction(
    parameters: TrussParameters, duration: float, opening: Opening | None = None
) -> float:
    """Infimum of max |reaction| from rest to rest [N]: 4 M (R(end) - R(start)) / T^2."""
    stroke = centre_travel(parameters, opening)
    return float(total_mass(parameters)) * least_peak_acceleration(stroke, duration)
