"""What the user asks of a trade-off of the arm; keys are named as those of a truss's are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from studies.arm.config import StageStudy, check_one_joint
from studies.arm.optimal.objectives import RESIDUAL
from studies.arm.search_limits import FRONT_POINTS
from studies.common.configuration import (
    boolean,
    key,
    optional_key,
    positive,
    two_limits,
    whole,
)
from studies.common.exit_codes import StudyError
from studies.fronts import keys

RESIDUAL_ENERGY = "residual-energy"
# the one of two that stands first is limited, and the other one is least: at rest any torque is
# enough for the least energy, so that energy is limited where it stands beside another one
TRADED = ("time", RESIDUAL_ENERGY, "peak-torque", "deflection")


def _objectives(name: str, value: Any) -> tuple[str, ...]:
    """Two different quantities, the one that is limited first."""
    names: tuple[str, ...] = keys.objectives(TRADED, TRADED)(name, value)
    if names == ("time", RESIDUAL_ENERGY):
        raise StudyError(
            f"{name} has time and residual-energy, between which there is no trade-off: an arm can "
            "come to rest in any duration; give one of them together with peak-torque or "
            "deflection, or sweep the duration of antenna-ocp arm solve"
        )
    return names


@dataclass(frozen=True, kw_only=True)
class TradeOffStudy(StageStudy):
    """Two quantities of the arm against each other: `antenna-ocp pareto arm`."""

    objectives: Any = key(
        _objectives,
        "",
        f"two out of {', '.join(TRADED)}: the first in this order is limited, the other one is "
        "minimised",
        default=("time", "peak-torque"),
    )
    points: int | None = optional_key(
        whole(3, 200), "", f"approximate number of points of the front; by default {FRONT_POINTS}"
    )
    range: Any = optional_key(
        two_limits,
        "",
        "lowest and highest limit, in s, J or N m; by default the range of interest",
    )
    coarse: bool = key(boolean, "", "a sketch: few points", default=False)
    residual_energy: float | None = optional_key(
        positive,
        "J",
        "residual energy up to which the arm counts as at rest: that of every motion is at most "
        "this, and if residual-energy is one of the two, its limits begin there; by default "
        f"{RESIDUAL:g}",
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        check_one_joint("a front", self.slew)
        if self.limited == RESIDUAL_ENERGY and self.range and self.range[0] < self.still:
            raise StudyError(
                f"range begins at {self.range[0]:g} J, but up to residual_energy, {self.still:g} "
                "J, the arm counts as at rest; begin the range there, or give a lower "
                "residual_energy"
            )

    @property
    def still(self) -> float:
        """Energy up to which the arm counts as still [J]."""
        return self.residual_energy or RESIDUAL

    @property
    def limited(self) -> str:
        """The objective that is limited, from point to point."""
        return str(self.objectives[0])

    @property
    def least(self) -> str:
        """The one that is least under each limit."""
        return str(self.objectives[1])

    @property
    def question(self) -> str:
        """What is asked, in one line."""
        limited, least = (
            "duration" if name == "time" else name.replace("-", " ") for name in self.objectives
        )
        time = "" if "time" in self.objectives else f" in {self.slew.duration:.6g} s"
        end = "to a lock" if RESIDUAL_ENERGY in self.objectives else "rest to rest"
        return f"{self.stage} arm{time}, torque drive: {least} against {limited}, {end}"
