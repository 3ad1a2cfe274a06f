"""A motion replayed on B21 for many arms at once: one fixed-step Runge-Kutta run, all arms abreast.

Mass matrix, force and strain energy are affine in the stiffness of each link and in the tip
mass, so that those of any arm are combined from four arms' expressions.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from models.ancf.joints import Driven, Torque
from models.arm.driven import DrivenArm
from models.arm.parameters import ArmParameters
from models.arm.reduced import solve_small
from models.arm.reduced_simulation import ReducedMotion
from studies.arm.replay.full import Motion
from studies.arm.replay.spread import Factors, varied
from studies.arm.stage import Stage

Array = NDArray[np.float64]
STEP = 0.0025  # [s]; stable for the fastest mode of B21, 144 Hz
STEPS = 16000  # of one arm followed, or more
_MANY = 100_000  # steps of single arms from which compiled code pays
_OFF = 0.1  # factor less one of the arms that are combined


def residuals(motion: Motion, points: Sequence[Factors], step: float = STEP) -> Array:
    """E_res on B21 [J] at each point, (m,), after the lock.

    Parameters
    ----------
    motion : Motion
        Its torque, or its angle, is applied to every arm.
    points : (big stiffness, small stiffness, tip mass) factors of each arm.
    step : float
        [s]
    """
    stage, joint = motion.stage, motion.joints[motion.stage.moving[0]]
    steps = int(np.ceil(stage.duration / step))
    half = np.linspace(0.0, stage.duration, 2 * steps + 1)
    lanes, factors = len(points), np.array(points).T
    quick = steps * lanes > _MANY
    if isinstance(joint, Torque):
        given = joint.torque(half)[None]
        rate, energy, start = torque_driven(stage, quick)
    elif isinstance(joint, Driven):
        given = np.stack(joint.law(half))
        rate, energy, start = angle_driven(stage, quick)
    advance = runge_kutta(rate).map("advance", "serial", lanes, [1, 3], [])
    y = np.tile(start[:, None], lanes)
    for k in range(steps):
        y = advance(y, given[:, 2 * k : 2 * k + 3], factors, stage.duration / steps)
    left = energy.map("energy", "serial", lanes, [1], [])(y, given[:, -1], factors)
    return np.asarray(left.full())[0]


def follow(motion: Motion, samples: int) -> ReducedMotion:
    """The motion of the nominal arm under torque on B21 at even instants, with `STEPS` or more."""
    stage, joint = motion.stage, motion.joints[motion.stage.moving[0]]
    if not isinstance(joint, Torque):
        raise ValueError("follow: the motion is not under torque")
    rate, _, start = torque_driven(stage, False)
    each = int(np.ceil(max(STEPS, stage.duration / STEP) / (samples - 1)))
    half = np.linspace(0.0, stage.duration, 2 * each * (samples - 1) + 1)
    torque, h = joint.torque(half), 2 * half[1]
    advance = runge_kutta(rate).mapaccum("follow", each)
    path = np.empty((len(start), samples))
    path[:, 0] = start
    for k in range(samples - 1):
        part = torque[2 * each * k : 2 * each * (k + 1) + 1]
        given = np.stack((part[:-1:2], part[1::2], part[2::2]), axis=1).reshape(1, -1)
        path[:, k + 1] = advance(path[:, k], given, np.ones(3), h).full()[:, -1]
    q, v = np.split(path, 2)
    nodes = stage.model.to_nodes(q, v, 1)[0]
    times = np.linspace(0.0, stage.duration, samples)
    return ReducedMotion(stage.model, times, q, v, nodes[12:14], nodes[4:6])


def torque_driven(stage: Stage, quick: bool) -> tuple[ca.Function, ca.Function, Array]:
    """State rates, E_res and start of an arm under torque; state (q, v), input tau."""
    model, joint = stage.model, stage.moving[0]
    q, v = ca.SX.sym("q", model.size), ca.SX.sym("v", model.size)
    given, factors = ca.SX.sym("tau"), ca.SX.sym("factors", 3)
    torque = ca.vertcat(*(given if k == joint else ca.SX(0) for k in (0, 1)))

    def motion(arm: ArmParameters) -> tuple[Any, ...]:
        other = stage.reduced(arm)
        return other.mass_matrix(q), other.force(q, v, torque)

    acceleration = ca.vertcat(*solve_small(*_affine(stage, factors, motion)))
    left = _energy(stage, factors, q, v)
    arguments = [ca.vertcat(q, v), given, factors]
    start = np.concatenate((model.at(*stage.start), np.zeros(model.size)))
    return (*_functions(arguments, ca.vertcat(v, acceleration), left, quick), start)


def angle_driven(stage: Stage, quick: bool) -> tuple[ca.Function, ca.Function, Array]:
    """The same of an arm on an angle; state (z, zdot), input (s, sdot, sddot)."""
    nominal = DrivenArm(stage.model)
    n = len(nominal.elastic)
    z, rate = ca.SX.sym("z", n), ca.SX.sym("zdot", n)
    given, factors = ca.SX.sym("s", 3), ca.SX.sym("factors", 3)

    def motion(arm: ArmParameters) -> tuple[Any, ...]:
        return DrivenArm(stage.reduced(arm)).balance(z, rate, given[0], given[1], given[2])

    acceleration = ca.vertcat(*solve_small(*_affine(stage, factors, motion)))
    left = _energy(stage, factors, *nominal.motion(z, rate, given[0], given[1]))
    arguments = [ca.vertcat(z, rate), given, factors]
    found = _functions(arguments, ca.vertcat(rate, acceleration), left, quick)
    return (*found, np.zeros(2 * n))


def _energy(stage: Stage, factors: Any, q: Any, v: Any) -> Any:
    """E_res [J] of the arm of some factors at coordinates q and rates v."""
    x, y = ca.SX.sym("x", stage.model.size), ca.SX.sym("y", stage.model.size)

    def locked(arm: ArmParameters) -> tuple[Any, ...]:
        return DrivenArm(stage.reduced(arm)).locked(x, y)

    mass, momentum, strain = _affine(stage, factors, locked)
    kinetic = 0.5 * ca.dot(momentum, ca.vertcat(*solve_small(mass, momentum)))
    return ca.Function("left", [x, y, factors], [kinetic + strain])(q, v, factors)


def _affine(
    stage: Stage, factors: Any, build: Callable[[ArmParameters], tuple[Any, ...]]
) -> tuple[Any, ...]:
    """What `build` makes of an arm, for the arm of any factors (3, 1)."""
    nominal = build(stage.arm)
    found = list(nominal)
    for k in range(3):
        off = [1.0, 1.0, 1.0]
        off[k] += _OFF
        other = build(varied(stage.arm, (off[0], off[1], off[2])))
        for i, (there, here) in enumerate(zip(other, nominal, strict=True)):
            found[i] = found[i] + (factors[k] - 1.0) / _OFF * (there - here)
    return tuple(found)


def _functions(
    arguments: list[Any], rate: Any, energy: Any, quick: bool
) -> tuple[ca.Function, ca.Function]:
    """Both as functions; the rates compiled if that pays and gcc is at hand."""
    options: dict[str, Any] = {"cse": True}
    if quick and shutil.which("gcc"):
        jit = {"flags": ["-O2"], "directory": f"{tempfile.gettempdir()}/"}
        options |= {"jit": True, "compiler": "shell", "jit_options": jit}
    return ca.Function("rate", arguments, [rate], options), ca.Function("left", arguments, [energy])


def runge_kutta(rate: ca.Function) -> ca.Function:
    """One step of the classical method of order 4; inputs at its start, middle and end."""
    y, given = ca.MX.sym("y", *rate.size_in(0)), ca.MX.sym("given", rate.size1_in(1), 3)
    factors, step = ca.MX.sym("factors", 3), ca.MX.sym("step")
    first = rate(y, given[:, 0], factors)
    second = rate(y + step / 2 * first, given[:, 1], factors)
    third = rate(y + step / 2 * second, given[:, 1], factors)
    fourth = rate(y + step * third, given[:, 2], factors)
    after = y + step / 6 * (first + 2 * second + 2 * third + fourth)
    return ca.Function("step", [y, given, factors, step], [after])
