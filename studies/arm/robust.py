"""One motion for a spread of stiffness: copies of the arm that share the torque.

The copies of other stiffness must end at rest, elastic coordinates included, wherever they
arrive; their angle is free. On the pinned arm the rate of the angle then follows from the
momentum, which the torque alone decides, and is not imposed twice.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from models.arm.parameters import ArmParameters
from models.arm.reduced_run import simulate_reduced
from ocp import IpoptOptions, Phase, Problem, Settings, SolveFailed, solve
from studies.arm.optimum import Solved, reduced_residual, torque_joints
from studies.arm.problem import (
    ArmPhase,
    Limits,
    arm_phase,
    column,
    quasi_static,
    reduced_signals,
    smoothness,
    solve_small,
    starting_law,
    torque_column,
)
from studies.arm.replay import Motion, replay
from studies.arm.stage import ELBOW, ROOT, Stage
from studies.exit_codes import ExitCode, StudyError

Array = NDArray[np.float64]
Progress = Callable[[str], None]
DESIGN = (0.9, 1.1)  # stiffness factors of the copies beside the nominal
MESH = 200


def with_stiffness(arm: ArmParameters, factor: float) -> ArmParameters:
    """The arm with the bending stiffness of both links times a factor."""
    big, small = (
        dataclasses.replace(link, bending_stiffness=factor * link.bending_stiffness)
        for link in (arm.big, arm.small)
    )
    return dataclasses.replace(arm, big=big, small=small)


def robust_problem(
    stage: Stage, limits: Limits, factors: Sequence[float] = DESIGN
) -> tuple[Problem, ArmPhase]:
    """The smoothest torque under its caps that leaves every copy at rest."""
    law = starting_law(stage, limits)
    arm = arm_phase(stage, limits, law=law)
    own = arm.phase
    dynamics, guess = dict(own.dynamics), dict(own.guess)
    initial, final = dict(own.initial), dict(own.final)
    grid = np.linspace(0.0, stage.duration, 201)
    for factor in factors:
        copy = dataclasses.replace(stage, arm=with_stiffness(stage.arm, factor))
        at, rates = quasi_static(copy, law, grid)
        q, v = reduced_signals(copy, at, f", stiffness x {factor:g}")
        force = copy.model.force(column(q), column(v), torque_column(arm.torque))
        acceleration = solve_small(copy.model.mass_matrix(column(q)), force)
        dynamics |= dict(zip(q, v, strict=True)) | dict(zip(v, acceleration, strict=True))
        guess |= {s: (grid, x) for s, x in zip((*q, *v), (*at, *rates), strict=True)}
        start, end = copy.model.at(*stage.start), copy.model.at(*stage.end)
        for k, name in enumerate(copy.model.coordinates):
            rigid = name.startswith("theta")
            initial |= {q[k]: float(start[k]), v[k]: 0.0}
            final |= {} if rigid else {q[k]: float(end[k])}
            final |= {} if rigid and ROOT in stage.moving else {v[k]: 0.0}
    phase = Phase(
        own.name, dynamics=dynamics, initial=initial, final=final, start=0.0,
        end=stage.duration, guess=guess,
    )  # fmt: skip
    shared = dataclasses.replace(arm, phase=phase)
    return Problem(f"robust {stage.name} arm", [phase], minimise=smoothness(shared, stage)), shared


def solve_robust(
    stage: Stage, limits: Limits, factors: Sequence[float] = DESIGN, intervals: int = MESH
) -> Solved:
    """Solve `robust_problem`.

    Raises
    ------
    StudyError
        If nothing is found.
    """
    stated, arm = robust_problem(stage, limits, factors)
    settings = Settings(
        intervals=intervals, degree=3, refine=False, move_breakpoints=False,
        ipopt=IpoptOptions(tolerance=1e-7, constraint_violation=1e-9, max_iterations=200),
    )  # fmt: skip
    try:
        solution = solve(stated, settings=settings)
    except SolveFailed as error:
        raise StudyError(
            f"no robust motion of the stage '{stage.name}' was found: {error}", ExitCode.NOT_SOLVED
        ) from error
    return Solved("robust", stage, solution.trajectory, arm)


@dataclass(frozen=True, eq=False)
class Spread:
    """Residual energies [J] of a motion over stiffness factors, and its angle misses [rad]."""

    factors: Array
    reduced: Array
    full: Array
    misses: Array

    @property
    def worst(self) -> tuple[float, float]:
        """Largest sqrt(E_res) [sqrt J] on B21 and on the full model."""
        return float(np.sqrt(self.reduced.max())), float(np.sqrt(self.full.max()))


def spread(solved: Solved, *, points: int = 21, full: int = 9, width: float = 0.1) -> Spread:
    """Replay a motion of given torque on arms of other stiffness."""
    factors = np.linspace(1 - width, 1 + width, points)
    reduced = [reduced_energy(solved, with_stiffness(solved.stage.arm, f)) for f in factors]
    left, missed = [], []
    for factor in np.linspace(1 - width, 1 + width, full):
        arm = with_stiffness(solved.stage.arm, float(factor))
        stage = dataclasses.replace(solved.stage, arm=arm)
        joints: dict[int, Any] = dict(torque_joints(solved.torques, stage.duration))
        done = replay(Motion(solved.name, "torque", stage, joints))
        left.append(done.residual_energy)
        missed.append(done.miss)
    return Spread(factors, np.array(reduced), np.array(left), np.array(missed))


def reduced_energy(solved: Solved, arm: ArmParameters) -> float:
    """E_res on B21 of another arm under the same torque [J]."""
    stage = dataclasses.replace(solved.stage, arm=arm)
    joints = torque_joints(solved.torques, stage.duration)
    motion = simulate_reduced(
        stage.model, stage.model.at(*stage.start), np.array([0.0, stage.duration]),
        root=joints.get(ROOT), elbow=joints.get(ELBOW), tolerance=1e-9,
    )  # fmt: skip
    return reduced_residual(stage, motion)


def tip_mass_miss(solved: Solved, factor: float) -> float:
    """Angle miss [rad] under torque drive with a tip mass times a factor.

    The torque fixes the momentum, the inertia turns it into an angle: D changes as 1/J, and no
    open-loop law can remove that.
    """
    arm = dataclasses.replace(solved.stage.arm, tip_mass=factor * solved.stage.arm.tip_mass)
    stage = dataclasses.replace(solved.stage, arm=arm)
    joints: dict[int, Any] = dict(torque_joints(solved.torques, stage.duration))
    return replay(Motion(solved.name, "torque", stage, joints)).miss
