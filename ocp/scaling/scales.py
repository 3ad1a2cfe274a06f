"""Typical sizes, in the units of the statement."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from ocp.problem.functionals import Functional
from ocp.scaling.symbol_sizes import STATED


@dataclass(frozen=True, repr=False)
class Scales:
    """Typical sizes, in the units of the statement.

    Attributes
    ----------
    signals, unknowns, functionals : size by name (functionals by object).
    bounds : size by (phase name or "", bound name).
    time : typical duration [s].
    objective : size of the objective.
    reasons : where each size comes from, by kind and the key above.
    """

    signals: Mapping[str, float]
    unknowns: Mapping[str, float]
    bounds: Mapping[tuple[str, str], float]
    functionals: Mapping[Functional, float]
    time: float
    objective: float
    reasons: Mapping[tuple[str, Any], str] = field(default_factory=dict)

    def __repr__(self) -> str:
        return (
            f"Scales({len(self.signals)} signals, {len(self.bounds)} bounds; objective "
            f"{self.objective:.4g}, time {self.time:.4g} s)"
        )

    @property
    def symbols(self) -> dict[str, float]:
        """Size of each signal and unknown by name."""
        return {**self.signals, **self.unknowns}

    @property
    def symbols_with_reasons(self) -> Iterator[tuple[str, float, str]]:
        """Names of signals and unknowns, their sizes, and where these come from."""
        for kind, sizes in (("signal", self.signals), ("unknown", self.unknowns)):
            for name, size in sizes.items():
                yield name, size, self.reasons.get((kind, name), "")

    @property
    def objective_is_stated(self) -> bool:
        """Whether the objective's size was stated."""
        return self.reasons.get(("objective", "")) == STATED
