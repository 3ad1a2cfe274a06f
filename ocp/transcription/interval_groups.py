"""Intervals of one kind: where their unknowns are, counted from the first one of each interval."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocp.arrays import Integers
from ocp.numerics.schemes import Collocation
from ocp.problem.symbols import Control

# first column, rows and columns of a table of unknowns that follow each other
_Table = tuple[int, int, int]


@dataclass(frozen=True, eq=False, repr=False)
class ControlSet:
    """Controls that are polynomials of the same order in an interval.

    Attributes
    ----------
    order : int or None
        None for the highest that the scheme determines, which depends on the degree.
    one_fewer : bool
        Whether controls of the highest order have one coefficient fewer than there are points.
    """

    controls: tuple[Control, ...]
    order: int | None
    one_fewer: bool = False


@dataclass(frozen=True, eq=False, repr=False)
class IntervalGroup:
    """The intervals of one degree whose breakpoints all stay, or all have a movable end.

    Attributes
    ----------
    collocation : Collocation
    intervals : (m,)
        Their numbers.
    moving : bool
        Whether they have a movable end.
    support : (m, s + 1, n_x)
        Columns of the states at the support points.
    controls : tuple of (m, count, n)
        Columns of the Bernstein coefficients of each set of controls, so that bounds on them bound
        the controls at all times.
    algebraics : (m, s, n_z)
        Columns of the algebraic signals at the collocation points.
    """

    collocation: Collocation
    intervals: Integers
    moving: bool
    support: Integers
    controls: tuple[Integers, ...]
    algebraics: Integers


@dataclass(frozen=True, eq=False, repr=False)
class IntervalLayout:
    """Where the unknowns of an interval of one degree are, counted from its first column.

    The states and the running totals at its left breakpoint come first. Controls of a fixed order
    follow, whose columns do not depend on the degree, then the states inside, the other controls,
    and the algebraic signals.

    Attributes
    ----------
    rule : Collocation
    controls : tuple of (first, rows, columns)
        The coefficients of each set of controls, one row a coefficient.
    inner, algebraics : (first, rows, columns)
        The states inside and the algebraic signals, one row a point.
    length : int
        Number of all columns of the interval.
    """

    rule: Collocation
    controls: tuple[_Table, ...]
    inner: _Table
    algebraics: _Table
    length: int

    @classmethod
    def of(
        cls,
        rule: Collocation,
        control_sets: tuple[ControlSet, ...],
        states: int,
        totals: int,
        algebraics: int,
        determined: bool,
    ) -> IntervalLayout:
        """For numbers of signals; with `determined` equations give all coefficients of controls."""
        place = states + totals

        def table(rows: int, columns: int) -> _Table:
            nonlocal place
            begin, place = place, place + rows * columns
            return begin, rows, columns

        def of_sets(*, fixed: bool) -> dict[ControlSet, _Table]:
            return {
                members: table(_coefficients(members, rule, determined), len(members.controls))
                for members in control_sets
                if (members.order is not None) == fixed
            }

        leading = of_sets(fixed=True)
        inner = table(rule.inner, states)
        tables = leading | of_sets(fixed=False)
        of_algebraics = table(rule.degree, algebraics)
        controls = tuple(tables[members] for members in control_sets)
        return cls(rule, controls, inner, of_algebraics, length=place)

    def group(
        self, intervals: Integers, moving: bool, begins: Integers, nodes: Integers
    ) -> IntervalGroup:
        """The unknowns of some intervals.

        Parameters
        ----------
        intervals : (m,)
            Their numbers.
        begins : (N + 1,)
            The first columns of all intervals of the phase, and of its last breakpoint.
        nodes : (N + 1, n_x)
            Columns of the states there.
        """

        def columns(table: _Table) -> Integers:
            place, rows, count = table
            inside = np.arange(rows * count).reshape(rows, count)
            return np.asarray(begins[intervals][:, None, None] + place + inside)

        support = [nodes[intervals][:, None, :], columns(self.inner)]
        if self.rule.ends_on_support:
            support.append(nodes[intervals + 1][:, None, :])
        return IntervalGroup(
            collocation=self.rule,
            intervals=intervals,
            moving=moving,
            support=np.concatenate(support, axis=1),
            controls=tuple(columns(table) for table in self.controls),
            algebraics=columns(self.algebraics),
        )


def _coefficients(members: ControlSet, rule: Collocation, determined: bool) -> int:
    """Number of coefficients of a set of controls in an interval."""
    if members.order is not None:
        return members.order + 1
    if determined:
        return rule.degree
    return max(1, min(rule.choices, rule.degree - members.one_fewer))
