"""Weight of the ring on a test bench, which carries a share of it.

The fixed bar stands still, and the centre of mass is the ring's centre, R from it. So only gravity
along that line does work: along the ring's axis and across the line the centre does not move.

Symbols: M [kg]; R [m]; g [m/s^2] towards the centre; s [-] share that is carried; alpha [rad].
"""

from __future__ import annotations

import math

from models.truss.inertia import linear_momentum, total_mass
from models.truss.kinematics import Expression, ring_radius
from models.truss.parameters import TrussParameters


def gravity_potential(parameters: TrussParameters, alpha: Expression) -> Expression:
    """Potential energy of the weight [J], -(1 - s) M g R, zero at the fixed bar."""
    return -_pull(parameters) * total_mass(parameters) * ring_radius(parameters, alpha)


def gravity_slope(parameters: TrussParameters, alpha: Expression) -> Expression:
    """Torque of the weight against the opening [N m], -(1 - s) M g R'."""
    return -_pull(parameters) * linear_momentum(parameters, alpha, 1.0)


def gravity_push(parameters: TrussParameters) -> Expression:
    """Part of the hoop force on one face that the weight takes [N].

    The fixed bar carries the weight. Of its reaction the part that presses on all corners evenly
    counts, as in `inertia_push`; the rest bends the ring as a whole and is left out.
    """
    n = parameters.modules
    return -_pull(parameters) * total_mass(parameters) / (4 * n * math.sin(math.pi / n))


def _pull(parameters: TrussParameters) -> Expression:
    """(1 - s) g [m/s^2], what of gravity does work on the ring."""
    return (1 - parameters.off_load) * parameters.gravity[0]
