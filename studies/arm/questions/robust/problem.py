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
from numpy.typing import NDArray

from models.arm.driven import DrivenArm
from models.arm.reduced_simulation import reduced_modes
from ocp import (
    Bound,
    Ipopt,
    OcpError,
    Phase,
    Problem,
    Radau,
    Settings,
    Trajectory,
    Unknown,
    collocate,
)
from studies.arm.optimal.phase import MARGIN, ArmPhase
from studies.arm.optimal.solve import PIVOTS, Solved
from studies.arm.questions.robust.copies import (
    BEND,
    Copy,
    Drive,
    Start,
    angle_copy,
    drive_of,
    residual_energy,
    rigid_start,
    solved_start,
    torque_copy,
)
from studies.arm.replay.spread import Spread, varied
from studies.arm.stage import ELBOW, ROOT, Stage
from studies.common.exit_codes import ExitCode, StudyError

Array = NDArray[np.float64]
Progress = Callable[[str], None]
Mesh = tuple[int, int]
_MESHES = {ROOT: (11.6, 3), ELBOW: (11.0, 5)}  # intervals a second [1/s], degree
SLOW = 15.0  # [Hz], below which a mode's rest is demanded; the faster follow the torque
SIZE = 1e-2  # typical sqrt(E_res) [sqrt(J)]
STILL = 0.05  # of it, below which a residual need not be less
_RIPPLE, _GOES = 0.012, 3  # share of the cap, per share of torque to spare; solves at most
_SMOOTH = 1e-3  # weight of the mean square of the rate's slope, to leave nothing undecided


def mesh_of(stage: Stage) -> Mesh:
    """Intervals and degree that resolve the slow modes of an arm of our sizes.

    The small arm's go up to 6.7 Hz, the big arm's to 2.2 Hz, and on a finer mesh than it needs
    the solver creeps.
    """
    pace, degree = _MESHES[stage.moving[0]]
    return round(pace * stage.duration), degree


def nominal_statement(stage: Stage) -> tuple[Problem, ArmPhase]:
    """The motion of least peak torque of the nominal arm, from rest to elastic rest."""
    drive, start = drive_of(stage), rigid_start(stage)
    arm = torque_copy(stage, drive, start)
    phase = _phase(stage, drive, start, [arm])
    goal = phase.peak(drive.torque / drive.unit, absolute=True).symbol
    bounds = [*arrival(stage, phase, arm), *elastic_rest(stage, phase, arm)]
    goal += _SMOOTH * _smoothness(stage, drive, phase)
    return Problem(f"{stage.name} arm", [phase], bounds=bounds, minimise=goal), _of_drive(
        stage, drive, phase
    )


def robust_statement(nominal: Solved, spread: Spread, cap: float) -> tuple[Problem, ArmPhase]:
    """The motion of least worst residual of an arm and its copies.

    Parameters
    ----------
    nominal : Solved
        What the solver starts from.
    spread : Spread
        Its drive, and the copies.
    cap : float
        Largest torque [N m].
    """
    stage = nominal.stage
    drive, start = drive_of(stage, cap), solved_start(nominal)
    arm = torque_copy(stage, drive, start)
    arms = [(stage, arm)]
    for number, (x, y) in enumerate(spread.design):
        other = dataclasses.replace(stage, arm=varied(stage.arm, spread.factors(x, y)))
        name = f" of copy {number}"
        copy = (torque_copy(other, drive, start, name) if spread.drive == "torque"
                else angle_copy(other, start, arm, name))  # fmt: skip
        arms.append((other, copy))
    phase = _phase(stage, drive, start, [copy for _, copy in arms])
    worst = Unknown("worst residual", "1e-2 sqrt(J)", STILL, guess=2.0, scale=1.0)
    bounds = arrival(stage, phase, arm)
    for number, (other, copy) in enumerate(arms):
        left = phase.at_end(residual_energy(other, copy) / SIZE**2)
        bounds.append(
            Bound(f"residual of arm {number}", left.symbol - worst.symbol**2, upper=0.0, scale=1.0)
        )
    goal = worst.symbol + _SMOOTH * _smoothness(stage, drive, phase)
    name = f"{stage.name} arm, {spread.drive} drive"
    return Problem(name, [phase], bounds=bounds, minimise=goal), _of_drive(stage, drive, phase)


def arrival(stage: Stage, phase: Phase, arm: Copy) -> list[Bound]:
    """The joint of the nominal arm at its target and at rest."""
    angle = DrivenArm(stage.model).angle(arm.q)
    turn = ca.jtimes(angle, arm.q, arm.v)
    target = stage.end[stage.moving[0]]
    return [
        Bound("angle at the end", phase.at_end(angle).symbol, "rad", target, target, 1.0),
        Bound("rate at the end", phase.at_end(turn).symbol, "rad/s", 0, 0, 1.0 / stage.duration),
    ]


