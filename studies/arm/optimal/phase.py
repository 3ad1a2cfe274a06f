"""The arm's motion as a phase of an optimal control problem on the reduced model B21.

The torque of each driven joint and its rate are states, zero at both ends; the slope of the
rate is the control, constant in each interval, so that nothing rings what the mesh does not
resolve. At both ends the elastic coordinates rest too: the lock meets nothing that moves. In a
slow stage the torque hardly stirs the elastic modes, exact rest is as good as implied by zero
torque, and stating it again makes the equations singular: there the elastic energy at the lock
is bounded instead.

Symbols: q coordinates of B21, v their rates, tau torques (root, elbow) [N m].
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from models.arm.reduced import ReducedArm, solve_small
from models.arm.reduced_simulation import reduced_modes
from models.laws import JerkLimited, Law
from models.laws.unit_turns import quintic
from ocp import Between, Bound, Constant, Control, Phase, State
from ocp.arrays import Array
from studies.arm.laws.rigid import feed_forward, joint_motion
from studies.arm.stage import ELBOW, JOINT_NAMES, ROOT, Stage, TorqueCaps

MARGIN = 3e-4  # of a cap, left for what happens between the points of the mesh
REST = 1e-11  # [J] elastic energy at the lock of a slow stage; a hundredth of what counts as still
_GRID = 201  # instants of a guess
_TORQUE = 5.0  # typical torque in J D / T^2
_RATE = 30.0  # typical torque rate in J D / T^3
_BEND = 400.0  # typical slope of the rate in J D / T^4
_CONSTANT, _QUINTIC = 4.0, 5.77  # peaks of the rigid bound and of the quintic step in J D / T^2
_STEEPEST = 32.0  # torque rate in J D / T^3 below which even a rigid arm does not arrive
_PERIODS = 50.0  # of the first mode, beyond which a stage is slow


@dataclass(frozen=True, eq=False)
class Drives:
    """Torque of the driven joints, its rate and the rate's slope, by joint.

    Attributes
    ----------
    torque, rate : states.
    bend : control, the slope of the rate.
    """

    torque: Mapping[int, State]
    rate: Mapping[int, State]
    bend: Mapping[int, Control]

    @property
    def states(self) -> tuple[State, ...]:
        """Torques, then rates."""
        return (*self.torque.values(), *self.rate.values())

    @property
    def dynamics(self) -> dict[State, Any]:
        """Torque and rate are integrals of the slope."""
        rates = {self.torque[k]: self.rate[k] for k in self.torque}
        return rates | {self.rate[k]: self.bend[k] for k in self.rate}

    @property
    def column(self) -> Any:
        """(root, elbow) torques, zero where a joint is not driven."""
        torques = self.torque
        return ca.vertcat(*(torques[k].symbol if k in torques else ca.SX(0) for k in (ROOT, ELBOW)))


@dataclass(frozen=True, eq=False)
class ArmPhase:
    """A phase in which joints turn, up to their lock, with the signals of its expressions.

    Attributes
    ----------
    phase : Phase
    stage : as it was stated; a free duration ends in another one.
    q, v : states of the reduced arm.
    drives : Drives
    acceleration : expressions of the rates of `v`.
    bounds : on the end of the phase, of the problem.
    aims : where q and v end beside rest, in their order; None of those that are not stated.
    """

    phase: Phase
    stage: Stage
    q: tuple[State, ...]
    v: tuple[State, ...]
    drives: Drives
    acceleration: tuple[Any, ...]
    bounds: tuple[Bound, ...] = ()
    aims: tuple[Constant | None, ...] = ()

    @property
    def model(self) -> ReducedArm:
        """B21 while the stage runs."""
        return self.stage.model

    @property
    def torque(self) -> Mapping[int, State]:
        """Torques by driven joint."""
        return self.drives.torque


def column(signals: Iterable[Any]) -> Any:
    """Symbols of signals as one column."""
    return ca.vertcat(*(signal.symbol for signal in signals))


def arm_phase(
    stage: Stage,
    caps: TorqueCaps,
    *,
    start: float | Between = 0.0,
    end: float | Between | None = None,
    law: Law | None = None,
    suffix: str = "",
    linked: bool = False,
    left: float | None = None,
) -> ArmPhase:
    """Rest to rest of a stage, torques zero at both ends.

    Where rest is stated by values, constants of the problem move them, see `ArmPhase.aims`: what
    the full model misses by is the next solve's aim.

    Parameters
    ----------
    stage : Stage
    caps : TorqueCaps
    start, end : number or Between, optional
        Times of the release and of the lock [s]; zero and the stage's duration by default.
    law : unit law to start from, the quintic step by default.
    suffix : of the names of the coordinates, where phases must be told apart.
    linked : leave the coordinates at the start to links with the phase before.
    left : energy that the lock may meet instead of rest [J], kinetic and elastic.
    """
    model, duration = stage.model, stage.duration
    law = law or quintic(duration)

    # the guess: a rigid arm follows the law, its links bent by their own inertia
    grid = np.linspace(0.0, duration, _GRID)
    guess_q, guess_v = quasi_static(stage, law, grid)
    torques = feed_forward(stage, law)(grid)

    q, v = reduced_signals(stage, guess_q, suffix)
    drives = torque_signals(stage, caps)
    acceleration = accelerations(model, q, v, drives)

    to_rest = left is None
    initial, rest, left = _boundary(stage, q, v, drives.states, left)
    # where the energy of the end is bounded its angles are still stated
    stated = (*(left is None or state in rest for state in q), *(left is None for _ in v))
    aims = tuple(
        Constant(f"aim of {state.name}", state.unit, 0.0) if to_rest and is_stated else None
        for state, is_stated in zip((*q, *v), stated, strict=True)
    )
    pairs = zip((*q, *v), aims, strict=True)
    final: dict[State, Any] = rest | {
        state: rest[state] + at for state, at in pairs if at is not None
    }
    if linked:
        initial = dict.fromkeys(drives.states, 0.0)

    times = grid + (start.start if isinstance(start, Between) else start)
    guess: dict[Any, Any] = sampled_guess((*q, *v), times, (*guess_q, *guess_v))
    for k in stage.moving:
        guess[drives.torque[k]] = times, torques[k]
        guess[drives.rate[k]] = times, np.gradient(torques[k], grid)
        guess[drives.bend[k]] = 0.0

    phase = Phase(
        stage.name,
        dynamics=equations_of_motion(q, v, acceleration) | drives.dynamics,
        initial=initial,
        final=final,
        start=start,
        end=duration if end is None else end,
        bounds=taken_by_the_wheels(model, q, v, acceleration, caps),
        guess=guess,
    )
    bounds = () if left is None else (at_rest(phase, model, q, v, left),)
    return ArmPhase(phase, stage, q, v, drives, acceleration, bounds, aims)


def accelerations(
    model: ReducedArm, q: Iterable[State], v: Iterable[State], drives: Drives
) -> tuple[Any, ...]:
    """Expressions of the accelerations of a reduced arm under the torques."""
    position, rate = column(q), column(v)
    return tuple(solve_small(*model.mass_and_force(position, rate, drives.column)))


def taken_by_the_wheels(
    model: ReducedArm,
    q: Iterable[State],
    v: Iterable[State],
    acceleration: Iterable[Any],
    caps: TorqueCaps,
) -> tuple[Bound, ...]:
    """Caps on what the root passes on to a satellite that is held."""
    handed, moment = angular_momentum(model, q, v), root_moment(model, q, v, acceleration)
    taken = (
        ("momentum handed to the satellite", handed, "N m s", caps.momentum),
        ("moment of the satellite", moment, "N m", caps.root_moment),
    )
    return tuple(
        Bound(name, value, unit, -_with_margin(cap), _with_margin(cap), scale=cap)
        for name, value, unit, cap in taken
        if cap is not None
    )


def angular_momentum(model: ReducedArm, q: Iterable[State], v: Iterable[State]) -> Any:
    """Of the arm about the root [N m s]."""
    return model.angular_momentum(column(q), column(v))


def root_moment(
    model: ReducedArm, q: Iterable[State], v: Iterable[State], acceleration: Iterable[Any]
) -> Any:
    """Its rate, the moment of the satellite on the arm [N m]."""
    position, rate = column(q), column(v)
    handed = model.angular_momentum(position, rate)
    by_rates = ca.jtimes(handed, rate, ca.vertcat(*acceleration))
    return ca.jtimes(handed, position, rate) + by_rates


def equations_of_motion(
    q: Iterable[State], v: Iterable[State], acceleration: Iterable[Any]
) -> dict[State, Any]:
    """Coordinates are integrals of their rates, these of the accelerations."""
    rates = tuple(v)
    return dict(zip(q, rates, strict=True)) | dict(zip(rates, acceleration, strict=True))


def sampled_guess(
    signals: Iterable[Any], times: Array, values: Iterable[Array]
) -> dict[Any, tuple[Array, Array]]:
    """Guesses of signals sampled at the same times."""
    return {signal: (times, x) for signal, x in zip(signals, values, strict=True)}


def _boundary(
    stage: Stage,
    q: tuple[State, ...],
    v: tuple[State, ...],
    drives: tuple[State, ...],
    left: float | None,
) -> tuple[dict[State, float], dict[State, float], float | None]:
    """Values at release and lock, and the energy that stands for rest there, if one does [J]."""
    still = dict.fromkeys(drives, 0.0)
    start, end = (
        dict(zip(q, map(float, pose), strict=True)) | dict.fromkeys(v, 0.0) | still
        for pose in (stage.model.at(*stage.start), stage.model.at(*stage.end))
    )
    if left is not None:
        return start, still | _angles(end), left
    if is_slow(stage):
        return start, still | _angles(end, rates=True), REST
    return start, end, None


def _angles(values: dict[State, float], rates: bool = False) -> dict[State, float]:
    """The angles, and their rates, among boundary values."""
    return {
        state: value
        for state, value in values.items()
        if state.name.startswith("theta") or (rates and "theta" in state.name)
    }


def is_slow(stage: Stage) -> bool:
    """Whether a stage lasts so many periods of its first mode that the torque hardly stirs it."""
    angles = (np.array(stage.start) + share * stage.turn for share in (0.0, 0.5, 1.0))
    lowest = min(reduced_modes(stage.model, stage.model.at(*a))[0][0] for a in angles)
    return bool(stage.duration * lowest > _PERIODS)


def at_rest(
    phase: Phase, model: ReducedArm, q: tuple[State, ...], v: tuple[State, ...], left: float
) -> Bound:
    """Kinetic and elastic energy at the end of a phase at most `left` [J]."""
    energy = model.kinetic_energy(column(q), column(v)) + model.strain_energy(column(q))
    return Bound(f"energy left by {phase.name}", phase.at_end(energy / left), "1", upper=1.0)


def reduced_signals(
    stage: Stage, guess: Array, suffix: str = ""
) -> tuple[tuple[State, ...], tuple[State, ...]]:
    """States of the reduced arm, scaled by what a guess (n, m) shows."""
    model = stage.model
    units = {"theta": "rad", "delta": "m", "psi": "1"}
    swing = 2 * np.pi * float(reduced_modes(model, model.at(*stage.start))[0][0])

    q, v = [], []
    for name, values in zip(model.coordinates, guess, strict=True):
        unit = next(u for key, u in units.items() if name.startswith(key))
        turns = unit == "rad"
        size = 1.0 if turns else max(np.abs(values).max(), 1e-9)
        # angles change within the stage, elastic coordinates within the first mode's period
        pace = 1.0 / stage.duration if turns else swing
        q.append(State(name + suffix, unit, scale=float(size)))
        v.append(State(f"rate of {name}{suffix}", f"{unit}/s", scale=float(size * pace)))
    return tuple(q), tuple(v)


def torque_signals(stage: Stage, caps: TorqueCaps) -> Drives:
    """The drives of a stage's joints, with a margin below their caps."""
    torques, rates, bends, T = {}, {}, {}, stage.duration
    for k in stage.moving:
        name, unit = f"{JOINT_NAMES[k]} torque", float(stage.torque_units[k])
        torque, rate = _with_margin(caps.torque[k]), _with_margin(caps.rate[k])
        torques[k] = State(name, "N m", -torque, torque, scale=_TORQUE * unit)
        rates[k] = State(f"rate of {name}", "N m/s", -rate, rate, scale=_RATE * unit / T)
        bends[k] = Control(
            f"slope of the rate of {name}",
            "N m/s^2",
            scale=_BEND * unit / T**2,
            piecewise="constant",
        )
    return Drives(torques, rates, bends)


