"""The full model on a satellite that is free to turn about the root.

The satellite is a rigid body of inertia H about the root, whose axis stays in place. Where the root
is locked, the satellite turns with it: H is part of the hub, and the root is free. Where the root
is driven, its torque moves the arm as on a satellite that is held, and turns the satellite the
other way: it has the arm's momentum with the other sign. The lock then joins two bodies that turn.

Motions are simulated in fixed axes. What the joints and the antenna do is seen from the satellite.

Symbols: H [kg m^2]; theta0, its turn [rad]; w0, its rate [rad/s]; x merged coordinates.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_trapezoid

from models.ancf.analysis import Engagement, engage
from models.ancf.assembly import dense
from models.ancf.chain import Chain
from models.ancf.integrate import Simulation
from models.ancf.joints import Free, Joint, Locked, joint_rates, quarter
from models.ancf.motion import MinimalCoordinates
from models.ancf.state import NodalState
from ocp.arrays import Array
from studies.arm.stage import ELBOW, ROOT, Stage


@dataclass(frozen=True, eq=False)
class SatelliteMotion:
    """How a free satellite turns, until the lock and as far beyond it as a replay goes on.

    Attributes
    ----------
    inertia : H [kg m^2].
    turn, rate : (m,) theta0 and w0 at the replay's times until the lock [rad, rad/s].
    turn_after, rate_after : (k,) at those after it, empty if there are none.
    """

    inertia: float
    turn: Array
    rate: Array
    turn_after: Array
    rate_after: Array


def satellite_motion(stage: Stage, before: Simulation, after: Simulation | None) -> SatelliteMotion:
    """The satellite's turn along a motion of the arm on it, in fixed axes."""
    H = stage.satellite_inertia
    assert H is not None
    turn, rate = _turned(stage, before)
    after_turn = after_rate = np.empty(0)
    if after is not None:
        # the root is locked to the satellite
        angles = after.joint_angles()[ROOT]
        after_turn = turn[-1] + angles - angles[0]
        after_rate = joint_rates(after.chain, after.q, after.v)[ROOT]
    return SatelliteMotion(H, turn, rate, after_turn, after_rate)


def _turned(stage: Stage, run: Simulation) -> tuple[Array, Array]:
    """Theta0 and w0 (m,) until the lock."""
    if stage.carried:
        angles = run.joint_angles()[ROOT]
        return angles - angles[0], joint_rates(run.chain, run.q, run.v)[ROOT]
    H = stage.satellite_inertia
    assert H is not None
    rate = -momenta(run.chain, run.q, run.v)[1] / H
    return np.asarray(cumulative_trapezoid(rate, run.times, initial=0.0)), rate


def seen_from(q: Array, v: Array, turn: Array, rate: Array) -> tuple[Array, Array]:
    """Nodes and rates (size, m) as a satellite sees them that turns by theta0 (m,) at w0 (m,)."""
    c, s = np.cos(turn), np.sin(turn)

    def back(vectors: Array) -> Array:
        x, y, turned = vectors[0::2], vectors[1::2], np.empty_like(vectors)
        turned[0::2], turned[1::2] = c * x + s * y, c * y - s * x
        return turned

    return back(q), back(v - rate * across(q))


def lock_on(stage: Stage, joints: Sequence[Joint], run: Simulation) -> Engagement:
    """Lock the joints that turn at the end of a motion in fixed axes.

    Angles and misses are those of the joints, against the satellite.
    """
    chain = stage.chain(run.chain.elements, locked=True)
    state, H = run.final, stage.satellite_inertia
    end, targets = float(run.times[-1]), {k: stage.end[k] for k in stage.moving}
    if H is None:
        return engage(chain, joints, state, stage.moving, time=end, targets=targets)

    turn, rate = _turned(stage, run)
    after = [Free(), joints[ELBOW]]
    momentum = None if stage.carried else _momentum(chain, after, state, H, float(rate[-1]))
    moving = [k for k in stage.moving if k != ROOT]
    lock = engage(chain, after, state, moving, time=end, targets=targets, momentum=momentum)
    angle = lock.angle - np.array([turn[-1], 0.0])
    if stage.carried:
        return dataclasses.replace(lock, angle=angle)

    # two bodies become one, with the rates that the root and the satellite had
    was, root, now = float(rate[-1]), _root_rate(chain, state), _root_rate(chain, lock.state)
    off = float(np.angle(np.exp(1j * (angle[ROOT] - stage.end[ROOT]))))
    return dataclasses.replace(
        lock,
        angle=angle,
        miss={ROOT: off, **lock.miss},
        lost_energy=lock.lost_energy + H * (was**2 - root**2) / 2,
        impulse=np.array([H * (was - now), lock.impulse[ELBOW]]),
    )


def _root_rate(chain: Chain, state: NodalState) -> float:
    """At which the root turns in fixed axes [rad/s]."""
    return float(joint_rates(chain, state.q[:, None], state.v[:, None])[ROOT, 0])


def _momentum(
    chain: Chain, joints: Sequence[Joint], state: NodalState, inertia: float, rate: float
) -> Array:
    """Momentum on x of the arm, and of a satellite that turns at a rate of its own [rad/s]."""
    locked = [joint if isinstance(joint, Locked) else Free() for joint in joints]
    assembly = MinimalCoordinates(chain, locked).assembly
    rates = assembly.gather(state.v)
    momentum = np.asarray(dense(assembly.mass) @ rates)

    # the slope at the root carries the hub, of which the satellite has a rate of its own here
    root = list(assembly.place[[2, 3]])
    across = quarter(state.q[[2, 3], None])[:, 0]
    momentum[root] += inertia * (rate * across - rates[root])
    return momentum


def momenta(chain: Chain, q: Array, v: Array) -> tuple[Array, Array]:
    """Linear (2, m) [N s] and angular (m,) [N m s] momentum about the root.

    Translations and the rotation about the root are exact motions of the elements, so that both
    are products of the mass matrix with them: that of a chain whose root is not pinned, as the
    root too moves in a translation.
    """
    flying = dataclasses.replace(chain, pinned=False)
    assembly = MinimalCoordinates(flying, [Free()] * len(chain.links)).assembly
    momentum = dense(assembly.mass) @ np.column_stack([assembly.gather(x) for x in v.T])

    axis = np.arange(chain.size) % 4  # 0 and 1: positions along x and y; 2 and 3: slopes
    linear = [assembly.gather((axis == k).astype(float)) @ momentum for k in (0, 1)]

    spin = np.column_stack([assembly.gather(x) for x in across(q).T])
    return np.array(linear), (spin * momentum).sum(axis=0)


def across(q: Array) -> Array:
    """Rates of all nodes by a turn about the root: positions and slopes, by a right angle."""
    turned = np.empty_like(q)
    turned[0::2], turned[1::2] = -q[1::2], q[0::2]
    return turned
