"""Every quantity of a deployment as an expression of the problem's signals.

Objectives take their peaks, and caps bound them. None of them grows with the number of modules.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import casadi as ca

from models.truss import (
    Net,
    TrussParameters,
    angular_acceleration,
    buckling_shares,
    extreme_bar_forces,
    far_end_ratio,
    force_coefficients,
    reaction_force,
    rope_acceleration,
    rope_force,
    rope_jerk,
    rope_length,
    rope_leverage,
    rope_speed,
)
from studies.drive.motor import motor_speed, motor_torque, rotor_force, shares_of_the_curve
from studies.margin.available import needed_at_standstill
from studies.margin.loads import needed_of_the_motor
from studies.truss.config import TrussStudy

if TYPE_CHECKING:
    from ocp import Control, State

AT_THE_ROOT = ("peak-root-moment", "peak-root-momentum")

# whose greatest modulus counts; all others are never negative in a deployment, or may be
OF_BOTH_SIGNS = frozenset(
    (
        "peak-acceleration",
        "peak-rope-acceleration",
        "peak-rope-jerk",
        "peak-reaction",
        "peak-bar-force",
        *AT_THE_ROOT,
    )
)


@dataclass(frozen=True, eq=False)
class ArmSignals:
    """The arm that carries the ring.

    Attributes
    ----------
    coordinates, rates : of the arm (4,).
    accelerations : expressions of the rates of its rates (4,).
    torque : by which the ropes have to do more than on a tip that is held [N m].
    left : energy of arm and open ring where the ring stands still [J].
    moment, momentum : of the satellite on the arm about the root, and its integral [N m, N m s].
    """

    coordinates: tuple[State, ...]
    rates: tuple[State, ...]
    accelerations: tuple[Any, ...]
    torque: Any
    left: Any
    moment: Any
    momentum: Any


# of angle, speed, acceleration and branch of the net: rope forces and tensions at the far end [N]
Pull = Callable[[Any, Any, Any, Net], tuple[tuple[Any, ...], ...]]


@dataclass(frozen=True)
class Reserve:
    """What a rope may do beside a motion: limits of force, power and motor hold with it, too.

    Attributes
    ----------
    speed, acceleration : more of them, at any time [m/s, m/s^2].
    """

    speed: float = 0.0
    acceleration: float = 0.0


@dataclass(frozen=True, eq=False)
class Signals:
    """The signals of the problem, and the truss that they move.

    Attributes
    ----------
    truss : its parameters; a stand-in where some of them are unknowns.
    angle, speed, acceleration : the last one is an expression where a force drives.
    jerk, force : None where they are no signals.
    snap : rate of the jerk where that is a state, since the stretch of the ropes is planned.
    pull : of all the trusses that move by the same law; None where there is one.
    arm : that carries the ring; None where its fixed bar is held.
    """

    truss: TrussParameters
    angle: State
    speed: State
    acceleration: Any
    jerk: Control | State | None
    force: Control | None
    pull: Pull | None = None
    arm: ArmSignals | None = None
    snap: Control | None = None


def acceleration_in(signals: Signals, net: Net) -> Any:
    """Angular acceleration as a signal or, where the rope force drives, as an expression."""
    if signals.force is None:
        return signals.acceleration
    return angular_acceleration(
        signals.truss, signals.angle.symbol, signals.speed.symbol, signals.force.symbol, net
    )


def force_in(signals: Signals, net: Net) -> Any:
    """Rope force at the motor as a signal or as an expression."""
    held, arm = _force_if_held(signals, net), signals.arm
    if arm is None:
        return held
    return held + arm.torque / rope_leverage(signals.truss, signals.angle.symbol)


def _force_if_held(signals: Signals, net: Net) -> Any:
    """The same of a ring whose fixed bar is held."""
    if signals.force is not None:
        return signals.force
    acceleration = signals.acceleration.symbol
    return rope_force(signals.truss, signals.angle.symbol, signals.speed.symbol, acceleration, net)


def force_of_acceleration(truss: TrussParameters, alpha: Any) -> Any:
    """Force on each rope for a unit of the rope's acceleration [N s^2/m]."""
    return -force_coefficients(truss, alpha).inertial / rope_speed(truss, alpha, 1.0)


