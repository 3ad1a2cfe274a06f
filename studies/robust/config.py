"""What the user asks of a robust law: a study of the truss, its scenarios, and a scatter."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from models.truss import TrussParameters
from studies.common import rates
from studies.common.configuration import (
    boolean,
    check,
    check_keys,
    finite,
    from_mapping,
    key,
    not_negative,
    positive,
    table,
    whole,
)
from studies.common.exit_codes import StudyError, quoted
from studies.truss.carrier import refuse_arm
from studies.truss.config import TrussStudy
from studies.truss.config import as_dictionary as truss_dictionary
from studies.truss.config import study_from as truss_study_from

# what may differ from truss to truss: neither the stroke nor the angle of the taut net
OF_THE_TRUSS = {
    "pulley_friction": "1",
    "joint_friction": "N m s/rad",
    "slider_friction": "N s/m",
    "spring_stiffness": "N/m",
    "net_stiffness": "N/m",
    "linear_density": "kg/m",
}
STUCK = {"stuck_moment": "N m", "stuck_angle_deg": "deg", "stuck_width_deg": "deg"}
VARIED = {**OF_THE_TRUSS, **STUCK}
STUCK_WIDTH = 5.0  # [deg], by default
CAPS = (
    "force",
    "least_tension",
    "speed",
    "acceleration",
    "jerk",
    "rope_speed",
    "rope_acceleration",
    "rope_jerk",
    "reaction",
)
NOMINAL, CORNER = "nominal", "corner"


def _scenarios(name: str, value: Any) -> dict[str, dict[str, float]]:
    """Trusses by name, each by the values that differ from the study's truss."""
    found = {}
    for scenario, raw in table(name, value).items():
        where = f"{name}.{scenario}"
        if scenario == NOMINAL:
            raise StudyError(f"{where} is always there: the study's own truss; rename the scenario")
        if re.fullmatch(rf"{CORNER} \d+", scenario):
            raise StudyError(f"{where} is a reserved name; rename the scenario")
        check_keys(table(where, raw), VARIED, f"{where}.")
        found[scenario] = {word: not_negative(f"{where}.{word}", raw[word]) for word in raw}
        if "stuck_moment" in raw and "stuck_angle_deg" not in raw:
            raise StudyError(f"{where}.stuck_moment has no angle; also give stuck_angle_deg")
    return found


def _scatter(name: str, value: Any) -> dict[str, dict[str, float]]:
    """Distributions by parameter: low and high, or mean and deviation."""
    found = {}
    for word, raw in table(name, value).items():
        check_keys({word: raw}, VARIED, f"{name}.")
        where = f"{name}.{word}"
        if set(table(where, raw)) not in ({"low", "high"}, {"mean", "deviation"}):
            raise StudyError(
                f"{where} is {quoted(dict(raw))}; give low and high (uniform), or mean and "
                "deviation (normal, cut off at zero)"
            )
        found[word] = {end: finite(f"{where}.{end}", raw[end]) for end in raw}
        low = found[word].get("low", found[word].get("deviation", 0.0))
        if low < 0 or found[word].get("high", math.inf) < low or found[word].get("mean", 0) < 0:
            raise StudyError(
                f"{where} is {quoted(dict(raw))}; give numbers from zero, the lower first"
            )
    return found


@dataclass(frozen=True, kw_only=True)
class Uncertainty:
    """Trusses for which one law has to work, and the scatter of the random trusses.

    Attributes
    ----------
    scenarios : by name, the values that differ from the study's truss, which is always included.
    scatter : by parameter, its distribution among the random trusses.
    corners : whether the law also has to work for every truss in the ranges of the scatter.
    deviations : half the range of a normal distribution.
    draws : number of random trusses; 0 for none.
    seed : of the random trusses.
    confidence : level of the confidence interval of a rate.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """

    scenarios: Any = key(
        _scenarios,
        "",
        "tables of values that differ from the study's truss: " + ", ".join(VARIED),
        factory=dict,
        flags=(),
    )
    scatter: Any = key(
        _scatter,
        "",
        "by the same names, {low, high} (uniform) or {mean, deviation} (normal, cut at zero)",
        factory=dict,
        flags=(),
    )
    corners: bool = key(
        boolean, "", "whether the law has to work for all trusses in the ranges", default=True
    )
    deviations: float = key(
        positive, "", "half the range of a normal distribution, in deviations", default=3.0
    )
    draws: int = key(whole(0, 10_000_000), "", "random trusses of the scatter", default=10_000)
    seed: int = key(whole(0), "", "of the random trusses", default=1)
    confidence: float = key(
        rates.confidence, "", "of the confidence interval of a rate", default=0.95
    )

    def __post_init__(self) -> None:
        check(self, "robust.")
        if not (self.scenarios or self.ranges):
            raise StudyError(
                "there are no scenarios, and no scatter with corners; give tables such as "
                "[robust.scenarios.rough] with pulley_friction = 0.015"
            )
        if "stuck_moment" in self.scatter and "stuck_angle_deg" not in self.scatter:
            raise StudyError(
                "robust.scatter.stuck_moment has no angle; also give robust.scatter.stuck_angle_deg"
            )

    @property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """Minimum and maximum of each parameter with a scatter, if the corners count."""
        if not self.corners:
            return {}
        return {word: self._range(shape) for word, shape in sorted(self.scatter.items())}

    def _range(self, shape: Mapping[str, float]) -> tuple[float, float]:
        if "low" in shape:
            return shape["low"], shape["high"]
        half = self.deviations * shape["deviation"]
        return max(shape["mean"] - half, 0.0), shape["mean"] + half


