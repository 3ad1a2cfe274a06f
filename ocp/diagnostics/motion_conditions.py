"""The conditions of a certificate on the motion: that it does what the statement asks for.

They are what `verify` finds, replayed anew, and held to tolerances of their own.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ocp.accuracy import Accuracy
from ocp.diagnostics.crossed_jumps import crossed_jumps
from ocp.diagnostics.diagnostic import Evidence, Finding
from ocp.optimality.iterate import LEAST_OF_A_SCALE
from ocp.verification.simulation import SimulatedMotion
from ocp.verification.verify import (
    ReplayedAnswer,
    verify,
)


def motion_conditions(answer: Evidence) -> Iterator[Finding]:
    """The motion against the statement: replayed, and between its points."""
    iterate, evaluator, allowed = answer.iterate, answer.evaluator, answer.allowed
    replay = ReplayedAnswer.of(answer.solution.form, iterate, evaluator)
    found = verify(iterate, replay, Accuracy())

    yield Finding("replay", found.miss, allowed.replay, _replay_words(replay.simulated))
    yield Finding(
        "path constraints",
        found.excess,
        allowed.excess,
        "the largest violation of a path constraint, bound or peak on the replayed motion, "
        "between the points too, relative to its scale",
    )
    for peak, (name, stated, dense) in zip(iterate.problem.peaks, found.peaks, strict=True):
        # a peak of zero has the size that is stated, or of what it might be
        size = max(abs(stated), peak.scale or LEAST_OF_A_SCALE * iterate.scales.functionals[peak])
        yield Finding(
            f"peak '{name}'",
            abs(dense - stated) / size,
            allowed.excess,
            f"its largest value on the replayed motion is {dense:.8g}, reported as {stated:.8g}",
        )
    reported = replace(iterate, objective=found.objective)
    yield Finding(
        "objective",
        abs(found.replayed_objective - found.objective) / reported.objective_size,
        allowed.objective,
        "the relative difference between the objective of the replayed motion and the reported one",
    )
    yield Finding(
        "effect of the excess",
        found.effect,
        allowed.objective,
        "the violations of path constraints, bounds and peaks between the points, times their "
        "multipliers: a first-order change of the objective",
    )
    yield Finding(
        "dynamics",
        found.dynamics,
        allowed.replay,
        "the largest error of the dynamics, integrals and equations between the points, from "
        "dense samples",
    )
    for jump in crossed_jumps(iterate.trajectory, evaluator):
        if jump.moves:
            yield Finding("jumps", jump.size, allowed.steps, jump.sentence)

    bounds = dict(found.bounds)
    exceeded = [f"'{name}'" for name, excess in bounds.items() if not excess <= allowed.bounds]
    yield Finding(
        "problem bounds",
        float(np.max([0.0, *bounds.values()])),
        allowed.bounds,
        "the largest violation of a bound or link of the whole problem on the replayed motion, "
        f"relative to its scale; too large: {', '.join(exceeded) or 'none'}",
    )


def _replay_words(simulated: SimulatedMotion) -> str:
    begin = "the initial state"
    if simulated.restarts:
        begin += f" and {simulated.restarts} restarts (the motion amplifies too much for one run)"
    return (
        f"the end-state error of a replay of the controls by another integrator from {begin}, "
        "relative to the scale of the states; errors of the states grow by a factor of up to "
        f"{simulated.amplification:.1e}"
    )
