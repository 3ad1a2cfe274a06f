"""The way between a condensed program and the plain one.

What is found is expanded to the plain program: the unknowns left out follow from the polynomials
of `ocp.transcription.courses`, and stationarity by them determines the multipliers of the rows
left out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.nlp.ipopt import Duals, NlpResult
from ocp.transcription.courses import Chains
from ocp.transcription.kernels import Program

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Pull:
    """What some instances of a block add to the slopes by the states that polynomials replace.

    Attributes
    ----------
    slopes : ``(w, d, c, multipliers of the rows) ->`` slopes by the local variables replaced.
    columns, data, rows : of the plain program's block, without the rows that are left out.
    intervals : (k,) place of the instances among the group's intervals.
    nodes, states : (r,) or (k, r) support point, from 0 within, and number of the chained state.
    """

    slopes: ca.Function
    columns: Integers
    data: Array
    rows: Integers
    intervals: Integers
    nodes: Integers
    states: Integers

    def add(self, total: Array, x: Array, constants: Array, multipliers: Array) -> None:
        """Add to (m, s, n) slopes."""
        found = self.slopes(
            x[self.columns].T, self.data.T, constants, multipliers[self.rows].T
        ).full().T  # fmt: skip
        np.add.at(total, (self.intervals[:, None], self.nodes, self.states[None, :]), found)


@dataclass(frozen=True, eq=False)
class Part:
    """The chains of a group within a condensed program.

    Attributes
    ----------
    course : ``(arguments, width, constants) ->`` (n, s) scaled states at the support points but
        the left.
    gains : ``constants ->`` (n, n) of each state by each other, scaled, over a unit length.
    dynamics : (m, s, n) rows of the plain program that are left out.
    ends : (m, n) rows of the condensed program in their place.
    """

    chains: Chains
    arguments: Integers
    course: ca.Function
    gains: ca.Function
    dynamics: Integers
    ends: Integers
    pulls: tuple[Pull, ...]

    def inside(self, x: Array, constants: Array) -> Array:
        """(m, s - 1, n) unknowns left out, from those that are there."""
        m, s, n = self.dynamics.shape
        found = self.course(x[self.arguments].T, self.chains.widths.T, constants).full().T
        return found.reshape(m, s, n)[:, :-1]

    def slopes(self, x: Array, constants: Array, multipliers: Array) -> Array:
        """(m, s, n) slopes of the rows that are kept by the states that polynomials replace."""
        total = np.zeros(self.dynamics.shape)
        for pull in self.pulls:
            pull.add(total, x, constants, multipliers)
        return total

    def matrix(self, x: Array, constants: Array) -> Array:
        """(m, s n, s n) slopes of the dynamics by the states at all support points but the left."""
        s, n = self.dynamics.shape[1:]
        given = x[self.arguments] * self.chains.sizes[self.arguments]
        clock = given[:, given.shape[1] - self.chains.clocks :].T
        lengths = self.chains.length(list(clock), self.chains.widths[:, 0])
        rates = np.kron(np.eye(s), np.array(self.gains(constants)))
        fixed = np.kron(self.chains.group.scheme.derivative[:, 1:], np.eye(n))
        return np.asarray(fixed - lengths[:, None, None] * rates)


@dataclass(frozen=True, eq=False)
class Condensed:
    """A condensed program and the way back to the plain one.

    Attributes
    ----------
    columns, rows : unknowns and rows of the plain program that are kept, first and in order.
    bounded, bounds : bounded unknowns that are left out, and the rows in place of their bounds.
    """

    plain: Program
    program: Program
    columns: Integers
    rows: Integers
    bounded: Integers
    bounds: Integers
    parts: tuple[Part, ...]

    def limits(
        self, columns: tuple[Array, Array], rows: tuple[Array, Array]
    ) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        """Limits of unknowns and rows, from those of the plain program."""
        found = []
        for column, row in zip(columns, rows, strict=True):
            side = np.zeros(self.program.rows)
            side[: self.rows.size] = row[self.rows]
            side[self.bounds] = column[self.bounded]
            found.append((column[self.columns], side))
        (low, under), (high, over) = found
        return (low, high), (under, over)

    def duals(self, duals: Duals, x: Array, constants: Array) -> Duals:
        """Multipliers, from those of the plain program at a point of it."""
        rows = np.zeros(self.program.rows)
        rows[: self.rows.size] = duals.rows[self.rows]
        rows[self.bounds] = duals.columns[self.bounded]
        for part in self.parts:
            m, s, n = part.dynamics.shape
            own = duals.rows[part.dynamics].reshape(m, 1, s * n)
            pulled = (own @ part.matrix(x, constants)).reshape(m, s, n)
            pulled += part.slopes(x, constants, duals.rows)
            rows[part.ends] = pulled[:, -1]
        return Duals(duals.columns[self.columns], rows)

    def point(self, x: Array, constants: Array) -> Array:
        """The plain program's unknowns."""
        found = np.zeros(self.plain.variables)
        found[self.columns] = x
        for part in self.parts:
            found[part.chains.inside] = part.inside(found, constants)
        return found

    def expanded(
        self, result: NlpResult, columns: tuple[Array, Array], constants: Array
    ) -> NlpResult:
        """A result in terms of the plain program, whose column limits are given."""
        if not self.parts:
            return result
        x = self.point(result.x, constants)
        bounds, rows = np.zeros(self.plain.variables), np.zeros(self.plain.rows)
        bounds[self.columns] = result.bound_multipliers
        bounds[self.bounded] = result.row_multipliers[self.bounds]
        rows[self.rows] = result.row_multipliers[: self.rows.size]
        for part in self.parts:
            m, s, n = part.dynamics.shape
            pulled = -part.slopes(x, constants, rows)
            pulled[:, :-1] -= bounds[part.chains.inside]
            pulled[:, -1] += result.row_multipliers[part.ends]
            transposed = part.matrix(x, constants).transpose(0, 2, 1)
            solved = np.linalg.solve(transposed, pulled.reshape(m, s * n, 1))
            rows[part.dynamics] = solved.reshape(m, s, n)
        values = np.zeros(self.plain.rows)
        values[self.rows] = result.rows[: self.rows.size]
        if result.outcome != "solved":  # what is violated shows in rows that a user knows
            x = np.clip(x, *columns)
            values = np.array(self.plain.oracle(x, constants)[1]).ravel()
        return replace(result, x=x, rows=values, bound_multipliers=bounds, row_multipliers=rows)
