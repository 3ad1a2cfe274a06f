"""What a solver of nonlinear programs leaves behind."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from ocp.arrays import Array

# Steps after which the last one began near the point where it ends.
NEAR = 3

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
        What the last step needed to lead down, scaled: nothing near a least value, something near a
        saddle. nan where no step was made, or where the solver does not tell.
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

    @property
    def seems_least(self) -> bool:
        """Whether the last step led down by itself, from a point near the one where it ends.

        A warm start for other constants may take one step, with the curvature that there was.
        """
        return self.added_curvature == 0 and self.attempts == 1 and self.iterations >= NEAR
