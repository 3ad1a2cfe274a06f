"""What a solver of nonlinear programs leaves behind."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ocp.arrays import Array

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
