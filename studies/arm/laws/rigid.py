"""The rigid arm: its equations of motion, and the drives that move it along a unit law.

Symbols: theta absolute angles of the links, w and a their first and second rates; phi angle of
the elbow; tau torques of root and elbow [N m]. Inertias [kg m^2]: A about the root with the outer
mass at the elbow, B about the elbow, C of the coupling.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from models.ancf.joints import Driven, Torque
from models.arm.parameters import ArmParameters
from models.laws import Law
from ocp.arrays import Array
from studies.arm.stage import Stage


def joint_motion(stage: Stage, law: Law, t: Array) -> tuple[Array, Array, Array]:
    """Angles, rates and accelerations (2, m) of both joints along a unit law."""
    unit = law.motion(np.clip(t, 0.0, law.duration))
    turn = stage.turn[:, None]
    start = np.array(stage.start)[:, None]
    return start + turn * unit.angle, turn * unit.speed, turn * unit.acceleration


def inertias(arm: ArmParameters) -> tuple[float, float, float]:
    """A, B and C [kg m^2]."""
    B = arm.elbow_inertia
    A = arm.root_inertia(np.pi / 2) - B
    return A, B, (arm.root_inertia(0.0) - A - B) / 2


@dataclass(frozen=True, eq=False)
class RigidEquations:
    """Two rigid links: `A a1 + c a2 + h1 = tau1 - tau2` and `c a1 + B a2 + h2 = tau2`.

    The second is the angular momentum of the outer link about the elbow, the sum of both that of
    the arm about the root. `c = C cos phi`, `h1 = -C sin phi w2^2` and `h2 = C sin phi w1^2`.
    """

    A: float
    B: float
    c: Array
    h1: Array
    h2: Array


def rigid_equations(arm: ArmParameters, phi: Array, rates: Array) -> RigidEquations:
    """Equations at angles of the elbow (m,) and rates of the joints (2, m)."""
    A, B, C = inertias(arm)
    w1, w2 = rates[0], rates[0] + rates[1]
    sin = C * np.sin(phi)
    return RigidEquations(A, B, c=C * np.cos(phi), h1=-(sin * w2**2), h2=sin * w1**2)


def feed_forward(stage: Stage, law: Law) -> Callable[[Array], Array]:
    """Torques (2, m) [N m] over times (m,) that move the rigid arm along a unit law."""
    H = stage.satellite_inertia

    def torques(t: Array) -> Array:
        (_, phi), rates, accelerations = joint_motion(stage, law, t)
        eq = rigid_equations(stage.arm, phi, rates)
        a1, a2 = np.cumsum(accelerations, axis=0)
        if H is not None:
            # the satellite turns against the arm, so that both have no momentum
            w1, w2 = np.cumsum(rates, axis=0)
            whole = H + eq.A + eq.B + 2 * eq.c
            w0 = -((eq.A + eq.c) * w1 + (eq.B + eq.c) * w2) / whole
            eq = rigid_equations(stage.arm, phi, rates + np.array([w0, 0 * w0]))
            a0 = -((eq.A + eq.c) * a1 + (eq.B + eq.c) * a2 + eq.h1 + eq.h2) / whole
            a1, a2 = a1 + a0, a2 + a0
        elbow = eq.B * a2 + eq.c * a1 + eq.h2
        return np.array((elbow + eq.A * a1 + eq.c * a2 + eq.h1, elbow))

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
