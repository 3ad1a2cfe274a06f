"""What an engineer asks of a motion: loads at the root and in the links, and what it leaves.

Loads come from the nodes of the full model: the force of the satellite on the arm is the rate of
the arm's linear momentum, its moment the rate of the angular momentum about the root.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from models.ancf.assembly import dense
from models.ancf.chain import Chain
from models.ancf.integrate import Simulation, StepControl, simulate
from models.ancf.joints import Free, joint_rates
from models.ancf.motion import MinimalCoordinates
from studies.arm.replay.full import ELEMENTS, SMOOTH, Motion, Replay, replay

Array = NDArray[np.float64]
EARLY_LATE = 0.1  # [s] that a lock may be early or late
_GRID = 2001


@dataclass(frozen=True, eq=False)
class Loads:
    """Histories of a replay until the lock and after it, as far as the replay went on.

    Attributes
    ----------
    times : (m,) [s]; the lock's instant stands twice, right before it and right after.
    until : number of samples until right before the lock.
    force : (2, m) of the satellite on the arm [N].
    moment : (m,) of the satellite about the root, rate of the angular momentum [N m].
    reaction : (m,) the same from the balance of forces at the root's node [N m].
    angular_momentum : (m,) of the arm about the root, the negative of the satellite's [N m s].
    bending : (L, m) largest bending moment anywhere on each link [N m].
    tip_acceleration : (m,) [m/s^2].
    force_impulse : (2,) of the root's force in the lock [N s].
    moment_impulse : of its moment in the lock [N m s].
    """

    times: Array
    until: int
    force: Array
    moment: Array
    reaction: Array
    angular_momentum: Array
    bending: Array
    tip_acceleration: Array
    force_impulse: Array
    moment_impulse: float

    @property
    def imbalance(self) -> float:
        """Largest difference of moment and reaction until the lock over the largest moment."""
        off = np.abs(self.moment - self.reaction)[: self.until]
        return float(off.max() / np.abs(self.moment[: self.until]).max())


def loads(replayed: Replay, settings: StepControl = SMOOTH) -> Loads:
    """Loads along a replay: even samples until the lock, those of the replay after it."""
    run, stage = replayed.run, replayed.motion.stage
    chain = run.before.chain
    t = np.linspace(run.before.times[0], run.before.times[-1], _GRID)
    moving = simulate(chain, stage.full_joints(dict(replayed.motion.joints)),
                      stage.start_state(chain.elements), t, settings=settings)  # fmt: skip
    parts = [_along(moving)] + ([_along(run.after)] if run.after is not None else [])
    columns = [np.concatenate(column, axis=-1) for column in zip(*parts, strict=True)]
    lock = run.engagement.state
    edges = [momenta(chain, s.q[:, None], s.v[:, None]) for s in (run.before.final, lock)]
    impulse = (edges[1][0] - edges[0][0])[:, 0], float((edges[1][1] - edges[0][1])[0])
    t, force, moment, reaction, angular, bending, tip = columns
    return Loads(t, _GRID, force, moment, reaction, angular, bending, tip, *impulse)


def _along(run: Simulation) -> tuple[Array, ...]:
    """Times, force, moment, reaction, angular momentum, bending and acceleration of a run."""
    chain, t = run.chain, run.times
    linear, angular = momenta(chain, run.q, run.v)
    tip_speed = run.v[list(chain.slots(1, -1)[:2])]
    return (
        t, _rate(linear, t), _rate(angular, t), run.torque[0], angular,
        np.array([bending_moments(chain, k, run.q) for k in range(len(chain.links))]),
        np.linalg.norm(_rate(tip_speed, t), axis=0),
    )  # fmt: skip


def _rate(values: Array, t: Array) -> Array:
    return np.asarray(CubicSpline(t, values, axis=-1)(t, 1))


def momenta(chain: Chain, q: Array, v: Array) -> tuple[Array, Array]:
    """Linear (2, m) [N s] and angular (m,) [N m s] momentum about the root.

    Translations and the rotation about the root are exact motions of the elements, so that both
    are products of the mass matrix with them: that of a chain whose root is not pinned, as the
    root too moves in a translation.
    """
    flying = dataclasses.replace(chain, pinned=False)
    asm = MinimalCoordinates(flying, [Free()] * len(chain.links)).assembly
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


def early_and_late(motion: Motion, elements: int = ELEMENTS) -> tuple[Replay, Replay]:
    """The motion locked `EARLY_LATE` too early, and too late."""
    end = motion.stage.duration
    return (
        replay(motion, elements=elements, lock_at=end - EARLY_LATE),
        replay(motion, elements=elements, lock_at=end + EARLY_LATE),
    )


def modal_ratios(replayed: Replay, assumed: float) -> Array:
    """Damping ratios of the locked modes (k,): those of the links' damping, else an assumed one.

    The links' damping grows with the frequency from its ratio at `damping_frequency`.
    """
    eta = replayed.motion.stage.arm.relaxation_time
    f = replayed.frequencies
    return np.pi * eta * f if eta > 0 else np.full(len(f), assumed)


def settling_time(replayed: Replay, error: float, ratios: Array) -> float:
    """Time after the lock until the tip stays within an error [m] of where it comes to rest.

    Bound of the decaying sum of the locked modes that the replay reports, with the amplitudes
    right after the lock: for damping ratios (k,) well below one.
    """
    omega = 2 * np.pi * replayed.frequencies
    slowest = omega * np.real(ratios - np.sqrt(ratios.astype(complex) ** 2 - 1))
    amplitude = replayed.tip_by_mode

    def bound(t: float) -> float:
        return float((amplitude * np.exp(-slowest * t)).sum())

    if bound(0.0) <= error:
        return 0.0
    high = 1.0
    while bound(high) > error:
        high *= 2.0
    return float(brentq(lambda t: bound(t) - error, 0.0, high))
