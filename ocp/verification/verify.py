"""The verdict on an iterate: what its simulation and its values between the points say."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ocp.mesh.evaluation import Evaluator
from ocp.mesh.trajectory import Trajectory
from ocp.optimality.iterate import Iterate
from ocp.problem.functionals import Peak
from ocp.refinement.accuracy import Accuracy
from ocp.refinement.error_estimate import MotionErrors, dense_peak
from ocp.verification.bernstein_bounds import Margin, rigorous_excess
from ocp.verification.simulation import SimulatedMotion, replayed

# A replay may exceed by this factor what the solve was held to: errors of the intervals add up on
# the way to its end.
_SLACK = 10.0

# Part of the objective's scale below which its value is next to nothing, so that a difference is
# not relative to it.
_LEAST_OBJECTIVE = 1e-3


@dataclass(frozen=True)
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

    def __repr__(self) -> str:
        verdict = "passed" if self.passed else "; ".join(self.reasons) or "not verified"
        return (
            f"Verification({verdict}: replayed end {self.miss:.2g}, constraints {self.excess:.2g} "
            "of their sizes)"
        )


def verify(
    iterate: Iterate, simulated: SimulatedMotion, accuracy: Accuracy, evaluator: Evaluator
) -> Verification:
    """Check an iterate and its replay against everything that the problem states.

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
                                                all states act on it with their misses
    bounds and links        10 ``replay``       relative to the largest of value, limits and scale:
                                                as the objective
    ======================  ==================  ==================================================

    Parameters
    ----------
    simulated : SimulatedMotion
        Of the iterate's trajectory.
    accuracy : Accuracy
        What was asked for, see the table. All of it is relative.
    """
    problem, trajectory = iterate.problem, iterate.trajectory
    replay = replayed(trajectory, simulated)
    errors = MotionErrors(iterate.transcription, trajectory, evaluator)
    replay_errors = MotionErrors(iterate.transcription, replay, evaluator)

    # the objective with the peaks that the replay has between the points
    peaks = {peak: dense_peak(evaluator, replay, peak) for peak in problem.peaks}
    objective = problem.sense * evaluator.number(replay, problem.objective, peaks)

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
    )
    boundary = dict(boundary_excesses(iterate, replay, evaluator, peaks))
    stated = _reasons(numbers, errors.worst_dynamics, boundary, objective_size(iterate), accuracy)
    reasons = tuple(reason for reason in stated if reason)
    return replace(numbers, passed=not reasons, reasons=reasons)


def _reasons(
    numbers: Verification,
    dynamics: float,
    boundary: Mapping[str, float],
    size: float,
    accuracy: Accuracy,
) -> Iterator[str]:
    """Why an answer does not pass, an empty string for what does, see the table of `verify`.

    Parameters
    ----------
    dynamics : float
        Error of the dynamics between the points.
    boundary : mapping of str to float
        Excess of the problem's bounds and links, by name.
    size : float
        Of the objective.
    """
    yield _over(numbers.miss, accuracy.replay, "the replay misses the end state by {} of its size")
    yield _over(
        numbers.excess,
        _SLACK * accuracy.path,
        "a path constraint or peak of the replay is exceeded by {} of its size",
    )
    yield _over(
        dynamics,
        _SLACK * accuracy.dynamics,
        "the dynamics, an integral or an equation is off by {} between the points",
    )
    yield _over(
        abs(numbers.replayed_objective - numbers.objective) / size,
        _SLACK * accuracy.replay,
        "the objective of the replay differs from the solver's by {} of its size",
    )

    # a bound that could not be had is none to exceed
    for margin in numbers.margins:
        where = f"'{margin.name}' in phase '{margin.phase}'"
        words = f"by its bound {where} may be exceeded by {{}} of its size"
        yield _over(margin.rigorous or 0.0, _SLACK * accuracy.path, words)

    for name, excess in boundary.items():
        words = f"'{name}' is exceeded by {{}} of its size"
        yield _over(excess, _SLACK * accuracy.replay, words)


def unverified(objective: float) -> Verification:
    """What stands where no verification was asked for."""
    nan = float("nan")
    return Verification(nan, nan, (), objective, nan, nan, False, ("verify=False",))


def objective_size(iterate: Iterate) -> float:
    """What differences of the objective are relative to: its value, if that is not next to none."""
    return max(abs(iterate.objective), _LEAST_OBJECTIVE * iterate.scales.objective)


def boundary_excesses(
    iterate: Iterate, trajectory: Trajectory, evaluator: Evaluator, peaks: Mapping[Peak, float]
) -> Iterator[tuple[str, float]]:
    """Names of the problem's bounds and links, and how far a motion exceeds them, relative.

    The size of each is the largest of its value, its limits and its scale.
    """
    parameters = evaluator.parameters(trajectory)
    for bound in iterate.problem.boundary_constraints:
        value = evaluator.number(trajectory, bound.expression, peaks)
        lower, upper = parameters.pair(bound)

        # a limit of zero has no size of its own, which its scale then gives
        finite = [abs(limit) for limit in (lower, upper) if np.isfinite(limit)]
        size = max(abs(value), *finite, iterate.scales.bounds["", bound.name])
        yield bound.name, max(value - upper, lower - value) / size


def _margins(iterate: Iterate, errors: MotionErrors, evaluator: Evaluator) -> tuple[Margin, ...]:
    """Dense and rigorous excess of all path constraints but equations."""
    trajectory, constraints = iterate.trajectory, iterate.transcription.constraints
    peaks = dict(zip(iterate.problem.peaks, trajectory.peaks, strict=True))
    margins = []

    # dense values lie below the maximum, rigorous bounds above it: the two enclose it
    for phase, of_phase, excess in zip(trajectory.phases, constraints, errors.excess, strict=True):
        for constraint, dense in zip(of_phase, excess, strict=True):
            if not constraint.is_equation:
                bound = rigorous_excess(evaluator, trajectory, phase.name, constraint, peaks)
                largest = float(dense.values.max())
                margins.append(Margin(phase.name, constraint.name, largest, bound))
    return tuple(margins)


def _over(value: float, allowed: float, words: str) -> str:
    """Why a value does not pass, or nothing."""
    if value <= allowed:
        return ""
    return words.format(f"{value:.2e}") + f" (tolerance {allowed:.0e})"
