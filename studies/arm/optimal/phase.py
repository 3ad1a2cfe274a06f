"""The arm's motion as an optimal control problem on the reduced model B21.

The torque of each driven joint and its rate are states, zero at both ends; the slope of the
rate is the control, constant in each interval, so that nothing rings what the mesh does not
resolve. At both ends the elastic coordinates rest too: the lock meets nothing that moves. In a
slow stage the torque hardly stirs the elastic modes, exact rest is as good as implied by zero
torque, and stating it again makes the equations singular: there the elastic energy at the lock
is bounded instead.

Symbols: q coordinates of B21, v their rates, tau torques (root, elbow) [N m].
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from models.arm.reduced import ReducedArm, solve_small
from models.arm.reduced_simulation import reduced_modes
from models.laws import JerkLimited, Law
from ocp import Between, Bound, Control, Phase, State
from studies.arm.laws.rigid import feed_forward, joint_motion
from studies.arm.laws.unit_laws import quintic
from studies.arm.stage import JOINT_NAMES, Stage

Array = NDArray[np.float64]
_GRID = 201  # instants of a guess
_RATE = 30.0  # typical torque rate in J D / T^3
MARGIN = 3e-4  # of a cap, left for what happens between the points of the mesh
_QUINTIC = 5.77  # peak of the quintic step in J D / T^2
_BEND = 400.0  # typical slope of the rate in J D / T^4
_PERIODS = 50.0  # of the first mode, beyond which a stage is slow
REST = 1e-11  # [J] elastic energy at the lock of a slow stage; a hundredth of what counts as still


@dataclass(frozen=True)
class Limits:
    """What holds at all times; None is no limit.

    Attributes
    ----------
    torque : (root, elbow) caps [N m].
    rate : caps of their rates [N m/s].
    """

    torque: tuple[float | None, float | None] = (None, None)
    rate: tuple[float | None, float | None] = (None, None)


@dataclass(frozen=True, eq=False)
class ArmPhase:
    """A phase with the signals that its expressions are made of.

    Attributes
    ----------
    q, v : states of the reduced arm.
    torque, rate, bend : torque, its rate and the rate's slope, by driven joint.
    acceleration : expressions of the rates of `v`.
    bounds : on the end of the phase, of the problem.
    """

    phase: Phase
    model: ReducedArm
    q: tuple[State, ...]
    v: tuple[State, ...]
    torque: dict[int, State]
    rate: dict[int, State]
    bend: dict[int, Control]
    acceleration: tuple[Any, ...]
    bounds: tuple[Bound, ...] = ()


def column(signals: Any) -> Any:
    """Symbols of signals as one column."""
    return ca.vertcat(*(signal.symbol for signal in signals))


def torque_column(torque: dict[int, State]) -> Any:
    """(root, elbow) torques, zero where a joint is not driven."""
    return ca.vertcat(*(torque[k].symbol if k in torque else ca.SX(0) for k in (0, 1)))


def arm_phase(
    stage: Stage,
    limits: Limits,
    *,
    start: float | Between = 0.0,
    end: float | Between | None = None,
    law: Law | None = None,
    suffix: str = "",
    linked: bool = False,
    left: float | None = None,
) -> ArmPhase:
    """Rest to rest of a stage, torques zero at both ends.

    Parameters
    ----------
    stage : Stage
    limits : Limits
    start, end : number or Between, optional
        Times of the release and of the lock [s]; zero and the stage's duration by default.
    law : unit law to start from, the quintic step by default.
    suffix : of the names of the coordinates, where phases must be told apart.
    linked : leave the coordinates at the start to links with the phase before.
    left : energy that the lock may meet instead of rest [J], kinetic and elastic.
    """
    model, T = stage.model, stage.duration
    law = law or quintic(T)
    grid = np.linspace(0.0, T, _GRID)
    guess_q, guess_v = quasi_static(stage, law, grid)
    torques = feed_forward(stage, law)(grid)
    q, v = reduced_signals(stage, guess_q, suffix)
    torque, rate, bend = torque_signals(stage, limits)
    acceleration = solve_small(
        model.mass_matrix(column(q)), model.force(column(q), column(v), torque_column(torque))
    )
    drives = (*torque.values(), *rate.values())
    initial, final, left = _boundary(stage, q, v, drives, left)
    if linked:
        initial = dict.fromkeys(drives, 0.0)
    at = grid + (start.start if isinstance(start, Between) else start)
    coordinates = (*q, *v)
    guess: dict[Any, Any] = {
        s: (at, x) for s, x in zip(coordinates, (*guess_q, *guess_v), strict=True)
    }
    guess |= {torque[k]: (at, torques[k]) for k in torque}
    guess |= {rate[k]: (at, np.gradient(torques[k], grid)) for k in rate}
    guess |= {bend[k]: 0.0 for k in bend}
    dynamics: dict[State, Any] = dict(zip(coordinates, (*v, *acceleration), strict=True))
    dynamics |= {torque[k]: rate[k] for k in torque} | {rate[k]: bend[k] for k in torque}
    phase = Phase(
        stage.name, dynamics=dynamics, initial=initial, final=final, start=start,
        end=T if end is None else end, guess=guess,
    )  # fmt: skip
    bounds = () if left is None else (at_rest(phase, model, q, v, left),)
    return ArmPhase(phase, model, q, v, torque, rate, bend, tuple(acceleration), bounds)


def _boundary(
    stage: Stage, q: tuple[State, ...], v: tuple[State, ...], drives: tuple[State, ...],
    left: float | None,
) -> tuple[dict[State, float], dict[State, float], float | None]:  # fmt: skip
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
        s: x for s, x in values.items()
        if s.name.startswith("theta") or (rates and "theta" in s.name)
    }  # fmt: skip


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
    names = stage.model.coordinates
    sizes = [1.0 if n.startswith("theta") else max(np.abs(g).max(), 1e-9)
             for n, g in zip(names, guess, strict=True)]  # fmt: skip
    units = {"theta": "rad", "delta": "m", "psi": "1"}
    swing = 2 * np.pi * float(reduced_modes(stage.model, stage.model.at(*stage.start))[0][0])
    q, v = [], []
    for name, size in zip(names, sizes, strict=True):
        unit = next(u for key, u in units.items() if name.startswith(key))
        pace = 1.0 / stage.duration if unit == "rad" else swing
        q.append(State(name + suffix, unit, scale=float(size)))
        v.append(State(f"rate of {name}{suffix}", f"{unit}/s", scale=float(size * pace)))
    return tuple(q), tuple(v)


def torque_signals(
    stage: Stage, limits: Limits
) -> tuple[dict[int, State], dict[int, State], dict[int, Control]]:
    """Torques and rates as states with their caps, and the slopes of the rates as controls."""
    torque, rate, bend = {}, {}, {}
    for k in stage.moving:
        name, size, T = JOINT_NAMES[k], float(stage.torque_units[k]), stage.duration
        torque[k] = State(f"{name} torque", "N m", *_within(limits.torque[k]), scale=5.0 * size)
        rate[k] = State(
            f"rate of {name} torque", "N m/s", *_within(limits.rate[k]), scale=_RATE * size / T
        )
        bend[k] = Control(
            f"slope of the rate of {name} torque", "N m/s^2", scale=_BEND * size / T**2,
            shape="constant",
        )  # fmt: skip
    return torque, rate, bend


def _within(cap: float | None) -> tuple[float, float]:
    return (-np.inf, np.inf) if cap is None else (-cap * (1 - MARGIN), cap * (1 - MARGIN))


def quasi_static(stage: Stage, law: Law, t: Array) -> tuple[Array, Array]:
    """Coordinates and rates (n, m) along a unit law, links bent as their inertia bends them.

    The elastic rows of K q = B tau - M a with the undeformed arm's masses.
    """
    model = stage.model
    angles, _, acc = joint_motion(stage, law, t)
    torques = feed_forward(stage, law)(t)
    q = np.array([model.at(*angle) for angle in angles.T]).T
    places = {"theta1": acc[0], "theta2": acc[0] + acc[1]}
    a = np.array([places.get(name, 0 * t) for name in model.coordinates])
    elastic = [k for k, name in enumerate(model.coordinates) if not name.startswith("theta")]
    symbols = ca.SX.sym("q", model.size), ca.SX.sym("tau", 2)
    pull = model.force(symbols[0], ca.DM.zeros(model.size), symbols[1])
    force = ca.Function("pull", list(symbols), [pull])
    for k in range(len(t)):
        mass, stiffness = (m.full() for m in model.linear(q[:, k]))
        load = force(q[:, k], torques[:, k]).full()[:, 0] - mass @ a[:, k]
        q[elastic, k] = np.linalg.solve(stiffness[np.ix_(elastic, elastic)], load[elastic])
    return q, np.gradient(q, t, axis=1)


def smoothness(arm: ArmPhase, stage: Stage) -> Any:
    """Mean square of the slopes of the torque rates over their typical size."""
    unit = stage.torque_units / stage.duration**2 * _BEND
    total = sum((arm.bend[k] / unit[k]) ** 2 for k in arm.bend)
    return arm.phase.integral(total, "smoothness", "s") / stage.duration


def starting_law(stage: Stage, limits: Limits) -> Law:
    """A unit law that a rigid arm can follow under the caps: what the solver starts from."""
    T = stage.duration
    k = stage.moving[0]
    cap, rate = limits.torque[k], limits.rate[k]
    unit = float(stage.torque_units[k])
    if cap is not None and 4.0 < cap / unit < _QUINTIC:
        ramp = 0.45 * (1.0 - 4.0 * unit / cap)  # share of T; a trapezoid of peak 4/(1 - 2 ramp)
        return JerkLimited(T, 0.0, 1.0, 4.0 / (1.0 - 2.0 * ramp) / ramp / T**3)
    if rate is not None and rate * T / unit > 32.0:
        return JerkLimited(T, 0.0, 1.0, rate * T / unit / T**3)
    return quintic(T)
