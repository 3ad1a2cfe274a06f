"""Replays of a motion on the full ANCF model, with the lock and what it leaves.

Residual energy E_res: mechanical energy right after the lock, above the locked equilibrium.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from models.ancf.analysis import LockedRun, natural_modes, run_and_lock
from models.ancf.assembly import dense
from models.ancf.integrate import StepControl
from models.ancf.joints import Joint, Locked
from models.ancf.motion import MinimalCoordinates
from models.ancf.state import posed
from studies.arm.stage import Stage

Array = NDArray[np.float64]
Drive = Literal["torque", "angle"]
ELEMENTS = 8  # a link
SMOOTH = StepControl(1e-9)
JUMPS = StepControl(1e-7, fixed_step=0.004)  # modes too fast for the step are damped, see models
MODES = 3
SAMPLES = 1001


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
class Replay:
    """A motion on the full model.

    Attributes
    ----------
    motion : Motion
    run : the simulation, the lock and the motion after it.
    residual_energy : E_res [J].
    peak_torque : largest absolute torque of each joint (2,) [N m].
    modal_energy : energies of the first locked modes (k,) [J].
    modal_amplitude : their largest displacement anywhere on the arm (k,) [m].
    tip_by_mode : amplitude of the tip in each (k,) [m].
    tip_amplitude, elbow_amplitude, moment_amplitude : what they can reach together at the tip,
        the elbow [m] and in the root's bending moment [N m].
    frequencies : of these modes (k,) [Hz].
    """

    motion: Motion
    run: LockedRun
    residual_energy: float
    peak_torque: Array
    modal_energy: Array
    modal_amplitude: Array
    tip_by_mode: Array
    tip_amplitude: float
    elbow_amplitude: float
    moment_amplitude: float
    frequencies: Array

    @property
    def miss(self) -> float:
        """Largest angle miss at the lock [rad]."""
        return max((abs(v) for v in self.run.engagement.miss.values()), default=0.0)


def replay(
    motion: Motion,
    *,
    elements: int = ELEMENTS,
    settings: StepControl | None = None,
    lock_at: float | None = None,
    after: Array | None = None,
    modes: int = MODES,
) -> Replay:
    """Replay a motion on the full model and lock the joints that turned.

    Parameters
    ----------
    motion : Motion
    elements : int
        A link.
    settings : StepControl, optional
        Of the integrator.
    lock_at : float, optional
        Time of the lock [s], the stage's duration by default.
    after : (m,), optional
        Instants of the motion after the lock, from the lock on [s].
    modes : int
        Number of locked modes to report.
    """
    stage = motion.stage
    chain = stage.arm.chain(elements)
    end = stage.duration if lock_at is None else lock_at
    run = run_and_lock(
        chain,
        stage.full_joints(dict(motion.joints)),
        stage.start_state(elements),
        sample_times(motion, end),
        list(stage.moving),
        targets={k: stage.end[k] for k in stage.moving},
        after=after,
        settings=settings or (JUMPS if motion.jumps else SMOOTH),
    )
    peak = np.abs(run.before.torque).max(axis=1)
    modal = _modal(run, modes)
    return Replay(motion, run, run.residual_energy, peak, *modal)


def sample_times(motion: Motion, end: float) -> Array:
    """Output instants: even ones, and both sides of every breakpoint."""
    edges = np.array([b for joint in motion.joints.values() for b in joint.breakpoints])
    sides = np.concatenate([edges * (1 - 1e-12), edges]) if len(edges) < 50 else edges
    times = np.unique(np.concatenate([np.linspace(0.0, end, SAMPLES), sides]))
    return np.asarray(times[(times >= 0) & (times <= end)])


def _modal(run: LockedRun, count: int) -> tuple[Array, Array, Array, float, float, float, Array]:
    """Energy and amplitude of the first locked modes, and of tip, elbow and root moment."""
    chain, lock = run.before.chain, run.engagement
    angles = [j.angle for j in lock.joints if isinstance(j, Locked)]
    rest = posed(chain, angles)
    modes = natural_modes(chain, lock.joints, rest, count=count)
    form = MinimalCoordinates(chain, lock.joints)
    asm, omega = form.assembly, 2 * np.pi * modes.frequencies
    shapes = np.column_stack([asm.gather(shape) for shape in modes.shapes.T])
    mass = dense(asm.mass)
    eta = shapes.T @ mass @ (asm.gather(lock.state.q) - asm.gather(rest.q))
    rate = shapes.T @ mass @ asm.gather(lock.state.v)
    amplitude = np.hypot(eta, rate / omega)
    places = [chain.slots(link, -1)[:2] for link in (1, 0)]
    tip, elbow = (_amplitude(modes.shapes, list(p), amplitude) for p in places)
    moment = float(np.abs(_root_moments(run, modes.shapes) * amplitude).sum())
    largest = np.abs(modes.shapes[_translations(chain.size)]).max(axis=0) * amplitude
    energy = 0.5 * (omega * amplitude) ** 2
    return energy, largest, tip, tip.sum(), elbow.sum(), moment, modes.frequencies


def _translations(size: int) -> NDArray[np.intp]:
    return np.flatnonzero(np.arange(size) % 4 < 2)


def _amplitude(shapes: Array, place: list[int], amplitude: Array) -> Array:
    """Displacement at a node in each mode (k,) [m]."""
    return np.asarray(np.linalg.norm(shapes[place], axis=0) * amplitude)


def _root_moments(run: LockedRun, shapes: Array) -> Array:
    """Bending moment at the root of unit mode shapes (k,) [N m], from its first element.

    EI times the curvature of the cubic at its start, perpendicular to the link.
    """
    chain = run.before.chain
    link = chain.links[0]
    L = link.length / chain.elements
    first, second = (list(chain.slots(0, k)) for k in (0, 1))
    slope = run.engagement.state.q[first[2:]]
    across = np.array([-slope[1], slope[0]]) / np.hypot(*slope)
    r0, s0, r1, s1 = (
        across @ shapes[rows] for rows in (first[:2], first[2:], second[:2], second[2:])
    )
    return np.asarray(link.bending_stiffness * (6 * (r1 - r0) / L**2 - (4 * s0 + 2 * s1) / L))