def expressions(
    study: TrussStudy, signals: Signals, net: Net, reserve: Reserve | None = None
) -> Mapping[str, tuple[Any, ...]]:
    """What is limited or minimised, by quantity; the largest of several counts.

    Parameters
    ----------
    net : the branch of the potential.
    reserve : in force and power of the rope and in what the motor does.

    Returns
    -------
    mapping of str to tuple
        Those of the motor only where the drive is stated, the rope's jerk only where it is limited.
    """
    truss, drive, margin = signals.truss, study.drive, study.margin
    alpha, omega = signals.angle.symbol, signals.speed.symbol
    signal_or_expression = acceleration_in(signals, net)
    acceleration = getattr(signal_or_expression, "symbol", signal_or_expression)
    force, held = (
        getattr(one, "symbol", one)
        for one in (force_in(signals, net), _force_if_held(signals, net))
    )
    speed = -rope_speed(truss, alpha, omega)
    of_the_rope = rope_acceleration(truss, alpha, omega, acceleration)
    hauling, hauled_faster, pull = speed, -of_the_rope, force
    if reserve is not None:
        hauling = speed + reserve.speed
        hauled_faster = reserve.acceleration - of_the_rope
        pull = force + reserve.acceleration * force_of_acceleration(truss, alpha)
    hauled = rope_length(truss, truss.stowed_angle) - rope_length(truss, alpha)
    of_the_motor = pull + rotor_force(drive, hauling, hauled_faster, hauled)

    found: dict[str, tuple[Any, ...]] = {
        "peak-acceleration": (acceleration,),
        "peak-rope-speed": (speed,),
        "peak-rope-acceleration": (of_the_rope,),
        "peak-reaction": (reaction_force(truss, alpha, omega, acceleration),),
        "peak-force": (pull,),
        "peak-power": (2 * of_the_motor * hauling,),
    }
    # tensions fall along the rope, so that the last segment has the least of all
    found["least-tension"] = found["peak-far-end-tension"] = (force * far_end_ratio(truss, alpha),)

    if signals.pull is not None:
        forces, tensions = signals.pull(alpha, omega, acceleration, net)
        found["peak-force"] = forces
        found["least-tension"] = found["peak-far-end-tension"] = tensions

    state = (truss, alpha, omega, acceleration, held, net)
    bars, shares = extreme_bar_forces(*state), buckling_shares(*state)
    found["peak-bar-force"] = namedtuple("Bars", bars)(*ca.cse(list(bars.values())))
    found["peak-buckling-load"] = namedtuple("Shares", shares)(*ca.cse(list(shares.values())))

    if (arm := signals.arm) is not None:
        found |= {"peak-root-moment": (arm.moment,), "peak-root-momentum": (arm.momentum,)}
    if signals.jerk is not None:
        jerk = rope_jerk(truss, alpha, omega, acceleration, signals.jerk.symbol)
        found["peak-rope-jerk"] = (jerk,)
    if margin is not None:
        motion = alpha, omega, acceleration
        needed = needed_of_the_motor(margin, truss, *motion, net, drive)
        found["peak-factored-force"] = needed
        if at_standstill := needed_at_standstill(margin, drive, truss, *motion, net):
            found["peak-stall-force"] = at_standstill
    if drive is not None and drive.drum_radius is not None:
        shaft = motor_speed(drive, hauling, hauled)
        torque = motor_torque(drive, of_the_motor, hauled)
        found |= {
            "peak-motor-speed": (shaft,),
            "peak-motor-torque": (torque,),
            "peak-motor-load": shares_of_the_curve(drive, shaft, torque),
        }
        if drive.motor_inertia > 0.0:  # the motor brakes its rotor, too
            found["peak-motor-torque"] = (torque, -torque)
            found["peak-motor-force"] = (of_the_motor, -of_the_motor)
    return found
