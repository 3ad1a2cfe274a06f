"""Copies of an arm that share one drive, for a motion that suits them all.

Under torque drive the copies share the nominal arm's torque; under angle drive their joint
follows the nominal arm's angle.

Symbols: q, v coordinates and rates of B21, z those of them that are elastic, tau torque [N m].
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from models.arm.driven import DrivenArm
from models.arm.lock import energy_after_lock, lock_terms
from models.arm.reduced import ReducedArm
from ocp.arrays import Array
from studies.arm.optimal.motion import OptimalMotion
from studies.arm.optimal.phase import (
    Drives,
    accelerations,
    column,
    equations_of_motion,
    reduced_signals,
    sampled_guess,
)
from studies.arm.questions.robust.spread import Spread
from studies.arm.replay.reduced_model import paths
from studies.arm.stage import Stage


@dataclass(frozen=True, eq=False)
class ArmCopy:
    """One arm in the problem.

    Attributes
    ----------
    model : its equations.
    q, v : (n, 1) expressions of all its coordinates and rates.
    acceleration : expressions of the rates of its velocity states.
    dynamics, initial, guess : of its states.
    """

    model: ReducedArm
    q: Any
    v: Any
    acceleration: tuple[Any, ...]
    dynamics: dict[Any, Any]
    initial: dict[Any, Any]
    guess: dict[Any, Any]


@dataclass(frozen=True, eq=False)
class SampledMotion:
    """A motion to start from, of the nominal arm and, on an angle, of each copy.

    Attributes
    ----------
    times : (m,) [s].
    q, v : (n, m) of the nominal arm. Under torque copies start from the same: from motions of their
        own the solver took no fewer iterations there.
    torque, rate : (m,) [N m], [N m/s].
    own : (k, 2 n, m) elastic coordinates and rates of k copies on the angle; empty under torque.
    """

    times: Array
    q: Array
    v: Array
    torque: Array
    rate: Array
    own: Array


def replayed_motion(motion: OptimalMotion, spread: Spread) -> SampledMotion:
    """A motion already found, of all arms of a spread's design."""
    run, law = motion.reduced, motion.torques[motion.stage.moving[0]]
    design = [spread.factors(x, y) for x, y in spread.design]
    on_angle = spread.drive == "angle"
    return SampledMotion(
        run.times,
        run.q,
        run.v,
        law(run.times),
        rate=law.derivative()(run.times),
        own=paths(motion.motion("angle"), design, len(run.times)) if on_angle else np.empty(0),
    )


def torque_copy(stage: Stage, drives: Drives, start: SampledMotion) -> ArmCopy:
    """The nominal arm, under the torque."""
    return _under_torque(stage, drives, start, "", range(stage.model.size))


def other_torque_copy(stage: Stage, drives: Drives, start: SampledMotion, suffix: str) -> ArmCopy:
    """Another arm under the same torque, without the angles that nothing else depends on.

    No elastic motion depends on where the whole arm points to, and the other arms need not arrive.
    """
    model = stage.model
    q, v = ca.SX.sym("q", model.size), ca.SX.sym("v", model.size)
    mass, force = model.mass_and_force(q, v, ca.DM.zeros(2))
    felt = ca.jacobian(ca.vertcat(ca.vec(mass), force), q).sparsity().get_col()
    return _under_torque(stage, drives, start, suffix, sorted(set(felt)))


def _under_torque(
    stage: Stage, drives: Drives, start: SampledMotion, suffix: str, places: Iterable[int]
) -> ArmCopy:
    """An arm under the torque, of whose coordinates those at `places` are states."""
    model = stage.model
    q, v = reduced_signals(stage, start.q, suffix)
    acceleration = accelerations(model, q, v, drives)

    pose = dict(zip(q, map(float, model.at(*stage.start)), strict=True))
    guess = sampled_guess((*q, *v), start.times, (*start.q, *start.v))
    kept = (*(q[k] for k in places), *v)
    rates = equations_of_motion(q, v, acceleration)
    return ArmCopy(
        model=model,
        q=column(q),
        v=column(v),
        acceleration=acceleration,
        dynamics={state: rates[state] for state in kept},
        initial={state: pose.get(state, 0.0) for state in kept},
        guess={state: guess[state] for state in kept},
    )


def angle_copy(
    stage: Stage, start: SampledMotion, own: Array, nominal: ArmCopy, suffix: str
) -> ArmCopy:
    """An arm whose joint follows that of the nominal one: its elastic coordinates only.

    `own` (2 n, m) is how the arm itself moves on the angle to start from. From the motion of the
    nominal arm, which is none of its own, the solver took up to half as many iterations more.
    """
    driven = DrivenArm(stage.reduced(tied=False))
    places = list(driven.elastic)
    z, rate = (tuple(x[k] for k in places) for x in reduced_signals(stage, start.q, suffix))

    # the nominal arm's joint with its first two derivatives
    s = driven.angle(nominal.q)
    turn = ca.jtimes(s, nominal.q, nominal.v)
    spin = ca.jtimes(turn, nominal.q, nominal.v)
    spin += ca.jtimes(s, nominal.q, ca.vertcat(*nominal.acceleration))

    values = driven.acceleration(column(z), column(rate), s, turn, spin)
    acceleration = tuple(values[i] for i in range(values.numel()))
    q, v = driven.motion(column(z), column(rate), s, turn)
    return ArmCopy(
        model=driven.model,
        q=q,
        v=v,
        acceleration=acceleration,
        dynamics=equations_of_motion(z, rate, acceleration),
        initial=dict.fromkeys((*z, *rate), 0.0),
        guess=sampled_guess((*z, *rate), start.times, own),
    )


def residual_energy(stage: Stage, copy: ArmCopy) -> Any:
    """E_res [J] of a copy if its joint locked now."""
    q, v = (ca.SX.sym(name, copy.model.size) for name in "qv")
    energy = energy_after_lock(*lock_terms(copy.model, stage.moving, q, v))
    return ca.Function("left", [q, v], [energy])(copy.q, copy.v)
