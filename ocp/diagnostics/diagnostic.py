"""What a diagnostic is, what it is given, and what it says."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Protocol

import casadi as ca

from ocp.arrays import Array
from ocp.diagnostics.tolerances import Tolerances
from ocp.mesh.trajectory import Evaluator, Trajectory
from ocp.optimality.iterate import Iterate
from ocp.optimality.multipliers import Multipliers
from ocp.problem.functionals import Functional, Peak


@dataclass(frozen=True, eq=False)
class Finding:
    """One number, what it may be at most, and what it means.

    Attributes
    ----------
    name : str
    value, tolerance : float
        Of the same unit.
    sentence : str
    start : Trajectory or None
        A motion from which a solve should reach a better answer, if one was found.
    open : bool
        Whether it could not be finished, so that the value says nothing.
    """

    name: str
    value: float
    tolerance: float
    sentence: str
    start: Trajectory | None = None
    open: bool = False

    @property
    def passed(self) -> bool:
        """Whether the value is a number within its tolerance."""
        return not self.open and bool(self.value <= self.tolerance)

    @property
    def failed(self) -> bool:
        """Whether it was finished, and the value is no number within its tolerance."""
        return not (self.passed or self.open)

    def __str__(self) -> str:
        if self.open:
            return f"open  {self.name}: {self.sentence}"
        return (
            f"{'pass' if self.passed else 'FAIL'}  {self.name}: {self.value:.1e} of "
            f"{self.tolerance:.0e} allowed; {self.sentence}"
        )


class Diagnostic(Protocol):
    """What `certify` asks about an answer: any function from its evidence to findings.

    The functions of `ocp.diagnostics.standard` are some. One of your own may read whatever the
    evidence holds, and solve again if it likes::

        def cool_enough(answer: Evidence) -> Iterator[Finding]:
            hottest = answer.solution.sample(temperature, times).max()
            yield Finding("temperature", hottest, 350.0, "the largest at these times [K]")


        certify(solution, diagnostics=(*STANDARD, cool_enough))
    """

    def __call__(self, answer: Evidence, /) -> Iterable[Finding]:
        """What is found; one finding at least for whatever was looked at, right or wrong."""
        ...


@dataclass(frozen=True, eq=False, repr=False)
class Evidence:
    """An answer, as a diagnostic looks at it.

    Attributes
    ----------
    solution : Solution
        As it was handed to `certify`.
    iterate : Iterate
        With the trajectory and the objective that the solution shows, if it is the statement that
        was solved.
    multipliers : Multipliers
        As the solution shows them.
    scaled : (rows + n,)
        Scaled multipliers of the rows, then of the unknowns' bounds.
    evaluator : Evaluator
        Of expressions along the motion.
    allowed : Tolerances
        Of the certificate.
    """

    solution: Any
    iterate: Iterate
    multipliers: Multipliers
    scaled: Array
    evaluator: Evaluator
    allowed: Tolerances

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
