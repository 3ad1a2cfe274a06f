"""The conditions of a certificate on the motion: that it does what the statement asks for.

The replayed motion is held against the statement, and the motion itself is looked at between its
points (`motion_conditions`). Steps are told that no derivative shows (`step_conditions`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

import numpy as np

from ocp.optimality.iterate import Iterate
from ocp.optimality.number_steps import number_remark, number_steps
from ocp.optimality.roomy_sizes import roomy_sizes
from ocp.optimality.steps import step_remark, steps_along
from ocp.problem.problem import Problem
from ocp.problem.symbols import Constant
from ocp.refinement.accuracy import Accuracy
from ocp.refinement.estimates.excess_price import worth_of_excess
from ocp.refinement.estimates.missed_slopes import missed_slopes
from ocp.refinement.estimates.motion_errors import MotionErrors
from ocp.refinement.estimates.narrow_features import NarrowFeature, feature_remark, narrow_features
from ocp.scaling.far_sizes import ROOMY
from ocp.verification.conditions import Condition, Evidence
from ocp.verification.far_origins import WITHIN
from ocp.verification.replayed_answer import ReplayedAnswer
from ocp.verification.simulation import SimulatedMotion
from ocp.verification.tolerances import Tolerances
from ocp.verification.verify import Verification, boundary_excesses, verify

# Part of its scale that is the size of a peak of zero, as of an objective that is zero
_OF_A_SCALE = 1e-3


def motion_conditions(evidence: Evidence, allowed: Tolerances) -> Iterator[Condition]:
    """The motion against the statement: replayed, between its points, and at what they miss."""
    iterate, evaluator = evidence.iterate, evidence.evaluator
    replay = ReplayedAnswer.of(evidence.form, iterate, evaluator)
    verification = verify(iterate, replay, Accuracy())
    between_points = MotionErrors(
        iterate.transcription, iterate.trajectory, evaluator, iterate.parameters
    )

    # what follows is relative to the sizes of the signals
    for taken in roomy_sizes(iterate):
        ratio = taken.size / taken.of_motion
        yield Condition(f"size of {taken.what}", ratio, ROOMY, taken.sentence)
    words = _replay_words(replay.simulated)
    yield Condition("replay", replay.simulated.miss, allowed.replay, words)
    yield from _replayed_values(iterate, verification, allowed)
    yield Condition(
        "worth of the excess",
        worth_of_excess(iterate, between_points.excess),
        allowed.objective,
        "the excess of path constraints, bounds and peaks between the points, times their "
        "multipliers: what it gains of the objective, to first order",
    )

    unseen = narrow_features(between_points, allowed.replay)
    yield from _narrow("narrow features", unseen, allowed.replay, iterate.problem)
    for far in verification.far_origins:
        name = f"displacement of '{far.state}' in '{far.phase}'"
        yield Condition(name, far.error, WITHIN, far.sentence)
    slopes = missed_slopes(iterate, evaluator, allowed.gain)
    hidden = (slope.feature for slope in slopes if not isinstance(slope.symbol, Constant))
    name = "narrow features of what is multiplied by zero"
    yield from _narrow(name, hidden, allowed.gain, iterate.problem)

    # bounds and links of the problem, with the peaks of the replay as they are between the points
    dense = (value for _, _, value in verification.peaks)
    peaks = dict(zip(iterate.problem.peaks, dense, strict=True))
    yield _problem_bounds(
        dict(boundary_excesses(iterate, replay.solved, evaluator, peaks)), allowed
    )


def _replayed_values(
    iterate: Iterate, verification: Verification, allowed: Tolerances
) -> Iterator[Condition]:
    """What the replayed motion says of path constraints, of each peak and of the objective."""
    yield Condition(
        "path constraints",
        verification.excess,
        allowed.excess,
        "the replayed motion exceeds a path constraint, bound or peak between the points by this "
        "part of its size",
    )
    for peak, (name, stated, dense) in zip(iterate.problem.peaks, verification.peaks, strict=True):
        # a peak of zero has the size that is stated, or of what it might be
        size = max(abs(stated), peak.scale or _OF_A_SCALE * iterate.scales.functionals[peak])
        yield Condition(
            f"peak '{name}'",
            abs(dense - stated) / size,
            allowed.excess,
            f"its largest value on the replayed motion is {dense:.8g}, reported as {stated:.8g}",
        )
    reported = replace(iterate, objective=verification.objective)
    yield Condition(
        "objective",
        abs(verification.replayed_objective - reported.objective) / reported.objective_size,
        allowed.objective,
        "the replayed motion has an objective that differs by this part",
    )


def _narrow(
    name: str, found: Iterable[NarrowFeature], allowed: float, problem: Problem
) -> Iterator[Condition]:
    """The condition that narrow features break; none where there are none to tell of."""
    features = list(found)
    if remark := feature_remark(features, problem):
        yield Condition(name, max(feature.size for feature in features), allowed, remark)


def _problem_bounds(excesses: Mapping[str, float], allowed: Tolerances) -> Condition:
    """Bounds and links of the problem, by name how far each is exceeded, relative."""
    exceeded = [f"'{name}'" for name, excess in excesses.items() if not excess <= allowed.bounds]
    return Condition(
        "problem bounds",
        float(np.max([0.0, *excesses.values()])),
        allowed.bounds,
        f"the replayed motion does not meet {', '.join(exceeded)}"
        if exceeded
        else "the replayed motion meets all bounds and links up to this part of their sizes",
    )


def _replay_words(simulated: SimulatedMotion) -> str:
    begin = "the initial state"
    if simulated.restarts:
        begin += f" and {simulated.restarts} restarts (the motion amplifies too much for one run)"
    return (
        f"the controls, replayed by another integrator from {begin}, miss the end state by this "
        f"part of its size; errors of the states grow up to {simulated.amplification:.1e} times"
    )


def step_conditions(evidence: Evidence, allowed: Tolerances) -> Iterator[Condition]:
    """Steps of the expressions, whose share in the costates the program does not have."""
    iterate = evidence.iterate
    steps = list(steps_along(iterate.problem, iterate.trajectory, evidence.evaluator))
    if remark := step_remark(steps):
        size = max(step.size for step in steps if step.unseen)
        yield Condition("steps", size, allowed.steps, remark)
    beside = list(number_steps(iterate, evidence.evaluator))
    if remark := number_remark(beside):
        size = max(step.size for step in beside)
        name = "steps of other end values, times or parameters"
        yield Condition(name, size, allowed.steps, remark)
