"""Quantities of a result beside those of other laws, and what it costs in each of them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

WORSE = 1.1  # ratio to the better baseline from which a quantity counts as a cost
OUTSTANDING = 10.0  # ratio above which a cost is said before anything else

Better = Literal["less", "more", "neither"]


def behind(unit: str) -> str:
    """The unit as it stands behind a number in a sentence: a part or a factor has none."""
    return "" if unit in ("", "1") else f" {unit}"


@dataclass(frozen=True)
class TableRow:
    """One quantity, for each law.

    Attributes
    ----------
    key, title, unit : the quantity.
    values : of each law, the result's own first; nan where it is not defined.
    cap, bound : what it may not exceed (a tension: undercut), and what no law can beat.
    minimised : whether it is an objective.
    better : whether less or more of it is better.
    broken_by : names of the laws that break the cap.
    negligible : so little of it is as good as none.
    """

    key: str
    title: str
    unit: str
    values: Mapping[str, float]
    cap: float | None = None
    bound: float | None = None
    minimised: bool = False
    better: Better = "neither"
    broken_by: tuple[str, ...] = ()
    negligible: float = 0.0


@dataclass(frozen=True)
class Cost:
    """A quantity in which the result is worse than the better baseline.

    Attributes
    ----------
    key, title, unit : the quantity.
    value : of the result.
    baseline, baseline_value : the baseline that is best in it.
    ratio : how many times worse, at least `WORSE`; infinite where there is no such number.
    """

    key: str
    title: str
    unit: str
    value: float
    baseline: str
    baseline_value: float
    ratio: float

    def __post_init__(self) -> None:
        if math.isnan(self.ratio):  # JSON has no infinity, and no cost is without a ratio
            object.__setattr__(self, "ratio", math.inf)

    @property
    def sentence(self) -> str:
        """One line for the report."""
        unit = behind(self.unit)
        return (
            f"{self.title} is {self._times} that of {self.baseline}: {self.value:.6g}{unit} "
            f"instead of {self.baseline_value:.6g}{unit}"
        )

    @property
    def _times(self) -> str:
        if math.isinf(self.ratio):
            return "greater than any multiple of"
        if 0 < self.value < self.baseline_value:  # of which more is better
            return f"1/{self.ratio:.3g} of"
        return f"{self.ratio:.3g} times"


def costs_elsewhere(table: Sequence[TableRow], also_found: Sequence[str] = ()) -> tuple[Cost, ...]:
    """What the first law of a table costs, compared with the best other law, dearest first.

    Parameters
    ----------
    also_found : as `Result` has it: columns that are no laws to compare with.
    """
    costs = [cost for row in table if (cost := _cost(row, also_found)) is not None]
    return tuple(sorted(costs, key=lambda cost: -cost.ratio))


def _cost(row: TableRow, also_found: Sequence[str]) -> Cost | None:
    """The cost in one quantity; None where the first law is hardly worse, or nothing is known."""
    own = next(iter(row.values), "")
    values = {
        law: value
        for law, value in row.values.items()
        if math.isfinite(value) and law not in also_found
    }
    if row.better == "neither" or own not in values or len(values) < 2:
        return None

    value, sign = values.pop(own), 1.0 if row.better == "less" else -1.0
    baseline = min(values, key=lambda law: sign * values[law])
    best = values[baseline]
    larger, smaller = (value, best) if row.better == "less" else (best, value)

    if larger <= row.negligible or sign * value <= sign * best:
        return None
    smaller = max(smaller, row.negligible)
    ratio = larger / smaller if smaller > 0.0 else math.inf
    if ratio <= WORSE:
        return None
    return Cost(row.key, row.title, row.unit, value, baseline, best, ratio)
