"""One motion for a spread of arms: copies with other stiffness and tip mass beside the nominal.

The nominal motion has the least peak torque of those that bring the nominal arm to the target,
elastic rest included. The robust one has, under a given peak torque, the least worst residual
energy of that arm and its copies after the lock; none of them needs to rest exactly. The torque's
rate is continuous and piecewise linear in both.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np

from models.arm.driven import DrivenArm
from models.arm.reduced_simulation import reduced_modes
from ocp import Bound, OcpError, Phase, Problem, Trajectory, Unknown, collocate
from studies.arm.optimal.motion import OptimalMotion
from studies.arm.optimal.phase import MARGIN, ArmPhase, Drives
from studies.arm.optimal.solver import robust_settings
from studies.arm.questions.robust.copies import (
    BEND,
    ArmCopy,
    SampledMotion,
    angle_copy,
    drives_of,
    replayed_motion,
    residual_energy,
    rigid_motion,
    steepest_rate,
    torque_copy,
)
from studies.arm.questions.robust.spread import Spread
from studies.arm.replay.reduced_model import varied
from studies.arm.search_limits import CAP_CORRECTIONS
from studies.arm.stage import ELBOW, ROOT, Stage
from studies.common.exit_codes import ExitCode, StudyError

Progress = Callable[[str], None]
MeshSize = tuple[int, int]
"""Intervals and degree."""
_MESHES = {ROOT: (11.6, 3), ELBOW: (11.0, 5)}  # intervals a second [1/s], degree
SLOW = 15.0  # [Hz], below which a mode's rest is demanded; the faster follow the torque
SIZE = 1e-2  # typical sqrt(E_res) [sqrt(J)]
STILL = 0.05  # of it, below which a residual need not be less
_RIPPLE = 0.012  # share of the cap by which the torque ripples, per share of torque to spare
_OVERSHOOT = 1.2  # of an excess over the cap, by which the margin grows
_SMOOTH = 1e-3  # weight of the mean square of the rate's slope, to leave nothing undecided


def mesh_of(stage: Stage) -> MeshSize:
    """Intervals and degree that resolve the slow modes of an arm of our sizes.

    The small arm's go up to 6.7 Hz, the big arm's to 2.2 Hz, and on a finer mesh than it needs
    the solver creeps.
    """
    pace, degree = _MESHES[stage.moving[0]]
    return round(pace * stage.duration), degree


def nominal_statement(stage: Stage) -> tuple[Problem, ArmPhase]:
    """The motion of least peak torque of the nominal arm, from rest to elastic rest."""
    joint, drives, start = stage.moving[0], drives_of(stage), rigid_motion(stage)
    arm = torque_copy(stage, drives, start)
    phase = _phase(stage, drives, start, [arm])

    unit = float(stage.torque_units[joint])
    goal = phase.peak(drives.torque[joint] / unit, absolute=True).symbol
    bounds = [*arrival(stage, phase, arm), *elastic_rest(stage, phase, arm)]
    goal += _SMOOTH * _smoothness(stage, drives, phase)
    problem = Problem(f"{stage.name} arm", [phase], bounds=bounds, minimise=goal)
    return problem, _arm_phase(stage, drives, phase)


def robust_statement(
    nominal: OptimalMotion, spread: Spread, cap: float
) -> tuple[Problem, ArmPhase]:
    """The motion of least worst residual of an arm and its copies.

    Parameters
    ----------
    nominal : OptimalMotion
        What the solver starts from.
    spread : Spread
        Its drive, and the copies.
    cap : float
        Largest torque [N m].
    """
    stage = nominal.stage
    drives, start = drives_of(stage, cap), replayed_motion(nominal)
    arm = torque_copy(stage, drives, start)

    arms = [(stage, arm)]
    for number, (x, y) in enumerate(spread.design):
        other = dataclasses.replace(stage, arm=varied(stage.arm, spread.factors(x, y)))
        name = f" of copy {number}"
        if spread.drive == "torque":
            arms.append((other, torque_copy(other, drives, start, name)))
        else:
            arms.append((other, angle_copy(other, start, arm, name)))
    phase = _phase(stage, drives, start, [copy for _, copy in arms])

    # the worst residual as an unknown above all of them: a maximum is not smooth
    worst = Unknown("worst residual", "1e-2 sqrt(J)", STILL, guess=2.0, scale=1.0)
    bounds = arrival(stage, phase, arm)
    for number, (other, copy) in enumerate(arms):
        left = phase.at_end(residual_energy(other, copy) / SIZE**2)
        excess = left.symbol - worst.symbol**2
        bounds.append(Bound(f"residual of arm {number}", excess, upper=0.0, scale=1.0))

    goal = worst.symbol + _SMOOTH * _smoothness(stage, drives, phase)
    name = f"{stage.name} arm, {spread.drive} drive"
    problem = Problem(name, [phase], bounds=bounds, minimise=goal)
    return problem, _arm_phase(stage, drives, phase)


def arrival(stage: Stage, phase: Phase, arm: ArmCopy) -> list[Bound]:
    """The joint of the nominal arm at its target and at rest."""
    angle = DrivenArm(stage.model).angle(arm.q)
    turn = ca.jtimes(angle, arm.q, arm.v)
    target = stage.end[stage.moving[0]]
    return [
        Bound("angle at the end", phase.at_end(angle).symbol, "rad", target, target, 1.0),
        Bound("rate at the end", phase.at_end(turn).symbol, "rad/s", 0, 0, 1.0 / stage.duration),
    ]


def elastic_rest(stage: Stage, phase: Phase, arm: ArmCopy) -> list[Bound]:
    """Amplitude and rate of the slow modes of the arm with the joint free, all zero."""
    model, pose = stage.model, stage.model.at(*stage.end)
    frequencies, shapes = reduced_modes(model, pose)
    mass = model.linear(pose)[0].full()

    bounds = []
    for k, frequency in enumerate(frequencies[frequencies < SLOW]):
        row = ca.DM(shapes[:, k] @ mass).T
        amplitude = phase.at_end(row @ (arm.q - ca.DM(pose)))
        rate = phase.at_end(row @ arm.v)
        size = SIZE / (2.0 * np.pi * float(frequency))
        bounds.append(Bound(f"mode {k + 1} at the end", amplitude.symbol, "1", 0, 0, size))
        bounds.append(Bound(f"rate of mode {k + 1} at the end", rate.symbol, "1", 0, 0, SIZE))
    return bounds


def _phase(stage: Stage, drives: Drives, start: SampledMotion, copies: Sequence[ArmCopy]) -> Phase:
    """From rest, of all copies under one drive."""
    joint = stage.moving[0]
    # only the drive has to rest at the end: what the copies do there is judged
    still = dict.fromkeys(drives.states, 0.0)
    dynamics: dict[Any, Any] = drives.dynamics
    initial: dict[Any, Any] = dict(still)
    guess: dict[Any, Any] = {
        drives.torque[joint]: (start.times, start.torque),
        drives.rate[joint]: (start.times, start.rate),
        drives.bend[joint]: 0.0,
    }

    for copy in copies:
        dynamics |= copy.dynamics
        initial |= copy.initial
        guess |= copy.guess

    return Phase(
        stage.name,
        dynamics=dynamics,
        initial=initial,
        final=still,
        start=0.0,
        end=stage.duration,
        guess=guess,
    )


def _smoothness(stage: Stage, drives: Drives, phase: Phase) -> Any:
    bend = drives.bend[stage.moving[0]] * (stage.duration / (BEND * steepest_rate(stage)))
    return phase.integral(bend**2, "smoothness", "s").symbol / stage.duration


def _arm_phase(stage: Stage, drives: Drives, phase: Phase) -> ArmPhase:
    """What an `OptimalMotion` reads: the drives; the copies' states do not matter to it."""
    return ArmPhase(phase, stage.model, q=(), v=(), drives=drives, acceleration=())


