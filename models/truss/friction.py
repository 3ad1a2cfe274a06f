"""Viscous friction of the joints, (27).

Symbols: D [N m s/rad]; xi1 [N m s/rad], xi2 [N s/m]; g link ratio; omega [rad/s].
"""

from __future__ import annotations

from models.truss.kinematics import Expression, link_ratio, slider_distance_slope
from models.truss.parameters import TrussParameters


def joint_damping(parameters: TrussParameters, alpha: Expression) -> Expression:
    """D(alpha) [N m s/rad]: the generalised force of the joints is -D omega, (27)."""
    g = link_ratio(parameters, alpha)
    slope = slider_distance_slope(parameters, alpha)
    turning = 4 + 4 * g**2 + 4 * (1 + g) ** 2 + 2 * 2**2
    return parameters.modules * (
        parameters.joint_friction * turning + 2 * parameters.slider_friction * slope**2
    )


def joint_loss(parameters: TrussParameters, alpha: Expression, omega: Expression) -> Expression:
    """Power dissipated in the joints [W], D omega^2."""
    return joint_damping(parameters, alpha) * omega**2
