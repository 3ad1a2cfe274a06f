"""What the user asks of a trade-off: its objectives, where the front is looked for, how finely.

They are in the table `[pareto]`. All other keys are those of a study of the truss.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from studies.common.configuration import (
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
from studies.pareto import keys
from studies.truss.config import TrussStudy, as_dictionary, study_from
from studies.truss.limits.caps import CAPPED, cap_on
from studies.truss.quantities import OBJECTIVES, QUANTITIES

# those that may be limited, the first of two is: nothing minimises the jerk of the angle, and
# bounds of time and signals are the easiest
LIMITED = ("peak-jerk", "time", "peak-acceleration", *CAPPED)
KNOWN = tuple(dict.fromkeys((*OBJECTIVES, "peak-jerk")))


def _objectives(name: str, value: Any) -> tuple[str, ...]:
    """Two or three different objectives, of which all but one can be limited."""
    names: tuple[str, ...] = keys.objectives(KNOWN)(name, value)
    unlimited = [one for one in names if one not in LIMITED]
    if len(unlimited) > 1:
        raise StudyError(
            f"{name} has {' and '.join(unlimited)}, neither of which can be limited while the "
            "other is least; give one of them together with time, or with a quantity that has a cap"
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
        f"two or three out of {', '.join(OBJECTIVES)} and peak-jerk: all but one are limited, the "
        "last one is least",
    )
    points: int | None = optional_key(
        whole(3, 500),
        "",
        f"about so many on the front, {keys.FRONT} unless stated; of three objectives on each "
        f"slice, {keys.SLICE} unless stated",
    )
    range: Any = optional_key(
        two_limits, "", "lowest and highest limit, in its SI unit; unless stated, all that there is"
    )
    slices: Any = optional_key(keys.slices, "", keys.SLICES_MEANING)
    coarse: bool = key(boolean, "", keys.COARSE_MEANING, default=False)

    def __post_init__(self) -> None:
        check(self, "pareto.")
        keys.check_sliced("pareto.slices", self.slices, self.objectives)

    @property
    def in_order(self) -> tuple[str, ...]:
        """The objectives by how easily each is limited; the last one is least."""
        return keys.in_order(self.objectives, LIMITED)

    @property
    def sliced(self) -> str | None:
        """Of three objectives the one whose limit is the same for all points of a slice."""
        return self.in_order[0] if len(self.objectives) == 3 else None

    @property
    def limited(self) -> str:
        """The objective that is limited, from point to point."""
        return self.in_order[-2]

    @property
    def least(self) -> str:
        """The one that is least under each limit."""
        return self.in_order[-1]


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
                "pareto.range limits the duration, and so does duration = [low, high]; leave "
                "one of them out: the range"
            )
        if pareto.sliced is not None and isinstance(pareto.slices, tuple):
            self._check_slices(pareto.sliced, pareto.slices)

    def _check_slices(self, sliced: str, limits: tuple[float, ...]) -> None:
        """Refuse limits of slices that contradict the bounds or the cap on the same quantity."""
        low, high = 0.0, cap_on(self.truss.caps, self.truss.drive, sliced) or math.inf
        if sliced == "time":
            low, high = self.truss.duration
        for limit in limits:
            if not low <= limit <= high:
                quantity = QUANTITIES[sliced]
                words = f"from {low:g} to {high:g}" if sliced == "time" else f"at most {high:g}"
                raise StudyError(
                    f"pareto.slices has a {quantity.title} of {limit:g} {quantity.unit}, but the "
                    f"study allows {words} {quantity.unit}; leave that slice out"
                )

    @property
    def name(self) -> str:
        """Default name of the results folder."""
        return "-".join(("pareto-truss", *self.pareto.in_order))

    @property
    def question(self) -> str:
        """What is asked, in one line."""
        *limited, least = (QUANTITIES[name].title for name in self.pareto.in_order)
        low, high = self.truss.duration
        time = f"T = {low:g} s" if low == high else f"T from {low:g} to {high:g} s"
        friction = self.truss.truss.pulley_friction
        return (
            f"Ring truss, {self.truss.truss.modules} modules, mu = {friction:g}, {time}: "
            f"{least} against {' and '.join(reversed(limited))}"
        )


def pareto_from(raw: Mapping[str, Any]) -> ParetoStudy:
    """Check a nested dictionary and return the study it states.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """
    own = [field.name for field in dataclasses.fields(TrussStudy) if field.name != "minimise"]
    if "minimise" in raw:
        raise StudyError(
            "a trade-off takes its objectives from pareto.objectives; leave out minimise"
        )
    check_keys(raw, ["pareto", *own])
    stated = table("pareto", raw.get("pareto", {}))
    if "objectives" not in stated:
        raise StudyError(
            "no objectives are stated; give two: --objectives A,B or pareto.objectives"
        )
    pareto = from_mapping(TradeOff, stated, "pareto.")
    rest = {name: value for name, value in raw.items() if name != "pareto"}
    if pareto.sliced is not None:  # the seconds of one search would not do for all slices
        solver = table("solver", raw.get("solver", {}))
        rest["solver"] = {"seconds": keys.SECONDS, **solver}
    return ParetoStudy(pareto=pareto, truss=study_from({**rest, "minimise": pareto.least}))


def configuration_of(study: ParetoStudy) -> dict[str, Any]:
    """The nested dictionary from which `pareto_from` makes the same study again."""
    stated = {
        name: list(value) if isinstance(value, tuple) else value
        for name, value in dataclasses.asdict(study.pareto).items()
        if value is not None
    }
    truss = {
        name: value for name, value in as_dictionary(study.truss).items() if name != "minimise"
    }
    return {**truss, "pareto": stated}
