"""What the user asks of stage 2: how far the antenna turns, in what time, and under which caps."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from models.errors import ModelError
from models.truss import TrussParameters
from models.turn import TurnParameters, stowed_ring_inertia, torsion_stiffness
from models.turn.parameters import POISSON
from studies.arm.config import ArmStudy, check_wheels
from studies.common.arm_description import ArmDescription
from studies.common.configuration import (
    check,
    choice,
    finite,
    from_mapping,
    key,
    key_of,
    positive,
    section,
)
from studies.common.exit_codes import StudyError
from studies.truss.carrier import CarryingArm
from studies.truss.config import ring_in_space

OBJECTIVES = ("peak-torque", "time", "utilisation")
FULL_TURN = 360.0  # [deg]


def _turned(name: str, value: Any) -> float:
    """An angle above zero and at most a full turn."""
    angle = positive(name, value)
    if angle > FULL_TURN:
        raise StudyError(f"{name} is {angle:g} deg; give at most {FULL_TURN:g}")
    return angle


@dataclass(frozen=True, kw_only=True)
class TurnStudy:
    """The turn of the folded antenna about the axis of the big arm, from rest to rest.

    Attributes
    ----------
    minimise : "peak-torque" in the duration, "time" under the caps, or "utilisation", the largest
        part of the caps on torque and momentum that is used in the duration.
    angle_deg : by which the antenna turns.
    duration : duration of the turn; for the minimum time, the longest one to try [s].
    torque : cap on the torque in the big arm, which the drive gives [N m].
    residual_energy : cap on the swing that remains when the drive stops [J].
    drive_acceleration : cap on the acceleration of the drive's angle [rad/s^2].
    poisson : Poisson's ratio of the big arm's tube.
    satellite_inertia : about that axis, of a satellite that is free to turn [kg m^2]; None for one
        that is held.
    wheel_torque, wheel_momentum : caps on what a held one takes [N m, N m s].
    truss, arm : the stowed ring; the arm, whose `tip_mass` is the mass of the antenna.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """

    minimise: str = key(
        choice(OBJECTIVES),
        "",
        "peak-torque, time (under the caps) or utilisation (of the caps on torque and momentum)",
        default="peak-torque",
    )
    angle_deg: float = key(_turned, "deg", "by which the antenna turns", default=90.0)
    duration: float = key(
        positive,
        "s",
        "duration of the turn; for the minimum time, the longest one to try",
        default=5.0,
    )
    torque: float = key(positive, "N m", "cap on the torque in the big arm", default=5.0)
    residual_energy: float = key(
        positive, "J", "cap on the swing that remains when the drive stops", default=1e-6
    )
    drive_acceleration: float = key(
        positive, "rad/s^2", "cap on the drive's acceleration, an assumption", default=2.0
    )
    poisson: float = key(
        finite, "", "Poisson's ratio of the big arm's tube, an assumption", default=POISSON
    )
    satellite_inertia: float | None = key_of(CarryingArm, "satellite_inertia")
    wheel_torque: float | None = key_of(ArmStudy, "wheel_torque")
    wheel_momentum: float | None = key_of(ArmStudy, "wheel_momentum")
    truss: TrussParameters = key(
        ring_in_space,
        "",
        "the ring, with the keys of a study of the truss",
        factory=TrussParameters,
        flags=(),
    )
    arm: ArmDescription = key(
        section(ArmDescription), "", "the arm; its tip_mass is the antenna", factory=ArmDescription
    )

    def __post_init__(self) -> None:
        check(self)
        check_wheels(self)
        assert self.parameters  # made once here, so that what cannot turn is said early

    @cached_property
    def parameters(self) -> TurnParameters:
        """The antenna on the big arm, as the satellite sees it.

        Raises
        ------
        StudyError
            If the antenna has no mass, or the ratio is none of a material.
        """
        try:
            turn = TurnParameters(
                stowed_ring_inertia(self.truss, self.arm.tip_mass),
                torsion_stiffness(self.arm.parameters, self.poisson),
            )
        except ModelError as error:
            raise StudyError(str(error)) from error
        H = self.satellite_inertia
        return turn if H is None else turn.on_free_satellite(H)

    @property
    def most_torque(self) -> float:
        """Of the drive [N m]: a held satellite takes as much."""
        return self.torque if self.wheel_torque is None else min(self.torque, self.wheel_torque)

    @property
    def angle(self) -> float:
        """D [rad]."""
        return math.radians(self.angle_deg)

    @property
    def question(self) -> str:
        """What is asked, in one line."""
        what = f"Antenna turned by {self.angle_deg:g} deg about the big arm"
        if self.minimise == "time":
            return f"{what}: minimum time under {self.most_torque:g} N m"
        aim = "peak torque" if self.minimise == "peak-torque" else "utilisation"
        return f"{what} in {self.duration:g} s: least {aim}"


def study_from(raw: Mapping[str, Any]) -> TurnStudy:
    """Check a nested dictionary and return the study it states.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """
    return from_mapping(TurnStudy, raw)