def _with_margin(cap: float | None) -> float:
    return np.inf if cap is None else cap * (1 - MARGIN)


def quasi_static(stage: Stage, law: Law, t: Array) -> tuple[Array, Array]:
    """Coordinates and rates (n, m) along a unit law, links bent as their inertia bends them.

    The elastic rows of K q = B tau - M a with the undeformed arm's masses.
    """
    model, names = stage.model, stage.model.coordinates
    angles, _, joint_acc = joint_motion(stage, law, t)
    torques = feed_forward(stage, law)(t)

    q = np.array([model.at(*angle) for angle in angles.T]).T
    rigid = {"theta1": joint_acc[0], "theta2": joint_acc[0] + joint_acc[1]}
    acceleration = np.array([rigid.get(name, 0 * t) for name in names])

    symbols = ca.SX.sym("q", model.size), ca.SX.sym("tau", 2)
    pull = model.force(symbols[0], ca.DM.zeros(model.size), symbols[1])
    force = ca.Function("pull", list(symbols), [pull])

    elastic = [k for k, name in enumerate(names) if not name.startswith("theta")]
    for k in range(len(t)):
        mass, stiffness = (m.full() for m in model.linear(q[:, k]))
        load = force(q[:, k], torques[:, k]).full()[:, 0] - mass @ acceleration[:, k]
        q[elastic, k] = np.linalg.solve(stiffness[np.ix_(elastic, elastic)], load[elastic])
    return q, np.gradient(q, t, axis=1)


