"""All sets of multipliers that fit an optimum, by linear programs.

At an ordinary optimum there is one. Where two limits change places there are many, and what is read
off them has a range (`ocp.analysis.sensitivity`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ocp.arrays import Array, Integers
from ocp.optimality.active_set import MULTIPLIER_FREE, LimitDistances
from ocp.optimality.iterate import Iterate
from ocp.optimality.switch_slopes import switch_slopes

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
    """All sets of multipliers that fit: changes `z` with ``equations @ z = constants`` and bounds.

    Attributes
    ----------
    entries : (m,)
        The rows, then unknowns, whose multipliers may change.
    lower, upper : (m,)
        Of the changes.
    many : bool
        Whether more than one set fits the program. Where this is because a switch lies on a
        breakpoint, the `equations` leave one of them, and it need not be that of the solver.
    """

    entries: Integers
    equations: csr_matrix
    constants: Array
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
        nothing = np.zeros(equations.shape[0])
        least, largest = np.maximum(lower, -1.0), np.minimum(upper, 1.0)
        small = cls(entries, equations, nothing, least, largest, False)
        random = np.random.default_rng(0).normal(size=entries.size)
        many = entries.size > nothing.size  # more multipliers than equations for them
        many = many or max(small.most(random), small.most(-random)) > MULTIPLIER_SPREAD
        changes = cls(entries, equations, nothing, lower, upper, many)
        return changes._without_gains_of_switches(iterate, multipliers) if many else changes

    def _without_gains_of_switches(self, iterate: Iterate, multipliers: Array) -> MultiplierChanges:
        """Those that promise nothing of moving a switch that lies on a breakpoint."""
        from scipy.sparse import csr_matrix, vstack

        slopes = switch_slopes(iterate)
        if not slopes.direct.size:
            return self
        sizes = np.maximum(np.abs(slopes.by_multiplier).max(axis=1), 1e-300)
        present = slopes.direct + slopes.by_multiplier @ multipliers
        rows = csr_matrix(slopes.by_multiplier[:, self.entries] / sizes[:, None])
        fewer = replace(
            self,
            equations=vstack([self.equations, rows]).tocsr(),
            constants=np.concatenate([self.constants, -present / sizes]),
        )
        # a control that only seems to switch there says nothing of the multipliers
        return fewer if fewer.exist else self

    @property
    def exist(self) -> bool:
        """Whether any set of multipliers fits."""
        return self._program(np.zeros(self.entries.size)).status == 0

    def most(self, direction: Array) -> float:
        """Largest value of ``direction @ z``; infinite if the linear program has no end."""
        size = float(np.abs(direction).max(initial=0.0))
        if size == 0.0:
            return 0.0
        result = self._program(-direction / size)
        return float(-result.fun * size) if result.status == 0 else math.inf

    def _program(self, cost: Array) -> Any:
        """What HiGHS says of the changes of least cost."""
        from scipy.optimize import linprog

        return linprog(
            cost,
            A_eq=self.equations,
            b_eq=self.constants,
            bounds=np.column_stack([self.lower, self.upper]),
            method="highs",
        )

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
