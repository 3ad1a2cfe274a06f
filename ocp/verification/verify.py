"""The verdict on an iterate: what its simulation and its values between the points say.

An answer passes if nothing that is compared is more than this. `path`, `dynamics` and `replay` are
the accuracies that were asked for. All is relative.

======================  ==================  ==================================================
what is compared        at most             why
======================  ==================  ==================================================
missed end state        ``replay``          the accuracy that a user relies on, with no slack
excess of the replay    10 ``path``         the solution's own excess, and what its error in
                                            the dynamics adds to it
excess of the solution  10 ``path``         the same between its own points
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
effect of the excess    1e-2                of the objective, by the limits' multipliers: what
                                            is exceeded by a small part of its size may be most
                                            of what the objective pays for
======================  ==================  ==================================================
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import casadi as ca
import numpy as np

from ocp.accuracy import SLACK, Accuracy
from ocp.estimates.estimated_gain import effect_of_excess
from ocp.estimates.motion_errors import MotionErrors, dense_peak
from ocp.mesh.algebraic_equations import with_solved_algebraics
from ocp.mesh.dense_integral import dense_integral
from ocp.mesh.trajectory import Evaluator, Trajectory
from ocp.optimality.iterate import Iterate
from ocp.problem.functionals import Integral, Peak
from ocp.problem.parameters import parameters_of
from ocp.problem.symbols import resolve
from ocp.reformulate.form import Form
from ocp.scaling.scales import error_sizes, near_limits
from ocp.verification.simulation import (
    MOST,
    STEP_TOLERANCE,
    SimulatedMotion,
    replayed,
    simulate,
)

# The end of a verdict that no second solve stands behind
NOT_CONFIRMED = "not confirmed (ocp.certify)"

# Of the objective: what violations of limits may change it by. Above it the answer is of another
# kind.
_EFFECT = 1e-2

# Part of a peak that the motion may stay below it, where something else makes the difference
_LOOSE = 1e-3


@dataclass(frozen=True, eq=False, repr=False)
class ReplayedAnswer:
    """A replayed motion.

    Attributes
    ----------
    form : Form
        The statement, and what was solved in its place.
    simulated : SimulatedMotion
        Of the statement.
    motion : Trajectory
        The same as a motion of the statement.
    solved : Trajectory
        The same as a motion of what was solved.
    stated_evaluator, evaluator : Evaluator
        Of the statement, and of what was solved.
    """

    form: Form
    simulated: SimulatedMotion
    motion: Trajectory
    solved: Trajectory
    stated_evaluator: Evaluator
    evaluator: Evaluator

    @classmethod
    def of(
        cls,
        form: Form,
        iterate: Iterate,
        evaluator: Evaluator,
        allowed: float = Accuracy.replay,
        most: float = MOST,
    ) -> ReplayedAnswer:
        """Replay an iterate of a form, whose evaluator is given.

        Parameters
        ----------
        allowed : float
            That the end may be missed by. Where that is more than by default, so may each step.
        most : float
            As of `simulate`.
        """
        motion, sizes = form.stated(iterate.trajectory), dict(iterate.scales.signals)
        tolerance = STEP_TOLERANCE * max(1.0, allowed / Accuracy.replay)
        if form.is_statement:
            simulated = simulate(
                form.problem,
                motion,
                error_sizes(iterate.parameters, motion, sizes),
                tolerance,
                most,
            )
            again = with_solved_algebraics(replayed(motion, simulated), evaluator)
            return cls(form, simulated, again, again, evaluator, evaluator)

        parameters = parameters_of(form.statement, motion.constants)
        stated = error_sizes(parameters, motion, {**_sizes(motion), **_same(form, sizes)})
        simulated = simulate(form.statement, motion, stated, tolerance, most)
        stated_evaluator = Evaluator(form.statement)
        again = with_solved_algebraics(replayed(motion, simulated), stated_evaluator)
        own = simulated
        if any(state in form.back for phase in form.statement.phases for state in phase.states):
            own = simulate(form.problem, iterate.trajectory, sizes, tolerance, most)
        solved = with_solved_algebraics(replayed(iterate.trajectory, own), evaluator)
        return cls(form, simulated, again, solved, stated_evaluator, evaluator)


def _same(form: Form, sizes: dict[str, float]) -> dict[str, float]:
    """Sizes of the signals that the statement has as well."""
    gone = {symbol.name for symbol in form.back}
    return {name: size for name, size in sizes.items() if name not in gone}


def _sizes(motion: Trajectory) -> dict[str, float]:
    """The largest value of each state of a motion; 1 where it is zero all along."""
    found = dict[str, float]()
    for phase in motion.phases:
        largest = np.abs(np.concatenate(phase.state_polynomial.range())).max(axis=0)
        for name, value in zip(phase.states, largest, strict=True):
            found[name] = max(found.get(name, 0.0), float(value))
    return {name: size or 1.0 for name, size in found.items()}


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
    bounds : tuple of (name, excess of the replayed motion)
        Of the problem's bounds and links, relative.
    objective, replayed_objective : float
        As the solver reports it, and of the replayed motion.
    effect : float
        Of the excess between the solution's points on the objective, by the multipliers, relative.
    passed : bool
        Whether all tolerances are met.
    reasons : tuple of str
        Why they are not.
    seconds : float
        Spent on replay and evaluation.
    amplification : float
        Factor by which the motion amplifies errors.
    restarts : int
        How often the replay was set back to the solution because this factor is too large.
    dynamics : float
        Largest error of the solution's dynamics between its points, relative.
    one_run : float
        Miss of the end state where the replay is set back only if errors grow a million times.
        `miss` is the same unless an unstable motion amplifies what its intervals are off by to more
        than is allowed: then the replay is set back as often as it takes.
    accuracy : float
        The largest of all that is compared, and of what the objective may be off by, as far as the
        meshes of a solve tell.
    """

    miss: float
    excess: float
    peaks: tuple[tuple[str, float, float], ...]
    bounds: tuple[tuple[str, float], ...]
    objective: float
    replayed_objective: float
    effect: float
    passed: bool
    reasons: tuple[str, ...] = ()
    seconds: float = 0.0
    amplification: float = 1.0
    restarts: int = 0
    dynamics: float = math.nan
    one_run: float = math.nan
    accuracy: float = math.nan

    def __repr__(self) -> str:
        verdict = "passed" if self.passed else "; ".join(self.reasons) or "not verified"
        return (
            f"Verification({verdict}: replayed end {self.miss:.2g}, constraints {self.excess:.2g} "
            "of their scale)"
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
        bounds=tuple(_boundary_excesses(iterate, replay.solved, evaluator, dense)),
        objective=iterate.objective,
        replayed_objective=objective,
        effect=effect_of_excess(iterate, errors.excess),
        passed=False,
        amplification=simulated.amplification,
        restarts=simulated.restarts,
        dynamics=errors.worst_dynamics,
    )
    size = iterate.objective_size if iterate.costs_nothing else abs(iterate.objective)
    of_motion = _compared(
        numbers,
        dict(_path_excesses(iterate, errors)),
        accuracy,
        size=iterate.objective_size,
        of_kinks=abs(objective - as_solved) / size,
    )
    compared = list(of_motion)
    reasons = tuple(_over(*each) for each in compared if not each.value <= each.allowed)
    values = [each.value for each in compared]
    worst = math.nan if any(map(math.isnan, values)) else max(values)
    return replace(numbers, passed=not reasons, reasons=reasons, accuracy=worst)


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


