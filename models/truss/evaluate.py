"""Numbers of a given motion: forces, powers and energies of the truss along it.

Symbols: alpha [rad], omega [rad/s], acc [rad/s^2]; T1 [N] motor force on each of the two ropes.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from models.arrays import Array, elementwise
from models.errors import require
from models.truss.bar_forces import largest_bar_force
from models.truss.buckling import buckling_shares
from models.truss.dynamics import rope_force
from models.truss.friction import joint_loss, one_way
from models.truss.inertia import kinetic_energy, linear_momentum, reaction_force
from models.truss.kinematics import rope_acceleration, rope_length, rope_speed
from models.truss.parameters import TrussParameters
from models.truss.potential import Net, potential
from models.truss.rope import far_end_ratio, pulley_loss_by_sum, rope_leverage

_BEYOND_OPEN = 1e-4  # [rad] past 90 deg: the paper's printed law ends 3.7e-6 rad past it
_BACKWARD_SLACK = 1e-6  # of the greatest speed: what a solver's bounds may leave


@dataclass(frozen=True, eq=False)
class TrussMotion:
    """Histories of a motion, all of shape (m,).

    Attributes
    ----------
    parameters : of the truss.
    angle, speed, acceleration : alpha [rad] and its time derivatives, as given.
    rope_length, rope_speed, rope_acceleration : of one rope [m, m/s, m/s^2], (20); the speed is
        dL/dt, negative while the rope is wound in.
    rope_force, far_end_tension : T1 at the motor and T_4n at the fixed end [N], (38), (29).
    buckling_share : largest push in a bar of any module, as part of its buckling load [-].
    bar_force : largest push or pull in a link or cross-bar of any module [N].
    motor_power : -2 T1 dL/dt [W], of both ropes.
    joint_power, pulley_power : dissipated [W], the former in joints, sliders, off-load and by a
        measured load.
    kinetic_energy, potential_energy : [J], (22), (26).
    momentum, reaction_force : along the line from the fixed bar to the centre [N s, N].
    """

    parameters: TrussParameters
    angle: Array
    speed: Array
    acceleration: Array
    rope_length: Array
    rope_speed: Array
    rope_acceleration: Array
    rope_force: Array
    far_end_tension: Array
    bar_force: Array
    buckling_share: Array
    motor_power: Array
    joint_power: Array
    kinetic_energy: Array
    potential_energy: Array
    momentum: Array
    reaction_force: Array

    @cached_property
    def pulley_power(self) -> Array:
        """Dissipated at the pulleys, summed one by one [W], (m,).

        It is a check of the closed form that the rope force rests on, and dearer than the rest.
        """
        return pulley_loss_by_sum(self.parameters, self.angle, self.speed, self.rope_force)


def evaluate_motion(
    parameters: TrussParameters,
    angle: ArrayLike,
    speed: ArrayLike,
    acceleration: ArrayLike,
    *,
    torque: ArrayLike = 0.0,
    net: Net = "by angle",
) -> TrussMotion:
    """Evaluate the truss along a motion given by angle, speed, acceleration of shape (m,).

    Parameters
    ----------
    torque : by which the ropes have to do more, because what carries the ring moves [N m], (m,).
        The forces in the bars leave it out.

    Raises
    ------
    ModelError
        If shapes differ, a value is not finite, an angle lies outside (0, 90 deg], or the speed
        is negative with pulley or Coulomb friction, whose sense would turn round.
    """
    alpha, omega, acc = (
        np.atleast_1d(np.asarray(values, dtype=float)) for values in (angle, speed, acceleration)
    )
    _check_motion(parameters, alpha, omega, acc)

    more = np.broadcast_to(np.asarray(torque, dtype=float), alpha.shape)
    rows = elementwise(_kernel(parameters, net), alpha, omega, acc, more)
    history = dict(zip(_QUANTITIES, (row.ravel() for row in rows), strict=True))
    return TrussMotion(
        parameters=parameters,
        angle=alpha,
        speed=omega,
        acceleration=acc,
        motor_power=-2 * history["rope_force"] * history["rope_speed"],
        **history,
    )


_QUANTITIES = (
    "rope_length",
    "rope_speed",
    "rope_acceleration",
    "rope_force",
    "far_end_tension",
    "bar_force",
    "buckling_share",
    "joint_power",
    "kinetic_energy",
    "potential_energy",
    "momentum",
    "reaction_force",
)


@functools.lru_cache(maxsize=32)
def _kernel(parameters: TrussParameters, net: Net) -> ca.Function:
    """Compile scalars (alpha, omega, acc, torque) -> `_QUANTITIES`, once per truss."""
    names = ("alpha", "omega", "acc", "torque")
    alpha, omega, acc, torque = (ca.SX.sym(name) for name in names)

    # In one function, so that the quantities share what they have in common.
    held = rope_force(parameters, alpha, omega, acc, net)
    force = held + torque / rope_leverage(parameters, alpha)
    outputs = [
        rope_length(parameters, alpha),
        rope_speed(parameters, alpha, omega),
        rope_acceleration(parameters, alpha, omega, acc),
        force,
        force * far_end_ratio(parameters, alpha),
        largest_bar_force(parameters, alpha, omega, acc, held, net),
        ca.mmax(ca.vertcat(*buckling_shares(parameters, alpha, omega, acc, held, net).values())),
        joint_loss(parameters, alpha, omega),
        kinetic_energy(parameters, alpha, omega),
        potential(parameters, alpha, net),
        linear_momentum(parameters, alpha, omega),
        reaction_force(parameters, alpha, omega, acc),
    ]

    dense = [ca.densify(output) for output in outputs]
    kernel: ca.Function = ca.Function("truss", [alpha, omega, acc, torque], dense, {"cse": True})
    return kernel


def _check_motion(parameters: TrussParameters, alpha: Array, omega: Array, acc: Array) -> None:
    require(
        alpha.ndim == 1 and alpha.shape == omega.shape == acc.shape and alpha.size > 0,
        f"angle, speed, acceleration have the shapes {alpha.shape}, {omega.shape}, {acc.shape}; "
        "give three arrays of one length.",
    )
    finite = all(np.isfinite(values).all() for values in (alpha, omega, acc))
    require(finite, "the motion holds values that are not finite; remove them.")

    low, high = alpha.min(), alpha.max()
    require(
        low > 0 and high <= math.pi / 2 + _BEYOND_OPEN,
        f"the angle runs from {low:g} to {high:g} rad; keep it in (0, pi/2].",
    )

    slowest = omega.min()
    rubs = one_way(parameters)
    require(
        not rubs or slowest >= -_BACKWARD_SLACK * np.abs(omega).max(),
        f"the speed falls to {slowest:g} rad/s, but pulley and Coulomb friction are modelled for a "
        f"truss that opens; keep the speed non-negative or leave {', '.join(rubs)} out.",
    )
