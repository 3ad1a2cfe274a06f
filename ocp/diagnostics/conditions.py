"""What a condition of a certificate is, and what it is tested on."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ocp.arrays import Array
from ocp.mesh.trajectory import Evaluator
from ocp.optimality.iterate import Iterate
from ocp.optimality.multipliers import Multipliers
from ocp.problem.functionals import Functional, Peak


@dataclass(frozen=True)
class Condition:
    """One number, what it may be at most, and what it means."""

    name: str
    value: float
    tolerance: float
    sentence: str

    @property
    def passed(self) -> bool:
        """Whether the value is a number within its tolerance."""
        return bool(self.value <= self.tolerance)

    def __str__(self) -> str:
        return (
            f"{'pass' if self.passed else 'FAIL'}  {self.name}: {self.value:.1e} of "
            f"{self.tolerance:.0e} allowed; {self.sentence}"
        )


@dataclass(frozen=True, eq=False, repr=False)
class Evidence:
    """What the conditions are tested on.

    Attributes
    ----------
    iterate : Iterate
        With the trajectory and the objective that the solution shows.
    multipliers : Multipliers
        As the solution shows them.
    scaled : (rows + n,)
        Scaled multipliers of the rows, then of the unknowns' bounds.
    """

    iterate: Iterate
    multipliers: Multipliers
    scaled: Array
    evaluator: Evaluator

    @property
    def peaks(self) -> dict[Peak, float]:
        """Values of the peaks as the solution shows them."""
        return self.iterate.trajectory.peaks_of(self.iterate.problem)

    def bound_multiplier(self, column: int) -> float:
        """Multiplier of the bound of an unknown [unit of the objective / unit of the unknown]."""
        multiplier = self.scaled[self.iterate.row_multipliers.size + column]
        size = self.iterate.transcription.columns.sizes[column]
        return float(multiplier * self.iterate.scales.objective / size)

    def slope(self, functional: Functional) -> float:
        """Slope by a functional of the objective with the bounds and links adjoined to it."""
        problem = self.iterate.problem
        total = problem.objective
        for bound in problem.boundary_constraints:
            total = total + self.multipliers.boundary[bound.name] * bound.expression
        by_functional = ca.densify(ca.jacobian(total, functional.symbol))
        return self.evaluator.number(self.iterate.trajectory, by_functional, self.peaks)
