"""The conditions of a certificate on the motion: that it does what the statement asks for.

The replayed motion is held against the statement, and the motion itself is looked at between its
points.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from ocp.accuracy import Accuracy
from ocp.diagnostics.diagnostic import Evidence, Finding, Tolerances
from ocp.estimates.motion_errors import MotionErrors
from ocp.estimates.promised_gain import worth_of_excess
from ocp.optimality.crossed_jumps import crossed_jumps
from ocp.optimality.iterate import Iterate
from ocp.verification.simulation import SimulatedMotion
from ocp.verification.verify import (
    ReplayedAnswer,
    Verification,
    boundary_excesses,
    verify,
)

# Part of its scale that is the size of a peak of zero, as of an objective that is zero
_OF_A_SCALE = 1e-3


def motion_conditions(answer: Evidence) -> Iterator[Finding]:
    """The motion against the statement: replayed, and between its points."""
    iterate, evaluator, allowed = answer.iterate, answer.evaluator, answer.allowed
    replay = ReplayedAnswer.of(answer.solution.form, iterate, evaluator)
    verification = verify(iterate, replay, Accuracy())
    between_points = MotionErrors(
        iterate.transcription, iterate.trajectory, evaluator, iterate.parameters
    )

    words = _replay_words(replay.simulated)
    yield Finding("replay", replay.simulated.miss, allowed.replay, words)
    yield from _replayed_values(iterate, verification, allowed)
    yield Finding(
        "effect of the excess",
        worth_of_excess(iterate, between_points.excess),
        allowed.objective,
        "the violations of path constraints, bounds and peaks between the points, times their "
        "multipliers: a first-order change of the objective",
    )

    yield Finding(
        "dynamics",
        between_points.worst_dynamics,
        allowed.replay,
        "the largest error of the dynamics, integrals and equations between the points, by dense "
        "samples",
    )
    for jump in crossed_jumps(iterate.trajectory, evaluator):
        if jump.moves:
            yield Finding("jumps", jump.size, allowed.steps, jump.sentence)

    # bounds and links of the problem, with the peaks of the replay as they are between the points
    dense = (value for _, _, value in verification.peaks)
    peaks = dict(zip(iterate.problem.peaks, dense, strict=True))
    yield _problem_bounds(
        dict(boundary_excesses(iterate, replay.solved, evaluator, peaks)), allowed
    )


def _replayed_values(
    iterate: Iterate, verification: Verification, allowed: Tolerances
) -> Iterator[Finding]:
    """What the replayed motion says of path constraints, of each peak and of the objective."""
    yield Finding(
        "path constraints",
        verification.excess,
        allowed.excess,
        "the replayed motion exceeds a path constraint, bound or peak between the points by this "
        "part of its size",
    )
    for peak, (name, stated, dense) in zip(iterate.problem.peaks, verification.peaks, strict=True):
        # a peak of zero has the size that is stated, or of what it might be
        size = max(abs(stated), peak.scale or _OF_A_SCALE * iterate.scales.functionals[peak])
        yield Finding(
            f"peak '{name}'",
            abs(dense - stated) / size,
            allowed.excess,
            f"its largest value on the replayed motion is {dense:.8g}, reported as {stated:.8g}",
        )
    reported = replace(iterate, objective=verification.objective)
    yield Finding(
        "objective",
        abs(verification.replayed_objective - reported.objective) / reported.objective_size,
        allowed.objective,
        "the replayed motion has an objective that differs by this part",
    )


def _problem_bounds(excesses: Mapping[str, float], allowed: Tolerances) -> Finding:
    """Bounds and links of the problem, by name how far each is exceeded, relative."""
    exceeded = [f"'{name}'" for name, excess in excesses.items() if not excess <= allowed.bounds]
    return Finding(
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