@dataclass(frozen=True, kw_only=True)
class RobustTrussStudy:
    """One law of the truss for several scenarios.

    Attributes
    ----------
    deployment : the study of the nominal truss.
    uncertainty : scenarios and scatter.
    corners : further scenarios by name, trusses at corners of the ranges; found by the search.

    Raises
    ------
    StudyError
        If a robust law does not support the objective or a cap.
    """

    deployment: TrussStudy
    uncertainty: Uncertainty
    corners: Mapping[str, Mapping[str, float]] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        study = self.deployment
        refuse_arm(study.arm, "a robust law")
        if study.minimise != ({"peak-force": 1.0},):
            asked = ", ".join(study.objectives)
            raise StudyError(
                f"a robust law minimises the worst peak-force, but minimise is {asked}; remove it "
                "or give peak-force"
            )
        stated = dataclasses.asdict(study.caps)
        others = [name for name, cap in stated.items() if cap and name not in CAPS]
        if others:
            raise StudyError(
                f"caps.{others[0]} applies to one truss only; a robust law supports "
                f"{', '.join(CAPS)}"
            )
        if study.drive is not None:
            raise StudyError("a robust law does not support [drive]; give its limits as caps")
        if study.fixed_duration is None:
            raise StudyError(f"duration is {study.duration}; a robust law needs one number [s]")

    @property
    def scenarios(self) -> dict[str, Mapping[str, float]]:
        """Values of each truss that differ from the study's; nominal first, corners last."""
        return {NOMINAL: {}, **self.uncertainty.scenarios, **self.corners}

    @property
    def question(self) -> str:
        """The question, in one line."""
        stated = len(self.scenarios) - len(self.corners)
        counted = f"{stated} scenario{'s' * (stated > 1)}"
        ranges = " and of all in the ranges" if self.uncertainty.ranges else ""
        return f"{self.deployment.question}, worst of {counted}{ranges}"

    def truss_of(self, scenario: str) -> TrussParameters:
        """The truss of a scenario, without what sticks."""
        stated = self.scenarios[scenario]
        changes: dict[str, Any] = {w: v for w, v in stated.items() if w in OF_THE_TRUSS}
        return dataclasses.replace(self.deployment.truss, **changes)

    def values_of(self, stated: Mapping[str, float]) -> list[float]:
        """A number for each of `VARIED`, in SI units and degrees."""
        own = {word: float(getattr(self.deployment.truss, word)) for word in OF_THE_TRUSS}
        nothing = {"stuck_moment": 0.0, "stuck_angle_deg": 0.0, "stuck_width_deg": STUCK_WIDTH}
        return [({**own, **nothing, **stated})[word] for word in VARIED]


def study_from(raw: Mapping[str, Any]) -> RobustTrussStudy:
    """Check a nested dictionary and return the study it states: a truss, and `[robust]`.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """
    uncertainty = from_mapping(Uncertainty, table("robust", raw.get("robust", {})), "robust.")
    of_the_truss = {name: value for name, value in raw.items() if name != "robust"}
    deployment = truss_study_from({"minimise": "peak-force", **of_the_truss})
    return RobustTrussStudy(deployment=deployment, uncertainty=uncertainty)


def as_dictionary(study: RobustTrussStudy) -> dict[str, Any]:
    """The nested dictionary from which `study_from` makes the same study again."""
    own = dataclasses.asdict(study.uncertainty)
    return {**truss_dictionary(study.deployment), "robust": own}
