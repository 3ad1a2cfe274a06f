"""Replays on the reduced model B21: one arm, or many arms abreast, by fixed Runge-Kutta steps.

Mass matrix, force and strain energy are affine in the stiffness of each link and in the tip
mass, so that those of any arm are combined from four arms' expressions.

Symbols: q, v coordinates and rates; z the elastic coordinates; y state of an arm, (q, v) under
torque and (z, zdot) on a given angle.
"""

from __future__ import annotations

import dataclasses
import math
import shutil
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from models.ancf.joints import Driven, Torque
from models.arm.driven import DrivenArm
from models.arm.lock import energy_after_lock, lock_reduced, lock_terms
from models.arm.parameters import ArmParameters
from models.arm.reduced import ReducedArm, solve_small
from models.arm.reduced_simulation import Method, ReducedMotion, reduced_modes
from ocp.arrays import Array
from studies.arm.replay.full_model import Drive, Motion
from studies.arm.stage import ELBOW, ROOT, Stage
from studies.common.processes.pool import interrupts_wait

Factors = tuple[float, float, float]
"""(big stiffness, small stiffness, tip mass) of an arm over the nominal one's."""
NOMINAL: Factors = (1.0, 1.0, 1.0)
STEP = 0.0025  # [s], or less where that is not stable
STABLE = 2.6  # step times rate, in all directions to the left of the imaginary axis
STEPS = 16000  # of one arm followed, or more
_MANY = 15_000  # steps of single arms from which compiled code pays: it takes half a second
# Periods of the fastest mode beyond which explicit steps take a minute. No mode swings through so
# slow a motion, so that implicit steps are long, and as exact.
_MANY_PERIODS = 3e4
_OFF = 0.1  # factor less one of the arms that are combined; any would do, as all is affine


def varied(arm: ArmParameters, factors: Factors) -> ArmParameters:
    """The arm with its stiffnesses and its tip mass times factors."""
    big, small, mass = factors
    return dataclasses.replace(
        arm,
        big=dataclasses.replace(arm.big, bending_stiffness=big * arm.big.bending_stiffness),
        small=dataclasses.replace(arm.small, bending_stiffness=small * arm.small.bending_stiffness),
        tip_mass=mass * arm.tip_mass,
    )


def method_for(model: ReducedArm, angles: tuple[float, float], duration: float) -> Method:
    """Integrator for an optimum on a reduced model that starts at (theta1, theta2) [rad]."""
    fastest = float(reduced_modes(model, model.at(*angles))[0][-1])
    return "Radau" if fastest * duration > _MANY_PERIODS else "DOP853"


def reduced_residual(stage: Stage, motion: ReducedMotion) -> float:
    """E_res on a reduced model after locking the joints that turned [J]."""
    locked, q, v = lock_reduced(
        motion.model,
        motion.q[:, -1],
        motion.v[:, -1],
        root=ROOT in stage.moving,
        elbow=ELBOW in stage.moving,
    )
    return sum(float(energy) for energy in locked.energies(q, v))


@dataclass(frozen=True, eq=False)
class ArmEquations:
    """Equations of one joint's motion, for the arm of any factors.

    Attributes
    ----------
    step : `(y, inputs, factors, length) -> y` after one step of the method of order 4; the inputs
        at its start, middle and end are the torque [N m], or the joint's angle with its first two
        derivatives.
    energy : `(y, input, factors) -> E_res` [J] if the joint locked now.
    start : (n,) y at the start, at rest.
    """

    step: ca.Function
    energy: ca.Function
    start: Array


def residuals(
    motion: Motion,
    points: Sequence[Factors],
    step: float | None = None,
    live: Callable[[str], None] | None = None,
) -> Array:
    """E_res on B21 [J] at each point, (m,), after the lock.

    Parameters
    ----------
    motion : Motion
        Its torque, or its angle, is applied to every arm.
    points : (big stiffness, small stiffness, tip mass) factors of each arm.
    step : float, optional
        [s]; the longest that is stable and not above `STEP`, unless stated.
    live : callable, optional
        Receives a line now and then.
    """
    stage, factors = motion.stage, np.array(points).T
    if step is None:
        step = _stable_step(motion, points)
    steps, arms = int(np.ceil(stage.duration / step)), len(points)
    inputs = _inputs(motion, steps)
    equations = arm_equations(stage, motion.drive, compiled=steps * arms > _MANY)
    advance = _abreast(equations, arms)

    def each_step() -> Iterator[Array]:
        for k in range(steps):
            if live is not None:
                done = f"{motion.stage.duration * k / steps:.2f} of {motion.stage.duration:g} s"
                live(f"{motion.name}: {arms} arms on B21, {done}")
            yield inputs[:, 2 * k : 2 * k + 3]

    state = march(
        advance,
        np.tile(equations.start[:, None], arms),
        each_step(),
        factors,
        stage.duration / steps,
    )
    energy = equations.energy.map("energy", "serial", arms, [1], [])
    return np.asarray(energy(state, inputs[:, -1], factors).full())[0]


