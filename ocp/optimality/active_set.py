"""The active set: which limits a solution lies at, and which of them hold it there.

A limit is *active* where a value is close to it. It is *strongly active* where its multiplier is
more than what the solver's barrier leaves everywhere. At an ordinary optimum the two are the same.
They differ where a limit is about to enter or to leave the active set.

How close is close depends on what is concluded from it. The constants below are all that the engine
uses, each with its reason. They count on a barrier parameter of about 1e-10 to 1e-12, which IPOPT
reaches at the default tolerance: distance times multiplier of a limit, both scaled, are about that
parameter.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from ocp.arrays import Array, Flags
from ocp.numerics.piecewise_polynomial import PiecewisePolynomial
from ocp.optimality.iterate import Iterate

# Part of a signal's size, or of its range, within which a value is at its bound. A strongly active
# bound is met to 1e-8 or better, another active one to the square root of the barrier parameter.
# What stays farther away than that stays away on purpose.
AT = 1e-5

# Part of a signal's size, or of its range, within which a value may be at its bound between
# samples. For conclusions that only hold off the bounds, so that a false alarm costs nothing.
CLOSE = 1e-3

# Scaled distance of a row or an unknown from an active limit, strongly active or not. It is ten
# times the square root of a barrier parameter of 1e-10.
ACTIVE = 1e-4

# Scaled distance at which the multiplier of a limit is free to be any number of its sign. Limits
# with a scaled multiplier above 1e-4 are met that closely; a smaller one counts as none.
MULTIPLIER_FREE = 1e-6

# Scaled product of a limit's multiplier and the distance from it that a solver leaves: ten times a
# barrier parameter of 1e-10. It is also what moving on to the limit would gain, in parts of the
# objective's size. A larger product is no remainder of the barrier.
LEFT = 1e-9

# The same of all limits of a phase's controls together. A run that ends where it stands still may
# leave more at each of them. To first order the objective gains no more than the sum by moving all
# these controls on to their limits.
LEFT_TOGETHER = 1e-6

# Part of the largest multiplier of the same limit, from which on that one is strongly active.
# Where it is not, the barrier leaves about 1e-10 over the scaled distance.
STRONGLY_ACTIVE = 1e-6

# Part of the largest multiplier of all paths and states, from which on one of them shapes the
# costates. Coarser than `STRONGLY_ACTIVE`, because small multipliers bend costates only a little.
ACTING = 1e-4


def at_limit(values: Array, limit: float, margin: float) -> Flags:
    """Whether values are within a margin of a limit; none is, if the limit is infinite."""
    return np.asarray(np.abs(values - limit) <= margin)


def share_at_limit(polynomial: PiecewisePolynomial, limit: float, margin: float) -> Array:
    """The part of an interval's coefficients that are at a limit, shape (N,).

    Parameters
    ----------
    polynomial : PiecewisePolynomial
        With one component. A share of one means, for a Bernstein basis, that the signal is at its
        limit all through the interval.
    limit, margin : float
        In the unit of the signal.
    """
    shares = np.zeros(polynomial.intervals)
    for piece in polynomial.pieces:
        at = at_limit(piece.coefficients[:, :, 0], limit, margin)
        shares[piece.intervals] = at.mean(axis=1)
    return shares


@dataclass(frozen=True, eq=False, repr=False)
class LimitDistances:
    """Scaled distances of a program's rows and unknowns from their limits.

    Attributes
    ----------
    lower, upper : (rows + unknowns,)
        Rows first. Negative where a limit is violated, infinite where there is none.
    """

    lower: Array
    upper: Array

    def active(self, closeness: float) -> tuple[Flags, Flags]:
        """Which lower and which upper limits are closer than a scaled distance."""
        return self.lower <= closeness, self.upper <= closeness

    @property
    def violation(self) -> float:
        """Largest violation of any limit, 0 if there is none."""
        return max(0.0, -float(self.lower.min()), -float(self.upper.min()))


def limit_distances(iterate: Iterate) -> LimitDistances:
    """How far the rows and unknowns of an iterate are from their limits."""
    values = np.concatenate([iterate.rows, iterate.x])
    lower, upper = np.hstack([iterate.limits.rows, iterate.limits.columns])
    return LimitDistances(values - lower, upper - values)


def strongly_active(multipliers: Array, part: float, largest: float | None = None) -> Flags:
    """Whether multipliers are more than a part of the largest, which is theirs if not given."""
    sizes = np.abs(multipliers)
    return np.asarray(sizes > part * (sizes.max(initial=0.0) if largest is None else largest))


def path_multiplier_sums(iterate: Iterate, index: int) -> dict[int, Array]:
    """The sum of each path constraint's multipliers in each interval of a phase.

    Returns
    -------
    dict of int to (N,)
        Sums of the absolute scaled multipliers, by the number of the path constraint; those of the
        bounds of states and algebraic signals are multipliers of unknowns that are not fixed.
    """
    transcription = iterate.transcription
    columns = transcription.columns.phases[index]
    sums: dict[int, Array] = {}
    for path in transcription.rows.phases[index].path:
        total = sums.setdefault(path.constraint, np.zeros(columns.intervals))
        np.add.at(total, path.intervals, np.abs(iterate.determined_row_multipliers[path.rows]))

    lower, upper = iterate.limits.columns
    of_columns = np.where(lower < upper, np.abs(iterate.bound_multipliers), 0.0)
    for number, constraint in enumerate(transcription.constraints[index]):
        if constraint.sampled:
            continue
        total = sums.setdefault(number, np.zeros(columns.intervals))
        for intervals, points in columns.at_points(constraint.name):
            total[intervals] += of_columns[points].sum(axis=1)
    return sums


def saturated_constraints(iterate: Iterate, index: int) -> Flags:
    """Whether a constraint of controls alone holds each at its limit all through, (N, n_u).

    The controls are in the order of a trajectory.
    """
    transcription = iterate.transcription
    columns = transcription.columns.phases[index]
    count = columns.intervals
    saturated = np.zeros((count, len(columns.controls)), dtype=bool)
    numbers = [i for i, c in enumerate(transcription.constraints[index]) if c.of_controls]
    if not numbers:
        return saturated

    distances = limit_distances(iterate)
    for number in numbers:
        expression = transcription.constraints[index][number].expression
        limited = [ca.depends_on(expression, control.symbol) for control in columns.controls]
        for distance in (distances.lower, distances.upper):
            farthest = np.zeros(count)
            for path in transcription.rows.of_constraint(index, number):
                np.maximum.at(farthest, path.intervals, distance[path.rows])
            saturated |= (farthest <= CLOSE)[:, None] & limited
    return saturated


def acting_on_states(iterate: Iterate) -> tuple[Flags, ...]:
    """Intervals of each phase in which a limit of states alone acts, (N,).

    Its multipliers sit at points, and the costates jump there. Between them they say little of the
    controls. Where a limit depends on a control as well, each control that meets it can be compared
    (Bryson and Ho, "Applied Optimal Control", section 3.8).
    """
    strongest = strongest_multipliers(iterate, mixed=False)
    return tuple(of_phase > ACTING for of_phase in strongest)


def strongest_multipliers(iterate: Iterate, *, mixed: bool = True) -> tuple[Array, ...]:
    """The largest multiplier of path constraints, peaks and states' bounds in each interval, (N,).

    For each phase, as a part of the largest one of all phases; zero where no limit is active.
    Constraints that depend on no state are no part of it, be they of controls alone or of time as
    well: like bounds of controls they leave the costates as they are.

    Parameters
    ----------
    mixed : bool
        Whether constraints that depend on states and controls count.
    """
    transcription = iterate.transcription
    phases = transcription.columns.phases
    largest_of = [np.zeros(phase.intervals) for phase in phases]

    # Where no limit acts at all, the largest multiplier is what the barrier leaves, too.
    distances = limit_distances(iterate)
    active = np.minimum(distances.lower, distances.upper) <= ACTIVE
    of_rows, of_columns = np.split(active, [iterate.row_multipliers.size])

    # rows of paths and peaks
    multipliers = np.where(of_rows, np.abs(iterate.determined_row_multipliers), 0.0)
    for index, (of_phase, rows) in enumerate(
        zip(largest_of, transcription.rows.phases, strict=True)
    ):
        for path in rows.path:
            constraint = transcription.constraints[index][path.constraint]
            if not constraint.of_states or (constraint.has_control and not mixed):
                continue
            np.maximum.at(of_phase, path.intervals, multipliers[path.rows])

    # bounds of the states; multipliers of fixed ones are no densities in time
    lower, upper = iterate.limits.columns
    bounds = np.where((lower < upper) & of_columns, np.abs(iterate.bound_multipliers), 0.0)
    for of_phase, phase in zip(largest_of, phases, strict=True):
        for group in phase.groups:
            of_group = bounds[group.support].max(axis=(1, 2))
            of_phase[group.intervals] = np.maximum(of_phase[group.intervals], of_group)

    largest = max(float(of_phase.max(initial=0.0)) for of_phase in largest_of) or 1.0
    return tuple(of_phase / largest for of_phase in largest_of)