def slope_unit(stage: Stage, joint: int) -> float:
    """Typical slope of a torque's rate [N m/s^2]."""
    return float(stage.torque_units[joint]) / stage.duration**2 * _BEND


def smoothness(arm: ArmPhase) -> Any:
    """Mean square of the slopes of the torque rates over their typical size."""
    stage = arm.stage
    total = sum((bend / slope_unit(stage, k)) ** 2 for k, bend in arm.drives.bend.items())
    return arm.phase.integral(total, "smoothness", "s") / stage.duration


def starting_law(stage: Stage, caps: TorqueCaps) -> Law:
    """A unit law that a rigid arm can follow under the caps: what the solver starts from."""
    T, k = stage.duration, stage.moving[0]
    cap, rate, unit = caps.torque[k], caps.rate[k], float(stage.torque_units[k])

    if cap is not None and _CONSTANT < cap / unit < _QUINTIC:
        # a trapezoid of peak 4 / (1 - 2 ramp), with the ramp as a share of T
        ramp = 0.45 * (1.0 - _CONSTANT * unit / cap)
        return JerkLimited(T, 0.0, 1.0, _CONSTANT / (1.0 - 2.0 * ramp) / ramp / T**3)
    if rate is not None and rate * T / unit > _STEEPEST:
        return JerkLimited(T, 0.0, 1.0, rate * T / unit / T**3)
    return quintic(T)
