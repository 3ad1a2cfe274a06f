"""Controls far from those of a motion that make less of the Hamiltonian, and their estimated gain.

Pontryagin's minimum principle asks for the least value of the Hamiltonian among all controls that
are allowed, not only among those nearby. A nonlinear program compares neighbours. Where the
Hamiltonian has several local minima by the controls, its answer stays in the one where it began. A
control that changes to a better minimum for a short time changes the objective by the difference of
the Hamiltonian times that time, to first order (Bryson and Ho, "Applied Optimal Control", ch. 2 and
3).

Nothing is tried where the best controls are neighbours: where the Hamiltonian and all limits are
linear in them, or convex. Which controls are tried elsewhere is in `control_trials`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ocp.arrays import ROUNDING, Array, Flags, Integers
from ocp.diagnostics.control_trials import EVALUATIONS, ControlTrials, Dependence, dependence_of
from ocp.estimates.estimated_gain import CERTIFIED_GAIN
from ocp.mesh.trajectory import Evaluator
from ocp.numerics.columnwise import columnwise
from ocp.numerics.polynomial_expressions import curves_upwards, is_linear, is_quadratic
from ocp.optimality.active_set import ACTING, acting_on_states, strongest_multipliers
from ocp.optimality.hamiltonian import hamiltonian_of
from ocp.optimality.iterate import Iterate
from ocp.optimality.multipliers import duration_multiplier, phase_costates
from ocp.problem.display import with_unit

# Gauss points of an interval, and evaluations of the Hamiltonian in all: on fine meshes fewer
# points of an interval are looked at.
_POINTS = 4
_MOST_EVALUATIONS = 200_000

# Part of the Hamiltonian's terms that a difference has to exceed: minima that are as deep as each
# other, as those of an angle, differ by the errors of the costates.
_LEAST = 1e-6

# and the part where a mixed constraint acts: there the costates' errors left up to 7e-3 on first
# meshes, and 1e-5 on those that ended. Where multipliers meet the minimum principle on any mesh, as
# those of Lobatto's scheme do, costates are of a lower order between the points.
_MUCH = 1e-2


@dataclass(frozen=True, eq=False, repr=False)
class OtherControls:
    """The best of the controls that were tried, at `m` points of a phase.

    Attributes
    ----------
    phase : str
    names : (n_u,) str
        Of the controls.
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
    """

    phase: str
    names: tuple[str, ...]
    times: Array
    own: Array
    best: Array
    less: Array
    weights: Array
    vanished: bool

    @property
    def gain(self) -> float:
        """Estimated gain by the best controls, all else as it is [unit of the objective]."""
        return float(self.weights @ self.less)


def other_controls(iterate: Iterate, evaluator: Evaluator) -> Iterator[OtherControls]:
    """The best controls that were tried, for each phase in which others than neighbours may be.

    Nothing is tried in intervals in which a limit of states alone acts. Where controls enter it,
    only what is much better counts, and everywhere if the scheme's multipliers tell little.
    """
    alone, telling = acting_on_states(iterate), iterate.scheme.informative_multipliers
    for index, strongest in enumerate(strongest_multipliers(iterate)):
        acting = (strongest > ACTING) | (not telling)
        found = _others_of_phase(iterate, evaluator, index, ~alone[index], acting)
        if found is not None:
            yield found


def gain_of(found: Sequence[OtherControls], iterate: Iterate) -> float:
    """Estimated gain by all other controls together, relative to the objective."""
    return sum(other.gain for other in found) / iterate.objective_size


def others_remark(found: Sequence[OtherControls], iterate: Iterate) -> str:
    """A sentence on controls that may gain more than a certificate lets pass; empty if none do."""
    gain = gain_of(found, iterate)
    if not gain > CERTIFIED_GAIN:
        return ""

    # the controls that differ by more than rounding, where they gain most
    most = max(found, key=lambda other: other.gain)
    k = int(np.argmax(most.less))
    units = {signal.name: signal.unit for signal in iterate.problem.signals[most.phase]}
    least = ROUNDING * np.maximum(np.abs(most.own[k]), np.abs(most.best[k]))
    pair = (np.where(np.abs(of[k]) > least, of[k], 0.0) for of in (most.own, most.best))
    changed = ", ".join(
        f"{with_unit(f'{name} = {best:.4g}', units[name])} instead of {own:.4g}"
        for name, own, best in zip(most.names, *pair, strict=True)
        if own != best
    )

    if most.vanished:
        return (
            f"phase '{most.phase}' has zero duration (at {most.times[k]:.4g} s), but if it lasts "
            f"{iterate.scales.time:.4g} s with {changed}, the objective may improve by "
            f"{100 * most.gain / iterate.objective_size:.2g} %; give a guess of these controls and "
            "of the phase's times, Between(lower, upper, guess), or give no guess"
        )
    return (
        f"other controls may improve the objective by {100 * gain:.2g} %, such as {changed} at "
        f"{most.times[k]:.4g} s; use these controls as a guess, or remove your guess; if the next "
        "solution has the same estimated improvement, faster and faster switching improves the "
        "objective (chattering), and no optimum exists: limit how fast the control changes"
    )


def _others_of_phase(
    iterate: Iterate, evaluator: Evaluator, index: int, where: Flags, acting: Flags
) -> OtherControls | None:
    """The best of what is tried in some intervals of a phase; None if there is no need.

    Parameters
    ----------
    where : (N,)
        In which intervals.
    acting : (N,)
        In which of them a limit acts, so that only what is much better counts.
    """
    phase, vanished = iterate.trajectory.phases[index], iterate.takes_no_time(index)
    of = dependence_of(iterate, evaluator, index)
    if not of.signals or not where.any():
        return None
    intervals, tau, weights = _points_of(np.flatnonzero(where), len(of.signals))
    costates = phase_costates(iterate, index).local(intervals, tau)
    hamiltonian = hamiltonian_of(evaluator, iterate.transcription, index)
    own = hamiltonian.at(evaluator, iterate.trajectory, costates, intervals, tau)
    if not vanished and _is_convex(iterate, evaluator, index, of, own.curvature, (intervals, tau)):
        return None

    trials = ControlTrials.of(iterate, evaluator, index, of, (intervals, tau), costates)
    best, least = trials.best(own.value)
    less, widths = own.value - least, np.diff(phase.breakpoints)
    if vanished:
        # No control matters there, and any is stationary. What counts is whether a longer phase
        # would pay with the best ones: a second more with its own costs minus the multiplier, which
        # is negative, and the best ones make that less.
        less += duration_multiplier(iterate, index)
        widths = np.diff(phase.fractions) * iterate.scales.time
    needed = np.where(acting[intervals], _MUCH, _LEAST) * np.abs(own.terms).sum(axis=1)
    less = np.where(less > needed, less, 0.0)
    return OtherControls(
        phase=phase.name,
        names=tuple(signal.name for signal in of.signals),
        times=trials.times[:, 0],
        own=trials.own,
        best=np.where((less > 0.0)[:, None], best, trials.own),
        less=less,
        weights=weights * widths[intervals],
        vanished=vanished,
    )


def _points_of(intervals: Integers, controls: int) -> tuple[Integers, Array, Array]:
    """Gauss points of intervals: numbers, local times, and weights that add up to one in each."""
    wanted = (EVALUATIONS * controls) * intervals.size
    points = int(np.clip(_MOST_EVALUATIONS // wanted, 1, _POINTS))
    nodes, weights = np.polynomial.legendre.leggauss(points)
    tau, shares = np.tile(0.5 * (nodes + 1.0), intervals.size), np.tile(weights, intervals.size)
    return np.repeat(intervals, points), tau, 0.5 * shares


def _is_convex(
    iterate: Iterate,
    evaluator: Evaluator,
    index: int,
    of: Dependence,
    curvature: Array,
    points: tuple[Integers, Array],
) -> bool:
    """Whether the Hamiltonian and the set of controls that are allowed are convex at points.

    Then the best controls are neighbours, which the program has compared. The allowed ones are a
    convex set where each constraint is linear in them, or a square function of them that curves
    away from its only limit: a circle of friction, a thrust of limited size.

    Parameters
    ----------
    curvature : (m, n_u, n_u)
        Of the Hamiltonian by the controls alone.
    """
    if not is_linear(of.value, of.tried):
        has_others = len(of.signals) > curvature.shape[1]
        if has_others or not is_quadratic(of.value, of.tried) or not curves_upwards(curvature):
            return False

    peaks = iterate.trajectory.peaks_of(iterate.problem)
    motion, count = iterate.trajectory.phases[index], len(of.signals)
    for place, constraint in enumerate(of.constraints):
        expression = of.path[place]
        if is_linear(expression, of.tried):
            continue
        lower, upper = constraint.limits(iterate.parameters, peaks)
        if not is_quadratic(expression, of.tried) or np.isfinite([lower, upper]).all():
            return False
        second = ca.densify(ca.vec(ca.hessian(expression, of.tried)[0]))
        (curvatures,) = columnwise(
            ca.Function("curvature", of.inputs[:3], [second]),
            motion.local(*points),
            evaluator.times(motion, *points)[:, None],
            evaluator.numbers(iterate.trajectory),
        )
        sign = 1.0 if np.isfinite(upper) else -1.0
        if not curves_upwards(sign * curvatures.reshape(-1, count, count)):
            return False
    return True
