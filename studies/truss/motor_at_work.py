"""What one motor of the ring does: the same formulas in a problem and along a motion."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from studies.drive.motor import motor_speed, motor_torque, rotor_force, shares_of_the_curve
from studies.drive.schema import Drive


@dataclass(frozen=True, eq=False)
class MotorAtWork:
    """One motor, in expressions or in arrays (m,). Of its shaft nothing is known without a drum.

    Attributes
    ----------
    drive : None where none is stated.
    pull : of the rope [N].
    speed, acceleration : at which the rope is wound in [m/s, m/s^2].
    wound : rope on the drum [m].
    """

    drive: Drive | None
    pull: Any
    speed: Any
    acceleration: Any
    wound: Any

    @cached_property
    def force(self) -> Any:
        """On its rope, that of its rotor included [N]."""
        return self.pull + rotor_force(self.drive, self.speed, self.acceleration, self.wound)

    @property
    def power(self) -> Any:
        """Of both motors at their ropes, that of their rotors included [W]."""
        return 2 * self.force * self.speed

    @property
    def _on_a_drum(self) -> Drive:
        assert self.drive is not None
        return self.drive

    @cached_property
    def shaft_speed(self) -> Any:
        """Of its shaft [rad/s]."""
        return motor_speed(self._on_a_drum, self.speed, self.wound)

    @cached_property
    def torque(self) -> Any:
        """Of its shaft [N m]."""
        return motor_torque(self._on_a_drum, self.force, self.wound)

    @property
    def torques(self) -> tuple[Any, ...]:
        """Of its shaft; a motor with a rotor brakes it, too [N m]."""
        brakes = self._on_a_drum.motor_inertia > 0.0
        return (self.torque, -self.torque) if brakes else (self.torque,)

    @property
    def loads(self) -> tuple[Any, ...]:
        """Shares of the torque-speed curve [1]."""
        return shares_of_the_curve(self._on_a_drum, self.shaft_speed, self.torque)
