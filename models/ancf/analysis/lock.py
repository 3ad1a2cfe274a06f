"""Locking of joints at the end of a motion, and what it leaves.

A lock acts at once at the angle reached: positions are continuous, velocities are projected
by the inelastic impulse M (v+ - v-) = Phi_q^T Lambda, the joint torque is zero afterwards.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.linalg import solve

from models.ancf.analysis.modes import equilibrium
from models.ancf.assembly import dense
from models.ancf.chain import Chain
from models.ancf.integrate.integrator import StepControl
from models.ancf.integrate.simulate import Simulation, simulate
from models.ancf.joints import (
    Free,
    Joint,
    Locked,
    check_joints,
    joint_angles,
    joint_rates,
    quarter,
)
from models.ancf.motion.minimal_coordinates import MinimalCoordinates
from models.ancf.state import NodalState
from models.arrays import Array
from models.errors import ModelError

_APPROACH = 65  # instants between which the path to a latch is interpolated


@dataclass(frozen=True, eq=False)
class Engagement:
    """What a lock does.

    Attributes
    ----------
    time : float
        [s]
    joints : tuple of Joint
        Joints afterwards: the engaged ones Locked at the angle reached, others Free unless
        locked before.
    state : NodalState
        State right after.
    impulse : (L,)
        Angular impulse of each joint on the link after it [N m s].
    lost_energy : float
        Kinetic energy lost [J].
    angle : (L,)
        Joint angles reached [rad].
    miss : dict
        Angle reached less target of each engaged joint with a target [rad].
    """

    time: float
    joints: tuple[Joint, ...]
    state: NodalState
    impulse: Array
    lost_energy: float
    angle: Array
    miss: dict[int, float]


def engage(
    chain: Chain,
    joints: Sequence[Joint],
    state: NodalState,
    engaged: Sequence[int],
    *,
    time: float = 0.0,
    targets: Mapping[int, float] | None = None,
    tolerance: float | None = None,
) -> Engagement:
    """Lock joints at the angles they have.

    Parameters
    ----------
    chain : Chain
    joints : sequence of Joint
        What was done at the joints until then.
    state : NodalState
        State right before.
    engaged : sequence of int
        Joints to lock.
    time : float
        [s]
    targets : mapping, optional
        Angle wanted of a joint [rad].
    tolerance : float, optional
        Largest miss that the lock accepts [rad]; any by default.

    Raises
    ------
    ModelError
        If a joint is missing, or misses its target by more than the tolerance.
    """
    joints, targets = list(check_joints(chain, joints)), targets or {}
    angle = joint_angles(chain, state.q[:, None])[:, 0]
    for k in engaged:
        if not 0 <= k < len(joints) or not chain.pinned:
            raise ModelError(f"engage: joint {k} cannot lock; the chain has {len(joints)} joints.")
    miss = {k: _wrap(angle[k] - targets[k]) for k in engaged if k in targets}
    for k, off in miss.items():
        if tolerance is not None and abs(off) > tolerance:
            raise ModelError(
                f"engage: joint {k} is at {angle[k]:.6g} rad and misses the lock at "
                f"{targets[k]:.6g} rad by {off:.2e} rad, more than {tolerance:.2e}; "
                "change the law, the time or the tolerance."
            )
    after = tuple(
        Locked(float(angle[k])) if k in engaged else joint if isinstance(joint, Locked) else Free()
        for k, joint in enumerate(joints)
    )
    form = MinimalCoordinates(chain, after)
    now, kick = project(form, state, time)
    lost = _kinetic(form, state) - _kinetic(form, now)
    impulse = _impulses(form, after, state, kick)
    return Engagement(time, after, now, impulse, lost, angle, miss)


def project(
    form: MinimalCoordinates, state: NodalState, time: float = 0.0, momentum: Array | None = None
) -> tuple[NodalState, Array]:
    """Velocities right after joints lock, J^T M J zdot = J^T p with v+ = J zdot.

    Parameters
    ----------
    form : MinimalCoordinates
        The chain with its joints as they are afterwards, at the angles reached.
    state : NodalState
        State right before.
    time : float
        [s]
    momentum : (n,), optional
        p in the merged coordinates right before; M v by default.

    Returns
    -------
    state : NodalState
    kick : (n,)
        Impulse M v+ - p on the merged coordinates.
    """
    asm, at = form.assembly, np.full(1, time)
    x, mass = asm.gather(state.q)[:, None], dense(asm.mass)
    if momentum is None:
        momentum = mass @ asm.gather(state.v)
    z = form.state(time, state.q, state.v)[0][:, None]
    pulled = form.ties.pull(at, x, momentum[:, None])
    rate = solve(form.ties.reduce(time, x[:, 0], mass), pulled, assume_a="pos")
    q, v = form.nodes(at, z, rate)
    return NodalState(q[:, 0], v[:, 0]), mass @ asm.gather(v[:, 0]) - momentum


def _impulses(
    form: MinimalCoordinates, joints: Sequence[Joint], state: NodalState, kick: Array
) -> Array:
    """Angular impulse of each joint on the link after it, (L,) [N m s]."""
    x = form.assembly.gather(state.q)
    impulse = np.zeros(len(joints))
    for tie in form.ties.ties:
        k = next(i for i, joint in enumerate(joints) if joint is tie.joint)
        b = list(tie.b)
        impulse[k] = (quarter(x[b, None]) * kick[b, None]).sum()
    return impulse


def _kinetic(form: MinimalCoordinates, state: NodalState) -> float:
    v = form.assembly.gather(state.v)
    return 0.5 * float(v @ (form.assembly.mass @ v))


def residual_energy(chain: Chain, joints: Sequence[Joint], state: NodalState) -> float:
    """Kinetic and potential energy of a state above the equilibrium of the locked chain [J]."""
    form = MinimalCoordinates(chain, joints)
    rest = state
    if any(chain.gravity):
        rest = equilibrium(chain, joints, state)
    return _mechanical(form, state) - (_mechanical(form, rest) if rest is not state else 0.0)


def _mechanical(form: MinimalCoordinates, state: NodalState) -> float:
    asm = form.assembly
    x = asm.gather(state.q)
    strain = float(asm.strain_energy(x[:, None])[0])
    return _kinetic(form, state) + strain - float(asm.gravity @ x)


@dataclass(frozen=True, eq=False)
class LockedRun:
    """A motion, its lock, and the motion that the lock leaves."""

    before: Simulation
    engagement: Engagement
    after: Simulation | None
    residual_energy: float


def run_and_lock(
    chain: Chain,
    joints: Sequence[Joint],
    state: NodalState,
    times: Array,
    engaged: Sequence[int],
    *,
    after: Array | None = None,
    targets: Mapping[int, float] | None = None,
    tolerance: float | None = None,
    settings: StepControl | None = None,
) -> LockedRun:
    """Simulate to `times[-1]`, lock there, and simulate the locked chain at `after` if given.

    `after` starts at `times[-1]`; for the other arguments see `simulate` and `engage`.
    """
    before = simulate(chain, joints, state, times, settings=settings)
    lock = engage(
        chain,
        joints,
        before.final,
        engaged,
        time=float(times[-1]),
        targets=targets,
        tolerance=tolerance,
    )
    left = residual_energy(chain, lock.joints, lock.state)
    rest = None
    if after is not None:
        rest = simulate(chain, lock.joints, lock.state, after, settings=settings)
    return LockedRun(before, lock, rest, left)


def latch_time(
    chain: Chain,
    joints: Sequence[Joint],
    motion: Simulation,
    joint: int,
    target: float,
    *,
    tolerance: float = 1e-6,
    settings: StepControl | None = None,
) -> tuple[float, NodalState]:
    """First time [s] at which a joint comes to a latch, and the state there.

    Parameters
    ----------
    motion : Simulation
        The motion of `chain` with `joints`, with output dense enough to show the approach.
    joint : int
    target : float
        Angle of the latch [rad], as followed from the start without jumps.
    tolerance : float
        Distance at which the latch catches [rad].

    Raises
    ------
    ModelError
        If the joint does not arrive.
    """
    off = motion.joint_angles()[joint] - target
    side = np.sign(off[0]) or 1.0
    beyond = np.flatnonzero(side * off <= tolerance)
    if not len(beyond):
        best = int(np.argmin(np.abs(off)))
        raise ModelError(
            f"latch: joint {joint} comes no nearer than {abs(off[best]):.2e} rad to the latch at "
            f"{target:.6g} rad (at t = {motion.times[best]:.4g} s); change the law or the target."
        )
    i = max(int(beyond[0]) - 1, 0)
    state, t = NodalState(motion.q[:, i], motion.v[:, i]), float(motion.times[i])
    if beyond[0] == 0:
        return t, state
    times = np.linspace(t, float(motion.times[beyond[0]]), _APPROACH)
    near = simulate(chain, joints, state, times, settings=settings)
    path = near.joint_angles()[joint] + off[i] + target - near.joint_angles()[joint, 0]
    rates = joint_rates(chain, near.q, near.v)[joint]
    caught = target + side * tolerance / 2
    meets = CubicHermiteSpline(times, path - caught, rates).roots(extrapolate=False)
    t_end = float(meets[0]) if len(meets) else float(times[-1])
    ends = np.array([t, t_end])
    return t_end, simulate(chain, joints, state, ends, settings=settings).final


def _wrap(angle: float) -> float:
    """Angle in (-pi, pi]."""
    return float(np.angle(np.exp(1j * angle)))