def elastic_rest(stage: Stage, phase: Phase, arm: Copy) -> list[Bound]:
    """Amplitude and rate of the slow modes of the arm with the joint free, all zero."""
    model, at = stage.model, stage.model.at(*stage.end)
    frequencies, shapes = reduced_modes(model, at)
    mass, found = model.linear(at)[0].full(), []
    for k, frequency in enumerate(frequencies[frequencies < SLOW]):
        row, size = ca.DM(shapes[:, k] @ mass).T, SIZE / (2.0 * np.pi * float(frequency))
        ends = phase.at_end(row @ (arm.q - ca.DM(at))), phase.at_end(row @ arm.v)
        found.append(Bound(f"mode {k + 1} at the end", ends[0].symbol, "1", 0, 0, size))
        found.append(Bound(f"rate of mode {k + 1} at the end", ends[1].symbol, "1", 0, 0, SIZE))
    return found


def _phase(stage: Stage, drive: Drive, start: Start, copies: Sequence[Copy]) -> Phase:
    joined: dict[str, dict[Any, Any]] = {
        "dynamics": {drive.torque: drive.rate, drive.rate: drive.bend},
        "initial": {drive.torque: 0.0, drive.rate: 0.0},
        "guess": {
            drive.torque: (start.times, start.torque), drive.rate: (start.times, start.rate),
            drive.bend: 0.0,
        },
    }  # fmt: skip
    for copy in copies:
        for key, values in joined.items():
            values |= getattr(copy, key)
    return Phase(
        stage.name, dynamics=joined["dynamics"], initial=joined["initial"],
        final={drive.torque: 0.0, drive.rate: 0.0}, start=0.0, end=stage.duration,
        guess=joined["guess"],
    )  # fmt: skip


def _smoothness(stage: Stage, drive: Drive, phase: Phase) -> Any:
    bend = drive.bend * (stage.duration / (BEND * drive.rate.upper))
    return phase.integral(bend**2, "smoothness", "s").symbol / stage.duration


def _of_drive(stage: Stage, drive: Drive, phase: Phase) -> ArmPhase:
    return ArmPhase(
        phase, stage.model, (), (), {drive.joint: drive.torque}, {drive.joint: drive.rate},
        {drive.joint: drive.bend}, (),
    )  # fmt: skip


def solve_nominal(stage: Stage, mesh: Mesh, progress: Progress | None = None) -> Solved:
    """Solve `nominal_statement` on one mesh."""
    return _solved("nominal", stage, nominal_statement(stage), mesh, progress)


def solve_robust(
    nominal: Solved, spread: Spread, share: float, mesh: Mesh, progress: Progress | None = None
) -> Solved:
    """Solve `robust_statement` on one mesh, with a share of the nominal motion's peak torque.

    The cap holds at the points of the mesh; it is lowered until it holds between them too. The
    more torque there is to spare, the more the torque ripples below it.
    """
    joint = nominal.stage.moving[0]
    cap, margin = share * float(nominal.peak_torque[joint]), MARGIN + _RIPPLE * (share - 1.0)
    name, guess = f"robust, {share:g} x peak", None
    for _ in range(_GOES):
        stated = robust_statement(nominal, spread, cap * (1.0 - margin))
        found = _solved(name, nominal.stage, stated, mesh, progress, guess)
        excess = float(found.peak_torque[joint]) / cap - 1.0
        if excess <= 0.0:
            break
        margin, guess = margin + 1.2 * excess, found.trajectory
    return found


def _solved(
    name: str, stage: Stage, stated: tuple[Problem, ArmPhase], mesh: Mesh, progress: Any,
    guess: Trajectory | None = None,
) -> Solved:  # fmt: skip
    """One mesh; the study replays what is found on models of its own.

    Raises
    ------
    StudyError
        If nothing is found.
    """
    solver = Ipopt(
        tolerance=1e-7,
        dual_tolerance=1e-4,
        constraint_violation=1e-9,
        max_iterations=150,
        pivot_tolerance=PIVOTS,
    )
    settings = Settings(scheme=Radau(mesh[1]), intervals=mesh[0], solver=solver)
    try:
        found, _ = collocate(stated[0], settings=settings, guess=guess, progress=progress)
    except OcpError as error:
        raise StudyError(
            f"no motion '{name}' of the stage '{stage.name}' was found: {error}",
            ExitCode.NOT_SOLVED,
        ) from error
    return Solved(name, stage, found, stated[1])
