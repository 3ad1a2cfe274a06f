"""The same motion where nothing holds the satellite: it turns about the root as the arm pushes it.

The satellite is a rigid body of inertia H about the root, whose axis stays in place. A torque at
the root moves the arm as before, whatever the satellite does, but turns the satellite the other
way, so that the joint between them travels further; the lock then joins two bodies that turn.
Where the root is clamped, the arm and the satellite turn together while the elbow is driven.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_simpson

from models.ancf.analysis import natural_modes, project, residual_energy, run_and_lock
from models.ancf.assembly import dense
from models.ancf.chain import Chain
from models.ancf.joints import Free, Joint, Locked, joint_rates, quarter
from models.ancf.motion import MinimalCoordinates
from models.ancf.state import NodalState, posed
from studies.arm.replay.full import SMOOTH, Replay
from studies.arm.replay.loads import Loads
from studies.arm.stage import ELBOW, ROOT

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FreeSatellite:
    """What changes where the satellite is free to turn.

    Attributes
    ----------
    inertia : H [kg m^2].
    turned : of the satellite at the lock [rad].
    largest_turn : on the way [rad].
    largest_momentum : of the satellite on the way [N m s].
    root_travel, elbow_travel : of the joint angles [rad].
    residual_energy : of arm and satellite right after the lock [J].
    frequency : first one of both, locked [Hz].
    held_frequency : first one of the arm on a satellite that is held [Hz].
    """

    inertia: float
    turned: float
    largest_turn: float
    largest_momentum: float
    root_travel: float
    elbow_travel: float
    residual_energy: float
    frequency: float
    held_frequency: float


def free_satellite(replayed: Replay, history: Loads, inertia: float) -> FreeSatellite:
    """A motion replayed with a satellite of a finite inertia [kg m^2]."""
    chain = replayed.run.before.chain
    freed = dataclasses.replace(chain, hub_inertia=chain.hub_inertia + inertia)
    push = _pushed if ROOT in replayed.motion.stage.moving else _carried
    turn, rate, travels, left, joints = push(replayed, history, freed, inertia)
    return FreeSatellite(
        inertia, float(turn[-1]), float(np.abs(turn).max()),
        inertia * float(np.abs(rate).max()), *travels, left,
        _first(freed, joints), float(replayed.frequencies[0]),
    )  # fmt: skip


_Case = tuple[Array, Array, tuple[float, float], float, list[Joint]]


def _pushed(replayed: Replay, history: Loads, freed: Chain, inertia: float) -> _Case:
    """A driven root: the satellite takes the arm's momentum with the other sign."""
    lock = replayed.run.engagement
    t = history.times[: history.until]
    rate = -history.angular_momentum[: history.until] / inertia
    turn = cumulative_simpson(rate, x=t, initial=0.0)
    joints: list[Joint] = [Free(), Locked(float(lock.angle[ELBOW]))]
    form = MinimalCoordinates(freed, joints)
    before = replayed.run.before.final
    now, _ = project(form, before, momentum=_momentum(form, before, inertia, float(rate[-1])))
    left = residual_energy(freed, joints, now)
    arm = replayed.run.before.joint_angles()
    travels = float(arm[ROOT, -1] - arm[ROOT, 0] - turn[-1]), float(arm[ELBOW, -1] - arm[ELBOW, 0])
    return turn, rate, travels, left, joints


def _momentum(form: MinimalCoordinates, state: NodalState, inertia: float, spin: float) -> Array:
    """Momentum of the arm and of a satellite that turns at a rate of its own [rad/s]."""
    asm = form.assembly
    v = asm.gather(state.v)
    p = np.asarray(dense(asm.mass) @ v)
    root = list(asm.place[[2, 3]])  # the slope at the root, which carries the hub
    across = quarter(state.q[[2, 3], None])[:, 0]
    p[root] += inertia * (spin * across - v[root])
    return p


def _carried(replayed: Replay, history: Loads, freed: Chain, inertia: float) -> _Case:
    """A clamped root: the satellite turns with the arm's root under the elbow's torque."""
    stage = replayed.motion.stage
    run = run_and_lock(
        freed, [Free(), replayed.motion.joints[ELBOW]], posed(freed, stage.start),
        history.times[: history.until], [ELBOW], settings=SMOOTH,
    )  # fmt: skip
    angles = run.before.joint_angles()
    rate = joint_rates(freed, run.before.q, run.before.v)[ROOT]
    travel = float(angles[ELBOW, -1] - angles[ELBOW, 0])
    turn = angles[ROOT] - angles[ROOT, 0]
    return turn, rate, (0.0, travel), run.residual_energy, list(run.engagement.joints)


def _first(chain: Chain, joints: list[Joint]) -> float:
    """First frequency of the locked arm with a satellite that is free to turn [Hz]."""
    elbow = joints[ELBOW]
    assert isinstance(elbow, Locked)
    rest = posed(chain, [0.0, elbow.angle])
    modes = natural_modes(chain, joints, rest, count=3)
    return float(modes.bending[0])  # an axial mode of the hub's slope may lie below
