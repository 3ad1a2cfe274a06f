"""Replays of a motion on the full ANCF model, with the lock and what it leaves.

Residual energy E_res: mechanical energy right after the lock, above the locked equilibrium.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from models.ancf.analysis import LockedRun, Modes, natural_modes, residual_energy
from models.ancf.assembly import dense
from models.ancf.chain import Chain
from models.ancf.integrate import StepControl, simulate
from models.ancf.joints import Free, Joint
from models.ancf.motion import MinimalCoordinates
from models.ancf.state import NodalState, posed
from ocp.arrays import Array
from studies.arm.replay.satellite import SatelliteMotion, lock_on, satellite_motion, seen_from
from studies.arm.stage import ROOT, Stage

Drive = Literal["torque", "angle"]
ELEMENTS = 8  # of a link
MODES = 3  # locked modes that are reported
DWELL_SAMPLES = 101  # instants between a lock and the next motion
SAMPLES = 2001  # even instants of the output, close enough for rates by splines through them
# of order 13: a third fewer steps than of order 9, and less of an error where few are taken
SMOOTH = StepControl(1e-9, stages=7)
CLOSE = StepControl(1e-8, stages=7)  # right to some per mille of 1e-6 J, in half the time
QUICK = StepControl(1e-7, stages=7)  # right to some per cent of what a law of the paper leaves
_CLOSE_FROM = 1e-7  # [J], above which `CLOSE` tells what is left
JUMPS = StepControl(1e-7, fixed_step=0.004)  # modes too fast for the step are damped, see models
_FEW_EDGES = 50  # breakpoints, up to which both sides of each are put out


@dataclass(frozen=True, eq=False)
class Motion:
    """What drives the joints of a stage, ready to be replayed.

    Attributes
    ----------
    name : of the law.
    drive : "torque" (joints free until the lock) or "angle" (torque is the reaction).
    stage : Stage
    joints : what is done at the joints that turn.
    jumps : whether torque or acceleration jumps, which calls for a fixed step.
    """

    name: str
    drive: Drive
    stage: Stage
    joints: Mapping[int, Joint]
    jumps: bool = False


@dataclass(frozen=True, eq=False)
class ResidualVibration:
    """The vibration that a lock leaves, in the first modes of the locked arm.

    Attributes
    ----------
    frequencies : of the modes (k,) [Hz].
    modal_energy : (k,) [J].
    modal_amplitude : largest displacement anywhere on the arm (k,) [m].
    tip_by_mode : amplitude of the tip in each (k,) [m].
    tip, elbow : amplitudes that all modes can reach together [m].
    root_moment : the same of the root's bending moment [N m].
    """

    frequencies: Array
    modal_energy: Array
    modal_amplitude: Array
    tip_by_mode: Array
    tip: float
    elbow: float
    root_moment: float


@dataclass(frozen=True, eq=False)
class LockedMotion:
    """A motion on the full model, up to the lock of the joints that turned and beyond it.

    Attributes
    ----------
    motion : Motion
    fixed : the simulation, the lock and the motion after it, in fixed axes.
    modes : number of locked modes to report.
    """

    motion: Motion
    fixed: LockedRun
    modes: int = MODES

    @property
    def chain_after(self) -> Chain:
        """The chain after the lock."""
        return self.motion.stage.chain(self.fixed.before.chain.elements, locked=True)

    @cached_property
    def satellite(self) -> SatelliteMotion | None:
        """How a free satellite turns; None if it is held."""
        if self.motion.stage.satellite_inertia is None:
            return None
        return satellite_motion(self.motion.stage, self.fixed.before, self.fixed.after)

    @cached_property
    def run(self) -> LockedRun:
        """The run as the satellite sees it."""
        turning, run = self.satellite, self.fixed
        if turning is None:
            return run
        # modes of the locked arm have no momentum, so that the satellite's rate is not seen in them
        lock, end = run.engagement, turning.turn[-1:]
        q, v = seen_from(lock.state.q[:, None], lock.state.v[:, None], end, np.zeros(1))
        state = NodalState(q[:, 0], v[:, 0])
        q, v = seen_from(run.before.q, run.before.v, turning.turn, turning.rate)
        before, after = replace(run.before, q=q, v=v), run.after
        if after is not None:
            q, v = seen_from(after.q, after.v, turning.turn_after, turning.rate_after)
            after = replace(after, q=q, v=v)
        return replace(run, before=before, engagement=replace(lock, state=state), after=after)

    @cached_property
    def vibration(self) -> ResidualVibration:
        """What the lock leaves, by mode."""
        return residual_vibration(self.run, self.chain_after, self.modes)

    @property
    def residual_energy(self) -> float:
        """E_res [J]."""
        return self.run.residual_energy

    @property
    def peak_torque(self) -> Array:
        """Largest absolute torque of each joint (2,) [N m]."""
        return np.asarray(np.abs(self.run.before.torque).max(axis=1))

    @property
    def miss(self) -> float:
        """Largest angle miss at the lock [rad]."""
        return max((abs(v) for v in self.run.engagement.miss.values()), default=0.0)


def replay(
    motion: Motion,
    *,
    elements: int = ELEMENTS,
    settings: StepControl | None = None,
    after: Array | None = None,
    modes: int = MODES,
    previous: LockedMotion | None = None,
) -> LockedMotion:
    """Replay a motion on the full model and lock the joints that turned.

    Parameters
    ----------
    motion : Motion
    elements : int
        Of a link.
    settings : StepControl, optional
        Of the integrator.
    after : (m,), optional
        Instants of the motion after the lock, from the lock on [s].
    modes : int
        Number of locked modes to report.
    previous : LockedMotion, optional
        The motion before, from the end of whose `after` this one goes on; from rest by default.
    """
    stage = motion.stage
    settings = settings or (JUMPS if motion.jumps else SMOOTH)
    joints, start = stage.full_joints(dict(motion.joints)), stage.start_state(elements)
    if previous is not None and previous.fixed.after is not None:
        held, start = previous.fixed.engagement.joints, previous.fixed.after.final
        joints = [motion.joints.get(k, joint) for k, joint in enumerate(held)]
    times = sample_times(motion)
    before = simulate(stage.chain(elements), joints, start, times, settings=settings)
    lock = lock_on(stage, joints, before)

    chain, swinging = stage.chain(elements, locked=True), None
    if after is not None:
        swinging = simulate(chain, lock.joints, lock.state, after, settings=settings)
    left = residual_energy(chain, lock.joints, lock.state)
    return LockedMotion(motion, LockedRun(before, lock, swinging, left), modes)


def in_turn(
    motions: Sequence[Motion],
    dwells: Sequence[float],
    *,
    elements: int = ELEMENTS,
    settings: StepControl | None = None,
) -> tuple[LockedMotion, ...]:
    """Motions one after the other, the arm locked between them for dwells [s]."""
    found: list[LockedMotion] = []
    for motion, dwell in itertools.zip_longest(motions, dwells):
        end, after = motion.stage.duration, None
        if dwell is not None:
            after = np.linspace(end, end + dwell, DWELL_SAMPLES)
        previous = found[-1] if found else None
        found.append(
            replay(motion, elements=elements, settings=settings, after=after, previous=previous)
        )
    return tuple(found)


def after_lock(stage: Stage, instants: int = 401) -> Array:
    """Instants after the lock that are followed, a quarter of the stage [s]."""
    return np.linspace(stage.duration, 1.25 * stage.duration, instants)


def followed(replayed: LockedMotion, after: Array) -> LockedMotion:
    """The same replay, followed beyond its lock at instants (m,) from the lock on [s]."""
    run = replayed.fixed
    # a thousandth of the swing; what swings less is followed no finer than the motion was
    tolerance = float(np.clip(1e-3 * replayed.vibration.tip, SMOOTH.tolerance, QUICK.tolerance))
    swinging = simulate(
        replayed.chain_after,
        run.engagement.joints,
        run.engagement.state,
        after,
        settings=StepControl(tolerance),
    )
    return replace(replayed, fixed=replace(run, after=swinging))


def steps_for(residual: float, drive: Drive = "torque") -> StepControl:
    """Steps that tell whether no more than an energy [J] is left.

    On an angle the steps are long, and fine ones are needed for the energy balance.
    """
    return CLOSE if residual >= _CLOSE_FROM and drive == "torque" else SMOOTH


def rough_steps_for(residual: float, drive: Drive = "torque") -> StepControl:
    """Steps that tell to some per cent whether no more than an energy [J] is left.

    For the rounds of a refinement: a third of the time of `steps_for`.
    """
    steps = steps_for(residual, drive)
    return QUICK if steps == CLOSE else steps


def sample_times(motion: Motion) -> Array:
    """Output instants: even ones, and both sides of every breakpoint."""
    end = motion.stage.duration
    edges = np.array([b for joint in motion.joints.values() for b in joint.breakpoints])
    # a law of many pieces is smooth enough to be read at its breakpoints alone
    sides = np.concatenate([edges * (1 - 1e-12), edges]) if len(edges) < _FEW_EDGES else edges
    times = np.unique(np.concatenate([np.linspace(0.0, end, SAMPLES), sides]))
    return np.asarray(times[(times >= 0) & (times <= end)])


def residual_vibration(run: LockedRun, chain: Chain, count: int) -> ResidualVibration:
    """Energy and amplitude of the first locked modes, and of tip, elbow and root moment."""
    lock = run.engagement
    rest = posed(chain, [float(angle) for angle in lock.angle])
    free = isinstance(lock.joints[ROOT], Free)
    modes = natural_modes(chain, lock.joints, rest, count=count + free)
    if free:
        # a satellite hangs on the length of the root's slope, too, and swings on it as none does
        kept = np.flatnonzero(modes.axial_fraction < 0.5)[:count]
        modes = Modes(modes.frequencies[kept], modes.shapes[:, kept], modes.axial_fraction[kept])

    # modal coordinates right after the lock: the shapes are orthonormal in the mass matrix
    assembly = MinimalCoordinates(chain, lock.joints).assembly
    shapes = np.column_stack([assembly.gather(shape) for shape in modes.shapes.T])
    mass = dense(assembly.mass)
    position = shapes.T @ mass @ (assembly.gather(lock.state.q) - assembly.gather(rest.q))
    rate = shapes.T @ mass @ assembly.gather(lock.state.v)
    omega = 2 * np.pi * modes.frequencies
    amplitude = np.hypot(position, rate / omega)

    tip, elbow = (
        _node_amplitude(modes.shapes, list(chain.slots(link, -1)[:2]), amplitude) for link in (1, 0)
    )
    translations = np.arange(chain.size) % 4 < 2
    return ResidualVibration(
        frequencies=modes.frequencies,
        modal_energy=0.5 * (omega * amplitude) ** 2,
        modal_amplitude=np.abs(modes.shapes[translations]).max(axis=0) * amplitude,
        tip_by_mode=tip,
        tip=float(tip.sum()),
        elbow=float(elbow.sum()),
        root_moment=float(np.abs(_root_moments(run, modes.shapes) * amplitude).sum()),
    )


def _node_amplitude(shapes: Array, place: list[int], amplitude: Array) -> Array:
    """Displacement at a node in each mode (k,) [m]."""
    return np.asarray(np.linalg.norm(shapes[place], axis=0) * amplitude)


def _root_moments(run: LockedRun, shapes: Array) -> Array:
    """Bending moment at the root of unit mode shapes (k,) [N m], from its first element.

    EI times the curvature of the cubic at its start, perpendicular to the link.
    """
    chain = run.before.chain
    link = chain.links[0]
    length = link.length / chain.elements
    first, second = (list(chain.slots(0, k)) for k in (0, 1))

    # unit vector across the link at its root
    slope = run.engagement.state.q[first[2:]]
    across = np.array([-slope[1], slope[0]]) / np.hypot(*slope)

    r0, s0 = across @ shapes[first[:2]], across @ shapes[first[2:]]
    r1, s1 = across @ shapes[second[:2]], across @ shapes[second[2:]]
    curvature = 6 * (r1 - r0) / length**2 - (4 * s0 + 2 * s1) / length
    return np.asarray(link.bending_stiffness * curvature)
