"""Laws of a unit turn from rest to rest, which an arm scales to the turn of its joint.

Symbols: T duration [s].
"""

from __future__ import annotations

from models.laws.bezier import Bezier, paper_points
from models.laws.piecewise import Piecewise, constant_jerk


def linear_torque(duration: float) -> Piecewise:
    """The paper's law: acceleration linear in time from 6/T^2 to -6/T^2."""
    edges, jerks = (0.0, duration), (-12.0 / duration**3,)
    return constant_jerk(edges, jerks, 0.0, start_acceleration=6.0 / duration**2)


def quintic(duration: float) -> Bezier:
    """Quintic step of the angle: the Bezier law of degree 5 with triple end points."""
    return Bezier(duration, (0.0, 0.0, 0.0, 1.0, 1.0, 1.0))


def bezier(duration: float) -> Bezier:
    """The paper's law for a unit turn."""
    return Bezier(duration, paper_points(0.0, 1.0))
