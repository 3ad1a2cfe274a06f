"""What the user asks of a whole deployment: its time, its dwells, and what each stage may use."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from models.truss import TrussParameters
from studies.arm.config import ArmStudy, check_wheels
from studies.arm.optimal.objectives import RESIDUAL
from studies.common.arm_description import ArmDescription
from studies.common.configuration import (
    boolean,
    check,
    choice,
    from_mapping,
    key,
    key_of,
    not_negative,
    optional_key,
    positive,
    section,
    whole,
)
from studies.common.exit_codes import ExitCode, StudyError
from studies.truss.carrier import CarryingArm
from studies.truss.config import ring_in_space
from studies.truss.limits.caps import jerk_cap
from studies.turn.config import TurnStudy

AIMS = ("utilisation", "time")
TOTAL = 36.0  # [s], where none is stated
DWELLS = 4  # one after each stage
TURNED_DEG = 90.0  # about the big arm: the elbow's axis is normal to the root's then
SPARE_ACCELERATION = 1.25  # over what a rigid arm needs, so that the twist can come to rest


@dataclass(frozen=True, kw_only=True)
class MissionStudy:
    """The whole deployment: big arm, turn, small arm, ring; each latches before the next.

    Attributes
    ----------
    least : "utilisation" for the least largest one in `total`, "time" for the least total under
        the caps.
    total : of stages and dwells [s]; None for the least one, which is what is found.
    dwell : dwell after each stage, for its latch and what has to come to rest [s].
    big_torque, small_torque : caps on the root's and the elbow's torque [N m].
    turn_torque, turn_acceleration : caps on the drive that turns the antenna about the big arm
        [N m, rad/s^2].
    residual_energy : cap on what each lock of the arm leaves, and the ring when it is open [J].
    rope_force, reaction : caps on the ring's motor and on what the arm feels of it [N].
    jerk : cap on the jerk of the ring's angle, as of a study of the truss.
    reaction_angle_deg : from the straight arm to the ring's centre; 90 bends it most.
    ring_turns : whether the ring turns with the tip; if not, its mass is a particle there.
    satellite_inertia : of a satellite that is free to turn about the root, the same about each
        axis [kg m^2]; None for one that is held.
    wheel_torque, wheel_momentum : caps on what a held one takes [N m, N m s].
    refine : whether motions of the arm are refined until the full model rests.
    intervals : of the meshes of the arm's motions, 0 for those of `antenna-ocp arm`.
    truss, arm : the ring and the arm.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """

    least: str = key(
        choice(AIMS), "", "utilisation (in total) or time (under the caps)", default="utilisation"
    )
    total: float | None = optional_key(
        positive, "s", "time of all stages and dwells; by default 36, or none for the minimum time"
    )
    dwell: float = key(not_negative, "s", "dwell after each stage, for its latch", default=2.0)
    big_torque: float = key(positive, "N m", "cap on the torque at the root", default=5.0)
    small_torque: float = key(positive, "N m", "cap on the torque at the elbow", default=12.0)
    turn_torque: float = key(
        positive, "N m", "cap on the torque that turns the antenna about the big arm", default=5.0
    )
    turn_acceleration: float = key(
        positive, "rad/s^2", "cap on the acceleration of that drive", default=2.0
    )
    residual_energy: float = key(
        positive,
        "J",
        "cap on the residual energy after each lock of the arm, and after the ring",
        default=RESIDUAL,
    )
    rope_force: float = key(positive, "N", "cap on the ring's force on one rope", default=60.0)
    reaction: float = key(positive, "N", "cap on the reaction of the ring on the arm", default=5.0)
    jerk: Any = key(
        jerk_cap,
        "rad/s^3",
        "cap on the jerk of the ring's angle, or 500/T^3, bezier, step5",
        default="500/T^3",
    )
    reaction_angle_deg: float = key_of(CarryingArm, "reaction_angle_deg")
    ring_turns: bool = key_of(CarryingArm, "ring_turns")
    satellite_inertia: float | None = key_of(CarryingArm, "satellite_inertia")
    wheel_torque: float | None = key_of(ArmStudy, "wheel_torque")
    wheel_momentum: float | None = key_of(ArmStudy, "wheel_momentum")
    refine: bool = key(
        boolean,
        "",
        "maximum number of rounds of the arm until the full model is at rest",
        default=True,
    )
    intervals: int = key(
        whole(0, 2000), "", "of the arm's meshes; 0 for those of arm solve", default=0
    )
    truss: TrussParameters = key(
        ring_in_space,
        "",
        "the ring, with the keys of a study of the truss",
        factory=TrussParameters,
        flags=(),
    )
    arm: ArmDescription = key(section(ArmDescription), "", "the arm", factory=ArmDescription)

    def __post_init__(self) -> None:
        check(self)
        assert self.carrier.with_ring(self.truss)  # a ring that is too heavy is said early
        check_wheels(self)
        if self.least == "time":
            if self.total is not None:
                raise StudyError(
                    f"total is {self.total:g} s, but with least = time the total is the result; "
                    "remove total, or use least = utilisation"
                )
            return
        if self.total is None:
            object.__setattr__(self, "total", TOTAL)
        if self.moving <= 0.0:
            raise StudyError(
                f"total is {self.total:g} s, but four dwells of {self.dwell:g} s leave no time "
                "for motions; give a longer total, or shorter dwells",
                ExitCode.INFEASIBLE,
            )

    @property
    def carrier(self) -> CarryingArm:
        """The arm as a study of the truss reads it."""
        return CarryingArm(
            **dataclasses.asdict(self.arm),
            reaction_angle_deg=self.reaction_angle_deg,
            ring_turns=self.ring_turns,
            satellite_inertia=self.satellite_inertia,
        )

    @property
    def moving(self) -> float:
        """Time for the motions of all stages [s], of a mission with a total."""
        assert self.total is not None
        return self.total - DWELLS * self.dwell

    def turn(self, duration: float) -> TurnStudy:
        """The turn about the big arm as a study of its own, in a time [s].

        In a time too short for its drive it takes as much acceleration as it needs.
        """
        needed = SPARE_ACCELERATION * 4.0 * math.radians(TURNED_DEG) / duration**2
        return TurnStudy(
            minimise="utilisation",
            angle_deg=TURNED_DEG,
            duration=duration,
            torque=self.turn_torque,
            residual_energy=self.residual_energy,
            drive_acceleration=max(self.turn_acceleration, needed),
            satellite_inertia=self.satellite_inertia,
            wheel_torque=self.wheel_torque,
            wheel_momentum=self.wheel_momentum,
            truss=self.truss,
            arm=self.arm,
        )

    @property
    def question(self) -> str:
        """What is asked, in one line."""
        if self.least == "time":
            return (
                f"big arm, turn, small arm, ring, {self.dwell:g} s after each: minimum total time"
            )
        return (
            f"big arm, turn, small arm and ring in {self.total:g} s, {self.dwell:g} s after each: "
            "minimum utilisation"
        )


def study_from(raw: Mapping[str, Any]) -> MissionStudy:
    """Check a nested dictionary and return the study it states.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """
    return from_mapping(MissionStudy, raw)
