"""What a diagnostic is: what it is given, what it may allow, and what it says."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from typing import Any, Protocol

import casadi as ca

from ocp.accuracy import SLACK, Accuracy
from ocp.arrays import Array
from ocp.errors import StatementError
from ocp.estimates.estimated_gain import CERTIFIED_GAIN
from ocp.keywords import checked_keywords
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


@checked_keywords()
@dataclass(frozen=True)
class Tolerances:
    """What a certificate allows, all relative.

    Attributes
    ----------
    replay : float
        Missed end state of the replay, and what the dynamics are off by between the points: what a
        solve asks for by default.
    excess : float
        Excess of a path constraint or peak of the replay: ten times the default of a solve, because
        the replayed motion is off by a little, too.
    objective, bounds : float
        Difference of the replayed objective, and excess of the problem's bounds and links: ten
        times the default for the missed end state, as misses of all states act on them.
    feasible : float
        Violated rows and bounds of the scaled program. The solver stops at 1e-10.
    stationary : float
        Slope of the scaled Lagrangian. The solver stops at 1e-6.
    complementary : float
        Product of an inequality's multiplier and the distance to its limit. The solver accepts
        1e-8.
    within : float
        Range of the Hamiltonian between two changes of the active set, where costates are as exact
        as the slope of the Lagrangian. Not where a path constraint acts: there `gain` counts.
    strict : float
        Worst interval mean of dH/du, in all intervals but those that hold a change of the active
        set or are next to one. It is relative to terms that cancel, hence wider than `within`.
    hamiltonian : float
        Mean drift of the Hamiltonian over the whole phase, and its end values at free times.
        Costates are of first order only in intervals that hold a jump of theirs, so that this is
        far wider than what holds between changes.
    slope : float
        Interval means of dH/du, averaged over time, changes included.
    gain : float
        What a better motion may gain, relative to the objective: by finer or other
        controls, or by other breakpoints where a path constraint acts. It is ten times the default
        of a solve, because such an estimate is of first order, and often ten times what is gained.
        The same for what a second solve reaches.
    steps : float
        Jump of a rate, integrand or constraint whose time depends on the motion, relative to its
        largest value: what is left where two branches are meant to be one function.

    Raises
    ------
    StatementError
        For a tolerance that is no positive number.
    """

    replay: float = Accuracy.replay
    excess: float = SLACK * Accuracy.path
    objective: float = 1e-5
    bounds: float = objective
    feasible: float = 1e-8
    stationary: float = 1e-5
    complementary: float = 1e-6
    hamiltonian: float = 5e-3
    slope: float = 1e-3
    within: float = 1e-5
    strict: float = 1e-4
    gain: float = CERTIFIED_GAIN
    steps: float = 1e-6

    def __post_init__(self) -> None:
        for entry in fields(self):
            value = getattr(self, entry.name)
            # infinite switches a check off
            if not (isinstance(value, (int, float)) and value > 0):
                raise StatementError(
                    f"the tolerance '{entry.name}' of a certificate is {value!r}; "
                    "give a positive number"
                )


class Diagnostic(Protocol):
    """What `certify` asks about an answer: any function from its evidence to findings.

    The functions in `ocp.STANDARD` are some. One of your own may read whatever the
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
