"""What an opening ring does to the satellite through a straight arm that does not bend.

Symbols: L [m] length of the arm; M [kg] mass of the ring; R(alpha) [m] its radius, and the distance
of its centre from the tip; gamma [rad] angle of the reaction; H [kg m^2] inertia of the satellite
about the root, theta0 [rad] its angle; A [kg m^2] inertia of satellite and arm with the whole
antenna as a particle at the tip.

The centre moves along a fixed line from the tip. So arm and ring hand over the momentum
L M R' alphadot sin(gamma) where the satellite is held. A free satellite turns with arm and ring:

    (A + 2 M L cos(gamma) R + 2 M R^2) theta0' = -L M R' alphadot sin(gamma)

The left has the hoop's own inertia M R^2 and that of its centre. Both sides are rates by alpha, so
that the turn depends on the angles alone: it is the same under any law.
"""

from __future__ import annotations

import math
from typing import Any

from models.arm.parameters import ArmParameters
from models.errors import require_positive
from models.truss import TrussParameters, linear_momentum, reaction_force, ring_radius, total_mass


def held_momentum(
    arm: ArmParameters, truss: TrussParameters, gamma: float, alpha: Any, omega: Any
) -> Any:
    """Angular momentum that arm and ring hand to a satellite that is held [N m s].

    Parameters
    ----------
    arm, truss : of which the length of the arm and the mass of the ring count.
    gamma : from the straight arm to the direction from the tip to the ring's centre [rad].
    alpha, omega : numbers, arrays or expressions of the ring's angle and rate [rad, rad/s].
    """
    return _lever(arm, gamma) * linear_momentum(truss, alpha, omega)


def held_moment(
    arm: ArmParameters, truss: TrussParameters, gamma: float, alpha: Any, omega: Any, acc: Any
) -> Any:
    """Its rate, the moment that the satellite gives about the root [N m].

    `acc` is the acceleration of the ring's angle [rad/s^2]; the others are as above.
    """
    return _lever(arm, gamma) * reaction_force(truss, alpha, omega, acc)


def free_turn(
    arm: ArmParameters, truss: TrussParameters, gamma: float, inertia: float, alpha: float
) -> float:
    """Turn theta0 of a free satellite while the ring opens from its stowed angle [rad].

    Parameters
    ----------
    arm : ArmParameters
        `tip_mass` is that of the whole antenna, the ring included.
    truss : TrussParameters
    gamma : from the straight arm to the direction from the tip to the ring's centre [rad].
    inertia : H [kg m^2].
    alpha : angle that the ring has reached [rad].

    Raises
    ------
    ModelError
        If the inertia is not positive.
    """
    require_positive("free_turn", satellite_inertia=inertia)
    M, L = float(total_mass(truss)), arm.big.length + arm.small.length
    A, B, C = inertia + arm.root_inertia(0.0), 2 * M * L * math.cos(gamma), 2 * M
    root = math.sqrt(4 * A * C - B**2)  # real, as A is more than M L^2

    def integral(angle: float) -> float:
        """Of dR / (A + B R + C R^2)."""
        return 2 / root * math.atan((2 * C * float(ring_radius(truss, angle)) + B) / root)

    return -L * M * math.sin(gamma) * (integral(alpha) - integral(truss.stowed_angle))


def _lever(arm: ArmParameters, gamma: float) -> float:
    """Of a force along the line from the tip to the ring's centre, about the root [m]."""
    return (arm.big.length + arm.small.length) * math.sin(gamma)
