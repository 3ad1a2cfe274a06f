"""Rigid inverse dynamics: the feed-forward torque of the torque drive."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from models.ancf.joints import Driven, Torque
from models.arm.parameters import ArmParameters
from models.laws import Law
from studies.arm.stage import Stage

Array = NDArray[np.float64]


def joint_motion(stage: Stage, law: Law, t: Array) -> tuple[Array, Array, Array]:
    """Angles, rates and accelerations (2, m) of both joints along a unit law."""
    unit = law.motion(np.clip(t, 0.0, law.duration))
    turn = stage.turn[:, None]
    start = np.array(stage.start)[:, None]
    return start + turn * unit.angle, turn * unit.speed, turn * unit.acceleration


def inertias(arm: ArmParameters) -> tuple[float, float, float]:
    """A about the root with the outer mass at the elbow, B about the elbow, coupling C [kg m^2]."""
    B = arm.elbow_inertia
    A = arm.root_inertia(np.pi / 2) - B
    return A, B, (arm.root_inertia(0.0) - A - B) / 2


def feed_forward(stage: Stage, law: Law) -> Callable[[Array], Array]:
    """Torques (2, m) [N m] over times (m,) that move the rigid arm along a unit law.

    Two rigid links with absolute angles theta: angular momentum of the outer one about the
    elbow, and of both about the root. With the elbow's angle phi, the inertia B about the elbow
    and the coupling C cos phi:
    `tau2 = B theta2'' + C (cos phi theta1'' + sin phi theta1'^2)`,
    `tau1 = tau2 + A theta1'' + C (cos phi theta2'' - sin phi theta2'^2)`.
    """
    A, B, C = inertias(stage.arm)

    def torques(t: Array) -> Array:
        (_, phi), rates, accelerations = joint_motion(stage, law, t)
        w1, w2 = np.cumsum(rates, axis=0)
        a1, a2 = np.cumsum(accelerations, axis=0)
        cos, sin = C * np.cos(phi), C * np.sin(phi)
        elbow = B * a2 + cos * a1 + sin * w1**2
        return np.array((elbow + A * a1 + cos * a2 - sin * w2**2, elbow))

    return torques


def torque_drives(stage: Stage, law: Law) -> dict[int, Torque]:
    """Feed-forward torques of the joints that turn."""
    torques = feed_forward(stage, law)

    def part(k: int) -> Callable[[Array], Array]:
        return lambda t: torques(np.atleast_1d(t))[k]

    return {k: Torque(part(k), law.breakpoints) for k in stage.moving}


def angle_drives(stage: Stage, law: Law) -> dict[int, Driven]:
    """Prescribed angles of the joints that turn."""

    def part(k: int, order: int) -> Callable[[Array], Array]:
        return lambda t: joint_motion(stage, law, np.atleast_1d(t))[order][k]

    return {k: Driven(part(k, 0), part(k, 1), part(k, 2), law.breakpoints) for k in stage.moving}