def paths(motion: Motion, points: Sequence[Factors], samples: int, steps: int = 1) -> Array:
    """States at even instants of arms that share a motion's drive, (m, n, samples).

    A state is (q, v) under torque, and elastic coordinates with their rates on an angle. `points`
    are as for `residuals`; `steps` is the least number of steps.
    """
    stage, factors = motion.stage, np.array(points).T
    least = max(steps, stage.duration / _stable_step(motion, points))
    each = int(np.ceil(least / (samples - 1)))  # steps from sample to sample
    steps, arms = each * (samples - 1), len(points)
    inputs = _inputs(motion, steps)
    equations = arm_equations(stage, motion.drive, compiled=steps * arms > _MANY)
    # all steps from sample to sample in one call: each takes longer to begin than a step does
    along = _abreast(equations, arms).mapaccum("along", each)
    now = (2 * np.arange(each)[:, None] + np.arange(3)).ravel()

    path = np.empty((samples, len(equations.start), arms))
    path[0] = equations.start[:, None]
    for k in range(samples - 1):
        given = inputs[:, 2 * k * each + now], np.tile(factors, each), stage.duration / steps
        path[k + 1] = along(path[k], *given).full()[:, -arms:]
    return path.transpose(2, 1, 0)


def _inputs(motion: Motion, steps: int) -> Array:
    """What the drive gives at starts, middles and ends of even steps, (k, 2 steps + 1)."""
    joint = motion.joints[motion.stage.moving[0]]
    half_steps = np.linspace(0.0, motion.stage.duration, 2 * steps + 1)
    if isinstance(joint, Torque):
        return np.asarray(joint.torque(half_steps)[None])
    if isinstance(joint, Driven):
        return np.stack(joint.law(half_steps))
    raise ValueError(f"{motion.name}: the joint is neither under torque nor on an angle")


def _stable_step(motion: Motion, points: Sequence[Factors]) -> float:
    """Step [s] of the method of order 4 for a motion of arms of some factors."""
    return min(STEP, STABLE / fastest_rate(motion.stage, motion.drive, points))


def fastest_rate(stage: Stage, drive: Drive, points: Sequence[Factors] = (NOMINAL,)) -> float:
    """Upper bound of the rates [1/s] of all modes of B21 along a stage, of arms of some factors.

    The rate of a mode is the size of its exponents: its angular frequency, or what is faster in a
    mode that is damped beyond its critical damping. With more stiffness and less mass all
    frequencies rise, and a joint that is held raises none above the highest.
    """
    stiffest = max(max(big, small) for big, small, _ in points)
    lightest = min(1.0, *(mass for _, _, mass in points))
    frequency = _highest_frequency(stage.lasting(1.0), drive) * math.sqrt(stiffest / lightest)
    return _rate(frequency, stage.arm)


def _rate(frequency: float, arm: ArmParameters) -> float:
    """Size [1/s] of the faster exponent of a mode of an angular frequency [rad/s]."""
    # the damping of the links goes with their stiffness, so that of a mode with its frequency
    ratio = 0.5 * arm.relaxation_time * frequency
    return frequency * (ratio + math.sqrt(ratio**2 - 1.0) if ratio > 1.0 else 1.0)


@lru_cache(maxsize=8)
def _highest_frequency(stage: Stage, drive: Drive) -> float:
    """Angular frequency [rad/s] of the fastest mode of B21 along a stage."""
    model = stage.model if drive == "torque" else stage.reduced(tied=False)
    poses = (np.array(stage.start) + share * stage.turn for share in np.linspace(0.0, 1.0, 9))
    return 2 * math.pi * max(float(reduced_modes(model, model.at(*a))[0][-1]) for a in poses)


def _abreast(equations: ArmEquations, arms: int) -> ca.Function:
    """One step of many arms, for which the inputs and its length are the same."""
    return equations.step.map("advance", "serial", arms, [1, 3], [])


def march(
    advance: ca.Function, state: Any, inputs: Iterable[Array], factors: Array, step: Any
) -> Any:
    """The state after one step for each of the inputs (at its start, middle and end)."""
    for now in inputs:
        state = advance(state, now, factors, step)
    return state


def follow(motion: Motion, samples: int) -> ReducedMotion:
    """The motion of the nominal arm under torque on B21 at even instants, with `STEPS` or more."""
    stage = motion.stage
    q, v = np.split(paths(motion, (NOMINAL,), samples, STEPS)[0], 2)
    nodes = stage.model.to_nodes(q, v, 1)[0]
    times = np.linspace(0.0, stage.duration, samples)
    return ReducedMotion(stage.model, times, q, v, tip=nodes[12:14], elbow=nodes[4:6])


