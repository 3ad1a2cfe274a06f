"""An instant of the problem's motion: expressions of its signals, for the rows of quantities.

Objectives take their peaks, and caps bound them. None of them grows with the number of modules.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
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
from studies.margin.available import needed_at_standstill
from studies.margin.loads import needed_of_the_motor
from studies.truss.config import TrussStudy
from studies.truss.motor_at_work import MotorAtWork

if TYPE_CHECKING:
    from ocp import Control, State


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
    """Angular acceleration; it is no signal where the rope force drives."""
    if signals.force is None:
        return signals.acceleration.symbol
    return angular_acceleration(
        signals.truss, signals.angle.symbol, signals.speed.symbol, signals.force.symbol, net
    )


def force_in(signals: Signals, net: Net) -> Any:
    """Rope force at the motor."""
    held, arm = _force_if_held(signals, net), signals.arm
    if arm is None:
        return held
    return held + arm.torque / rope_leverage(signals.truss, signals.angle.symbol)


def _force_if_held(signals: Signals, net: Net) -> Any:
    """The same of a ring whose fixed bar is held."""
    if signals.force is not None:
        return signals.force.symbol
    acceleration = signals.acceleration.symbol
    return rope_force(signals.truss, signals.angle.symbol, signals.speed.symbol, acceleration, net)


def force_of_acceleration(truss: TrussParameters, alpha: Any) -> Any:
    """Force on each rope for a unit of the rope's acceleration [N s^2/m]."""
    return -force_coefficients(truss, alpha).inertial / rope_speed(truss, alpha, 1.0)


@dataclass(frozen=True, eq=False)
class Instant:
    """An instant of a motion, in expressions. What the drive or the margins lack is empty.

    Attributes
    ----------
    net : the branch of the potential.
    reserve : in force and power of the rope and in what the motor does; None for none.
    """

    study: TrussStudy
    signals: Signals
    net: Net
    reserve: Reserve | None = None

    @property
    def arm(self) -> ArmSignals:
        """The arm that carries the ring."""
        assert self.signals.arm is not None
        return self.signals.arm

    @cached_property
    def acceleration(self) -> Any:
        """Of the angle."""
        return acceleration_in(self.signals, self.net)

    @property
    def _motion(self) -> tuple[Any, Any, Any]:
        return self.signals.angle.symbol, self.signals.speed.symbol, self.acceleration

    @cached_property
    def rope_speed(self) -> Any:
        """At which one rope is wound in."""
        alpha, omega, _ = self._motion
        return -rope_speed(self.signals.truss, alpha, omega)

    @cached_property
    def rope_acceleration(self) -> Any:
        """Second rate of the rope's length."""
        return rope_acceleration(self.signals.truss, *self._motion)

    @property
    def rope_jerk(self) -> Any:
        """Third rate of the rope's length, where the jerk is a signal."""
        assert self.signals.jerk is not None
        return rope_jerk(self.signals.truss, *self._motion, self.signals.jerk.symbol)

    @property
    def reaction(self) -> Any:
        """On the supporting arm, of a ring on a tip that is held."""
        return reaction_force(self.signals.truss, *self._motion)

    @cached_property
    def _force(self) -> Any:
        return force_in(self.signals, self.net)

    @cached_property
    def _pull(self) -> Any:
        """Force of the rope with its reserve."""
        if self.reserve is None:
            return self._force
        more = force_of_acceleration(self.signals.truss, self.signals.angle.symbol)
        return self._force + self.reserve.acceleration * more

    @cached_property
    def _of_all_trusses(self) -> tuple[tuple[Any, ...], ...] | None:
        """Rope forces and tensions at the far end of all trusses that move by the same law."""
        pull = self.signals.pull
        return None if pull is None else pull(*self._motion, self.net)

    @property
    def rope_forces(self) -> tuple[Any, ...]:
        """At the motor, of each truss."""
        return (self._pull,) if self._of_all_trusses is None else self._of_all_trusses[0]

    @property
    def far_end_tensions(self) -> tuple[Any, ...]:
        """Of the rope's last segment, of each truss."""
        if self._of_all_trusses is not None:
            return self._of_all_trusses[1]
        return (self._force * far_end_ratio(self.signals.truss, self.signals.angle.symbol),)

    @property
    def bar_forces(self) -> tuple[Any, ...]:
        """Extremes of the forces in bars, by their names."""
        return self._by_bar("Bars", extreme_bar_forces)

    @property
    def buckling_loads(self) -> tuple[Any, ...]:
        """Parts of the buckling loads of bars, by their names."""
        return self._by_bar("Shares", buckling_shares)

    def _by_bar(self, name: str, formula: Callable[..., Mapping[str, Any]]) -> tuple[Any, ...]:
        force = _force_if_held(self.signals, self.net)
        found = formula(self.signals.truss, *self._motion, force, self.net)
        return namedtuple(name, found)(*ca.cse(list(found.values())))

    @cached_property
    def motor(self) -> MotorAtWork:
        """One motor, with its reserve."""
        truss, winding = self.signals.truss, (self.rope_speed, -self.rope_acceleration)
        if (more := self.reserve) is not None:
            winding = self.rope_speed + more.speed, more.acceleration - self.rope_acceleration
        stowed, length = (
            rope_length(truss, angle) for angle in (truss.stowed_angle, self.signals.angle.symbol)
        )
        return MotorAtWork(self.study.drive, self._pull, *winding, stowed - length)

    @property
    def needed_of_the_motor(self) -> tuple[Any, ...]:
        """What the motor must be able to pull for the margins, in each load case."""
        margin, drive = self.study.margin, self.study.drive
        assert margin is not None
        truss, opening = self.signals.truss, self.study.opening
        return needed_of_the_motor(margin, truss, self._motion, self.net, drive, opening)

    @property
    def needed_at_standstill(self) -> tuple[Any, ...]:
        """The same of its stall force."""
        margin, drive = self.study.margin, self.study.drive
        assert margin is not None
        truss, opening = self.signals.truss, self.study.opening
        return needed_at_standstill(margin, drive, truss, self._motion, self.net, opening)
