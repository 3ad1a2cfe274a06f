"""Which bounds hold a co-design back, and what a little more room would be worth.

The price of a bound is the change of the least force per unit of its limit: the multiplier, by the
envelope theorem (`ocp.analysis.sensitivity`). The motion is as good as it can be on either side.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from models.truss import with_symbols
from ocp import Sided, Solution
from studies.codesign.config import UNITS, CodesignStudy
from studies.codesign.requirements import Requirement
from studies.common.result import Result
from studies.truss.limits.caps import CAPPED, CURVE, cap_on
from studies.truss.problem import SIGNAL_CAPS
from studies.truss.quantities import QUANTITIES

# Part of the objective that a limit has to be worth, if it could be moved by all of itself, before
# it counts as pressing. An interior-point method leaves 1e-9 at limits that do not.
PRESSING = 1e-5
NEAR = 1e-6  # relative distance within which a limit is touched


@dataclass(frozen=True)
class Price:
    """What a limit costs.

    Attributes
    ----------
    title, unit : of what is limited.
    side : "lower" or "upper".
    limit : its value [unit].
    price : change of the objective for a limit of one more [N per unit]; not finite where several
        limits fix the optimum and none of them can be moved alone.
    of_the_design : whether it is a limit of a parameter or a requirement, and not of the motion.
    note : why the price holds for small changes only; empty otherwise.
    """

    title: str
    unit: str
    side: str
    limit: float
    price: float
    of_the_design: bool
    note: str = ""

    @property
    def for_a_percent(self) -> float:
        """Change of the objective if the limit is loosened by one per cent [N]; never positive."""
        return -abs(self.price * self.limit) / 100

    @property
    def sentence(self) -> str:
        """One line for the reader."""
        word = "least" if self.side == "lower" else "most"
        loosened = "less" if self.side == "lower" else "more"
        unit = "" if self.unit == "1" else f" {self.unit}"
        if not math.isfinite(self.price):
            return (
                f"{self.title}, at {word} {self.limit:.6g}{unit}: its shadow price is "
                f"undefined, because {self.note}"
            )
        return (
            f"{self.title}, at {word} {self.limit:.6g}{unit}: 1 % {loosened} saves "
            f"{-self.for_a_percent:.3g} N ({abs(self.price):.4g} N per{unit or ' unit'})"
        )


def prices(
    study: CodesignStudy, held: Sequence[Requirement], design: Mapping[str, float], found: Solution
) -> tuple[Price, ...]:
    """The active limits, in the order of the force that 1 % saves.

    Parameters
    ----------
    study, held : CodesignStudy and sequence of Requirement
        As the problem was stated.
    design : mapping of str to float
        The parameters that were found, by name.
    found : Solution
        With its multipliers.
    """
    slopes = found.one_sided_sensitivities()
    listed = (
        *_of_the_parameters(study, design, slopes),
        *_of_the_requirements(study, held, design, slopes),
        *_of_the_motion(study, slopes),
    )
    least = PRESSING * abs(found.objective)
    pressing = (one for one in listed if abs(one.price * one.limit) > least)
    return tuple(sorted(pressing, key=lambda one: one.for_a_percent))


def files(result: Result) -> dict[str, str]:
    """The prices as a further file of a results folder."""
    return {"prices.csv": stored_prices(result.details["prices"])}


def stored_prices(records: Sequence[Mapping[str, Any]]) -> str:
    """The prices of a result's details as a table in CSV."""
    # what is not finite is null in a record, and an empty cell here
    found = [Price(**{**one, "price": _number(one["price"])}) for one in records]
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(["bound", "side", "limit", "unit", "price [N per unit]", "1 % looser [N]"])
    for one in found:
        numbers = (one.price, one.for_a_percent)
        row = (f"{number:.9g}" if math.isfinite(number) else "" for number in numbers)
        writer.writerow([one.title, one.side, f"{one.limit:.9g}", one.unit, *row])
    return stream.getvalue()


def _number(stored: float | None) -> float:
    return math.nan if stored is None else stored


def _of_the_parameters(
    study: CodesignStudy, design: Mapping[str, float], slopes: Mapping[str, Sided]
) -> Iterator[Price]:
    for name, ends in study.design.limits(study.deployment.truss).items():
        words = name.replace("_", " ")
        for side, limit in zip(("lower", "upper"), ends, strict=True):
            if abs(design[name] - limit) <= NEAR * abs(limit):
                yield _price(words, UNITS[name], side, limit, slopes[f"{words} {side}"])


def _of_the_requirements(
    study: CodesignStudy,
    held: Sequence[Requirement],
    design: Mapping[str, float],
    slopes: Mapping[str, Sided],
) -> Iterator[Price]:
    truss = with_symbols(study.deployment.truss, **design)
    for one in held:
        if not one.at_rest and abs(float(one.slack(truss))) <= NEAR:
            side = "lower" if one.is_least else "upper"
            yield _price(one.title, one.unit, side, one.limit, slopes[f"{one.title} {side}"])


def _price(title: str, unit: str, side: str, limit: float, slope: Sided) -> Price:
    # loosening is what a price is for: down at a least value, up at a largest one
    price = slope.below if side == "lower" else slope.above
    return Price(title, unit, side, limit, price, True, slope.note)


def _of_the_motion(study: CodesignStudy, slopes: Mapping[str, Sided]) -> Iterator[Price]:
    """Caps: both phases, both signs and all parts of one are the same limit."""
    deployment = study.deployment
    for key in (*CAPPED, CURVE):
        cap, quantity = cap_on(deployment.caps, deployment.drive, key), QUANTITIES[key]
        if not cap:
            continue
        word = "rope force" if key == "peak-force" else quantity.title
        word = key.removeprefix("peak-") if key in SIGNAL_CAPS else word
        name = re.compile(rf"(?:[^:]+: )?{re.escape(word)}(?: \(\d+\))? (lower|upper)")

        found = [(match[1], slopes[text]) for text in slopes if (match := name.fullmatch(text))]
        least = quantity.kind == "least"
        price = math.fsum(
            (one.below if least else -one.below) if side == "lower" else one.above
            for side, one in found
        )
        note = next((one.note for _, one in found if one.note), "")
        side = "lower" if least else "upper"
        yield Price(quantity.title, quantity.unit, side, cap, price, False, note)
