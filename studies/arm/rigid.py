"""Rigid inverse dynamics: the feed-forward torque of the torque drive."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from models.ancf.joint import Driven, Torque
from models.laws import Law
from studies.arm.stage import ELBOW, ROOT, Stage

Array = NDArray[np.float64]


@lru_cache(maxsize=16)
def _inverse(stage: Stage) -> ca.Function:
    """Compiled `(angles, rates, accelerations) -> torques`, (2,) each, of the undeformed arm.

    Of the reduced model with its elastic coordinates held at zero, theta1 row tau1 - tau2 and
    theta2 row tau2.
    """
    model = stage.reduced()
    q, a = ca.SX.sym("q", model.size), ca.SX.sym("a", model.size)
    v = ca.SX.sym("v", model.size)
    balance = model.residual(q, v, a, ca.DM.zeros(2))
    phi, rate, acc = (ca.SX.sym(name, 2) for name in ("phi", "rate", "acc"))
    places = {name: k for k, name in enumerate(model.coordinates)}
    torques = [ca.SX(0), ca.SX(0)]
    values = []
    for angle in (phi, rate, acc):
        total = {"theta1": angle[ROOT], "theta2": angle[ROOT] + angle[ELBOW]}
        values.append(ca.vertcat(*(total.get(name, ca.SX(0)) for name in model.coordinates)))
    rows = ca.substitute([balance], [q, v, a], values)[0]
    if "theta2" in places:
        torques[ELBOW] = rows[places["theta2"]]
    if "theta1" in places:
        torques[ROOT] = rows[places["theta1"]] + torques[ELBOW]
    return ca.Function("inverse", [phi, rate, acc], [ca.vertcat(*torques)])


def joint_motion(stage: Stage, law: Law, t: Array) -> tuple[Array, Array, Array]:
    """Angles, rates and accelerations (2, m) of both joints along a unit law."""
    unit = law.motion(np.clip(t, 0.0, law.duration))
    turn = stage.turn[:, None]
    start = np.array(stage.start)[:, None]
    return start + turn * unit.angle, turn * unit.speed, turn * unit.acceleration


def feed_forward(stage: Stage, law: Law) -> Callable[[Array], Array]:
    """Torques (2, m) [N m] over times (m,) that move the rigid arm along a unit law."""
    inverse = _inverse(stage)

    def torques(t: Array) -> Array:
        return np.asarray(inverse.map(len(t))(*joint_motion(stage, law, t)).full())

    return torques


def torque_drives(stage: Stage, law: Law) -> dict[int, Torque]:
    """Feed-forward torques of the joints that turn."""
    torques = feed_forward(stage, law)
    edges = law.breakpoints
    return {
        k: Torque(lambda t, k=k: torques(np.atleast_1d(t))[k], edges)  # type: ignore[misc]
        for k in stage.moving
    }


def angle_drives(stage: Stage, law: Law) -> dict[int, Driven]:
    """Prescribed angles of the joints that turn."""

    def part(k: int, order: int) -> Callable[[Array], Array]:
        return lambda t: joint_motion(stage, law, np.atleast_1d(t))[order][k]

    return {k: Driven(part(k, 0), part(k, 1), part(k, 2), law.breakpoints) for k in stage.moving}
