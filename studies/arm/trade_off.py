"""What the user asks of a trade-off of the arm; keys are named as those of a truss's are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from studies.arm.config import StageStudy, check_one_joint
from studies.arm.optimal.objectives import RESIDUAL
from studies.arm.search_limits import FRONT_POINTS, FRONT_SECONDS
from studies.common.configuration import (
    boolean,
    key,
    optional_key,
    positive,
    two_limits,
    whole,
)
from studies.common.exit_codes import StudyError
from studies.pareto import keys

RESIDUAL_ENERGY = "residual-energy"
# those that stand first are limited, and the last one of two or three is least: at rest any torque
# is enough for the least energy, so that energy is limited where it stands beside them
TRADED = ("time", RESIDUAL_ENERGY, "peak-torque", "deflection")
# the old pair, which sets laws against each other in durations that nobody states
LAWS_LEFT = ("time", RESIDUAL_ENERGY)
_OF_A_FRONT = ("points", "range", "residual_energy", "slices", "seconds", "coarse")


def _objectives(name: str, value: Any) -> tuple[str, ...]:
    """Two or three different quantities, in the order in which they are limited."""
    return keys.in_order(keys.objectives(TRADED)(name, value), TRADED)


@dataclass(frozen=True, kw_only=True)
class TradeOffStudy(StageStudy):
    """Two or three quantities of the arm against each other: `antenna-ocp pareto arm`."""

    objectives: Any = key(
        _objectives,
        "",
        f"two or three out of {', '.join(TRADED)}: all but one are limited, the last one is least",
        default=LAWS_LEFT,
    )
    points: int | None = optional_key(
        whole(3, 200),
        "",
        f"about so many on the front, {FRONT_POINTS} unless stated; of three objectives on each "
        f"slice, {keys.SLICE} unless stated",
    )
    range: Any = optional_key(
        two_limits,
        "",
        "lowest and highest limit, in s, J or N m; unless stated, what is of interest",
    )
    slices: Any = optional_key(keys.slices, "", keys.SLICES_MEANING)
    coarse: bool = key(boolean, "", "a sketch: few points, found one way", default=False)
    seconds: float | None = optional_key(
        positive,
        "s",
        f"of three objectives: what all slices may take; {FRONT_SECONDS:g} unless stated",
    )
    residual_energy: float | None = optional_key(
        positive,
        "J",
        "energy up to which the arm counts as still: every motion leaves no more, and where "
        f"residual-energy is traded its limits begin there; {RESIDUAL:g} unless stated",
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.objectives == LAWS_LEFT:
            for name in _OF_A_FRONT:
                if getattr(self, name) not in (None, False):
                    raise StudyError(
                        f"{name} is stated, but where residual-energy is set against time, "
                        f"durations are fixed parts of the stage's; leave {name} out"
                    )
            return
        check_one_joint("a front", self.slew)
        keys.check_sliced("slices", self.slices, self.objectives)
        if self.seconds is not None and self.sliced is None:
            raise StudyError(
                f"seconds is {self.seconds:g}, which the slices of three objectives may take, but "
                f"objectives has {' and '.join(self.objectives)}; leave it out, or add one"
            )
        for name, limits, of in (
            ("range", self.range or (), self.limited),
            ("slices", self.slices if isinstance(self.slices, tuple) else (), self.sliced),
        ):
            self._check_above_rest(name, limits, of)

    def _check_above_rest(self, name: str, limits: Sequence[float], of: str | None) -> None:
        """Refuse limits on an energy below which the arm counts as still."""
        if of == RESIDUAL_ENERGY and limits and limits[0] < self.still:
            raise StudyError(
                f"{name} begins at {limits[0]:g} J, but up to residual_energy, {self.still:g} J, "
                "the arm counts as still, and there is nothing to trade; begin it there, or state "
                "a lower residual_energy"
            )

    @property
    def still(self) -> float:
        """Energy up to which the arm counts as still [J]."""
        return self.residual_energy or RESIDUAL

    @property
    def sliced(self) -> str | None:
        """Of three objectives the one whose limit is the same for all points of a slice."""
        return str(self.objectives[0]) if len(self.objectives) == 3 else None

    @property
    def limited(self) -> str:
        """The objective that is limited, from point to point."""
        return str(self.objectives[-2])

    @property
    def least(self) -> str:
        """The one that is least under each limit."""
        return str(self.objectives[-1])

    @property
    def question(self) -> str:
        """What is asked, in one line."""
        if self.objectives == LAWS_LEFT:
            return (
                f"{self.stage} arm, torque drive: residual energy on the full model against "
                "duration"
            )
        *limited, least = (
            "duration" if name == "time" else name.replace("-", " ") for name in self.objectives
        )
        time = "" if "time" in self.objectives else f" in {self.slew.duration:.6g} s"
        end = "to a lock" if RESIDUAL_ENERGY in self.objectives else "rest to rest"
        against = " and ".join(reversed(limited))
        return f"{self.stage} arm{time}, torque drive: {least} against {against}, {end}"
