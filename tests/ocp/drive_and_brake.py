"""A problem that several tests ask: least time under different caps on the drive and the brake."""

import math

from ocp import Between, Constant, Control, Phase, Problem, State

STRONGEST = Constant("strongest", "m/s^2", 2.0)


def race() -> Problem:
    """Least time over 1 m from rest to rest, with another cap on the drive than on the brake."""
    x, v = State("x", "m"), State("v", "m/s")
    u = Control("u", "m/s^2", lower=-1.0, upper=STRONGEST, piecewise="constant")
    phase = Phase("race", {x: v, v: u}, {x: 0, v: 0}, {x: 1, v: 0}, end=Between(0.1, 20, guess=2))
    return Problem("race", phase, minimise=phase.end_time)


def least_time(strongest: float) -> float:
    """Drive, then brake: the areas of both halves of the speed's triangle make 1 m."""
    return math.sqrt(2.0 * (1.0 + 1.0 / strongest))
