"""The verdict on an iterate: what its simulation and its values between the points say.

An answer passes if nothing that is compared is more than this. `path`, `dynamics` and `replay` are
the accuracies that were asked for. All is relative.

======================  ==================  ==================================================
what is compared        at most             why
======================  ==================  ==================================================
missed end state        ``replay``          the promise that a user builds on, with no slack
excess of the replay    10 ``path``         the solution's own excess, and what its error in
                                            the dynamics adds to it
rigorous bound          10 ``path``         the solution's own excess, and a bound that is not
                                            the maximum itself
error of the dynamics   10 ``dynamics``     it is met in the intervals that refinement looks
                                            at; without refinement it tells a coarse mesh
replayed objective      10 ``replay``       relative to the objective, or to 1e-3 of its scale:
                                            all states act on it with their misses. Where a
                                            problem has peaks, 10 ``path`` if that is more:
                                            they may be exceeded by as much
costs with kinks        10 ``replay``       of the objective: a control that stands for a
                                            modulus may be below it between the points
bounds and links        10 ``replay``       relative to the largest of value, limits and scale:
                                            as the objective
worth of the excess     1e-2                of the objective, by the limits' multipliers: what
                                            is exceeded by a small part of its size may be most
                                            of what the objective pays for
======================  ==================  ==================================================

Where a constraint is a polynomial of time, its bound between the points is rigorous. In an interval
all signals are polynomials of local time. An expression that only adds and multiplies them is one
too, of a known degree, and a polynomial lies between its least and largest Bernstein coefficient.
Halving the interval where the two are apart brings the bound as close to the maximum as wanted
(Farouki, "The Bernstein polynomial basis: a centennial retrospective", Computer Aided Geometric
Design 29, 2012).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from ocp.accuracy import Accuracy
from ocp.arrays import Array, Integers
from ocp.estimates.excess_price import worth_of_excess
from ocp.estimates.motion_errors import MotionErrors, dense_peak
from ocp.mesh.dense_integral import dense_integral
from ocp.mesh.trajectory import Evaluator, PhaseTrajectory, Trajectory
from ocp.numerics.piecewise_polynomial import Lagrange, to_bernstein
from ocp.numerics.polynomial_expressions import largest, polynomial_degree
from ocp.optimality.iterate import Iterate
from ocp.problem.functionals import Integral, Peak
from ocp.problem.symbols import TIME, resolve
from ocp.scaling.far_sizes import near_limits
from ocp.transcription.path_constraints import PathConstraint
from ocp.verification.replayed_answer import ReplayedAnswer

# The end of a verdict that no second solve stands behind
NOT_CONFIRMED = "not confirmed (ocp.certify)"

# A replay may exceed by this factor what the solve was held to: errors of the intervals add up on
# the way to its end.
_SLACK = 10.0

# Of the objective: what limits may be exceeded by in worth. Above it the answer is of another kind.
_WORTH = 1e-2

# Part of a peak that the motion may stay below it, where something else makes the difference
_LOOSE = 1e-3

# The change of basis amplifies round-off by about 2^degree: at 24, to 2e-9 of the largest value
_HIGHEST_DEGREE = 24

# Bound minus maximum, relative to the size of the constraint: far below any tolerance on a path
_CLOSE = 1e-10


@dataclass(frozen=True, repr=False)
class Verification:
    """What the independent simulation and the evaluation between the points found.

    Attributes
    ----------
    miss : float
        Replayed end state minus the solution's, relative to the states' sizes.
    excess : float
        Largest excess of a path constraint or bound of the replayed motion, relative.
    peaks : tuple of (name, reported value, dense value of the replayed motion)
    objective, replayed_objective : float
        As the solver reports it, and of the replayed motion.
    integrator_error : float
        Largest estimated error of a step of the replay, relative to the states' sizes.
    passed : bool
        Whether all tolerances are met.
    reasons : tuple of str
        Why they are not.
    seconds : float
        Spent on replay and evaluation.
    margins : tuple of Margin
        Of every path constraint, bound of a state or algebraic signal and peak, along the solution
        between its points.
    amplification : float
        Factor by which the motion amplifies errors.
    restarts : int
        How often the replay was set back to the solution because this factor is too large.
    dynamics : float
        Largest error of the solution's dynamics between its points, relative.
    """

    miss: float
    excess: float
    peaks: tuple[tuple[str, float, float], ...]
    objective: float
    replayed_objective: float
    integrator_error: float
    passed: bool
    reasons: tuple[str, ...] = ()
    seconds: float = 0.0
    margins: tuple[Margin, ...] = ()
    amplification: float = 1.0
    restarts: int = 0
    dynamics: float = math.nan

    def __repr__(self) -> str:
        verdict = "passed" if self.passed else "; ".join(self.reasons) or "not verified"
        return (
            f"Verification({verdict}: replayed end {self.miss:.2g}, constraints {self.excess:.2g} "
            "of their sizes)"
        )


def verify(
    iterate: Iterate, replay: ReplayedAnswer, accuracy: Accuracy, errors: MotionErrors | None = None
) -> Verification:
    """Check an iterate and its replay against everything that the problem states.

    Parameters
    ----------
    iterate : Iterate
    replay : ReplayedAnswer
        Of the iterate.
    accuracy : Accuracy
        What was asked for, see the table of this module.
    errors : MotionErrors, optional
        Of the iterate's motion, where they were estimated before.
    """
    if not replay.form.is_statement:
        stated = replay.form.stated(iterate.trajectory)
        objective = replay.form.objective(stated, replay.stated_evaluator)
        iterate = replace(iterate, objective=objective, built=iterate.transcription)
    problem, trajectory = iterate.problem, iterate.trajectory
    transcription, parameters = iterate.transcription, iterate.parameters
    evaluator, simulated = replay.evaluator, replay.simulated
    if errors is None:
        errors = MotionErrors(transcription, trajectory, evaluator, parameters)
    replay_errors = MotionErrors(transcription, replay.solved, evaluator, parameters)

    # the objective with the peaks that the replay has between the points
    peaks = {peak: dense_peak(evaluator, replay.solved, peak) for peak in problem.peaks}
    objective, as_solved, dense = _objectives(replay, peaks)

    numbers = Verification(
        miss=simulated.miss,
        excess=replay_errors.worst_excess,
        peaks=tuple(
            (peak.name, reported, peaks[peak])
            for peak, reported in zip(problem.peaks, trajectory.peaks, strict=True)
        ),
        objective=iterate.objective,
        replayed_objective=objective,
        integrator_error=simulated.error,
        passed=False,
        margins=_margins(iterate, errors, evaluator),
        amplification=simulated.amplification,
        restarts=simulated.restarts,
        dynamics=errors.worst_dynamics,
    )
    size = iterate.objective_size if iterate.costs_nothing else abs(iterate.objective)
    of_motion = _reasons(
        numbers,
        dict(boundary_excesses(iterate, replay.solved, evaluator, dense)),
        accuracy,
        size=iterate.objective_size,
        worth=worth_of_excess(iterate, errors.excess),
        of_kinks=abs(objective - as_solved) / size,
    )
    reasons = tuple(reason for reason in of_motion if reason)
    return replace(numbers, passed=not reasons, reasons=reasons)


def _objectives(
    replay: ReplayedAnswer, peaks: Mapping[Peak, float]
) -> tuple[float, float, dict[Peak | Integral, float]]:
    """The objective of a replay, with integrals as stated and as solved, and known functionals.

    A control that stands for a kink may be below it between the points. One above the size of a
    vector is below it by a small part of what is typical, too.

    Parameters
    ----------
    peaks : mapping of Peak to float
        Of what was solved, on the replay.
    """
    form, statement, evaluator = replay.form, replay.form.statement, replay.stated_evaluator
    known: dict[Peak | Integral, float] = dict(peaks)
    if form.is_statement:
        objective = statement.sense * evaluator.number(replay.motion, statement.objective, known)
        return objective, objective, known

    dense: dict[Peak | Integral, float] = {
        peak: dense_peak(evaluator, replay.motion, peak) for peak in statement.peaks
    }
    solved = dict(dense)
    for integral in form.integrals:
        instead = form.back[integral]
        dense[integral] = dense_integral(evaluator, replay.motion, integral)
        solved[integral] = replay.evaluator.number(replay.solved, instead, peaks)
        known |= dict.fromkeys(_integrals_alone(instead), dense[integral])
    objective, as_solved = (
        statement.sense * evaluator.number(replay.motion, statement.objective, values)
        for values in (dense, solved)
    )
    return objective, as_solved, known


def _integrals_alone(expression: ca.SX) -> Iterator[Integral]:
    """The integral that an expression is, if it is one and nothing else."""
    if expression.is_symbolic():
        yield from (s for s in resolve(expression, "a number") if isinstance(s, Integral))


def _reasons(
    numbers: Verification,
    boundary: Mapping[str, float],
    accuracy: Accuracy,
    *,
    size: float,
    worth: float,
    of_kinks: float,
) -> Iterator[str]:
    """Why an answer does not pass, an empty string for what does, see the table of this module.

    Parameters
    ----------
    boundary : mapping of str to float
        Excess of the problem's bounds and links, by name.
    size : float
        Of the objective.
    worth, of_kinks : float
        What the excess between the points is worth, of the objective, and by how much of it its
        costs are too small there, see `_stated_integrals`.
    """
    yield _over(numbers.miss, accuracy.replay, "the replay misses the end state by {} of its size")
    yield _over(
        numbers.excess,
        _SLACK * accuracy.path,
        "a path constraint or peak of the replay is exceeded by {} of its size; if its value is "
        "nearly zero, state scale= of the Bound or peak, the size that matters",
    )
    yield _over(
        numbers.dynamics,
        _SLACK * accuracy.dynamics,
        "the dynamics, an integral or an equation is off by {} between the points",
    )
    yield _over(
        worth,
        _WORTH,
        "what limits are exceeded by between the points gains {} of the objective: state the limit "
        "that matters as a Bound with scale=, the size of what may not be exceeded",
    )
    yield _over(
        abs(numbers.replayed_objective - numbers.objective) / size,
        _SLACK * max(accuracy.replay, accuracy.path if numbers.peaks else 0.0),
        "the objective of the replay differs from the solver's by {} of its size"
        + _loose_peaks(numbers),
    )
    yield _over(
        of_kinks,
        _SLACK * accuracy.replay,
        "the costs are too small between the points of the mesh by {} of the objective: the "
        "control that stands for a modulus, a largest value or the size of a vector is below it "
        "there; allow more intervals, and for a vector state the scale= of its controls",
    )

    # a bound that could not be had is none to exceed
    for margin in numbers.margins:
        where = f"'{margin.name}' in phase '{margin.phase}'"
        words = f"{where} may be exceeded by {{}} of its size, by a proven bound of it"
        yield _over(margin.rigorous or 0.0, _SLACK * accuracy.path, words)

    for name, excess in boundary.items():
        words = f"'{name}' is exceeded by {{}} of its size"
        yield _over(excess, _SLACK * accuracy.replay, words)


def _loose_peaks(numbers: Verification) -> str:
    """Peaks that count as more than the motion has: nothing holds them to it."""
    loose = [
        f"the peak '{name}' counts as {stated:.6g}, and the motion has {dense:.6g}"
        for name, stated, dense in numbers.peaks
        if stated - dense > _LOOSE * abs(stated)
    ]
    if not loose:
        return ""
    return f", as {', '.join(loose)}: state an objective that is the better, the less a peak is"


def unverified(objective: float) -> Verification:
    """What stands where no verification was asked for."""
    nan = float("nan")
    return Verification(nan, nan, (), objective, nan, nan, False, ("verify=False",))


def boundary_excesses(
    iterate: Iterate, trajectory: Trajectory, evaluator: Evaluator, peaks: Mapping[Peak, float]
) -> Iterator[tuple[str, float]]:
    """Names of the problem's bounds and links, and how far a motion exceeds them, relative.

    The size of each is the largest of its value, its limits and its scale. Limits that are far
    beyond the others do not count.
    """
    for bound in iterate.problem.boundary_constraints:
        value = evaluator.number(trajectory, bound.expression, peaks)
        lower, upper = iterate.parameters.bound_limits["", bound.name]

        # a limit of zero has no size of its own, which its scale then gives
        typical = max(abs(value), iterate.scales.bounds["", bound.name])
        size = max(typical, *near_limits((lower, upper), typical), 0.0)
        yield bound.name, max(value - upper, lower - value) / size


def _margins(iterate: Iterate, errors: MotionErrors, evaluator: Evaluator) -> tuple[Margin, ...]:
    """Dense and rigorous excess of all path constraints but equations."""
    trajectory, constraints = iterate.trajectory, iterate.transcription.constraints
    margins = []

    # dense values lie below the maximum, rigorous bounds above it: the two enclose it
    phases = zip(trajectory.phases, constraints, errors.limits, errors.excess, strict=True)
    for phase, *of_phase in phases:
        for constraint, limits, dense in zip(*of_phase, strict=True):
            if not constraint.is_equation and not constraint.of_cost:
                bound = rigorous_excess(evaluator, trajectory, phase, constraint, limits)
                largest = float(dense.values.max())
                margins.append(Margin(phase.name, constraint.name, largest, bound))
    return tuple(margins)


def _over(value: float, allowed: float, words: str) -> str:
    """Why a value does not pass, or nothing."""
    if value <= allowed:
        return ""
    return words.format(f"{value:.2e}") + f" (tolerance {allowed:.0e})"


@dataclass(frozen=True)
class Margin:
    """How far a path constraint is exceeded, relative to its size; negative if it is kept.

    Attributes
    ----------
    phase, name : str
    dense : float
        The largest value found by dense evaluation.
    rigorous : float or None
        A bound that no instant exceeds, round-off included. None where the expression is no
        polynomial of time, or one of a degree above 24.
    """

    phase: str
    name: str
    dense: float
    rigorous: float | None


def rigorous_excess(
    evaluator: Evaluator,
    trajectory: Trajectory,
    motion: PhaseTrajectory,
    constraint: PathConstraint,
    limits: tuple[float, float],
) -> float | None:
    """A bound on how far a constraint is exceeded in a phase, or None where there is none.

    It is relative to `PathConstraint.size`, and infinite where a value is not finite.

    Parameters
    ----------
    motion : PhaseTrajectory
        The phase of the trajectory.
    limits : (lower, upper)
        Of the constraint [unit].
    """
    parts = []
    for orders, intervals in _intervals_by_orders(motion).items():
        degree = _degree(evaluator, motion, constraint, orders)
        if degree is None or degree > _HIGHEST_DEGREE:
            return None
        nodes = _nodes(degree)
        values = _sampled(evaluator, trajectory, motion.name, constraint, intervals, nodes)
        parts.append((values, to_bernstein(Lagrange(tuple(nodes.tolist())))))

    largest_value = max(float(np.abs(values).max()) for values, _ in parts)
    if not math.isfinite(largest_value):
        return math.inf
    size = constraint.size(limits, largest_value)

    worst = -math.inf
    for values, change in parts:
        # round-off of the coefficients
        noise = np.finfo(float).eps * np.abs(change).sum(axis=1).max() * largest_value
        for limit, sign in zip(limits, (-1.0, 1.0), strict=True):
            if math.isfinite(limit):
                bounds = largest(sign * (values @ change.T - limit), _CLOSE * size)
                worst = max(worst, float(bounds.max()) + noise)
    return float(worst / size)


def _intervals_by_orders(motion: PhaseTrajectory) -> dict[tuple[int, ...], Integers]:
    """Intervals (m,) in which the signals have the same orders, by the orders of each group."""
    table = np.column_stack([group.polynomial.orders for group in motion.groups])
    intervals: dict[tuple[int, ...], list[int]] = {}
    for number, orders in enumerate(table.tolist()):
        intervals.setdefault(tuple(orders), []).append(number)
    return {orders: np.array(numbers) for orders, numbers in intervals.items()}


def _degree(
    evaluator: Evaluator,
    motion: PhaseTrajectory,
    constraint: PathConstraint,
    orders: tuple[int, ...],
) -> int | None:
    """Degree of a constraint where the groups of signals have these orders."""
    symbols = {s.name: s.symbol for s in evaluator.problem.signals[motion.name]}
    names = motion.signals
    degrees = [
        order for group, order in zip(motion.groups, orders, strict=True) for _ in group.names
    ]
    polynomials = [*(symbols[name] for name in names), TIME.symbol]
    return polynomial_degree(constraint.expression, polynomials, [*degrees, 1])


def _nodes(degree: int) -> Array:
    """Extrema of Chebyshev's polynomial on [0, 1], shape (degree + 1,)."""
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * np.arange(degree + 1) / max(degree, 1)))


def _sampled(
    evaluator: Evaluator,
    trajectory: Trajectory,
    phase: str,
    constraint: PathConstraint,
    intervals: Integers,
    nodes: Array,
) -> Array:
    """Values of a constraint at local times of some intervals, shape (m, nodes)."""
    k, tau = np.repeat(intervals, nodes.size), np.tile(nodes, intervals.size)
    values = evaluator.values(trajectory, phase, [constraint.expression], k, tau)
    return np.asarray(constraint.sign * values.reshape(intervals.size, nodes.size))
