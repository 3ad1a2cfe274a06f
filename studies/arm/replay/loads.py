"""What an engineer asks of a motion: loads at the root and in the links, and what it leaves.

Loads come from the nodes of the full model: the force of the satellite on the arm is the rate of
the arm's linear momentum, its moment the rate of the angular momentum about the root.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from models.ancf.analysis import residual_energy
from models.ancf.chain import Chain
from models.ancf.integrate import Simulation, simulate
from models.ancf.joints import joint_rates
from ocp.arrays import Array
from studies.arm.replay.full_model import SAMPLES, SMOOTH, LockedMotion
from studies.arm.replay.satellite import lock_on, momenta
from studies.arm.stage import ROOT

EARLY_LATE = 0.1  # [s] that a lock may be early or late
_BEYOND = 11  # instants of a late lock's motion


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
        """Largest difference of angular momentum and integral of the reaction, over the momentum.

        Until the lock. Rates would not do: a torque that turns within few instants has splines
        through them ring.
        """
        times, momentum = self.times[: self.until], self.angular_momentum[: self.until]
        given = cumulative_trapezoid(self.reaction[: self.until], times, initial=0.0)
        off = np.abs(momentum - momentum[0] - given)
        return float(off.max() / np.abs(momentum).max())


def loads(replayed: LockedMotion) -> Loads:
    """Loads along a replay: even samples until the lock, those of the replay after it."""
    run, turning = replayed.fixed, replayed.satellite
    held = (
        np.zeros(len(run.before.times)),
        np.zeros(0 if run.after is None else len(run.after.times)),
    )
    rates = held if turning is None else (turning.rate, turning.rate_after)
    H = 0.0 if turning is None else turning.inertia
    hubs = H * replayed.motion.stage.carried, H

    # rates are those of splines through even instants: both sides of a jump would spoil them
    even = np.linspace(run.before.times[0], run.before.times[-1], SAMPLES)
    kept = np.isin(run.before.times, even)
    parts = [_along(run.before, hubs[0] * rates[0][kept], kept)]
    parts += [_along(run.after, hubs[1] * rates[1])] if run.after is not None else []
    columns = [np.concatenate(column, axis=-1) for column in zip(*parts, strict=True)]
    times, force, moment, reaction, angular, bending, tip_acceleration = columns

    # what the lock adds to the momenta within no time
    state = run.engagement.state
    q, v = state.q[:, None], state.v[:, None]
    linear_after, angular_after = momenta(replayed.chain_after, q, v)
    if H:
        angular_after -= H * joint_rates(replayed.chain_after, q, v)[ROOT]
    final = run.before.final
    linear_before, _ = momenta(run.before.chain, final.q[:, None], final.v[:, None])
    return Loads(
        times=times,
        until=SAMPLES,
        force=force,
        moment=moment,
        reaction=reaction,
        angular_momentum=angular,
        bending=bending,
        tip_acceleration=tip_acceleration,
        force_impulse=(linear_after - linear_before)[:, 0],
        moment_impulse=float(angular_after[0] - parts[0][4][-1]),
    )


def _along(
    run: Simulation, of_the_satellite: Array, kept: NDArray[np.bool_] | slice = slice(None)
) -> tuple[Array, ...]:
    """Times, force, moment, reaction, angular momentum, bending and acceleration of a run.

    `of_the_satellite` is the momentum of one that is part of the hub: the arm has the rest.
    """
    chain, times = run.chain, run.times[kept]
    q, v = run.q[:, kept], run.v[:, kept]
    linear, angular = momenta(chain, q, v)
    angular -= of_the_satellite
    tip_velocity = v[list(chain.slots(1, -1)[:2])]
    bending = np.array([bending_moments(chain, k, q) for k in range(len(chain.links))])
    tip_acceleration = np.linalg.norm(_rate(tip_velocity, times), axis=0)
    force, moment = _rate(linear, times), _rate(angular, times)
    reaction = run.torque[0, kept] - _rate(of_the_satellite, times)
    return times, force, moment, reaction, angular, bending, tip_acceleration


def _rate(values: Array, times: Array) -> Array:
    return np.asarray(CubicSpline(times, values, axis=-1)(times, 1))


def bending_moments(chain: Chain, link: int, q: Array) -> Array:
    """Largest absolute bending moment (m,) of a link over its element ends [N m]."""
    beam = chain.links[link]
    length = beam.length / chain.elements
    largest = np.zeros(q.shape[1])

    for element in range(chain.elements):
        start, end = (list(chain.slots(link, element + k)) for k in (0, 1))
        chord = q[end[:2]] - q[start[:2]]
        slopes = q[start[2:]], q[end[2:]]

        # second derivatives of the cubic at both ends of the element
        bends = (
            6 * chord / length**2 - (4 * slopes[0] + 2 * slopes[1]) / length,
            -6 * chord / length**2 + (2 * slopes[0] + 4 * slopes[1]) / length,
        )
        for bend, slope in zip(bends, slopes, strict=True):
            curvature = (slope[0] * bend[1] - slope[1] * bend[0]) / (slope**2).sum(axis=0)
            largest = np.maximum(largest, np.abs(beam.bending_stiffness * curvature))

    return largest


def deflections(replayed: LockedMotion) -> Array:
    """Largest distance (L,) of each link's end from the tangent at its start [m]."""
    run = replayed.run.before
    largest = []
    for k in range(len(run.chain.links)):
        first, last = (list(run.chain.slots(k, node)) for node in (0, -1))
        along, chord = run.q[first[2:]], run.q[last[:2]] - run.q[first[:2]]
        across = (along[0] * chord[1] - along[1] * chord[0]) / np.hypot(*along)
        largest.append(np.abs(across).max())
    return np.array(largest)


