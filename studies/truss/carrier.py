"""The arm that carries the ring, as the user states it: `[arm]` of the study, or an arm study."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from models.errors import ModelError
from studies.common.arm_description import ArmDescription
from studies.common.configuration import (
    boolean,
    finite,
    from_mapping,
    key,
    optional_key,
    positive,
    read_toml,
)
from studies.common.exit_codes import StudyError
from studies.common.study import placed

if TYPE_CHECKING:  # CasADi loads with them
    from models.ring_on_arm import RingOnArm
    from models.truss import TrussParameters

RESIDUAL = 1e-6  # [J] that may be left in the arm unless the user says otherwise, as by its locks


@dataclass(frozen=True, kw_only=True)
class CarryingArm(ArmDescription):
    """The straight arm, root and elbow locked, how the ring is mounted, and on what satellite.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """

    reaction_angle_deg: float = key(
        finite,
        "deg",
        "angle from the straight arm to the ring's centre, seen from the tip",
        default=90.0,
    )

    ring_turns: bool = key(
        boolean,
        "",
        "whether the ring turns with the tip; if not, its mass acts as a particle there",
        default=True,
    )

    satellite_inertia: float | None = optional_key(
        positive,
        "kg m^2",
        "inertia about the root of a satellite that is free to turn; without it the satellite is "
        "held",
    )

    def with_ring(self, truss: TrussParameters) -> RingOnArm:
        """The model of arm and ring.

        Raises
        ------
        StudyError
            If the ring is heavier than the antenna.
        """
        from models.ring_on_arm import RingOnArm

        try:
            angle = math.radians(self.reaction_angle_deg)
            return RingOnArm(self.parameters, truss, angle, self.ring_turns, self.satellite_inertia)
        except ModelError as error:
            raise StudyError(str(error).removesuffix(".")) from error


def refuse_arm(arm: CarryingArm | None, question: str) -> None:
    """Raise StudyError if there is an arm, for a question that leaves it out."""
    if arm is not None:
        raise StudyError(
            f"[arm] is given, but {question} does not include the arm; remove [arm], or use "
            "antenna-ocp truss"
        )


def read_arm(path: Path) -> dict[str, Any]:
    """The table `[arm]` of the file of an arm study.

    Raises
    ------
    StudyError
        If the file cannot be read or is no arm study.
    """
    raw, reasons = read_toml(path), []
    # by their places: the studies of the arm stand above those of the truss
    for kind in ("ArmStudy", "SequenceStudy", "RobustStudy"):
        try:
            study: Any = from_mapping(placed(f"studies.arm.config:{kind}"), raw)
        except StudyError as error:
            reasons.append(str(error))
        else:
            satellite = getattr(study, "satellite_inertia", None)
            return {**dataclasses.asdict(study.arm), "satellite_inertia": satellite}
    raise StudyError(
        f"the file {path} is not an arm study ({reasons[0]}); give the file of an antenna-ocp arm "
        "command, or [arm] in the study"
    )


def arm_of_file(text: str) -> dict[str, Any]:
    """The arm of the file that a flag names; see `read_arm`."""
    return read_arm(Path(text))
