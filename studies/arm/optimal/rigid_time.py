"""Durations of a rigid arm under caps on its torques: the least, and the quintic step's.

Symbols: w absolute rates of the links [rad/s], T duration [s]; A, B, C as in `rigid.inertias`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np

from models.arm.parameters import ArmParameters
from ocp import (
    Between,
    Control,
    FixedMesh,
    Phase,
    Problem,
    Settings,
    SolveFailed,
    State,
    solve,
)
from studies.arm.laws.rigid import feed_forward, inertias, joint_motion
from studies.arm.laws.unit_laws import quintic
from studies.arm.optimal.phase import Limits
from studies.arm.stage import ELBOW, JOINT_NAMES, Stage

_INTERVALS = 80  # 160 change a per mille; with 40 another local optimum, a tenth longer, is found
_GRID = 201
_LONGEST = 2.0  # times the quintic step's duration under the same caps


def quintic_duration(stage: Stage, limits: Limits) -> float:
    """Duration in which the rigid arm follows the quintic step under its torque caps [s].

    Torques fall as 1/T^2. Zero where no joint has a cap.
    """
    torques = feed_forward(stage, quintic(stage.duration))
    peaks = np.abs(torques(np.linspace(0.0, stage.duration, 1001))).max(axis=1)
    over = [float(peaks[k]) / cap for k in stage.moving if (cap := limits.torque[k]) is not None]
    return float(stage.duration * max(over, default=0.0) ** 0.5)


def least_rigid_duration(stage: Stage, limits: Limits) -> float | None:
    """Least duration of the rigid arm [s]: exact for one joint, a local optimum for both.

    None where a joint that turns has no cap, or the solver finds nothing.
    """
    caps = [cap for k in stage.moving if (cap := limits.torque[k]) is not None]
    if len(caps) < len(stage.moving):
        return None
    if len(caps) == 1:
        return stage.least_duration(caps[0])
    stated = _problem(stage.lasting(quintic_duration(stage, limits)), caps)
    try:
        on_one_mesh = Settings(intervals=_INTERVALS, refinement=FixedMesh(), verify=False)
        found = solve(stated, settings=on_one_mesh)
    except SolveFailed:
        return None
    return float(found.trajectory.phases[0].end)


def _problem(stage: Stage, caps: list[float]) -> Problem:
    T, law = stage.duration, quintic(stage.duration)
    t = np.linspace(0.0, T, _GRID)
    q = [State(f"{name} angle", "rad") for name in JOINT_NAMES]
    v = [State(f"{name} rate", "rad/s", scale=1.0 / T) for name in JOINT_NAMES]
    tau = [
        Control(f"{name} torque", "N m", lower=-cap, upper=cap, shape="constant")
        for name, cap in zip(JOINT_NAMES, caps, strict=True)
    ]
    dynamics: dict[State, Any] = dict(zip(q, v, strict=True))
    symbols = ([s.symbol for s in signals] for signals in (v, tau))
    dynamics |= zip(v, rigid_accelerations(stage.arm, q[ELBOW].symbol, *symbols), strict=True)
    ends = [dict(zip((*q, *v), (*angles, 0.0, 0.0), strict=True))
            for angles in (stage.start, stage.end)]  # fmt: skip
    angles, rates, _ = joint_motion(stage, law, t)
    along = (*angles, *rates, *feed_forward(stage, law)(t))
    guess: dict[Any, Any] = {s: (t, x) for s, x in zip((*q, *v, *tau), along, strict=True)}
    phase = Phase("rigid arm", dynamics=dynamics, initial=ends[0], final=ends[1],
                  end=Between(0.0, _LONGEST * T, T), guess=guess)  # fmt: skip
    return Problem("rigid arm", [phase], minimise=phase.duration / T)


def rigid_accelerations(
    arm: ArmParameters, phi: Any, rates: Sequence[Any], torques: Sequence[Any]
) -> list[Any]:
    """Second derivatives of both joint angles: the torques of `feed_forward` solved for them.

    Symbols of the elbow's angle, and of the joints' rates and torques.
    """
    A, B, C = inertias(arm)
    w1, w2 = rates[0], rates[0] + rates[1]
    cos, sin = C * ca.cos(phi), C * ca.sin(phi)
    inner, outer = torques[0] - torques[1] + sin * w2**2, torques[1] - sin * w1**2
    det = A * B - cos**2
    first = (B * inner - cos * outer) / det
    return [first, (A * outer - cos * inner) / det - first]
