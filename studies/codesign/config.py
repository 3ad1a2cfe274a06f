"""What the user asks of a co-design: a study of the truss, and which parameters are free."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from models.truss import TrussParameters
from studies.common.configuration import (
    Flag,
    as_stated,
    check,
    choices,
    from_mapping,
    key,
    optional_key,
    part_below_one,
    positive,
    table,
    whole,
    with_commas,
)
from studies.common.exit_codes import StudyError
from studies.truss.carrier import refuse_arm
from studies.truss.config import TrussStudy
from studies.truss.config import as_dictionary as truss_dictionary
from studies.truss.config import study_from as truss_study_from

UNITS = {"crank": "m", "link": "m", "spring_stiffness": "N/m", "spring_free_length": "m"}
FREE = tuple(UNITS)  # neither the diameter nor the tension of the net depends on them
OBJECTIVES = ("peak-force", "peak-factored-force")


@dataclass(frozen=True, kw_only=True)
class DesignSpace:
    """Which parameters of the truss are free, how far, and what every design has to meet.

    The diameter and the tension of the open net depend on parameters that are never free, and so
    stay as the study of the truss states them.

    Attributes
    ----------
    free : names of the parameters.
    range : part of its given value by which each may change, in either direction.
    holding_force : least force on each rope that holds the open truss [N].
    stroke : most length that each rope is wound in [m].
    stowed_height : most height of the stowed truss [m].
    starts : designs to start from, the given one and random ones in the range.
    seed : of these draws.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """

    free: tuple[str, ...] = key(
        choices(FREE),
        "",
        "free parameters",
        default=FREE,
        flags=(Flag("--free", metavar="A,B", read=with_commas),),
    )
    range: float = key(
        part_below_one(", as 0.3 for 30 %"),
        "",
        "fraction of its given value by which each may change, up and down",
        default=0.3,
    )
    holding_force: float | None = optional_key(
        positive,
        "N",
        "minimum force on each rope that holds the open truss; none: that of the truss",
    )
    stroke: float | None = optional_key(
        positive, "m", "maximum length that each rope is wound in; none: that of the truss"
    )
    stowed_height: float | None = optional_key(
        positive, "m", "maximum height of the stowed truss; none: that of the truss"
    )
    starts: int = key(
        whole(1, 100),
        "",
        "number of initial designs, the given one first",
        default=4,
        flags=(Flag("--designs", metavar="N"),),
    )
    seed: int = key(whole(0), "", "of the random designs among the starts", default=1)

    def __post_init__(self) -> None:
        check(self, "design.")
        repeated = [name for name in self.free if self.free.count(name) > 1]
        if repeated:
            raise StudyError(f"design.free names {repeated[0]} twice; name each parameter once")

    def limits(self, truss: TrussParameters) -> dict[str, tuple[float, float]]:
        """Least and largest value of each free parameter, in its unit."""
        stated = {name: float(getattr(truss, name)) for name in self.free}
        return {
            name: ((1 - self.range) * value, (1 + self.range) * value)
            for name, value in stated.items()
        }


@dataclass(frozen=True, kw_only=True)
class CodesignStudy:
    """A deployment and the mechanism that it moves, as one problem.

    Attributes
    ----------
    deployment : the study of the truss; its parameters are the given design.
    design : what is free, and what is required.

    Raises
    ------
    StudyError
        If the objective is none of a co-design.
    """

    deployment: TrussStudy
    design: DesignSpace = dataclasses.field(default_factory=DesignSpace)

    def __post_init__(self) -> None:
        refuse_arm(self.deployment.arm, "a co-design")
        if not self.deployment.is_whole:
            raise StudyError(
                "a co-design includes the whole opening, but start_deg, start_rate_deg_per_s or "
                "end_deg is given; remove it, or use antenna-ocp truss"
            )
        stages = self.deployment.minimise
        if len(stages) != 1 or len(stages[0]) != 1 or self.objective not in OBJECTIVES:
            asked = ", ".join(self.deployment.objectives)
            raise StudyError(
                f"a co-design minimises one of {', '.join(OBJECTIVES)}, but minimise is {asked}; "
                "give one of them"
            )

    @property
    def objective(self) -> str:
        """Name of what is minimised."""
        return self.deployment.objectives[0]

    @property
    def question(self) -> str:
        """The question, in one line."""
        free, span = ", ".join(self.design.free), 100 * self.design.range
        return f"{self.deployment.question}, with {free} free within {span:g} %".replace("_", " ")


def study_from(raw: Mapping[str, Any]) -> CodesignStudy:
    """Check a nested dictionary and return the study it states: a truss, and `[design]`.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """
    design = from_mapping(DesignSpace, table("design", raw.get("design", {})), "design.")
    of_the_truss = {name: value for name, value in raw.items() if name != "design"}
    return CodesignStudy(deployment=truss_study_from(of_the_truss), design=design)


def as_dictionary(study: CodesignStudy) -> dict[str, Any]:
    """The nested dictionary from which `study_from` makes the same study again."""
    return {**truss_dictionary(study.deployment), "design": as_stated(study.design)}
