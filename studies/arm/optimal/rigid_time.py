"""Durations of a rigid arm under caps on its torques: the least, and the quintic step's.

Symbols: T duration [s].
"""

from __future__ import annotations

from typing import Any

import numpy as np

from models.laws.unit_turns import quintic
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
from studies.arm.laws.rigid import feed_forward, joint_motion, rigid_accelerations
from studies.arm.optimal.phase import sampled_guess
from studies.arm.search_limits import RIGID_INTERVALS, RIGID_LONGEST
from studies.arm.stage import ELBOW, JOINT_NAMES, Stage, TorqueCaps

_GRID = 201  # instants of the guess
_DENSE = 1001  # instants at which a peak is looked for


def quintic_duration(stage: Stage, caps: TorqueCaps) -> float:
    """Duration in which the rigid arm follows the quintic step under its torque caps [s].

    Torques fall as 1/T^2. Zero where no joint has a cap.
    """
    torques = feed_forward(stage, quintic(stage.duration))
    peaks = np.abs(torques(np.linspace(0.0, stage.duration, _DENSE))).max(axis=1)
    over = [float(peaks[k]) / cap for k in stage.moving if (cap := caps.torque[k]) is not None]
    return float(stage.duration * max(over, default=0.0) ** 0.5)


def least_rigid_duration(stage: Stage, caps: TorqueCaps) -> float | None:
    """Least duration of the rigid arm [s]: exact for one joint, a local optimum for both.

    None where a joint that turns has no cap, or the solver finds nothing.
    """
    torque_caps = [cap for k in stage.moving if (cap := caps.torque[k]) is not None]
    if len(torque_caps) < len(stage.moving):
        return None
    if len(torque_caps) == 1:
        return stage.least_duration(torque_caps[0])

    stated = _problem(stage.lasting(quintic_duration(stage, caps)), torque_caps)
    settings = Settings(intervals=RIGID_INTERVALS, refinement=FixedMesh(), verify=False)
    try:
        solution = solve(stated, settings=settings, partial=False)
    except SolveFailed:
        return None
    return float(solution.trajectory.phases[0].end)


def _problem(stage: Stage, caps: list[float]) -> Problem:
    """Least time of both joints of a rigid arm, from the quintic step."""
    T, law = stage.duration, quintic(stage.duration)
    q = [State(f"{name} angle", "rad") for name in JOINT_NAMES]
    v = [State(f"rate of {name} angle", "rad/s", scale=1.0 / T) for name in JOINT_NAMES]
    tau = [
        Control(f"{name} torque", "N m", lower=-cap, upper=cap, piecewise="constant")
        for name, cap in zip(JOINT_NAMES, caps, strict=True)
    ]

    rates, torques = ([s.symbol for s in signals] for signals in (v, tau))
    accelerations = rigid_accelerations(stage.arm, q[ELBOW].symbol, rates, torques)
    dynamics: dict[State, Any] = dict(zip(q, v, strict=True))
    dynamics |= zip(v, accelerations, strict=True)

    # from rest to rest, as the arm is
    initial, final = (
        dict(zip((*q, *v), (*angles, 0.0, 0.0), strict=True)) for angles in (stage.start, stage.end)
    )

    t = np.linspace(0.0, T, _GRID)
    law_angles, law_rates, _ = joint_motion(stage, law, t)
    along_the_law = (*law_angles, *law_rates, *feed_forward(stage, law)(t))
    phase = Phase(
        "rigid arm",
        dynamics=dynamics,
        initial=initial,
        final=final,
        end=Between(0.0, RIGID_LONGEST * T, T),
        guess=sampled_guess((*q, *v, *tau), t, along_the_law),
    )
    return Problem("rigid arm", [phase], minimise=phase.duration / T)
