"""Controls far from those of a motion that make less of the Hamiltonian, and what they promise.

Pontryagin's minimum principle asks for the least value of the Hamiltonian among all controls that
are allowed, not only among those nearby. A nonlinear program compares neighbours. Where the
Hamiltonian has several local minima by the controls, its answer stays in the one where it began. A
control that changes to a better minimum for a short time changes the objective by the difference of
the Hamiltonian times that time, to first order (Bryson and Ho, "Applied Optimal Control", ch. 2 and
3).

Which controls are tried is in `trials`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ocp.arrays import Array, Flags, Integers
from ocp.estimates.other_controls.limits import (
    are_tied,
    dependence_on_controls,
    tried_signals,
)
from ocp.estimates.other_controls.trials import ControlTrials, evaluations
from ocp.estimates.promised_gain import CERTIFIED_GAIN
from ocp.mesh.trajectory import Evaluator
from ocp.numerics.columnwise import columnwise
from ocp.optimality.active_set import ACTING, acting_on_states, strongest_multipliers
from ocp.optimality.hamiltonian import hamiltonian_of
from ocp.optimality.iterate import Iterate
from ocp.optimality.multipliers import duration_multiplier, phase_costates
from ocp.problem.display import with_unit

# Gauss points of an interval, and evaluations of the Hamiltonian in all: on fine meshes fewer
# points of an interval are looked at
_POINTS = 4
_EVALUATIONS = 200_000

# Instants of a phase, at most, where what controls do may change for a short time
_DENSELY = 1000

# Part of the largest curvature, and of a control, that is rounding
_ROUNDING = 1e-9

# Part of the Hamiltonian's terms that a difference has to exceed: minima that are as deep as each
# other, as those of an angle, differ by the errors of the costates
_LEAST = 1e-6

# and the part where a mixed constraint acts: there the costates' errors left up to 7e-3
# on first meshes, and 1e-5 on those that ended. Where multipliers meet the minimum principle on any
# mesh, as those of Lobatto's scheme do, costates are of a lower order between the points.
_MUCH = 1e-2

# and where it does and there is one minimum only: what the costates' errors leave is all that could
# seem better at an optimum. On three such optima, from three meshes each, that was up to 1.5e-2; on
# nine of other problems nothing. A push at rest that was missed made it more than half.
_VERY_MUCH = 0.1


@dataclass(frozen=True, eq=False, repr=False)
class OtherControls:
    """The best of the controls that were tried, at `m` points of a phase.

    Attributes
    ----------
    phase : str
    names : (n_u,) str
        Of the controls.
    intervals : (m,)
        Their numbers.
    fractions : (m,)
        Of the phase's duration, in order.
    times : (m,)
        [s].
    own, best : (m, n_u)
        Controls of the motion, and the best ones; the same where none is better.
    less : (m,)
        By which the best ones make less of the Hamiltonian, not negative [unit of the objective/s].
    weights : (m,)
        Of the points [s], so that ``weights . less`` is the integral.
    vanished : bool
        Whether the phase takes no time. It counts as if it lasted the typical duration with the
        best controls, and `less` is what each second of that gains.
    one_minimum : bool
        Whether the Hamiltonian and all limits are convex in the controls. Then the best ones are in
        the motion's own minimum, and a mesh with points there leads to them.
    """

    phase: str
    names: tuple[str, ...]
    intervals: Integers
    fractions: Array
    times: Array
    own: Array
    best: Array
    less: Array
    weights: Array
    vanished: bool
    one_minimum: bool

    @property
    def gain(self) -> float:
        """What the best controls promise while the rest stays as it is [unit of the objective]."""
        return float(self.weights @ self.less)

    def of_intervals(self, count: int) -> Array:
        """`gain` of each of all intervals of the phase, shape (count,)."""
        gains = np.zeros(count)
        np.add.at(gains, self.intervals, self.weights * self.less)
        return gains


def other_controls(iterate: Iterate, evaluator: Evaluator) -> Iterator[OtherControls]:
    """The best controls that were tried, for each phase in which others than neighbours may be.

    Nothing is tried in intervals in which a limit of states alone acts. Where controls enter it,
    only what is much better counts, and everywhere if the scheme's multipliers tell little.
    """
    alone, telling = acting_on_states(iterate), iterate.scheme.informative_multipliers
    for index, strongest in enumerate(strongest_multipliers(iterate)):
        acting = (strongest > ACTING) | (not telling)
        found = others_of_phase(iterate, evaluator, index, ~alone[index], acting)
        if found is not None:
            yield found


def promised_by(found: Sequence[OtherControls], iterate: Iterate) -> float:
    """What other controls promise to gain together, relative to the objective."""
    return sum(other.gain for other in found) / iterate.objective_size


def others_remark(found: Sequence[OtherControls], iterate: Iterate) -> str:
    """A sentence on controls that promise more than a certificate lets pass; empty if none do."""
    gain = promised_by(found, iterate)
    if not gain > CERTIFIED_GAIN:
        return ""
    most = max(found, key=lambda other: other.gain)
    k = int(np.argmax(most.less))
    units = {signal.name: signal.unit for signal in iterate.problem.signals[most.phase]}
    changed = ", ".join(
        f"{with_unit(f'{name} = {best:.4g}', units[name])} instead of {own:.4g}"
        for name, own, best in zip(most.names, *_without_rounding(most, k), strict=True)
        if own != best
    )
    if most.vanished:
        return (
            f"phase '{most.phase}' takes no time (at {most.times[k]:.4g} s), but should take "
            f"longer: if it lasts {iterate.scales.time:.4g} s with {changed}, it promises to gain "
            f"{most.gain / iterate.objective_size:.2g} of the objective; state a guess of these "
            "controls and of the phase's times, Between(lower, upper, guess), or state no guess"
        )
    return (
        f"other controls promise to gain {gain:.2g} of the objective, such as {changed} at "
        f"{most.times[k]:.4g} s; state these controls as a guess, or leave out the guess that was "
        "stated; if the next answer promises as much again, ever faster switches gain "
        "(chattering), and there is no best motion: limit how fast the control changes"
    )


def _without_rounding(others: OtherControls, k: int) -> tuple[Array, Array]:
    """The motion's controls and the best ones at a point, with zero for what is rounding of it."""
    pair = others.own[k], others.best[k]
    least = _ROUNDING * np.maximum(*np.abs(pair))
    own, best = (np.where(np.abs(values) > least, values, 0.0) for values in pair)
    return own, best