def runge_kutta(rate: ca.Function, compiled: bool = False) -> ca.Function:
    """One step of the classical method of order 4; inputs at its start, middle and end."""
    y, given = ca.MX.sym("y", *rate.size_in(0)), ca.MX.sym("given", rate.size1_in(1), 3)
    factors, step = ca.MX.sym("factors", 3), ca.MX.sym("step")
    first = rate(y, given[:, 0], factors)
    second = rate(y + step / 2 * first, given[:, 1], factors)
    third = rate(y + step / 2 * second, given[:, 1], factors)
    fourth = rate(y + step * third, given[:, 2], factors)
    after = y + step / 6 * (first + 2 * second + 2 * third + fourth)
    with interrupts_wait():  # Ctrl-C would end the compiler, and the function would not be built
        return ca.Function("step", [y, given, factors, step], [after], _options(compiled))


def arm_equations(stage: Stage, drive: Drive, compiled: bool = False) -> ArmEquations:
    """The equations of a stage that turns one joint, which do not depend on how long it lasts.

    Parameters
    ----------
    stage : Stage
    drive : "torque" or "angle"
    compiled : bool
        Whether to have the step compiled, if gcc is at hand.
    """
    return _equations(stage.lasting(1.0), drive, compiled)


@lru_cache(maxsize=8)
def _equations(stage: Stage, drive: Drive, compiled: bool) -> ArmEquations:
    if drive == "torque":
        state, given, start, mechanics, place = _under_torque(stage)
    else:
        state, given, start, mechanics, place = _on_angle(stage)
    factors = ca.SX.sym("factors", 3)

    speed = state[state.numel() // 2 :]
    acceleration = ca.vertcat(*solve_small(*_affine(stage, factors, mechanics)))
    rate = ca.vertcat(speed, acceleration)

    arguments = [state, given, factors]
    # compiled as a whole: with the rates alone, a step would take twice as long
    return ArmEquations(
        step=runge_kutta(ca.Function("rate", arguments, [rate], {"cse": True}), compiled),
        energy=ca.Function("left", arguments, [_energy(stage, factors, drive, *place)]),
        start=start,
    )


_Mechanics = Callable[[ArmParameters], tuple[Any, ...]]
_Parts = tuple[Any, Any, Array, _Mechanics, tuple[Any, Any]]


def _under_torque(stage: Stage) -> _Parts:
    """State (q, v), input tau, start, mass matrix and force of an arm, and its (q, v)."""
    model, joint = stage.model, stage.moving[0]
    q, v = ca.SX.sym("q", model.size), ca.SX.sym("v", model.size)
    given = ca.SX.sym("tau")
    torque = ca.vertcat(*(given if k == joint else ca.SX(0) for k in (ROOT, ELBOW)))

    def mechanics(arm: ArmParameters) -> tuple[Any, ...]:
        return stage.reduced(arm).mass_and_force(q, v, torque)

    start = np.concatenate((model.at(*stage.start), np.zeros(model.size)))
    return ca.vertcat(q, v), given, start, mechanics, (q, v)


def _on_angle(stage: Stage) -> _Parts:
    """State (z, zdot), input (s, sdot, sddot), start, mass matrix and force, and its (q, v)."""
    nominal = DrivenArm(stage.reduced(tied=False))
    n = len(nominal.elastic)
    z, rate = ca.SX.sym("z", n), ca.SX.sym("zdot", n)
    given = ca.SX.sym("s", 3)

    def mechanics(arm: ArmParameters) -> tuple[Any, ...]:
        return DrivenArm(stage.reduced(arm, tied=False)).balance(
            z, rate, given[0], given[1], given[2]
        )

    place = nominal.motion(z, rate, given[0], given[1])
    return ca.vertcat(z, rate), given, np.zeros(2 * n), mechanics, place


def _energy(stage: Stage, factors: Any, drive: Drive, q: Any, v: Any) -> Any:
    """E_res [J] of the arm of some factors at coordinates q and rates v."""
    x, y = ca.SX.sym("x", stage.model.size), ca.SX.sym("y", stage.model.size)

    def locked(arm: ArmParameters) -> tuple[Any, ...]:
        return lock_terms(stage.reduced(arm, tied=drive == "torque"), stage.moving, x, y)

    energy = energy_after_lock(*_affine(stage, factors, locked))
    # as a function of symbols first: the terms are shared instead of repeated
    return ca.Function("left", [x, y, factors], [energy])(q, v, factors)


def _affine(stage: Stage, factors: Any, build: _Mechanics) -> tuple[Any, ...]:
    """What `build` makes of an arm, for the arm of any factors (3, 1)."""
    nominal = build(stage.arm)
    combined = list(nominal)
    for k in range(3):
        off = list(NOMINAL)
        off[k] += _OFF
        other = build(varied(stage.arm, (off[0], off[1], off[2])))
        for i, (there, here) in enumerate(zip(other, nominal, strict=True)):
            combined[i] = combined[i] + (factors[k] - 1.0) / _OFF * (there - here)
    return tuple(combined)


def _options(compiled: bool) -> dict[str, Any]:
    """Options of a function that is evaluated often."""
    if not (compiled and shutil.which("gcc")):
        return {}
    flags = {"flags": ["-O2"], "directory": f"{tempfile.gettempdir()}/"}
    return {"jit": True, "compiler": "shell", "jit_options": flags}
