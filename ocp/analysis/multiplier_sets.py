"""All sets of multipliers that fit an optimum, by linear programs.

At an ordinary optimum there is one. Where two limits change places there are many, and what is read
off them has a range (`ocp.analysis.sensitivity`).

Fine meshes have many as well: along an arc more limits are active at the points than the arc has
unknowns. What is read off is then still one number, mostly. That is asked first, without signs and
by one factorisation for all questions: a linear function of the multipliers is the same for all of
them if it is a combination of the equations that they solve.
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ocp.arrays import Array, Integers
from ocp.optimality.active_set import MULTIPLIER_FREE, LimitDistances
from ocp.optimality.iterate import Iterate

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix, csr_matrix
    from scipy.sparse.linalg import SuperLU

# Part of a slope, or of the objective per size, beyond which its two ends count as two.
MULTIPLIER_SPREAD = 1e-3

# Largest change of a multiplier that is looked at, in sizes of the largest one. A slope that
# changes by a hundredth of that has no end.
_REACH = 1e3
_ENDLESS = 1e-2

# Steps of the simplex method: beyond, a linear program takes minutes.
_MOST_STEPS = 5000

# HiGHS's presolve ends without an answer on such programs, whose changes of zero fit; its tolerance
# is that of sums of scaled multipliers.
_LINEAR_PROGRAM = {
    "presolve": False,
    "primal_feasibility_tolerance": 1e-9,
    "maxiter": _MOST_STEPS,
}

# Part of a direction that may be no combination of the equations, relative: what rounding leaves
# where their singular values reach down to 1e-9.
_ROUNDING = 1e-5
# What keeps the projection onto these combinations regular, and steps that take it away again. The
# next one where rounding swallows one.
_REGULAR = (1e-18, 1e-15, 1e-12, 1e-9)
_REFINEMENTS = 3


@dataclass(frozen=True, eq=False, repr=False)
class MultiplierChanges:
    """All sets of multipliers that fit: changes `z` with ``equations @ z = 0`` and bounds.

    Attributes
    ----------
    entries : (m,)
        The rows, then unknowns, whose multipliers may change.
    equations : (k, m)
        By which the Lagrangian stays stationary.
    lower, upper : (m,)
        Of the changes.
    many : bool
        Whether more than one set fits the program.
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

        # multipliers of active limits may take any value of their sign, of equations any at all
        near_lower, near_upper = distances.active(MULTIPLIER_FREE)
        entries = np.flatnonzero(near_lower | near_upper)
        is_equation = (distances.lower + distances.upper)[entries] <= 0.0
        reach = _REACH * max(1.0, float(np.abs(multipliers).max()))
        present = multipliers[entries]
        lower = np.where(is_equation | near_lower[entries], -reach, np.minimum(-present, 0.0))
        upper = np.where(is_equation | near_upper[entries], reach, np.maximum(-present, 0.0))
        around = cls(entries, csr_matrix(everything[:, entries]), lower, upper, many=True)

        # unless zero is the only change, one of two opposite random directions finds another
        small = replace(around, lower=np.maximum(lower, -1.0), upper=np.minimum(upper, 1.0))
        random = np.random.default_rng(0).normal(size=entries.size)
        one = around.is_combination(random) or np.all(
            np.array([small.most(random), small.most(-random)]) <= MULTIPLIER_SPREAD
        )
        return replace(around, many=not one)

    def is_combination(self, direction: Array) -> bool:
        """Whether the equations add up to a direction (m,).

        Then ``direction @ z`` is zero for all changes, whatever their signs may be.
        """
        padding = np.zeros(self.equations.shape[0])
        rest = direction
        for _ in range(_REFINEMENTS):
            rest = self._projection.solve(np.concatenate([rest, padding]))[: rest.size]
        return bool(np.linalg.norm(rest) <= _ROUNDING * np.linalg.norm(direction))

    @cached_property
    def _projection(self) -> SuperLU:
        """Solves for the part of a direction that is no combination of the equations."""
        from scipy.sparse.linalg import splu

        for regular in _REGULAR[:-1]:
            with suppress(RuntimeError):  # a pivot of zero
                return splu(self._with(regular))
        return splu(self._with(_REGULAR[-1]))

    def _with(self, regular: float) -> csc_matrix:
        """The matrix of the projection, kept regular by so much."""
        from scipy.sparse import bmat, identity

        k, m = self.equations.shape
        blocks = [[identity(m), self.equations.T], [self.equations, -regular * identity(k)]]
        return bmat(blocks).tocsc()

    def most(self, direction: Array) -> float:
        """Largest value of ``direction @ z``; nan if the linear program ends without an answer."""
        size = float(np.abs(direction).max(initial=0.0))
        if size == 0.0:
            return 0.0
        from scipy.optimize import linprog

        result = linprog(
            -direction / size,
            A_eq=self.equations,
            b_eq=np.zeros(self.equations.shape[0]),
            bounds=np.column_stack([self.lower, self.upper]),
            method="highs-ds",
            options=_LINEAR_PROGRAM,
        )
        return float(-result.fun * size) if result.status == 0 else math.nan

    def range_of(self, by_multiplier: Array) -> tuple[float, float]:
        """Smallest and largest change of a slope; infinite at the edge of what is looked at.

        Both are nan where a linear program ends without an answer.

        Parameters
        ----------
        by_multiplier : (rows and unknowns,)
            Derivatives of the slope.
        """
        direction = by_multiplier[self.entries]
        if self.is_combination(direction):
            return 0.0, 0.0
        edge = _ENDLESS * _REACH * float(np.abs(direction).max(initial=0.0))
        down, up = -self.most(-direction), self.most(direction)
        if math.isnan(down) or math.isnan(up):
            return math.nan, math.nan
        return (-math.inf if down < -edge else down), (math.inf if up > edge else up)
