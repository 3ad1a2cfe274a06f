"""How often something happens among draws, and between which rates the true one lies."""

from __future__ import annotations

from dataclasses import dataclass

from studies.common.configuration import part_below_one


@dataclass(frozen=True)
class Rate:
    """How many of the draws break a limit, and between which rates the true one lies."""

    broken: int
    draws: int
    low: float
    high: float

    @property
    def words(self) -> str:
        """In per cent, with the interval."""
        share = 100 * self.broken / self.draws
        return f"{share:.3g} % ({100 * self.low:.3g} to {100 * self.high:.3g} %)"


def rate(broken: int, draws: int, confidence: float) -> Rate:
    """The rate of an event, with the interval of Clopper and Pearson."""
    from scipy.stats import binomtest

    interval = binomtest(broken, draws).proportion_ci(confidence, method="exact")
    return Rate(broken, draws, float(interval.low), float(interval.high))


# of the confidence of an interval
confidence = part_below_one(", as 0.95 for 95 %")
