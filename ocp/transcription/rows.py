"""The map of the rows: what each row of the constraint vector stands for, and its limits.

It is filled while the blocks of the program are made, so that nobody else has to know in which
order that happens. Limits may depend on the constants of the problem.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ocp.arrays import Array, Integers
from ocp.problem.parameters import Parameters
from ocp.problem.symbols import is_number


class Limits:
    """Scaled lower and upper limits of a growing list of entries.

    A later statement on an entry replaces an earlier one, unless it narrows it.
    """

    def __init__(self, count: int = 0) -> None:
        self.count = count
        self._statements: list[tuple[Integers, Any, Any, float, bool]] = []
        self._back_offs: list[tuple[Integers, Array]] = []

    def take(self, instances: int, limits: list[tuple[Any, Any, float]]) -> Integers:
        """Entries for rows ``(lower, upper, scale)`` repeated; ids of shape (instances, rows)."""
        size = instances * len(limits)
        ids = np.arange(self.count, self.count + size).reshape(instances, len(limits))
        self.count += size
        for j, (lower, upper, scale) in enumerate(limits):
            self.bound(ids[:, j], lower, upper, scale)
        return ids

    def take_equations(self, instances: int, rows: int) -> Integers:
        """Entries for scaled equations ``row = 0``; ids of shape (instances, rows)."""
        return self.take(instances, [(0.0, 0.0, 1.0)] * rows)

    def bound(
        self, ids: Any, lower: Any, upper: Any, scale: float, *, narrows: bool = False
    ) -> None:
        """Set the limits of some entries, in place of those set before or in addition to them."""
        # numbers are told from expressions once, and not for all values of the constants
        low, high = (float(v) if is_number(v) else v for v in (lower, upper))
        self._statements.append((np.asarray(ids).ravel(), low, high, scale, narrows))

    def keep_inside(self, ids: Integers, back_off: Array) -> None:
        """Keep some entries inside their limits, by a scaled back-off each."""
        self._back_offs.append((ids, back_off))

    def at(self, parameters: Parameters) -> tuple[Array, Array]:
        """Scaled lower and upper limits, shape (count,) each, at values of the constants."""
        lower, upper = np.full(self.count, -np.inf), np.full(self.count, np.inf)
        for ids, low, high, scale, narrows in self._statements:
            least = (low if isinstance(low, float) else parameters.limit(low)) / scale
            largest = (high if isinstance(high, float) else parameters.limit(high)) / scale
            lower[ids] = np.maximum(lower[ids], least) if narrows else least
            upper[ids] = np.minimum(upper[ids], largest) if narrows else largest
        for ids, back_off in self._back_offs:
            lower[ids] += back_off
            upper[ids] -= back_off
        return lower, upper


@dataclass(frozen=True, eq=False, repr=False)
class PathRows:
    """Rows of one path constraint: points of intervals at which it is imposed.

    Attributes
    ----------
    phase, constraint : int
        Indices of the phase and of its path constraint.
    rows, intervals, tau : (m,)
        Row, interval and local time of each point.
    weights : (m,)
        Quadrature weights on [0, 1]; nan at points added between the collocation points.
    at_collocation_points : bool
        Whether the points are collocation points, or stand for Bernstein coefficients, so that
        multipliers are densities in time.
    """

    phase: int
    constraint: int
    rows: Integers
    intervals: Integers
    tau: Array
    weights: Array
    at_collocation_points: bool = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "at_collocation_points", bool(np.isfinite(self.weights).all()))


@dataclass(eq=False, repr=False)
class PhaseRows:
    """Rows of one phase.

    Attributes
    ----------
    defects : list of (m, s, n_x)
        Dynamics at the collocation points of each group of intervals.
    totals : (N, n_q)
        Running totals of the integrals over each interval.
    path : list of PathRows
    continuity : list of (m, n_x)
        Right ends of the intervals of each group whose scheme does not end on a support point.
    duration : (1,) or (0,)
        The order of the phase's times, where one is free.
    breakpoints : (k,)
        The order of breakpoints that may move.
    """

    totals: Integers
    defects: list[Integers] = field(default_factory=list)
    path: list[PathRows] = field(default_factory=list)
    continuity: list[Integers] = field(default_factory=list)
    duration: Integers = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    breakpoints: Integers = field(default_factory=lambda: np.empty(0, dtype=np.int64))


@dataclass(eq=False, repr=False)
class Rows:
    """All rows of a program.

    Attributes
    ----------
    limits : Limits
        Of all rows; they give out the numbers of new rows.
    phases : list of PhaseRows
    path : list of PathRows
        Rows of the path constraints of all phases.
    boundary : (n,)
        Bounds and links of the problem, in the order of `Problem.boundary_constraints`.
    """

    limits: Limits = field(default_factory=Limits)
    phases: list[PhaseRows] = field(default_factory=list)
    path: list[PathRows] = field(default_factory=list)
    boundary: Integers = field(default_factory=lambda: np.empty(0, dtype=np.int64))

    def of_constraint(self, phase: int, constraint: int) -> list[PathRows]:
        """Rows of one path constraint of a phase."""
        return [part for part in self.phases[phase].path if part.constraint == constraint]
