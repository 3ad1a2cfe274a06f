"""The truss on a rope that gives: stability and frequency of its motion while the motor stands.

Symbols: h [m] rope wound in by the motor, s [m] what the truss has taken of it; k [N/m] stiffness;
c [-] tension that stretches the rope per T1; T1 [N] motor force on one rope; f [m] leverage of both
ropes; J [kg m^2]; U [J]; alpha [rad]. A prime is a derivative with respect to alpha.

    T1 = k (h - s) / c

A drive that gives between motor and first pulley has c = 1: then k is T1 per metre wound in. A
rope that gives along its length is stretched by its mean tension. With h fixed the truss feels
the stiffness K = U'' - (T1 f)' and is stable at rest where it is positive:

    K = U'' - T1 f' + f (k s' + T1 c') / c

A rope that is pulled below its T1 = 0 is slack and does not push: nothing here holds for it.
"""

from __future__ import annotations

import functools
import math
from typing import Literal, NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from models.arrays import Array, elementwise
from models.numerics import dense_peak
from models.truss.dynamics import rope_force, static_force, static_torque
from models.truss.inertia import inertia
from models.truss.kinematics import Expression, rope_length, rope_speed
from models.truss.opening import Opening, whole_opening
from models.truss.parameters import TrussParameters
from models.truss.potential import Net, potential_slope
from models.truss.rope import mean_tension_ratio, rope_leverage

RopeYields = Literal["at the motor", "along its length"]


class LeastStiffness(NamedTuple):
    """Least stiffness at which no angle is unstable [N/m], and the angle that needs it [rad]."""

    angle: float
    stiffness: float


def stretching_ratio(
    parameters: TrussParameters, alpha: Expression, yields: RopeYields
) -> Expression:
    """Tension that stretches a rope over the motor's pull, c [-]."""
    return 1.0 if yields == "at the motor" else mean_tension_ratio(parameters, alpha)


def rope_taken(parameters: TrussParameters, alpha: Expression) -> Expression:
    """What the truss has taken of one rope since it was stowed, s [m], (20)."""
    return rope_length(parameters, parameters.stowed_angle) - rope_length(parameters, alpha)


def yielding_tension(
    parameters: TrussParameters,
    alpha: Expression,
    wound: Expression,
    stiffness: Expression,
    yields: RopeYields = "at the motor",
) -> Expression:
    """T1 [N] of a rope of which the motor has wound in `wound` [m]; negative if it is slack."""
    stretch = wound - rope_taken(parameters, alpha)
    return stiffness * stretch / stretching_ratio(parameters, alpha, yields)


def wound_rope(
    parameters: TrussParameters,
    alpha: Expression,
    omega: Expression,
    acc: Expression,
    stiffness: float,
    yields: RopeYields = "at the motor",
    net: Net = "by angle",
) -> Expression:
    """Rope that a motion needs, h [m]: what the truss takes, and the stretch; omega >= 0, (38)."""
    tension = rope_force(parameters, alpha, omega, acc, net)
    stretch = stretching_ratio(parameters, alpha, yields) * tension / stiffness
    return rope_taken(parameters, alpha) + stretch


def jerk_step_at_net(parameters: TrussParameters, omega: Expression) -> Expression:
    """Step of the jerk where the net becomes taut and the motor winds in evenly [rad/s^3].

    U'' steps there, and T1 f = k (h - s) f / c has no step in its rate. So J times the step of the
    jerk is less the step of U'' omega.
    """
    alpha = ca.SX.sym("alpha")
    slopes = [potential_slope(parameters, alpha, net) for net in ("slack", "taut")]
    bend = ca.Function("bend", [alpha], [ca.jacobian(slopes[1] - slopes[0], alpha)])
    net_angle = parameters.net_angle
    return -float(bend(net_angle)) * omega / float(inertia(parameters, net_angle))


def least_rope_stiffness(
    parameters: TrussParameters,
    yields: RopeYields = "at the motor",
    opening: Opening | None = None,
) -> LeastStiffness:
    """Least stiffness of a rope on which a motion, by default all of it, has no unstable angle.

    Below it the truss snaps through: at rest, behind the ridge of the static force, the rope
    relaxes faster than the springs do. Zero if a rope of any stiffness will do.
    """
    kernel, ends = _at_rest(parameters, yields), opening or whole_opening(parameters)
    peak = dense_peak(
        lambda alpha: elementwise(kernel, alpha, np.zeros_like(alpha))[0].ravel(),
        ends.start,
        ends.end,
        breakpoints=(parameters.net_angle,),  # where the net becomes taut, U'' jumps
    )
    return LeastStiffness(peak.where, max(0.0, peak.value))


def rope_mode_frequency(
    parameters: TrussParameters,
    angle: ArrayLike,
    stiffness: float,
    yields: RopeYields = "at the motor",
) -> Array:
    """Frequency of the truss at rest on its ropes, sqrt(K / J) / 2 pi [Hz]; friction is left out.

    Parameters
    ----------
    angle : alpha (m,) [rad].
    stiffness : k [N/m].

    Returns
    -------
    (m,) array
        nan where the truss is unstable.
    """
    alpha = np.atleast_1d(np.asarray(angle, dtype=float))
    square = elementwise(_at_rest(parameters, yields), alpha, stiffness + 0 * alpha)[1].ravel()
    return np.sqrt(np.where(square < 0, np.nan, square)) / (2 * math.pi)


@functools.lru_cache(maxsize=16)
def _at_rest(parameters: TrussParameters, yields: RopeYields) -> ca.Function:
    """Of alpha and k, at rest: the k at which K is zero [N/m], and K / J [1/s^2]."""
    alpha, k = ca.SX.sym("alpha"), ca.SX.sym("k")
    f, tension = rope_leverage(parameters, alpha), static_force(parameters, alpha)
    c = stretching_ratio(parameters, alpha, yields)
    lever = -rope_speed(parameters, alpha, 1.0) * f / c  # of k in K

    def slope(expression: Expression) -> Expression:
        return ca.jacobian(ca.SX(expression), alpha)

    rest = slope(static_torque(parameters, alpha)) - tension * slope(f) + f * tension * slope(c) / c
    outputs = [-rest / lever, (rest + k * lever) / inertia(parameters, alpha)]
    kernel: ca.Function = ca.Function(
        "at_rest", [alpha, k], [ca.densify(one) for one in outputs], {"cse": True}
    )
    return kernel