def others_of_phase(
    iterate: Iterate,
    evaluator: Evaluator,
    index: int,
    where: Flags,
    acting: Flags | None = None,
    *,
    minima_only: bool = False,
) -> OtherControls | None:
    """The best of what is tried in some intervals of a phase; None if there is no need.

    Parameters
    ----------
    where : (N,)
        In which intervals.
    acting : (N,), optional
        In which of them a limit acts, so that only what is much better counts.
    minima_only : bool
        Whether there is no need where the Hamiltonian has one minimum only.
    """
    phase = iterate.trajectory.phases[index]
    hamiltonian = hamiltonian_of(evaluator, iterate.transcription, index)
    tried, vanished = tried_signals(iterate, index), iterate.takes_no_time(index)
    dependence = dependence_on_controls(iterate, evaluator, index)
    if not tried:
        return None
    # a straight Hamiltonian has its least at an end of what straight limits leave, and neighbours
    # tell of it, unless limits leave a control no room alone
    tied = not minima_only and are_tied(iterate, evaluator, index)
    if dependence.is_straight and not (vanished or tied):
        return None
    intervals, tau, weights = _points_of(np.flatnonzero(where), len(tried))
    if not vanished and dependence.changes_shortly:
        dense = _dense_points(np.flatnonzero(where), phase.fractions, len(tried))
        intervals, tau, weights = max((intervals, tau, weights), dense, key=lambda p: p[0].size)
    if intervals.size == 0:
        return None
    costates = phase_costates(iterate, index).local(intervals, tau)
    own = hamiltonian.at(evaluator, iterate.trajectory, costates, intervals, tau)
    points = (intervals, tau)
    # the best ones are neighbours then, which the program has compared
    square = dependence.is_square and tried == hamiltonian.controls and not vanished
    convex = square and _is_convex(own.curvature)
    one_minimum = convex and _limits_are_convex(iterate, evaluator, index, points)
    if one_minimum and not tied:
        return None

    trials = ControlTrials.of(iterate, evaluator, index, points, costates, one_minimum=one_minimum)
    best, least = trials.best(own.value)
    less = own.value - least
    widths = np.diff(phase.breakpoints)
    if vanished:
        # No control matters there, and any is stationary. What counts is whether a longer phase
        # would pay with the best ones: a second more with its own costs minus the multiplier, which
        # is negative, and the best ones make that less.
        less += duration_multiplier(iterate, index)
        widths = np.diff(phase.fractions) * iterate.scales.time
    size = np.abs(own.terms).sum(axis=1)
    loose = np.zeros(intervals.size, dtype=bool) if acting is None else acting[intervals]
    needed = np.where(loose, _VERY_MUCH if one_minimum else _MUCH, _LEAST)
    less = np.where(less > needed * size, less, 0.0)
    times = trials.times[:, 0]
    return OtherControls(
        phase=phase.name,
        names=tuple(signal.name for signal in tried),
        intervals=intervals,
        fractions=(times - phase.start) / (phase.end - phase.start),
        times=times,
        own=trials.own,
        best=np.where((less > 0.0)[:, None], best, trials.own),
        less=less,
        weights=weights * widths[intervals],
        vanished=vanished,
        one_minimum=one_minimum,
    )


