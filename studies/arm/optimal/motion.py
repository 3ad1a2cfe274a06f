"""An optimal motion of a stage: its torques as exact polynomials, and its replays.

Two misses are told apart: the mesh error is the residual energy of the replay on B21 by another
integrator (the collocation believes it is zero); the model error is that of the full model
against the replay on B21.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property, partial

import casadi as ca
import numpy as np
from scipy.interpolate import BPoly, PPoly

from models.ancf.integrate import StepControl
from models.ancf.joints import Driven, Joint, Torque
from models.arm.reduced import ReducedArm
from models.arm.reduced_simulation import ReducedMotion, simulate_reduced
from ocp import PhaseTrajectory, Solution, Trajectory
from ocp.arrays import Array
from studies.arm.optimal.correction import added_to
from studies.arm.optimal.objectives import StatedStage
from studies.arm.optimal.phase import ArmPhase, slope_unit
from studies.arm.replay.full_model import ELEMENTS, MODES, Drive, LockedMotion, Motion, replay
from studies.arm.replay.reduced_model import follow, method_for, overdamped, reduced_residual
from studies.arm.stage import ELBOW, ROOT, Stage
from studies.common.code_version import hashed
from studies.common.finished import NOTHING_KEPT, FinishedSteps

SAMPLES = 2001  # of a replay on B21
_DENSE = 20 * SAMPLES  # instants at which a peak is looked for


@dataclass(frozen=True, eq=False)
class OptimalMotion:
    """A motion found by the optimiser.

    Attributes
    ----------
    name : str
    stated : the problem that was solved.
    solution : of the solver.
    weight : of the smoothness in what was minimised.
    added : torques by joint beside the solver's, with which the full model rests, see `correction`.
    kept : where its replays go to, and where those of an earlier run are read.
    """

    name: str
    stated: StatedStage
    solution: Solution
    weight: float = 0.0
    added: Mapping[int, PPoly] = field(default_factory=dict)
    kept: FinishedSteps = NOTHING_KEPT

    @cached_property
    def stage(self) -> Stage:
        """The stage that was stated, in the duration that was found."""
        return self.stated.stage.lasting(self.trajectory.phases[0].end)

    @property
    def trajectory(self) -> Trajectory:
        """Of the solver."""
        return self.solution.trajectory

    @property
    def arm(self) -> ArmPhase:
        """The phase with its signals."""
        return self.stated.arm

    @property
    def intervals(self) -> int:
        """Of the mesh."""
        return len(self.trajectory.phases[0].breakpoints) - 1

    @cached_property
    def torques(self) -> dict[int, PPoly]:
        """Torque of each driven joint as an exact piecewise polynomial."""
        return added_to(self._solved, self.added)

    @cached_property
    def _solved(self) -> dict[int, PPoly]:
        """The solver's torques alone."""
        phase = self.trajectory.phase(self.arm.phase.name)
        return {k: polynomial(phase, state.name) for k, state in self.arm.torque.items()}

    @cached_property
    def smoothness_share(self) -> float:
        """Part of what was minimised that is weighted smoothness, from 0 to 1."""
        whole = self.solution.objective
        return self.weight * self._smoothness / whole if self.weight else 0.0

    @property
    def objective(self) -> float:
        """What was asked to be least, in units of the rigid arm's, without the smoothness."""
        alone = self.solution.objective - self.weight * self._smoothness
        return float(alone ** (1.0 / self.stated.power))

    @cached_property
    def _smoothness(self) -> float:
        """Mean square of the slopes of the torque rates, as `phase.smoothness` states it."""
        total = 0.0
        for k, law in self._solved.items():
            slopes = law.derivative(2)
            square = slopes(slopes.x[:-1]) ** 2 @ np.diff(slopes.x)
            total += float(square) / slope_unit(self.stated.stage, k) ** 2
        return total / self.stated.stage.duration

    @property
    def added_share(self) -> float:
        """Largest torque added to the solver's, over the largest torque."""
        times = np.linspace(0.0, self.stage.duration, _DENSE)
        shares = [
            float(np.abs(more(times)).max()) / self.peak_torque[k] for k, more in self.added.items()
        ]
        return max(shares, default=0.0)

    @property
    def within_limits(self) -> bool:
        """Whether torques and their rates keep the limits of the problem that was solved."""
        drives = self.arm.drives
        return all(
            peaks[k] <= state.upper
            for states, peaks in ((drives.torque, self.peak_torque), (drives.rate, self.peak_rate))
            for k, state in states.items()
        )

    @property
    def peak_torque(self) -> Array:
        """Largest absolute torque of both joints (2,), between the points too [N m]."""
        return self._peaks(lambda law: law)

    @property
    def peak_rate(self) -> Array:
        """Largest absolute torque rate of both joints (2,) [N m/s]."""
        return self._peaks(lambda law: law.derivative())

    def _peaks(self, of: Callable[[PPoly], PPoly]) -> Array:
        times = np.linspace(0.0, self.stage.duration, _DENSE)
        peaks = np.zeros(2)
        for k, law in self.torques.items():
            peaks[k] = np.abs(of(law)(times)).max()
        return peaks

    @cached_property
    def reduced(self) -> ReducedMotion:
        """Replay on B21 by another integrator, explicit Runge-Kutta steps where they are few."""
        if len(self.stage.moving) > 1 or overdamped(self.stage):
            return self.on(self.stage.model)
        return follow(self.motion("torque"), SAMPLES)

    def on(self, model: ReducedArm) -> ReducedMotion:
        """Replay on a reduced model, by explicit steps of order 8 where they are not too many."""
        joints = torque_joints(self.torques, self.stage.duration)
        return simulate_reduced(
            model,
            model.at(*self.stage.start),
            np.linspace(0.0, self.stage.duration, SAMPLES),
            root=joints.get(ROOT),
            elbow=joints.get(ELBOW),
            tolerance=1e-11,
            method=method_for(model, self.stage.start, self.stage.duration),
        )

    @property
    def energy_on_B22(self) -> float:
        """E_res of the replay on B22, whose second link bends more freely [J]."""
        return reduced_residual(self.stage, self.on(self.stage.reduced(variant="B22")))

    @property
    def reduced_energy(self) -> float:
        """E_res of the replay on B21 [J]: the mesh error."""
        return reduced_residual(self.stage, self.reduced)

    def motion(self, drive: Drive) -> Motion:
        """The motion for the full model under either drive."""
        joints: dict[int, Joint]
        if drive == "torque":
            joints = dict(torque_joints(self.torques, self.stage.duration))
        else:
            joints = dict(angle_joints(self.reduced, self.torques))
        return Motion(self.name, drive, self.stage, joints)

    def replay(
        self,
        drive: Drive = "torque",
        *,
        elements: int = ELEMENTS,
        settings: StepControl | None = None,
        modes: int = MODES,
    ) -> LockedMotion:
        """On the full model, see `studies.arm.replay.full_model.replay`."""
        given = self.motion(drive)
        run = self.kept.step(
            "replay",
            lambda: replay(given, elements=elements, settings=settings, modes=modes).fixed,
            begins_with=self._mark(drive, elements, settings),
        )
        return LockedMotion(given, run, modes)

    def _mark(self, drive: Drive, elements: int, settings: StepControl | None) -> str:
        """Few letters of all that a replay depends on."""
        laws = [[k, law.c.tolist(), law.x.tolist()] for k, law in self.torques.items()]
        return hashed([repr(self.stage), drive, elements, repr(settings), laws])[:12]


