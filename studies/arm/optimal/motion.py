"""An optimal motion: its torques as exact polynomials, and its replays.

Two misses are told apart: the mesh error is the residual energy of the replay on B21 by another
integrator (the collocation believes it is zero); the model error is that of the full model
against the replay on B21.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any

import casadi as ca
import numpy as np
from scipy.interpolate import BPoly, PPoly

from models.ancf.analysis import LockedRun
from models.ancf.integrate import StepControl
from models.ancf.joints import Driven, Torque
from models.arm.reduced_simulation import ReducedMotion, simulate_reduced
from ocp import PhaseTrajectory, Solution, Trajectory
from ocp.arrays import Array
from studies.arm.optimal.correction import added_to
from studies.arm.optimal.objectives import StatedMotion
from studies.arm.optimal.phase import slope_unit
from studies.arm.replay.full_model import ELEMENTS, MODES, Drive, LockedMotion, Motion, in_turn
from studies.arm.replay.reduced_model import follow, method_for, reduced_residual
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
    stated: StatedMotion
    solution: Solution
    weight: float = 0.0
    added: Mapping[int, PPoly] = field(default_factory=dict)
    kept: FinishedSteps = NOTHING_KEPT

    @cached_property
    def stages(self) -> tuple[Stage, ...]:
        """Those that were stated, in the durations that were found."""
        phases = [self.trajectory.phase(arm.phase.name) for arm in self.stated.arms]
        stages = [arm.stage for arm in self.stated.arms]
        return tuple(
            stage.lasting(phase.end - phase.start)
            for stage, phase in zip(stages, phases, strict=True)
        )

    @property
    def stage(self) -> Stage:
        """The first one, of a motion of one stage."""
        return self.stages[0]

    @property
    def dwells(self) -> tuple[float, ...]:
        """Times that the arm stays locked between the stages [s]."""
        spans = [self.trajectory.phase(arm.phase.name) for arm in self.stated.arms]
        return tuple(after.start - before.end for before, after in itertools.pairwise(spans))

    @property
    def trajectory(self) -> Trajectory:
        """Of the solver."""
        return self.solution.trajectory

    @property
    def counts(self) -> tuple[int, ...]:
        """Intervals of the mesh of each phase."""
        return tuple(len(phase.breakpoints) - 1 for phase in self.trajectory.phases)

    @property
    def intervals(self) -> int:
        """Of the whole mesh."""
        return sum(self.counts)

    @cached_property
    def torques(self) -> dict[int, PPoly]:
        """Torque of each joint over its stage's time, as an exact piecewise polynomial."""
        return added_to(self._solved, self.added)

    @cached_property
    def _solved(self) -> dict[int, PPoly]:
        """The solver's torques alone."""
        found = {}
        for k, (arm, state) in self.stated.drives.items():
            law = polynomial(self.trajectory.phase(arm.phase.name), state.name)
            found[k] = PPoly(law.c, law.x - law.x[0])
        return found

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
            stage, slopes = self.stated.drives[k][0].stage, law.derivative(2)
            square = slopes(slopes.x[:-1]) ** 2 @ np.diff(slopes.x)
            total += float(square) / slope_unit(stage, k) ** 2 / stage.duration
        return total

    @property
    def added_share(self) -> float:
        """Largest torque added to the solver's, over the largest torque."""
        shares = [_largest(more) / self.peak_torque[k] for k, more in self.added.items()]
        return max(shares, default=0.0)

    @property
    def within_limits(self) -> bool:
        """Whether torques and their rates keep the limits of the problem that was solved."""
        torque, rate = self.peak_torque, self.peak_rate
        return all(
            torque[k] <= state.upper and rate[k] <= arm.drives.rate[k].upper
            for k, (arm, state) in self.stated.drives.items()
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
        peaks = np.zeros(2)
        for k, law in self.torques.items():
            peaks[k] = _largest(of(law))
        return peaks

    @cached_property
    def reduced(self) -> ReducedMotion:
        """Replay on B21 by another integrator, explicit Runge-Kutta steps where they are few."""
        if len(self.stage.moving) > 1:
            return self._by_error_control()
        return follow(self.motion("torque"), SAMPLES)

    def _by_error_control(self) -> ReducedMotion:
        """Replay on B21, by explicit steps of order 8 where they are not too many."""
        model, joints = self.stage.model, torque_joints(self.torques)
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
    def reduced_energy(self) -> float:
        """E_res of the replay on B21 [J]: the mesh error."""
        return reduced_residual(self.stage, self.reduced)

    def motions(self, drive: Drive) -> tuple[Motion, ...]:
        """Each stage for the full model; on given angles there is one."""
        if drive == "angle":
            return (Motion(self.name, drive, self.stage, angle_joints(self.reduced, self.torques)),)
        return tuple(
            Motion(name, drive, stage, torque_joints({k: self.torques[k] for k in stage.moving}))
            for name, stage in zip(self.names, self.stages, strict=True)
        )

    @property
    def names(self) -> tuple[str, ...]:
        """What its stages are called in results."""
        if len(self.stages) == 1:
            return (self.name,)
        return tuple(f"{stage.name} arm" for stage in self.stages)

    def motion(self, drive: Drive) -> Motion:
        """The first of `motions`: that of a motion of one stage."""
        return self.motions(drive)[0]

    def replays(
        self,
        drive: Drive = "torque",
        *,
        elements: int = ELEMENTS,
        settings: StepControl | None = None,
        modes: int = MODES,
    ) -> tuple[LockedMotion, ...]:
        """Each stage on the full model, from what the one before leaves, see `in_turn`."""
        given = self.motions(drive)

        def runs() -> tuple[LockedRun, ...]:
            found = in_turn(given, self.dwells, elements=elements, settings=settings)
            return tuple(one.fixed for one in found)

        # all that a replay depends on
        laws = [[k, law.c.tolist(), law.x.tolist()] for k, law in self.torques.items()]
        depends = [repr(self.stages), self.dwells, drive, elements, repr(settings), laws]
        found = self.kept.step("replay", runs, begins_with=hashed(depends)[:12])
        return tuple(LockedMotion(*pair, modes) for pair in zip(given, found, strict=True))

    def replay(self, drive: Drive = "torque", **how: Any) -> LockedMotion:
        """The last stage of `replays`: that of a motion of one."""
        return self.replays(drive, **how)[-1]


def _largest(law: PPoly) -> float:
    """Largest size of a law, between its points too."""
    return float(np.abs(law(np.linspace(law.x[0], law.x[-1], _DENSE))).max())


def polynomial(phase: PhaseTrajectory, state: str) -> PPoly:
    """A state of the solution as a function that SciPy differentiates and the replays evaluate."""
    powers = phase.polynomial(state).powers()[:, 0, :]  # of local time, in increasing order
    degrees = np.arange(powers.shape[1])
    coefficients = powers / np.diff(phase.breakpoints)[:, None] ** degrees
    return PPoly(coefficients.T[::-1], phase.breakpoints)


def torque_joints(torques: Mapping[int, PPoly]) -> dict[int, Torque]:
    """Torque laws; smooth enough that the integrator need not restart at the mesh."""
    return {k: Torque(partial(_until_end, law)) for k, law in torques.items()}


def _until_end(law: PPoly, t: Array) -> Array:
    """A torque that ends [N m]."""
    end = law.x[-1]
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
