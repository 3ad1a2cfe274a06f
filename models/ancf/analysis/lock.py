"""Locking of joints at the end of a motion, and what it leaves.

A lock acts at once at the angle reached: positions are continuous, velocities are projected
by the inelastic impulse M (v+ - v-) = Phi_q^T Lambda, the joint torque is zero afterwards.

Symbols: x coordinates of the assembly (n,), z minimal coordinates; p momentum on x; J = dx/dz.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from models.ancf.analysis.modes import equilibrium
from models.ancf.assembly import dense
from models.ancf.chain import Chain
from models.ancf.integrate import Simulation, StepControl, simulate
from models.ancf.joints import (
    Free,
    Joint,
    Locked,
    check_joints,
    joint_angles,
    joint_rates,
    quarter,
)
from models.ancf.motion import MinimalCoordinates
from models.ancf.state import NodalState
from models.arrays import Array
from models.errors import ModelError, require

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
    momentum: Array | None = None,
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
    momentum : (n,), optional
        Right before, see `project`.

    Raises
    ------
    ModelError
        If a joint is missing, or misses its target by more than the tolerance.
    """
    joints, targets = check_joints(chain, joints), targets or {}
    for k in engaged:
        require(
            0 <= k < len(joints) and chain.pinned,
            f"engage: joint {k} cannot lock; the chain has {len(joints)} joints.",
        )

    angle = joint_angles(chain, state.q[:, None])[:, 0]
    miss = {k: _wrap(angle[k] - targets[k]) for k in engaged if k in targets}
    for k, distance in miss.items():
        if tolerance is not None and abs(distance) > tolerance:
            raise ModelError(
                f"engage: joint {k} is at {angle[k]:.6g} rad and misses the lock at "
                f"{targets[k]:.6g} rad by {distance:.2e} rad, more than {tolerance:.2e}; "
                "change the law, the time or the tolerance."
            )

    # A drive or a torque ends with the lock, also at joints that do not engage.
    after = tuple(
        Locked(float(angle[k])) if k in engaged else joint if isinstance(joint, Locked) else Free()
        for k, joint in enumerate(joints)
    )
    form = MinimalCoordinates(chain, after)
    locked, kick = project(form, state, time, momentum)
    return Engagement(
        time=time,
        joints=after,
        state=locked,
        impulse=_impulses(form, state, kick),
        lost_energy=_energies(form, state)[0] - _energies(form, locked)[0],
        angle=angle,
        miss=miss,
    )


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
    from scipy.linalg import solve

    asm, elimination, instant = form.assembly, form.elimination, np.full(1, time)
    x, mass = asm.gather(state.q)[:, None], dense(asm.mass)
    if momentum is None:
        momentum = mass @ asm.gather(state.v)

    # The impulse of the lock does no work on z: the momentum on z is kept.
    z = form.coordinates(time, state.q, state.v)[0][:, None]
    on_z = elimination.force(instant, x, momentum[:, None])
    rate = solve(elimination.reduce(time, x[:, 0], mass), on_z, assume_a="pos")

    q, v = form.nodes(instant, z, rate)
    return NodalState(q[:, 0], v[:, 0]), mass @ asm.gather(v[:, 0]) - momentum


def residual_energy(chain: Chain, joints: Sequence[Joint], state: NodalState) -> float:
    """Kinetic and potential energy of a state above the equilibrium of the locked chain [J]."""
    form = MinimalCoordinates(chain, joints)
    energy = sum(_energies(form, state))

    # without gravity the equilibrium is the undeformed chain, whose energy is zero
    if any(chain.gravity):
        energy -= sum(_energies(form, equilibrium(chain, joints, state)))
    return energy


def _impulses(form: MinimalCoordinates, state: NodalState, kick: Array) -> Array:
    """Angular impulse of each joint on the link after it, (L,) [N m s]."""
    x = form.assembly.gather(state.q)
    impulses = np.zeros(len(form.joints))
    for tie in form.elimination.ties:
        slope, on_slope = x[tie.after, None], kick[tie.after, None]
        impulses[tie.number] = (quarter(slope) * on_slope).sum()
    return impulses


def _energies(form: MinimalCoordinates, state: NodalState) -> tuple[float, float, float]:
    """Kinetic, strain and gravity energy of a state [J]."""
    asm = form.assembly
    x, rate = asm.gather(state.q)[:, None], asm.gather(state.v)[:, None]
    kinetic, strain, gravity = (float(energy[0]) for energy in asm.energies(x, rate))
    return kinetic, strain, gravity


@dataclass(frozen=True, eq=False)
class LockedRun:
    """A motion, its lock, and the motion that the lock leaves."""

    before: Simulation
    engagement: Engagement
    after: Simulation | None
    residual_energy: float

    @property
    def runs(self) -> tuple[Simulation, ...]:
        """The motion up to the lock and, where it was followed, the one beyond it."""
        return (self.before,) if self.after is None else (self.before, self.after)


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

    # what is left goes on swinging about the locked configuration
    swinging = None
    if after is not None:
        swinging = simulate(chain, lock.joints, lock.state, after, settings=settings)
    return LockedRun(before, lock, swinging, left)


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
    from scipy.interpolate import CubicHermiteSpline

    distance = motion.joint_angles()[joint] - target
    side = np.sign(distance[0]) or 1.0
    beyond = np.flatnonzero(side * distance <= tolerance)
    if not len(beyond):
        nearest = int(np.argmin(np.abs(distance)))
        raise ModelError(
            f"latch: joint {joint} comes no nearer than {abs(distance[nearest]):.2e} rad to the "
            f"latch at {target:.6g} rad (at t = {motion.times[nearest]:.4g} s); "
            "change the law or the target."
        )

    # the last output before the latch, from which the approach is simulated again, densely
    i = max(int(beyond[0]) - 1, 0)
    state, t = NodalState(motion.q[:, i], motion.v[:, i]), float(motion.times[i])
    if beyond[0] == 0:
        return t, state
    times = np.linspace(t, float(motion.times[beyond[0]]), _APPROACH)
    near = simulate(chain, joints, state, times, settings=settings)

    # The angles of the new run start within one turn: they continue those of the given motion.
    angles = near.joint_angles()[joint]
    path = angles + distance[i] + target - angles[0]
    rates = joint_rates(chain, near.q, near.v)[joint]
    caught = target + side * tolerance / 2
    meets = CubicHermiteSpline(times, path - caught, rates).roots(extrapolate=False)

    t_end = float(meets[0]) if len(meets) else float(times[-1])
    last = simulate(chain, joints, state, np.array([t, t_end]), settings=settings)
    return t_end, last.final


def _wrap(angle: float) -> float:
    """Angle in (-pi, pi]."""
    return float(np.angle(np.exp(1j * angle)))
