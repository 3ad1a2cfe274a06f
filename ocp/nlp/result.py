"""What a solver of nonlinear programs leaves behind."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from ocp.arrays import Array

# The last step begins near the point where the run ends after so many, or if it changes no scaled
# unknown by more than this, as after a start from a neighbour.
_NEAR = 3
_SHORT = 1e-3

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
