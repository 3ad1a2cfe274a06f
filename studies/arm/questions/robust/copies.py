"""Copies of an arm that share one drive, for a motion that suits them all.

Under torque drive the copies share the nominal arm's torque; under angle drive their joint
follows the nominal arm's angle.

Symbols: q, v coordinates and rates of B21, z those of them that are elastic, tau torque [N m].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from models.arm.driven import DrivenArm
from models.arm.reduced import solve_small
from models.laws import JerkLimited
from ocp import Control, State
from studies.arm.laws.rigid import feed_forward
from studies.arm.optimal.phase import column, quasi_static, reduced_signals, torque_column
from studies.arm.optimal.solve import Solved
from studies.arm.stage import JOINT_NAMES, Stage
from studies.common.exit_codes import StudyError

Array = NDArray[np.float64]
RATE = 60.0  # cap of the torque's rate in J D / T^3: the quintic step's own peak
BEND = 20.0  # typical slope of the rate over its cap, times T
_GRID = 401  # instants of a guess


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


@dataclass(frozen=True, eq=False)
class Start:
    """Where the solver starts: times (m,) [s], q and v (n, m) of every arm, torque and its rate."""

    times: Array
    q: Array
    v: Array
    torque: Array
    rate: Array


def drive_of(stage: Stage, cap: float = np.inf) -> Drive:
    """The drive of a stage that turns one joint, with a cap on its torque [N m].

    Raises
    ------
    StudyError
        If the stage turns both.
    """
    if len(stage.moving) > 1:
        raise StudyError("a robust motion takes a stage that turns one joint; give big or small")
    joint, T = stage.moving[0], stage.duration
    unit, name = float(stage.torque_units[joint]), JOINT_NAMES[joint]
    steepest = RATE * unit / T
    return Drive(
        joint, unit,
        State(f"{name} torque", "N m", -cap, cap, scale=5.0 * unit),
        State(f"rate of {name} torque", "N m/s", -steepest, steepest, scale=steepest),
        Control(f"slope of the rate of {name} torque", "N m/s^2", scale=BEND * steepest / T,
                shape="constant"),
    )  # fmt: skip


def rigid_start(stage: Stage) -> Start:
    """What a rigid arm can follow under the rate cap, links bent as their inertia bends them."""
    times = np.linspace(0.0, stage.duration, _GRID)
    law = JerkLimited(stage.duration, 0.0, 1.0, 0.95 * RATE / stage.duration**3)
    torque = feed_forward(stage, law)(times)[stage.moving[0]]
    return Start(times, *quasi_static(stage, law, times), torque, np.gradient(torque, times))


def solved_start(motion: Solved) -> Start:
    """A motion already found, of all copies."""
    found, joint = motion.reduced, motion.stage.moving[0]
    law = motion.torques[joint]
    return Start(found.times, found.q, found.v, law(found.times), law.derivative()(found.times))


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


def residual_energy(stage: Stage, copy: Copy) -> Any:
    """E_res [J] of a copy if its joint locked now."""
    q, v = (ca.SX.sym(name, stage.model.size) for name in "qv")
    mass, momentum, strain = DrivenArm(stage.model).locked(q, v)
    kinetic = 0.5 * ca.dot(momentum, ca.vertcat(*solve_small(mass, momentum)))
    return ca.Function("left", [q, v], [kinetic + strain])(copy.q, copy.v)


def _guess(signals: Sequence[State], times: Array, values: Sequence[Array]) -> dict[Any, Any]:
    return {signal: (times, x) for signal, x in zip(signals, values, strict=True)}
