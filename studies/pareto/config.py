"""What the user asks of a trade-off: its objectives, where the front is looked for, how finely.

They are in the table `[pareto]`. All other keys are those of a study of the truss.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from studies.common.configuration import (
    as_stated,
    boolean,
    check,
    check_keys,
    from_mapping,
    key,
    optional_key,
    table,
    two_limits,
    whole,
)
from studies.common.exit_codes import StudyError
from studies.fronts import keys
from studies.truss import config as truss_config
from studies.truss.config import TrussStudy, ends_in_words
from studies.truss.limits.caps import CAPPED
from studies.truss.quantities import OBJECTIVES, QUANTITIES

POINTS = 40  # where nothing is stated
# those that may be limited, the first of two is: nothing minimises the jerk of the angle, and
# bounds of time and signals are the easiest
LIMITED = ("peak-jerk", "time", "peak-acceleration", *CAPPED)
KNOWN = tuple(dict.fromkeys((*OBJECTIVES, "peak-jerk")))


def _objectives(name: str, value: Any) -> tuple[str, ...]:
    """Two different objectives, of which one can be limited."""
    names: tuple[str, ...] = keys.objectives(KNOWN, LIMITED)(name, value)
    if names[0] not in LIMITED:
        raise StudyError(
            f"{name} has {' and '.join(names)}, neither of which can be limited while the other is "
            "minimised; give one of them together with time, or with a quantity that has a cap"
        )
    return names


@dataclass(frozen=True, kw_only=True)
class TradeOff:
    """What is traded, the table `[pareto]`.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """

    objectives: Any = key(
        _objectives,
        "",
        f"two out of {', '.join(OBJECTIVES)} and peak-jerk: one is limited, the other one is "
        "minimised",
    )
    points: int | None = optional_key(
        whole(3, 500), "", f"approximate number of points of the front; by default {POINTS}"
    )
    range: Any = optional_key(
        two_limits, "", "lowest and highest limit, in its SI unit; by default the whole front"
    )
    coarse: bool = key(boolean, "", keys.COARSE_MEANING, default=False)

    def __post_init__(self) -> None:
        check(self, "pareto.")

    @property
    def limited(self) -> str:
        """The objective that is limited, from point to point."""
        return str(self.objectives[0])

    @property
    def least(self) -> str:
        """The one that is least under each limit."""
        return str(self.objectives[1])


@dataclass(frozen=True, kw_only=True)
class ParetoStudy:
    """A trade-off of the truss.

    Attributes
    ----------
    pareto : what is traded.
    truss : the study whose motions are on the front; it minimises `pareto.least`.

    Raises
    ------
    StudyError
        If the front cannot be asked for like this.
    """

    pareto: TradeOff
    truss: TrussStudy

    def __post_init__(self) -> None:
        pareto = self.pareto
        low, high = self.truss.duration
        if "time" in pareto.objectives and low == high:
            raise StudyError(
                f"a front of the duration needs bounds on it, but it is fixed at {low:g} s; "
                "give --duration LOW..HIGH or duration = [low, high]"
            )
        if pareto.limited == "time" and pareto.range is not None:
            raise StudyError(
                "pareto.range and duration = [low, high] both limit the duration; remove one of "
                "them: the range"
            )

    @property
    def name(self) -> str:
        """Default name of the results folder."""
        return "-".join(("pareto-truss", *self.pareto.objectives))

    @property
    def question(self) -> str:
        """What is asked, in one line."""
        limited, least = (QUANTITIES[name].title for name in self.pareto.objectives)
        low, high = self.truss.duration
        time = f"T = {low:g} s" if low == high else f"T from {low:g} to {high:g} s"
        friction = self.truss.truss.pulley_friction
        return (
            f"Ring truss, {self.truss.truss.modules} modules, mu = {friction:g}, "
            f"{time}{ends_in_words(self.truss)}: {least} against {limited}"
        )


def limited(truss: TrussStudy, name: str, limit: float) -> TrussStudy:
    """A study with a limit on a quantity; that of the time is its longest duration."""
    if name == "time":
        return dataclasses.replace(truss, duration=(truss.duration[0], limit))
    return dataclasses.replace(truss, caps=dataclasses.replace(truss.caps, **{CAPPED[name]: limit}))


def study_from(raw: Mapping[str, Any]) -> ParetoStudy:
    """Check a nested dictionary and return the study it states.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """
    own = [field.name for field in dataclasses.fields(TrussStudy) if field.name != "minimise"]
    if "minimise" in raw:
        raise StudyError("a trade-off uses the objectives of pareto.objectives; remove minimise")
    check_keys(raw, ["pareto", *own])
    stated = table("pareto", raw.get("pareto", {}))
    if "objectives" not in stated:
        raise StudyError("no objectives are given; give two: --objectives A,B or pareto.objectives")
    pareto = from_mapping(TradeOff, stated, "pareto.")
    rest = {name: value for name, value in raw.items() if name != "pareto"}
    truss = truss_config.study_from({**rest, "minimise": pareto.least})
    return ParetoStudy(pareto=pareto, truss=truss)


def as_dictionary(study: ParetoStudy) -> dict[str, Any]:
    """The nested dictionary from which `study_from` makes the same study again."""
    own = truss_config.as_dictionary(study.truss)
    truss = {name: value for name, value in own.items() if name != "minimise"}
    return {**truss, "pareto": as_stated(study.pareto)}