def _points_of(intervals: Integers, controls: int) -> tuple[Integers, Array, Array]:
    """Gauss points of intervals: numbers, local times, and weights that add up to one in each."""
    wanted = max(evaluations(controls) * intervals.size, 1)
    points = int(np.clip(_EVALUATIONS // wanted, 1, _POINTS))
    nodes, weights = np.polynomial.legendre.leggauss(points)
    tau, shares = np.tile(0.5 * (nodes + 1.0), intervals.size), np.tile(weights, intervals.size)
    return np.repeat(intervals, points), tau, 0.5 * shares


def _dense_points(
    intervals: Integers, fractions: Array, controls: int
) -> tuple[Integers, Array, Array]:
    """As `_points_of`, but the middles of parts of intervals that are about as long as each other.

    Parameters
    ----------
    fractions : (N + 1,)
        Breakpoints of the phase.
    """
    count = min(_DENSELY, _EVALUATIONS // evaluations(controls))
    parts = np.maximum(np.ceil(np.diff(fractions)[intervals] * count).astype(np.int64), 1)
    of_part = np.repeat(np.arange(intervals.size), parts)
    number = np.arange(of_part.size) - np.repeat(np.cumsum(parts) - parts, parts)
    return intervals[of_part], (number + 0.5) / parts[of_part], 1.0 / parts[of_part]


def _limits_are_convex(
    iterate: Iterate, evaluator: Evaluator, index: int, points: tuple[Integers, Array]
) -> bool:
    """Whether the controls that path constraints allow are a convex set at points of a phase.

    They are where each constraint is linear in the controls, or a square function of them that
    curves away from its only limit: a circle of friction, a thrust of limited size.
    """
    motion = iterate.trajectory.phases[index]
    dependence = dependence_on_controls(iterate, evaluator, index)
    if not dependence.curved:
        return True
    if dependence.curvatures is None:
        return False

    # towards which side each curves
    peaks = iterate.trajectory.peaks_of(iterate.problem)
    constraints = iterate.transcription.constraints[index]
    paths = hamiltonian_of(evaluator, iterate.transcription, index).paths
    curved = [constraints[paths[i]] for i in dependence.curved]
    limits = [constraint.limits(iterate.parameters, peaks) for constraint in curved]
    if any(np.isfinite(one).all() for one in limits):
        return False
    signs = [1.0 if np.isfinite(upper) else -1.0 for _, upper in limits]
    curvatures = columnwise(
        dependence.curvatures,
        motion.local(*points),
        evaluator.times(motion, *points)[:, None],
        evaluator.numbers(iterate.trajectory),
    )
    count = len(dependence.columns)
    return all(
        _is_convex(sign * curvature.reshape(-1, count, count))
        for sign, curvature in zip(signs, curvatures, strict=True)
    )


def _is_convex(curvature: Array) -> bool:
    """Whether symmetric matrices (m, n, n) have no negative eigenvalue beyond rounding."""
    sizes = np.abs(curvature).max(axis=(1, 2))
    return bool((np.linalg.eigvalsh(curvature)[:, 0] >= -_ROUNDING * sizes).all())
