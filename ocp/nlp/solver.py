"""What `ocp.solve` asks of a solver of nonlinear programs, and what one leaves behind.

A solver of one's own is an object with these five methods, handed over as
``Settings(solver=...)``. `ocp.nlp.ipopt.Ipopt` is the one that comes with the package.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol, runtime_checkable

from ocp.arrays import Array
from ocp.transcription.kernels import Program
from ocp.transcription.transcribe import ProgramLimits

# The last step begins near the point where the run ends after so many, or if it changes no scaled
# unknown by more than this, as after a start from a neighbour.
_NEAR = 3
_SHORT = 1e-3

# [s] that a solver is given at least: it may take none at all for no limit.
LEAST_SECONDS = 1e-3

Outcome = Literal[
    "solved",
    "infeasible",
    "unbounded",
    "overdetermined",
    "budget",
    "invalid number",
    "interrupted",
    "failed",
]


@dataclass(frozen=True, eq=False, repr=False)
class NlpResult:
    """The end of a run.

    Attributes
    ----------
    outcome, status : str
        What became of it, in our words and in the solver's.
    x : (n,)
        Scaled unknowns.
    objective : float
        Scaled.
    rows : (m,)
        The constraint vector, scaled.
    bound_multipliers : (n,)
    row_multipliers : (m,)
        In CasADi's sign, ``L = f + lam^T g``.
    iterations : int
    seconds : float
        Of the wall clock.
    solver : str
        The one that ran.
    attempts : int
        Runs that it took, where there were several.
    added_curvature : float
        What the solver added to the Hessian of the Lagrangian so that its last step led down,
        scaled: 0 near a minimum, positive near a saddle. nan where no step was made, or where the
        solver does not tell.
    last_step : float
        Largest change of a scaled unknown in the last step; nan likewise.
    """

    outcome: Outcome
    status: str
    x: Array
    objective: float
    rows: Array
    bound_multipliers: Array
    row_multipliers: Array
    iterations: int
    seconds: float
    solver: str = "ipopt"
    attempts: int = 1
    added_curvature: float = math.nan
    last_step: float = math.nan

    @property
    def seems_least(self) -> bool | None:
        """Whether the run ends at a minimum and not at a saddle, by the curvature of its last step.

        None if that step began far from the point where the run ends: it tells nothing.
        """
        if self.iterations < _NEAR and not self.last_step <= _SHORT:
            return None
        return self.added_curvature == 0 and self.attempts == 1


Listener = Callable[[int, float, Array, Array], bool]
"""Called at every iteration with its number, the scaled objective, unknowns and rows.

Returns whether the solver is to stop.
"""


class PrimalDualPoint(Protocol):
    """A point of a program, scaled, with its multipliers: see `NlpResult`."""

    @property
    def x(self) -> Array: ...

    @property
    def bound_multipliers(self) -> Array: ...

    @property
    def row_multipliers(self) -> Array: ...


@dataclass(frozen=True, eq=False, repr=False)
class StartingPoint:
    """Where a solver starts.

    Attributes
    ----------
    x : (n,)
        Scaled unknowns.
    multipliers : (bounds (n,), rows (m,)) or None
        Of the bounds of the unknowns and of the rows, scaled, in CasADi's sign,
        ``L = f + lam^T g``; None where they are not known.
    """

    x: Array
    multipliers: tuple[Array, Array] | None = None

    @classmethod
    def at(cls, answer: PrimalDualPoint) -> StartingPoint:
        """The point of an answer of the same program, with its multipliers."""
        return cls(answer.x, (answer.bound_multipliers, answer.row_multipliers))


@runtime_checkable
class NlpSolver(Protocol):
    """A solver of nonlinear programs, with its options."""

    def solve(
        self,
        program: Program,
        start: StartingPoint,
        limits: ProgramLimits,
        parameters: Array,
        listener: Listener | None = None,
    ) -> NlpResult:
        """Minimise the program's objective within its limits.

        Never raises for a failed solve: the outcome tells.

        Parameters
        ----------
        program : Program
            Its functions of ``(x, p)``: objective, rows, and their first and second derivatives.
        start : StartingPoint
            Where to start, with multipliers or without.
        limits : ProgramLimits
            Lower and upper limits of the unknowns (n,) and of the rows (m,).
        parameters : (n_p,)
            Values of the problem's constants.
        listener : callable, optional
            Called at every iteration, see `Listener`.
        """
        ...

    def within(self, iterations: float, seconds: float) -> NlpSolver:
        """The same solver that stops after so many iterations or seconds."""
        ...

    def loosened(self, tolerance: float) -> NlpSolver:
        """The same solver for a mesh that is about to be replaced; itself if that gains nothing."""
        ...

    def within_gap(self, gap: float) -> NlpSolver:
        """The same solver, ending at most this far above the least scaled objective."""
        ...

    def alternatives(self, *, warm: bool) -> Sequence[NlpSolver]:
        """Other options to try in order where these failed, from a start `warm` or not."""
        ...
