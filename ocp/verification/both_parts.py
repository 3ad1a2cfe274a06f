"""Both parts of a control at once, if it was split (`ocp.reformulate.split_controls`).

The parts stand for the control as long as one of them is zero. A motion that has both at once is
none of the statement, and the best one of a statement in which losses are paid for.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ocp.arrays import Array
from ocp.errors import SolveFailed
from ocp.mesh.trajectory import PhaseTrajectory, Trajectory
from ocp.problem.problem import Problem
from ocp.reformulate.split_controls import SumOfParts, sums_of_parts

# Mean of both parts at once over a phase, of the largest value of the control. A solver leaves
# 1e-8. What is less than this and matters is what the replay finds, which drives the stated rates.
_BOTH = 1e-4

# Of the largest value of a control, within which it is zero: what a solver leaves of it
_ZERO = 1e-6

# Of an interval, at which both parts are looked at
_POINTS = (np.arange(8) + 0.5) / 8


def check_parts(problem: Problem, trajectory: Trajectory) -> None:
    """SolveFailed if a control has both of its parts at once."""
    found = [
        (float(both @ np.diff(motion.fractions)), int(both.argmax()), motion, made)
        for motion in trajectory.phases
        for made, both in _both_at_once(problem, motion)
    ]
    found.sort(key=lambda each: -each[0])
    if not found or found[0][0] <= _BOTH:
        return
    _, interval, motion, made = found[0]
    instant = float(motion.breakpoints[interval : interval + 2].mean())
    raise SolveFailed(
        f"the rates of phase '{motion.name}' of '{problem.name}' have the modulus or the largest "
        f"value of '{made.of}', and its positive and its negative part at once would "
        f"gain or cost nothing, as at {instant:.3g} s: something there pays for losses, such as a "
        "negative price; state it so that losses cost, or, if both are possible at once, state "
        "them as two controls, each not negative",
        trajectory,
    )


def _both_at_once(problem: Problem, motion: PhaseTrajectory) -> Iterator[tuple[SumOfParts, Array]]:
    """Means over the intervals of both parts at once, relative to the control, (N,).

    An interval in which the control changes its sign says nothing: there a polynomial is above the
    modulus.
    """
    k = np.repeat(np.arange(motion.intervals), _POINTS.size)
    tau = np.tile(_POINTS, motion.intervals)
    for made in sums_of_parts(problem.phase(motion.name)):
        total, control = (
            motion.polynomial(name).value(k, tau)[:, 0].reshape(motion.intervals, -1)
            for name in (made.name, made.of)
        )
        size = max(float(np.abs(control).max()), float(total.max()), np.finfo(float).tiny)
        of_one_sign = np.minimum(control.max(axis=1), -control.min(axis=1)) <= _ZERO * size
        yield made, of_one_sign * (total - np.abs(control)).mean(axis=1) / size
