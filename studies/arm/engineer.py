"""What an engineer asks of a motion: loads at the root and in the links, and what it leaves.

Loads come from the nodes of the full model: the force of the satellite on the arm is the rate of
the arm's linear momentum, its moment the rate of the angular momentum about the root.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from models.ancf.assembly import dense
from models.ancf.eliminated import Eliminated
from models.ancf.joint import Locked, joint_rates
from models.ancf.link import Chain
from models.ancf.simulate import simulate
from studies.arm.replay import SMOOTH, Motion, Replay, replay

Array = NDArray[np.float64]
EARLY_LATE = 0.1  # [s], the issue's
_GRID = 2001


@dataclass(frozen=True, eq=False)
class Loads:
    """Histories of a replay until the lock.

    Attributes
    ----------
    times : (m,) [s]
    force : (2, m) of the satellite on the arm [N].
    moment : (m,) of the satellite about the root [N m].
    angular_momentum : (m,) of the arm about the root, the negative of the satellite's [N m s].
    bending : (L, m) largest bending moment anywhere on each link [N m].
    tip_acceleration : (m,) [m/s^2].
    """

    times: Array
    force: Array
    moment: Array
    angular_momentum: Array
    bending: Array
    tip_acceleration: Array


def loads(replayed: Replay) -> Loads:
    """Loads along a replay, from even samples of it."""
    run = replayed.run.before
    t = np.linspace(run.times[0], run.times[-1], _GRID)
    again = simulate(run.chain, replayed.motion.stage.full_joints(dict(replayed.motion.joints)),
                     replayed.motion.stage.start_state(run.chain.elements), t,
                     settings=SMOOTH)  # fmt: skip
    linear, angular = momenta(run.chain, again.q, again.v)
    tip_speed = again.v[list(run.chain.slots(1, -1)[:2])]
    return Loads(
        t,
        np.gradient(linear, t, axis=1),
        np.gradient(angular, t),
        angular,
        np.array([bending_moments(run.chain, k, again.q) for k in range(len(run.chain.links))]),
        np.linalg.norm(np.gradient(tip_speed, t, axis=1), axis=0),
    )


def momenta(chain: Chain, q: Array, v: Array) -> tuple[Array, Array]:
    """Linear (2, m) [N s] and angular (m,) [N m s] momentum about the root.

    Rigid translations and the rotation about the root are exact motions of the elements, so that
    both are products of the mass matrix with them.
    """
    asm = Eliminated(chain, [Locked(0.0)] * len(chain.links)).assembly
    mass = dense(asm.mass)
    n = chain.size
    place = np.arange(n) % 4
    linear = []
    momentum = mass @ np.column_stack([asm.gather(column) for column in v.T])
    for k in (0, 1):
        linear.append(asm.gather((place == k).astype(float)) @ momentum)
    turned = np.empty_like(q)
    turned[0::2], turned[1::2] = -q[1::2], q[0::2]
    spin = np.column_stack([asm.gather(column) for column in turned.T])
    return np.array(linear), (spin * momentum).sum(axis=0)


def bending_moments(chain: Chain, link: int, q: Array) -> Array:
    """Largest absolute bending moment (m,) of a link over its element ends [N m]."""
    beam = chain.links[link]
    L = beam.length / chain.elements
    best = np.zeros(q.shape[1])
    for e in range(chain.elements):
        a, b = (list(chain.slots(link, e + k)) for k in (0, 1))
        for r, s in (
            (6 * (q[b[:2]] - q[a[:2]]) / L**2 - (4 * q[a[2:]] + 2 * q[b[2:]]) / L, q[a[2:]]),
            (-6 * (q[b[:2]] - q[a[:2]]) / L**2 + (2 * q[a[2:]] + 4 * q[b[2:]]) / L, q[b[2:]]),
        ):
            curvature = (s[0] * r[1] - s[1] * r[0]) / (s**2).sum(axis=0)
            best = np.maximum(best, np.abs(beam.bending_stiffness * curvature))
    return best


def deflections(replayed: Replay) -> Array:
    """Largest distance (L,) of each link's end from the tangent at its start [m]."""
    run = replayed.run.before
    out = []
    for k in range(len(run.chain.links)):
        first, last = (list(run.chain.slots(k, node)) for node in (0, -1))
        along, chord = run.q[first[2:]], run.q[last[:2]] - run.q[first[:2]]
        across = (along[0] * chord[1] - along[1] * chord[0]) / np.hypot(*along)
        out.append(np.abs(across).max())
    return np.array(out)


def mean_square(replayed: Replay) -> float:
    """Mean square torque of the driven joints together [N^2 m^2]: the heat of the motors."""
    run = replayed.run.before
    total = (run.torque[list(replayed.motion.stage.moving)] ** 2).sum(axis=0)
    return float(np.trapezoid(total, run.times) / (run.times[-1] - run.times[0]))


def work_drawn(replayed: Replay) -> float:
    """Mechanical work of drives that recover nothing [J]."""
    run = replayed.run.before
    power = run.torque * joint_rates(run.chain, run.q, run.v)
    drawn = np.maximum(power[list(replayed.motion.stage.moving)], 0.0)
    return float(np.trapezoid(drawn, run.times).sum())


def stress(moment: float, stiffness: float, diameter: float, modulus: float) -> float:
    """Bending stress at the surface of a tube, M D E / (2 EI) [Pa]."""
    return moment * diameter * modulus / (2.0 * stiffness)


def early_and_late(motion: Motion) -> tuple[Replay, Replay]:
    """The motion locked `EARLY_LATE` too early, and too late."""
    end = motion.stage.duration
    return (
        replay(motion, lock_at=end - EARLY_LATE),
        replay(motion, lock_at=end + EARLY_LATE),
    )


def settling_time(replayed: Replay, error: float, ratio: float) -> float:
    """Time after the lock until the tip stays within an error [m], with a modal damping ratio.

    Bound of the decaying sum of the first three locked modes, the ratio the same in each.
    """
    omega = 2 * np.pi * replayed.frequencies
    amplitude = replayed.tip_by_mode

    def bound(t: float) -> float:
        return float((amplitude * np.exp(-ratio * omega * t)).sum())

    if bound(0.0) <= error:
        return 0.0
    low, high = 0.0, 1.0
    while bound(high) > error:
        high *= 2.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if bound(middle) > error else (low, middle)
    return high
