"""All sets of multipliers that fit an optimum, by linear programs.

At an ordinary optimum there is one. Where two limits change places there are many, and what is read
off them has a range (`ocp.analysis.sensitivity`).

Fine meshes have many as well: along an arc more limits are active at the points than the arc has
unknowns. What is read off is then still one number, mostly. That is asked first, without signs and
by one factorisation for all questions: a linear function of the multipliers is the same for all of
them if it is a combination of the equations that they solve.

On a breakpoint where a control switches it is at one limit before and at the other one behind. If
the mesh does not let it move, the program says nothing of its neighbourhood: many sets of
multipliers fit. Those of the problem itself are among them, and they tell no gain by a move of the
switch (Bryson and Ho, Applied Optimal Control, ch. 3.7: the Hamiltonian has no jump).
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ocp.arrays import Array, Integers
from ocp.optimality.active_set import MULTIPLIER_FREE, LimitDistances, limit_distances
from ocp.optimality.iterate import Iterate
from ocp.optimality.multipliers import all_multipliers

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix, csr_matrix
    from scipy.sparse.linalg import SuperLU
from collections.abc import Iterator

from ocp.arrays import Flags
from ocp.mesh.mesh import Mesh
from ocp.optimality.active_set import AT, share_at_limit
from ocp.transcription.transcribe import transcribe

# Of the shorter interval beside a breakpoint: the step of a central difference. Rows are smooth in
# the widths of intervals, most of them linear.
_STEP = 1e-4

_NOTHING = 1e-300  # so that nothing is divided by zero

# Of the phase: a breakpoint this close to a known instant belongs to it and stays there.
_SAME = 1e-9


@dataclass(frozen=True, eq=False, repr=False)
class SwitchSlopes:
    """Derivatives of the Lagrangian by breakpoints: ``direct + by_multiplier @ multipliers``.

    Scaled, so that the largest factor of a multiplier is one.

    Attributes
    ----------
    direct : (k,)
    by_multiplier : (k, rows + unknowns)
    """

    direct: Array
    by_multiplier: Array

    def of(self, multipliers: Array) -> Array:
        """The derivatives for scaled multipliers (rows + unknowns,), shape (k,)."""
        return self.direct + self.by_multiplier @ multipliers

    def promised(self, multipliers: Array) -> Array:
        """Their moduli, in parts of the largest share of each, (k,)."""
        shares = np.abs(self.by_multiplier * multipliers).max(axis=1, initial=0.0)
        return np.abs(self.of(multipliers)) / np.maximum(shares, np.abs(self.direct) + _NOTHING)


def switch_slopes(iterate: Iterate) -> SwitchSlopes:
    """Of all fixed breakpoints at which a control switches."""
    unknowns = np.zeros(iterate.x.size)
    slopes = []
    for index, phase in enumerate(iterate.mesh.phases):
        for number in _switches(iterate, index):
            width = np.diff(phase.breakpoints)
            step = _STEP * min(width[number - 1], width[number])
            before, after = (_values(iterate, index, number, part) for part in (-step, step))
            slope = (after - before) / (2.0 * step)
            slopes.append(np.concatenate([slope / np.abs(slope).max(), unknowns]))
    size = iterate.transcription.program.rows + iterate.x.size
    table = np.array(slopes).reshape(-1, 1 + size)
    return SwitchSlopes(table[:, 0], table[:, 1:])


def _values(iterate: Iterate, index: int, number: int, step: float) -> Array:
    """Objective and rows of the same unknowns where a breakpoint stands elsewhere."""
    of_phase = iterate.mesh.phases[index]
    points = of_phase.breakpoints.copy()
    points[number] += step
    phases = list(iterate.mesh.phases)
    phases[index] = replace(of_phase, breakpoints=points)

    known = iterate.transcription
    mesh = Mesh(tuple(phases), iterate.mesh.extra, iterate.mesh.back_off)
    moved = transcribe(known.problem, mesh, known.scheme, known.controls, known.scales, known)
    objective, rows = moved.program.oracle(iterate.x, iterate.parameters.vector)
    return np.concatenate([[float(objective)], np.array(rows).ravel()])


def _switches(iterate: Iterate, index: int) -> Integers:
    """Numbers of the breakpoints of a phase that stay and carry a switch."""
    motion, mesh = iterate.trajectory.phases[index], iterate.mesh.phases[index]
    switch = np.zeros(mesh.intervals - 1, dtype=bool)
    for low, high in _at_limits(iterate, index):
        switch |= (low[:-1] & high[1:]) | (high[:-1] & low[1:])
    switch &= ~(mesh.moving[:-1] | mesh.moving[1:])

    numbers = np.flatnonzero(switch) + 1
    known = motion.fractions_of(iterate.problem.instants[motion.name])
    apart = np.abs(mesh.breakpoints[numbers][:, None] - known[None, :]) > _SAME
    return np.asarray(numbers[apart.all(axis=1)])


def _at_limits(iterate: Iterate, index: int) -> Iterator[tuple[Flags, Flags]]:
    """For each control with two limits, in which intervals it is all through at either one."""
    motion = iterate.trajectory.phases[index]
    for control in motion.controls:
        lower, upper = iterate.parameters.signal_limits[control]
        if not np.isfinite(upper - lower):
            continue
        margin, values = AT * (upper - lower), motion.polynomial(control)
        yield (
            share_at_limit(values, lower, margin) == 1.0,
            share_at_limit(values, upper, margin) == 1.0,
        )


# Part of a slope, or of the objective per size, beyond which its two ends count as two.
MULTIPLIER_SPREAD = 1e-3

# Largest change of a multiplier that is looked at, in sizes of the largest one. A slope that
# changes by a hundredth of that has no end.
_REACH = 1e3
_ENDLESS = 1e-2

# Of a linear program: beyond so many changes, or steps of the simplex method, it takes minutes, and
# the multipliers that a solver found are good enough.
_MOST_CHANGES = 5000
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

# Of the largest multiplier: what moving a switch may promise, which is the noise of a solver.
_NOISE = 1e-8


def fitted_to_switches(iterate: Iterate) -> Iterate:
    """The iterate with multipliers by which no switch should move; by its own it mostly should.

    Where a switch lies on a fixed breakpoint, the solver ends with any of the sets that fit.
    Costates, Hamiltonian and slopes are those of the problem for the set that is taken here.
    """
    slopes = switch_slopes(iterate)
    if not slopes.direct.size:
        return iterate
    multipliers = all_multipliers(iterate)
    if np.all(slopes.promised(multipliers) <= _NOISE):
        return iterate

    around = MultiplierChanges.around(iterate, multipliers, limit_distances(iterate))
    if around.entries.size > _MOST_CHANGES:
        return iterate
    change = around.without_gains_of(slopes, multipliers).least()
    if change is None:  # a control that only seems to switch there
        return iterate
    changes = np.zeros(multipliers.size)
    changes[around.entries] = change
    of_rows, of_unknowns = np.split(changes, [iterate.row_multipliers.size])
    return replace(
        iterate,
        row_multipliers=iterate.row_multipliers + of_rows,
        bound_multipliers=iterate.bound_multipliers + of_unknowns,
        built=iterate.transcription,
    )


@dataclass(frozen=True, eq=False, repr=False)
class MultiplierChanges:
    """All sets of multipliers that fit: changes `z` with ``equations @ z = constants`` and bounds.

    Attributes
    ----------
    entries : (m,)
        The rows, then unknowns, whose multipliers may change.
    lower, upper : (m,)
        Of the changes.
    constants : (k,)
        Zero, but where a set is asked for that promises nothing of moving a switch.
    many : bool
        Whether more than one set fits the program.
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
        """The multipliers around those of a solution; where there are many, by their switches."""
        around = cls.around(iterate, multipliers, distances)

        # unless zero is the only change, one of two opposite random directions finds another
        least, largest = np.maximum(around.lower, -1.0), np.minimum(around.upper, 1.0)
        small = replace(around, lower=least, upper=largest)
        random = np.random.default_rng(0).normal(size=around.entries.size)
        if around.combination(random) is not None:
            return around
        if np.all(np.array([small.most(random), small.most(-random)]) <= MULTIPLIER_SPREAD):
            return around

        many = replace(around, many=True)
        by_switches = many.without_gains_of(switch_slopes(iterate), multipliers)
        return many if by_switches.least() is None else by_switches

    @classmethod
    def around(
        cls, iterate: Iterate, multipliers: Array, distances: LimitDistances
    ) -> MultiplierChanges:
        """All changes that leave the Lagrangian stationary; whether there are many is not asked."""
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
        equations = csr_matrix(everything[:, entries])

        return cls(entries, equations, np.zeros(equations.shape[0]), lower, upper, many=False)

    def without_gains_of(self, slopes: SwitchSlopes, multipliers: Array) -> MultiplierChanges:
        """Those by which no switch on a breakpoint should move."""
        from scipy.sparse import csr_matrix, vstack

        rows = csr_matrix(slopes.by_multiplier[:, self.entries])
        return replace(
            self,
            equations=vstack([self.equations, rows]).tocsr(),
            constants=np.concatenate([self.constants, -slopes.of(multipliers)]),
        )

    def least(self) -> Array | None:
        """The change (m,) of the least sum of moduli; None if none fits, or none is found soon."""
        from scipy.optimize import linprog
        from scipy.sparse import hstack

        # as the difference of two parts that are not negative
        result = linprog(
            np.ones(2 * self.entries.size),
            A_eq=hstack([self.equations, -self.equations]).tocsr(),
            b_eq=self.constants,
            bounds=np.column_stack(
                [
                    np.zeros(2 * self.entries.size),
                    np.concatenate([np.maximum(self.upper, 0.0), np.maximum(-self.lower, 0.0)]),
                ]
            ),
            method="highs-ds",
            options={"maxiter": _MOST_STEPS},
        )
        return np.subtract(*np.split(result.x, 2)) if result.status == 0 else None

    def combination(self, direction: Array) -> Array | None:
        """Factors (k,) with which the equations add up to a direction (m,); None if none do.

        Then ``direction @ z`` is the same for all changes, whatever their signs may be.
        """
        factors, rest = np.zeros(self.equations.shape[0]), direction
        for _ in range(_REFINEMENTS):
            solved = self._projection.solve(np.concatenate([rest, np.zeros(factors.size)]))
            rest, factors = solved[: rest.size], factors + solved[rest.size :]
        allowed = _ROUNDING * np.linalg.norm(direction)
        return factors if np.linalg.norm(rest) <= allowed else None

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
            b_eq=self.constants,
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
        factors = self.combination(direction)
        if factors is not None:
            change = float(factors @ self.constants)
            return change, change
        edge = _ENDLESS * _REACH * float(np.abs(direction).max(initial=0.0))
        down, up = -self.most(-direction), self.most(direction)
        if math.isnan(down) or math.isnan(up):
            return math.nan, math.nan
        return (-math.inf if down < -edge else down), (math.inf if up > edge else up)