def mean_square(replayed: LockedMotion) -> float:
    """Mean square torque of the driven joints together [N^2 m^2]: the heat of the motors."""
    run = replayed.run.before
    total = (run.torque[list(replayed.motion.stage.moving)] ** 2).sum(axis=0)
    return float(np.trapezoid(total, run.times) / (run.times[-1] - run.times[0]))


def work_drawn(replayed: LockedMotion) -> float:
    """Mechanical work of drives that recover nothing [J]."""
    run = replayed.run.before
    power = run.torque * joint_rates(run.chain, run.q, run.v)
    drawn = np.maximum(power[list(replayed.motion.stage.moving)], 0.0)
    return float(np.trapezoid(drawn, run.times).sum())


def stress(moment: float, stiffness: float, diameter: float, modulus: float) -> float:
    """Bending stress at the surface of a tube, M D E / (2 EI) [Pa]."""
    return moment * diameter * modulus / (2.0 * stiffness)


@dataclass(frozen=True)
class OffTime:
    """What a lock off time leaves [J], its angle miss [rad] and largest impulse [N m s]."""

    residual_energy: float
    miss: float
    impulse: float


def early_and_late(replayed: LockedMotion) -> tuple[OffTime, OffTime]:
    """The motion locked `EARLY_LATE` too early, and too late; the joints are free until then."""
    stage, run = replayed.motion.stage, replayed.fixed.before
    joints = stage.full_joints(dict(replayed.motion.joints))
    end = float(run.times[-1])

    # the satellite's turn goes on from the whole motion until the lock
    i = int(np.argmin(np.abs(run.times - (end - EARLY_LATE))))
    beyond = simulate(
        run.chain, joints, run.final, np.linspace(end, end + EARLY_LATE, _BEYOND), settings=SMOOTH
    )

    def locked(times: Array, q: Array, v: Array) -> OffTime:
        lock = lock_on(stage, joints, dataclasses.replace(run, times=times, q=q, v=v))
        left = residual_energy(replayed.chain_after, lock.joints, lock.state)
        miss = max(abs(off) for off in lock.miss.values())
        return OffTime(left, miss, float(np.abs(lock.impulse).max()))

    early = locked(run.times[: i + 1], run.q[:, : i + 1], run.v[:, : i + 1])
    both = zip((run.times, run.q, run.v), (beyond.times, beyond.q, beyond.v), strict=True)
    return early, locked(*(np.concatenate([a, b[..., 1:]], axis=-1) for a, b in both))


def modal_ratios(replayed: LockedMotion, assumed: float) -> Array:
    """Damping ratios of the locked modes (k,): those of the links' damping, else an assumed one.

    The links' damping grows with the frequency from its ratio at `damping_frequency`.
    """
    relaxation = replayed.motion.stage.arm.relaxation_time
    frequencies = replayed.vibration.frequencies
    return (
        np.pi * relaxation * frequencies if relaxation > 0 else np.full_like(frequencies, assumed)
    )


def settling_time(replayed: LockedMotion, error: float, ratios: Array) -> float:
    """Time after the lock until the tip stays within an error [m] of where it comes to rest.

    Bound of the decaying sum of the locked modes that the replay reports, with the amplitudes
    right after the lock: for damping ratios (k,) well below one.
    """
    omega = 2 * np.pi * replayed.vibration.frequencies
    # the slower of both exponents, complex below critical damping
    decay = omega * np.real(ratios - np.sqrt(ratios.astype(complex) ** 2 - 1))
    amplitude = replayed.vibration.tip_by_mode

    def bound(t: float) -> float:
        return float((amplitude * np.exp(-decay * t)).sum())

    if bound(0.0) <= error:
        return 0.0

    high = 1.0
    while bound(high) > error:
        high *= 2.0
    return float(brentq(lambda t: bound(t) - error, 0.0, high))
