"""What the user asks of a trade-off: two objectives, where their front is looked for, how finely.

They are in the table `[pareto]`. All other keys are those of a study of the truss.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from studies.common.configuration import (
    boolean,
    check,
    check_keys,
    choice,
    from_mapping,
    key,
    optional_key,
    table,
    toml_text,
    two_limits,
    whole,
)
from studies.common.exit_codes import StudyError
from studies.truss.config import TrussStudy, as_dictionary, study_from
from studies.truss.limits.caps import CAPPED
from studies.truss.quantities import OBJECTIVES, QUANTITIES

# those that may be limited, the first of two is: bounds of time and signals are the easiest
LIMITED = ("time", "peak-acceleration", "peak-jerk", *CAPPED)


def _two(name: str, value: Any) -> tuple[str, str]:
    """Two different objectives, of which one can be limited."""
    known = tuple(dict.fromkeys((*OBJECTIVES, "peak-jerk")))
    if isinstance(value, str) or not isinstance(value, list | tuple) or len(value) != 2:
        raise StudyError(f"{name} is {value!r}; give two out of {', '.join(known)}")
    first, second = (choice(known)(name, item) for item in value)
    if first == second:
        raise StudyError(f"{name} names {first} twice; a trade-off is between two objectives")
    if not {first, second}.intersection(LIMITED):
        raise StudyError(
            f"{name} is {first} and {second}, neither of which can be limited while the other is "
            "least; give one of them beside time, or beside a quantity that has a cap"
        )
    return first, second


@dataclass(frozen=True, kw_only=True)
class TradeOff:
    """What is traded, the table `[pareto]`.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """

    objectives: Any = key(
        _two,
        "",
        f"two out of {', '.join(OBJECTIVES)} and peak-jerk: one is limited, the other least",
    )
    points: int = key(whole(3, 500), "", "about so many on the front", default=40)
    range: Any = optional_key(
        two_limits, "", "lowest and highest limit, in its SI unit; unless stated, all that there is"
    )
    coarse: bool = key(
        boolean, "", "a sketch: few points, from one start, on a coarse mesh", default=False
    )

    def __post_init__(self) -> None:
        check(self, "pareto.")
        if self.least == "peak-jerk":
            raise StudyError(
                f"pareto.objectives is {self.limited} and peak-jerk, but nothing minimises "
                "peak-jerk under a limit; give peak-jerk another partner"
            )

    @property
    def limited(self) -> str:
        """The objective that is limited."""
        return next(name for name in LIMITED if name in self.objectives)

    @property
    def least(self) -> str:
        """The other one, which is least under each limit."""
        first, second = self.objectives
        return str(second if first == self.limited else first)


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
        low, high = self.truss.duration
        if self.pareto.limited == "time":
            if low == high:
                raise StudyError(
                    f"a front of the duration needs bounds on it, but it is fixed at {low:g} s; "
                    "give --duration LOW..HIGH or duration = [low, high]"
                )
            if self.pareto.range is not None:
                raise StudyError(
                    "pareto.range limits the duration, and so does duration = [low, high]; leave "
                    "one of them out: the range"
                )

    @property
    def name(self) -> str:
        """Default name of the results folder."""
        return f"pareto-truss-{self.pareto.limited}-{self.pareto.least}"

    @property
    def question(self) -> str:
        """What is asked, in one line."""
        limited, least = (QUANTITIES[k].title for k in (self.pareto.limited, self.pareto.least))
        low, high = self.truss.duration
        time = f"T = {low:g} s" if low == high else f"T from {low:g} to {high:g} s"
        friction = self.truss.truss.pulley_friction
        return (
            f"Ring truss, {self.truss.truss.modules} modules, mu = {friction:g}, {time}: "
            f"{least} against {limited}"
        )


def pareto_from(raw: Mapping[str, Any]) -> ParetoStudy:
    """Check a nested dictionary and return the study it states.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """
    keys = [field.name for field in dataclasses.fields(TrussStudy) if field.name != "minimise"]
    if "minimise" in raw:
        raise StudyError(
            "a trade-off takes its objectives from pareto.objectives; leave out minimise"
        )
    check_keys(raw, ["pareto", *keys])
    stated = table("pareto", raw.get("pareto", {}))
    if "objectives" not in stated:
        raise StudyError(
            "no objectives are stated; give two: --objectives A,B or pareto.objectives"
        )
    pareto = from_mapping(TradeOff, stated, "pareto.")
    rest = {name: value for name, value in raw.items() if name != "pareto"}
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


def as_toml(study: ParetoStudy) -> str:
    """The file that states the same study again."""
    head = "# Reproduces this result: antenna-ocp pareto truss input.toml\n\n"
    return head + toml_text(configuration_of(study))
