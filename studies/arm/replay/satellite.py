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
from scipy.integrate import cumulative_simpson

from models.ancf.analysis import natural_modes, project, residual_energy, run_and_lock
from models.ancf.assembly import dense
from models.ancf.chain import Chain
from models.ancf.joints import Free, Joint, Locked, joint_rates, quarter
from models.ancf.motion import MinimalCoordinates
from models.ancf.state import NodalState, posed
from ocp.arrays import Array
from studies.arm.replay.full_model import SMOOTH, LockedMotion
from studies.arm.replay.loads import Loads
from studies.arm.stage import ELBOW, ROOT


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


@dataclass(frozen=True, eq=False)
class _FreeMotion:
    """The satellite's turn and rate (m,) until the lock, and what the lock finds and leaves."""

    turn: Array
    rate: Array
    root_travel: float
    elbow_travel: float
    residual_energy: float
    locked_joints: list[Joint]


def free_satellite(replayed: LockedMotion, history: Loads, inertia: float) -> FreeSatellite:
    """A motion replayed with a satellite of a finite inertia [kg m^2]."""
    chain = replayed.run.before.chain
    freed = dataclasses.replace(chain, hub_inertia=chain.hub_inertia + inertia)

    find = _pushed if ROOT in replayed.motion.stage.moving else _carried
    motion = find(replayed, history, freed, inertia)
    return FreeSatellite(
        inertia=inertia,
        turned=float(motion.turn[-1]),
        largest_turn=float(np.abs(motion.turn).max()),
        largest_momentum=inertia * float(np.abs(motion.rate).max()),
        root_travel=motion.root_travel,
        elbow_travel=motion.elbow_travel,
        residual_energy=motion.residual_energy,
        frequency=_first_frequency(freed, motion.locked_joints),
        held_frequency=float(replayed.vibration.frequencies[0]),
    )


def _pushed(replayed: LockedMotion, history: Loads, freed: Chain, inertia: float) -> _FreeMotion:
    """A driven root: the satellite takes the arm's momentum with the other sign."""
    lock = replayed.run.engagement
    times = history.times[: history.until]
    rate = -history.angular_momentum[: history.until] / inertia
    turn = cumulative_simpson(rate, x=times, initial=0.0)

    # the lock joins arm and satellite, each with the momentum that it has then
    joints: list[Joint] = [Free(), Locked(float(lock.angle[ELBOW]))]
    form = MinimalCoordinates(freed, joints)
    before = replayed.run.before.final
    momentum = _momentum(form, before, inertia, float(rate[-1]))
    together, _ = project(form, before, momentum=momentum)

    angles = replayed.run.before.joint_angles()
    return _FreeMotion(
        turn=turn,
        rate=rate,
        root_travel=float(angles[ROOT, -1] - angles[ROOT, 0] - turn[-1]),
        elbow_travel=float(angles[ELBOW, -1] - angles[ELBOW, 0]),
        residual_energy=residual_energy(freed, joints, together),
        locked_joints=joints,
    )


def _momentum(form: MinimalCoordinates, state: NodalState, inertia: float, spin: float) -> Array:
    """Momentum of the arm and of a satellite that turns at a rate of its own [rad/s]."""
    assembly = form.assembly
    rates = assembly.gather(state.v)
    momentum = np.asarray(dense(assembly.mass) @ rates)

    # the slope at the root carries the hub, whose rate is the satellite's own here
    root = list(assembly.place[[2, 3]])
    across = quarter(state.q[[2, 3], None])[:, 0]
    momentum[root] += inertia * (spin * across - rates[root])
    return momentum


def _carried(replayed: LockedMotion, history: Loads, freed: Chain, inertia: float) -> _FreeMotion:
    """A clamped root: the satellite turns with the arm's root under the elbow's torque."""
    stage = replayed.motion.stage
    run = run_and_lock(
        freed,
        [Free(), replayed.motion.joints[ELBOW]],
        posed(freed, stage.start),
        history.times[: history.until],
        [ELBOW],
        settings=SMOOTH,
    )

    # the arm's root is the satellite here: what it turns is what the satellite turns
    angles = run.before.joint_angles()
    return _FreeMotion(
        turn=angles[ROOT] - angles[ROOT, 0],
        rate=joint_rates(freed, run.before.q, run.before.v)[ROOT],
        root_travel=0.0,
        elbow_travel=float(angles[ELBOW, -1] - angles[ELBOW, 0]),
        residual_energy=run.residual_energy,
        locked_joints=list(run.engagement.joints),
    )


def _first_frequency(chain: Chain, joints: list[Joint]) -> float:
    """First frequency of the locked arm with a satellite that is free to turn [Hz]."""
    elbow = joints[ELBOW]
    assert isinstance(elbow, Locked)
    rest = posed(chain, [0.0, elbow.angle])
    modes = natural_modes(chain, joints, rest, count=3)
    return float(modes.bending[0])  # an axial mode of the hub's slope may lie below