def polynomial(phase: PhaseTrajectory, state: str) -> PPoly:
    """A state of the solution as a function that SciPy differentiates and the replays evaluate."""
    powers = phase.polynomial(state).powers()[:, 0, :]  # of local time, in increasing order
    degrees = np.arange(powers.shape[1])
    coefficients = powers / np.diff(phase.breakpoints)[:, None] ** degrees
    return PPoly(coefficients.T[::-1], phase.breakpoints)


def torque_joints(torques: Mapping[int, PPoly], end: float) -> dict[int, Torque]:
    """Torque laws; smooth enough that the integrator need not restart at the mesh."""
    return {k: Torque(partial(_until_end, law, end)) for k, law in torques.items()}


def _until_end(law: PPoly, end: float, t: Array) -> Array:
    """A torque that ends [N m]."""
    return np.where(t <= end, law(np.clip(t, 0.0, end)), 0.0)


def angle_joints(motion: ReducedMotion, torques: Mapping[int, PPoly]) -> dict[int, Driven]:
    """Joint angles of a motion of B21, interpolated with their first two derivatives."""
    model, count = motion.model, len(motion.times)

    q, v, a = (ca.SX.sym(name, model.size) for name in "qva")
    angles = ca.vertcat(model.embed(q)[0], model.elbow_angle(q))
    rates = ca.jtimes(angles, q, v)
    spins = ca.jtimes(rates, q, v) + ca.jtimes(angles, q, a)
    joint_angles = ca.Function("angles", [q, v, a], [angles, rates, spins]).map(count)

    # the motion's own accelerations, so that angle and derivatives belong together
    none = 0 * motion.times
    drive = np.array([torques[k](motion.times) if k in torques else none for k in (ROOT, ELBOW)])
    accelerations = model.dynamics.map(count)(motion.q, motion.v, drive)
    values = [x.full() for x in joint_angles(motion.q, motion.v, accelerations)]

    end = float(motion.times[-1])
    return {
        k: _driven(
            BPoly.from_derivatives(motion.times, np.stack([x[k] for x in values], axis=1)), end
        )
        for k in torques
    }


def _driven(law: BPoly, end: float) -> Driven:
    angle, rate, acceleration = (
        partial(_within, law if order == 0 else law.derivative(order), end) for order in (0, 1, 2)
    )
    return Driven(angle, rate, acceleration)


def _within(curve: BPoly, end: float, t: Array) -> Array:
    """A curve up to its end."""
    return np.asarray(curve(np.clip(t, 0.0, end)))
