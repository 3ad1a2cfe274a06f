"""All sets of multipliers that fit an optimum, by linear programs.

At an ordinary optimum there is one. Where two limits change places there are many, and what is read
off them has a range (`ocp.analysis.sensitivity`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ocp.arrays import Array, Integers
from ocp.optimality.active_set import MULTIPLIER_FREE, LimitDistances
from ocp.optimality.iterate import Iterate

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

# Part of a slope, or of the objective per size, beyond which its two ends count as two.
MULTIPLIER_SPREAD = 1e-3

# Largest change of a multiplier that is looked at, in sizes of the largest one. A slope that
# changes by a hundredth of that has no end.
_REACH = 1e3
_ENDLESS = 1e-2


@dataclass(frozen=True, eq=False, repr=False)
class MultiplierChanges:
    """All sets of multipliers that fit: changes `z` with ``equations @ z = 0`` and bounds.

    Attributes
    ----------
    entries : (m,)
        The rows, then unknowns, whose multipliers may change.
    lower, upper : (m,)
        Of the changes.
    many : bool
        Whether there is a change but zero.
    """

    entries: Integers
    equations: csr_matrix
    lower: Array
    upper: Array
    many: bool

    @classmethod
    def of(
        cls, iterate: Iterate, multipliers: Array, distances: LimitDistances
    ) -> MultiplierChanges:
        """The multipliers around those of a solution."""
        from scipy.sparse import csr_matrix, hstack, identity  # slow to load, seldom needed

        program = iterate.transcription.program
        jacobian = program.constraint_jacobian(iterate.x, iterate.parameters.vector)[1].sparse()
        everything = hstack([csr_matrix(jacobian).T, identity(iterate.x.size)]).tocsc()

        # multipliers of touched limits may take any value of their sign, of equations any at all
        near_lower, near_upper = distances.touching(MULTIPLIER_FREE)
        entries = np.flatnonzero(near_lower | near_upper)
        is_equation = (distances.lower + distances.upper)[entries] <= 0.0
        reach = _REACH * max(1.0, float(np.abs(multipliers).max()))
        present = multipliers[entries]
        lower = np.where(is_equation | near_lower[entries], -reach, np.minimum(-present, 0.0))
        upper = np.where(is_equation | near_upper[entries], reach, np.maximum(-present, 0.0))
        equations = csr_matrix(everything[:, entries])

        # unless zero is the only change, one of two opposite random directions finds another
        small = cls(entries, equations, np.maximum(lower, -1.0), np.minimum(upper, 1.0), False)
        random = np.random.default_rng(0).normal(size=entries.size)
        many = max(small.most(random), small.most(-random)) > MULTIPLIER_SPREAD
        return cls(entries, equations, lower, upper, many)

    def most(self, direction: Array) -> float:
        """Largest value of ``direction @ z``; infinite if the linear program has no end."""
        size = float(np.abs(direction).max(initial=0.0))
        if size == 0.0:
            return 0.0
        from scipy.optimize import linprog

        result = linprog(
            -direction / size,
            A_eq=self.equations,
            b_eq=np.zeros(self.equations.shape[0]),
            bounds=np.column_stack([self.lower, self.upper]),
            method="highs",
        )
        return float(-result.fun * size) if result.status == 0 else math.inf

    def range_of(self, by_multiplier: Array) -> tuple[float, float]:
        """Smallest and largest change of a slope; infinite at the edge of what is looked at.

        Parameters
        ----------
        by_multiplier : (rows and unknowns,)
            Derivatives of the slope.
        """
        direction = by_multiplier[self.entries]
        edge = _ENDLESS * _REACH * float(np.abs(direction).max(initial=0.0))
        down, up = -self.most(-direction), self.most(direction)
        return (-math.inf if down < -edge else down), (math.inf if up > edge else up)