def solve_nominal(stage: Stage, mesh: MeshSize, progress: Progress | None = None) -> OptimalMotion:
    """Solve `nominal_statement` on one mesh."""
    return _solved("nominal", stage, nominal_statement(stage), mesh, progress)


def solve_robust(
    nominal: OptimalMotion,
    spread: Spread,
    share: float,
    mesh: MeshSize,
    progress: Progress | None = None,
) -> OptimalMotion:
    """Solve `robust_statement` on one mesh, with a share of the nominal motion's peak torque.

    The cap holds at the points of the mesh; it is lowered until it holds between them too. The
    more torque there is to spare, the more the torque ripples below it.
    """
    joint = nominal.stage.moving[0]
    cap, margin = share * float(nominal.peak_torque[joint]), MARGIN + _RIPPLE * (share - 1.0)
    name, guess = f"robust, {share:g} x peak", None
    for _ in range(CAP_CORRECTIONS):
        stated = robust_statement(nominal, spread, cap * (1.0 - margin))
        motion = _solved(name, nominal.stage, stated, mesh, progress, guess)
        excess = float(motion.peak_torque[joint]) / cap - 1.0
        if excess <= 0.0:
            break
        margin, guess = margin + _OVERSHOOT * excess, motion.trajectory
    return motion


def _solved(
    name: str,
    stage: Stage,
    stated: tuple[Problem, ArmPhase],
    mesh: MeshSize,
    progress: Progress | None,
    guess: Trajectory | None = None,
) -> OptimalMotion:
    """One mesh; the study replays what is found on models of its own.

    Raises
    ------
    StudyError
        If nothing is found.
    """
    problem, arm = stated
    try:
        trajectory, _ = collocate(
            problem, settings=robust_settings(*mesh), guess=guess, progress=progress
        )
    except OcpError as error:
        raise StudyError(
            f"no motion '{name}' of the stage '{stage.name}' was found: {error}",
            ExitCode.NOT_SOLVED,
        ) from error
    return OptimalMotion(name, stage, trajectory, arm)