class _Compared(NamedTuple):
    """A value, what it may be at most, and the words for one that is more."""

    value: float
    allowed: float
    words: str


def _compared(
    numbers: Verification,
    path: Mapping[str, float],
    accuracy: Accuracy,
    *,
    size: float,
    of_kinks: float,
) -> Iterator[_Compared]:
    """All that is compared, see the table of this module.

    Parameters
    ----------
    path : mapping of str to float
        Excess of path constraints between the solution's points, by name.
    size : float
        Of the objective.
    of_kinks : float
        By how much of the objective its costs are too small between the points.
    """
    ending = "the replay misses the end state by {} of its scale"
    if math.isnan(numbers.miss):
        ending = (
            "the replay leads to values that are no numbers, as a root of less than zero, or where "
            "Newton's method does not solve the equations of algebraic variables"
        )
    yield _Compared(numbers.miss, accuracy.replay, ending)
    yield _Compared(
        numbers.excess,
        SLACK * accuracy.path,
        "the replay violates a path constraint or peak by {} of its scale; if its value is nearly "
        "zero, set scale= of the Bound or peak to a typical magnitude",
    )
    yield _Compared(
        numbers.dynamics,
        SLACK * accuracy.dynamics,
        "the error of the dynamics, an integral or an equation between the points is {}",
    )
    yield _Compared(
        numbers.effect,
        _EFFECT,
        "violations of limits between the points improve the objective by {} of it: write the "
        "important limit as a Bound with scale=, the magnitude that the limit must resolve",
    )
    yield _Compared(
        abs(numbers.replayed_objective - numbers.objective) / size,
        SLACK * max(accuracy.replay, accuracy.path if numbers.peaks else 0.0),
        "the objective of the replay differs from that of the solver by {} of its scale"
        + _loose_peaks(numbers),
    )
    yield _Compared(
        of_kinks,
        SLACK * accuracy.replay,
        "the costs between the points of the mesh are too small by {} of the objective, because "
        "the control that replaces an absolute value, a maximum or the length of a vector is "
        "below it there; allow more intervals, and for a vector set the scale= of its controls",
    )

    for excesses, allowed in ((path, accuracy.path), (dict(numbers.bounds), accuracy.replay)):
        for name, excess in excesses.items():
            words = f"the violation of '{name}' is {{}} of its scale"
            yield _Compared(excess, SLACK * allowed, words)


def _loose_peaks(numbers: Verification) -> str:
    """Peaks that count as more than the motion has: nothing holds them to it."""
    loose = [
        f"the peak '{name}' is {stated:.6g} in the objective, but {dense:.6g} in the motion"
        for name, stated, dense in numbers.peaks
        if stated - dense > _LOOSE * abs(stated)
    ]
    if not loose:
        return ""
    return f", because {', '.join(loose)}: use an objective that improves if the peak decreases"


def unverified(objective: float) -> Verification:
    """What stands where no verification was asked for."""
    nan = float("nan")
    return Verification(nan, nan, (), (), objective, nan, nan, False, ("verify=False",))


def _path_excesses(iterate: Iterate, errors: MotionErrors) -> Iterator[tuple[str, float]]:
    """Path constraints but equations, and how far a motion exceeds them between its points."""
    phases = zip(
        iterate.trajectory.phases, iterate.transcription.constraints, errors.excess, strict=True
    )
    for phase, constraints, excesses in phases:
        for constraint, excess in zip(constraints, excesses, strict=True):
            if not constraint.is_equation and not constraint.of_cost:
                yield f"{phase.name}: {constraint.name}", float(excess.values.max())


def _boundary_excesses(
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


def _over(value: float, allowed: float, words: str) -> str:
    """Why a value does not pass."""
    return words.format(f"{value:.2e}") + f" (tolerance {allowed:.0e})"
