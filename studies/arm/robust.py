"""One motion for a spread of arms: copies with other stiffness and tip mass beside the nominal.

The nominal arm obeys B21 under a torque whose rate is continuous and piecewise linear. Under
torque drive the copies share that torque; under angle drive their joint follows the nominal arm's
angle. The nominal comes to rest at the target, and so do the slow modes of every arm; the fast
ones follow the torque so closely that its smooth end leaves nothing worth a condition, and under
numerical damping theirs would cost several intervals of the mesh.

Symbols: q, v coordinates and rates of B21, z those of them that are elastic, tau torque [N m].
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from models.arm.driven import DrivenArm
from models.arm.reduced import ReducedArm, solve_small
from models.arm.reduced_run import reduced_modes
from models.laws import JerkLimited
from ocp import (
    Bound,
    Control,
    IpoptOptions,
    Phase,
    Problem,
    Settings,
    SolveFailed,
    State,
    solve,
)
from studies.arm.optimum import PIVOTS, Solved
from studies.arm.problem import ArmPhase, column, quasi_static, reduced_signals, torque_column
from studies.arm.replay import Drive as DriveName
from studies.arm.rigid import feed_forward
from studies.arm.spread import Spread, varied
from studies.arm.stage import JOINT_NAMES, Stage
from studies.exit_codes import ExitCode, StudyError

Array = NDArray[np.float64]
Progress = Callable[[str], None]
RATE = 60.0  # cap of the torque's rate in J D / T^3: the quintic step's own peak
MESH = (100, 3)  # intervals and degree that resolve the slow modes of the big arm
SLOW = 15.0  # [Hz], below which a mode's rest is demanded; the faster follow the torque
_MODE = 1e-2  # typical rate of a mode [sqrt(J)]
STILL = 0.05  # of it that a copy may keep
_GRID = 201  # instants of a guess
_SMOOTH = 1e-4  # weight of the mean square of the rate's slope, to leave nothing undecided
_BEND = 20.0  # typical slope of the rate over its cap, times T


@dataclass(frozen=True, eq=False)
class Copy:
    """One arm in the problem.

    Attributes
    ----------
    q, v : (n, 1) expressions of all its coordinates and rates.
    acceleration : expressions of the rates of its velocity states.
    dynamics, initial, guess : of its states.
    """

    q: Any
    v: Any
    acceleration: tuple[Any, ...]
    dynamics: dict[Any, Any]
    initial: dict[Any, Any]
    guess: dict[Any, Any]


@dataclass(frozen=True, eq=False)
class Drive:
    """Torque and rate as states, the rate's slope as control, of the one joint that turns.

    Attributes
    ----------
    joint : it.
    unit : J |D| / T^2 [N m].
    """

    joint: int
    unit: float
    torque: State
    rate: State
    bend: Control


def drive_of(stage: Stage) -> Drive:
    """The drive of a stage that turns one joint.

    Raises
    ------
    StudyError
        If the stage turns both.
    """
    if len(stage.moving) > 1:
        raise StudyError("a robust motion takes a stage that turns one joint; give big or small")
    joint, T = stage.moving[0], stage.duration
    unit, name = float(stage.torque_units[joint]), JOINT_NAMES[joint]
    cap = RATE * unit / T
    return Drive(
        joint, unit,
        State(f"{name} torque", "N m", scale=5.0 * unit),
        State(f"rate of {name} torque", "N m/s", -cap, cap, scale=cap),
        Control(f"slope of the rate of {name} torque", "N m/s^2", scale=_BEND * cap / T,
                shape="constant"),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Start:
    """Where the solver starts: times (m,) [s], q and v (n, m) of every arm, torque and its rate."""

    times: Array
    q: Array
    v: Array
    torque: Array
    rate: Array


def start_of(stage: Stage) -> Start:
    """What a rigid arm can follow under the rate cap, links bent as their inertia bends them."""
    times = np.linspace(0.0, stage.duration, _GRID)
    law = JerkLimited(stage.duration, 0.0, 1.0, 0.95 * RATE / stage.duration**3)
    torque = feed_forward(stage, law)(times)[stage.moving[0]]
    return Start(times, *quasi_static(stage, law, times), torque, np.gradient(torque, times))


def torque_copy(stage: Stage, drive: Drive, start: Start, suffix: str = "") -> Copy:
    """An arm under the torque."""
    model = stage.model
    q, v = reduced_signals(stage, start.q, suffix)
    torque = torque_column({drive.joint: drive.torque})
    force = model.force(column(q), column(v), torque)
    acceleration = tuple(solve_small(model.mass_matrix(column(q)), force))
    return Copy(
        column(q), column(v), acceleration,
        dict(zip(q, v, strict=True)) | dict(zip(v, acceleration, strict=True)),
        dict(zip(q, map(float, model.at(*stage.start)), strict=True)) | dict.fromkeys(v, 0.0),
        _guess((*q, *v), start.times, (*start.q, *start.v)),
    )  # fmt: skip


def _guess(signals: Sequence[State], times: Array, values: Sequence[Array]) -> dict[Any, Any]:
    return {signal: (times, x) for signal, x in zip(signals, values, strict=True)}


def angle_copy(stage: Stage, start: Start, nominal: Copy, suffix: str) -> Copy:
    """An arm whose joint follows that of the nominal one: its elastic coordinates only."""
    driven = DrivenArm(stage.model)
    places = list(driven.elastic)
    z, v = (tuple(x[k] for k in places) for x in reduced_signals(stage, start.q, suffix))
    s = driven.angle(nominal.q)
    turn = ca.jtimes(s, nominal.q, nominal.v)
    spin = ca.jtimes(turn, nominal.q, nominal.v)
    spin += ca.jtimes(s, nominal.q, ca.vertcat(*nominal.acceleration))
    found = driven.acceleration(column(z), column(v), s, turn, spin)
    acceleration = tuple(found[i] for i in range(found.numel()))
    return Copy(
        *driven.motion(column(z), column(v), s, turn), acceleration,
        dict(zip(z, v, strict=True)) | dict(zip(v, acceleration, strict=True)),
        dict.fromkeys((*z, *v), 0.0),
        _guess((*z, *v), start.times, (*start.q[places], *start.v[places])),
    )  # fmt: skip


def nominal_rest(stage: Stage, phase: Phase, nominal: Copy) -> list[Bound]:
    """The joint at its target and at rest, and the slow modes of the arm with the joint free."""
    model, end = stage.model, stage.model.at(*stage.end)
    place = _rigid(model)
    ends = {
        "angle": (nominal.q[place] - float(end[place]), 1.0),
        "rate": (nominal.v[place], 1.0 / stage.duration),
    }
    ends |= _slow_modes(model, end, nominal.q - ca.DM(end), nominal.v)
    return _within(phase, ends, 0.0, " at the end")


def copy_rest(stage: Stage, phase: Phase, copy: Copy, drive: DriveName, name: str) -> list[Bound]:
    """The slow modes of a copy; the rate of its joint follows, as the torque decides the momentum.

    Exactly so for the root, nearly so for the elbow, where a condition would be nearly redundant.
    """
    model, end = stage.model, stage.model.at(*stage.end)
    if drive == "torque":
        ends = _slow_modes(model, end, copy.q - ca.DM(end), copy.v)
    else:
        locked = ReducedArm(stage.arm, root_lock=stage.end[0], elbow_lock=stage.end[1])
        elastic = DrivenArm(model).elastic
        z, rate = (ca.vertcat(*(x[k] for k in elastic)) for x in (copy.q, copy.v))
        ends = _slow_modes(locked, locked.at(), z, rate)
    return _within(phase, ends, STILL, f" at the end{name}")


def _rigid(model: ReducedArm) -> int:
    """Place of the angle of the link behind the joint that turns."""
    return next(k for k, name in enumerate(model.coordinates) if name.startswith("theta"))


def _slow_modes(model: ReducedArm, at: Array, off: Any, rate: Any) -> dict[str, tuple[Any, float]]:
    """Amplitude and rate of the slow modes, with their scales."""
    frequencies, shapes = reduced_modes(model, at)
    mass, found = model.linear(at)[0].full(), {}
    for k, frequency in enumerate(frequencies[frequencies < SLOW]):
        row = ca.DM(shapes[:, k] @ mass).T
        found[f"mode {k + 1}"] = (row @ off, _MODE / (2.0 * np.pi * float(frequency)))
        found[f"rate of mode {k + 1}"] = (row @ rate, _MODE)
    return found


def _within(
    phase: Phase, ends: dict[str, tuple[Any, float]], share: float, suffix: str
) -> list[Bound]:
    """Bounds at the end of at most a share of the scales."""
    return [
        Bound(f"{name}{suffix}", phase.at_end(value).symbol, "1", -share * scale, share * scale,
              scale)
        for name, (value, scale) in ends.items()
    ]  # fmt: skip


def statement(stage: Stage, spread: Spread, *, copied: bool) -> tuple[Problem, ArmPhase]:
    """The motion of least peak torque of the nominal arm, or of that and its copies.

    Parameters
    ----------
    stage : Stage
    spread : Spread
    copied : bool
        Whether the copies come in.
    """
    drive, start = drive_of(stage), start_of(stage)
    nominal = torque_copy(stage, drive, start)
    copies: list[tuple[Stage, Copy, str]] = []
    for number, (x, y) in enumerate(spread.design if copied else ()):
        other = dataclasses.replace(stage, arm=varied(stage.arm, spread.factors(x, y)))
        name = f" of copy {number}"
        copy = (torque_copy(other, drive, start, name) if spread.drive == "torque"
                else angle_copy(other, start, nominal, name))  # fmt: skip
        copies.append((other, copy, name))
    phase = _phase(stage, drive, start, [nominal, *(copy for _, copy, _ in copies)])
    bounds = nominal_rest(stage, phase, nominal)
    for other, copy, name in copies:
        bounds += copy_rest(other, phase, copy, spread.drive, name)
    bend = drive.bend * (stage.duration / (_BEND * drive.rate.upper))
    goal = _SMOOTH * phase.integral(bend**2, "smoothness", "s").symbol / stage.duration
    goal += phase.peak(drive.torque / drive.unit, absolute=True).symbol
    arm = ArmPhase(
        phase, stage.model, (), (), {drive.joint: drive.torque}, {drive.joint: drive.rate},
        {drive.joint: drive.bend}, (),
    )  # fmt: skip
    name = f"{stage.name} arm, {spread.drive} drive"
    return Problem(name, [phase], bounds=bounds, minimise=goal), arm


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


def solved(
    stage: Stage,
    spread: Spread,
    *,
    copied: bool,
    mesh: tuple[int, int],
    name: str = "nominal",
    progress: Any = None,
) -> Solved:
    """Solve `statement` on one mesh.

    Raises
    ------
    StudyError
        If nothing is found.
    """
    stated, arm = statement(stage, spread, copied=copied)
    settings = Settings(
        intervals=mesh[0], degree=mesh[1], refine=False, move_breakpoints=False, verify=False,
        ipopt=IpoptOptions(
            tolerance=1e-7, dual_tolerance=1e-4, constraint_violation=1e-9, max_iterations=150,
            pivot_tolerance=PIVOTS,
        ),
    )  # fmt: skip
    try:
        found = solve(stated, settings=settings, progress=progress)
    except SolveFailed as error:
        raise StudyError(
            f"no {name} motion of the stage '{stage.name}' was found: {error}", ExitCode.NOT_SOLVED
        ) from error
    return Solved(name, stage, found.trajectory, arm)
