"""The motions that the rows are taken from, each computed once, when a row needs it.

Symbols: T duration [s], J rigid inertia about the driven joint [kg m^2], tau torque [N m].
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeVar

import numpy as np

from models.ancf.analysis import LockedRun, run_and_lock
from models.ancf.chain import Chain, Link
from models.ancf.integrate import Simulation, StepControl, simulate
from models.ancf.joints import Free, Torque
from models.ancf.state import posed
from models.arm.parameters import ArmParameters, double_pendulum, single_pendulum
from models.laws import Bezier, Step5, paper_points
from models.truss import DYNAMIC_SET, KINEMATIC_SET, TrussParameters
from ocp.arrays import Array
from studies.arm.stage import Stage, big_arm, small_arm
from studies.common.console import Console, silent
from studies.common.finished import NOTHING_KEPT, FinishedSteps
from studies.paper.config import PaperStudy
from studies.truss.motions.deployment import Deployment

_T = TypeVar("_T")
DEPLOYED = math.pi / 2
WITH_FRICTION = dataclasses.replace(DYNAMIC_SET, pulley_friction=0.01)
AS_PRINTED = dataclasses.replace(DYNAMIC_SET, counting="as printed")
FRICTIONS = (0.0, 0.0025, 0.005, 0.01)  # of Fig. 19; the paper's own cannot be read

PENDULUM_TIMES = {"single": 1.3, "double": 5.0}  # [s], Table 1
PENDULUM_SAMPLES = 501
PENDULUM_ELEMENTS = (8, 4)  # of a link: with the first the tip is right to 2e-4 m
# steps per second: enough for the arm's first mode with the elbow held, 2.2 Hz, and with the elbow
# free, up to 6.7 Hz; modes above a fifth of these rates are damped
ARM_STEPS = {"big": 20.0, "small": 100.0}
FASTER_STEPS = 20.0
ARM_AFTER = 10.0  # [s] of motion after the lock
ARM_SAMPLES = 2001


def fixed_steps(stage: Stage, rate: float) -> StepControl:
    """Steps of an arm's replay: the torque jumps, so modes too fast for the step are damped."""
    return StepControl(1e-7, fixed_step=min(1 / rate, stage.duration / 400))


def linear_torque(stage: Stage) -> float:
    """Start value tau0 = 6 J dtheta / T^2 of a torque that falls to -tau0 [N m]."""
    joint = stage.moving[0]
    return float(6.0 * stage.inertias[joint] * stage.turn[joint] / stage.duration**2)


def linear_run(stage: Stage, elements: int, rate: float) -> LockedRun:
    """A stage under the linear torque on the full model, locked at its end; steps per second."""
    (joint,), T, tau0 = stage.moving, stage.duration, linear_torque(stage)

    def torque(t: np.ndarray) -> np.ndarray:
        return tau0 * (1.0 - 2.0 * t / T)

    return run_and_lock(
        stage.arm.chain(elements),
        stage.full_joints({joint: Torque(torque)}),
        stage.start_state(elements),
        np.linspace(0.0, T, ARM_SAMPLES),
        [joint],
        targets={joint: stage.end[joint]},
        after=np.linspace(T, T + ARM_AFTER, ARM_SAMPLES),
        settings=fixed_steps(stage, rate),
    )


@dataclass(frozen=True, eq=False)
class Cases:
    """The paper's motions on our models.

    Attributes
    ----------
    study : the keys.
    console : where progress is said.
    kept : where simulations go to, and where those of an earlier run are read.
    """

    study: PaperStudy
    console: Console = field(default_factory=silent)
    kept: FinishedSteps = NOTHING_KEPT

    def laws(self, truss: TrussParameters) -> tuple[Deployment, Deployment]:
        """The Bezier law with its ends pinned to the exact angles, and Step5."""
        start, T = truss.stowed_angle, self.study.duration
        points = paper_points(start, DEPLOYED)
        bezier = Deployment("Bezier", Bezier(T, points), truss)
        return bezier, Deployment("Step5", Step5(T, start, DEPLOYED), truss)

    @cached_property
    def kinematic(self) -> tuple[Deployment, Deployment]:
        """Bezier and Step5 on the set of Figs 11 to 14."""
        return self.laws(KINEMATIC_SET)

    @cached_property
    def dynamic(self) -> tuple[Deployment, Deployment]:
        """The same on the set of Figs 17 to 20 without pulley friction."""
        return self.laws(DYNAMIC_SET)

    @cached_property
    def rubbing(self) -> tuple[Deployment, Deployment]:
        """The same with the pulley friction mu = 0.01."""
        return self.laws(WITH_FRICTION)

    @cached_property
    def as_printed(self) -> Bezier:
        """The Bezier law with its points as printed."""
        return Bezier(self.study.duration)

    @cached_property
    def pendulums(self) -> dict[str, tuple[Simulation, Simulation]]:
        """Single and double pendulum of Table 1, released from the horizontal, on two meshes."""
        runs = {}
        for name, make in (("single", single_pendulum), ("double", double_pendulum)):
            self.console.progress(f"{name} pendulum")
            times = np.linspace(0.0, PENDULUM_TIMES[name], PENDULUM_SAMPLES)
            fine, coarse = (
                self._step(f"{name} pendulum, {elements} elements a link", _swung, chain, times)
                for elements, chain in ((n, make(n)) for n in PENDULUM_ELEMENTS)
            )
            runs[name] = fine, coarse
        return runs

    @cached_property
    def arms(self) -> dict[str, tuple[Stage, LockedRun]]:
        """Big arm in 86 s and small arm in 112 s, under the linear torque."""
        stages: dict[str, Callable[[], Stage]] = {"big": big_arm, "small": small_arm}
        runs = {}
        for name, make in stages.items():
            self.console.progress(f"{name} arm")
            stage = make()
            given = stage, self.study.elements, ARM_STEPS[name]
            runs[name] = stage, self._step(f"{name} arm", linear_run, *given)
        return runs

    def faster(self, name: str, duration: float, modulus: float = 1.0) -> tuple[Stage, LockedRun]:
        """A stage in another time [s], of an arm whose modulus is a multiple of ours."""
        step = f"{name} arm in {duration:g} s, modulus times {modulus:g}"
        self.console.progress(step)
        arm = stiffened(ArmParameters(), modulus)
        stage = {"big": big_arm, "small": small_arm}[name](duration, arm)
        given = stage, self.study.elements, FASTER_STEPS
        return stage, self._step(step, linear_run, *given)

    def _step(self, name: str, take: Callable[..., _T], *given: object) -> _T:
        return self.kept.step(name, lambda: take(*given), say=self.console.progress)


def _swung(chain: Chain, times: Array) -> Simulation:
    """A chain that is let go from rest."""
    return simulate(chain, [Free()] * len(chain.links), posed(chain), times)


def stiffened(arm: ArmParameters, factor: float) -> ArmParameters:
    """The arm with a multiple of its Young's modulus."""

    def stiffer(link: Link) -> Link:
        return dataclasses.replace(
            link,
            axial_stiffness=factor * link.axial_stiffness,
            bending_stiffness=factor * link.bending_stiffness,
        )

    return dataclasses.replace(arm, big=stiffer(arm.big), small=stiffer(arm.small))
