"""How to share time out among stages that follow each other, from what each does in its time.

A stage in T [s] uses at least u(T) of its caps, and more time never costs: u falls. Stages are at
rest between each other, so nothing else couples them. The least largest utilisation in a total time
is then where all u are equal, but for stages that more time helps no further.

Between known points log u is taken as linear in log T; what is found there is evaluated again.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

RIGID = -2.0  # d log u / d log T of a rigid body under a torque or force
FLATTEST = -0.1  # beyond it more time is taken not to help: ten times the time gains a fifth
EQUAL = 2e-3  # relative spread of utilisations that count as equal
ROUNDS = 8
HALVINGS = 200


@dataclass(eq=False)
class StageCurve:
    """Utilisation of a stage against its duration, known where it was evaluated.

    Attributes
    ----------
    name : of the stage.
    evaluate : gives the utilisation in a duration [s].
    known : utilisation by duration [s].
    """

    name: str
    evaluate: Callable[[float], float]
    known: dict[float, float] = field(default_factory=dict)

    def at(self, duration: float) -> float:
        """Utilisation in a duration [s], evaluated if it is not known."""
        if duration not in self.known:
            self.known[duration] = self.evaluate(duration)
        return self.known[duration]

    def slope(self, duration: float) -> float:
        """Slope of log u against log T near a duration [s], from the two known points about it."""
        durations = sorted(self.known)
        if len(durations) == 1:
            return RIGID
        place = min(max(int(np.searchsorted(durations, duration)), 1), len(durations) - 1)
        left, right = durations[place - 1], durations[place]
        rise = math.log(self.known[right] / self.known[left])
        return min(rise / math.log(right / left), 0.0)

    @property
    def floor(self) -> float:
        """Duration [s] from which more time helps no further; infinite if none is known."""
        durations = sorted(self.known)
        flat = [d for d in durations[:-1] if self.slope(math.nextafter(d, math.inf)) > FLATTEST]
        return min(flat, default=math.inf)

    @property
    def least(self) -> float:
        """Utilisation that more time does not lower; 0 where none is known."""
        return self.known.get(self.floor, 0.0)

    def duration_for(self, utilisation: float) -> float:
        """Duration [s] in which the stage uses that much, as the known points have it."""
        durations = sorted(self.known)
        used = [self.known[d] for d in durations]
        # the nearest known point, and the slope on the side of it that is asked for
        place = int(np.argmin([abs(math.log(u / utilisation)) for u in used]))
        near = durations[place]
        beyond = math.inf if utilisation < used[place] else 0.0
        slope = min(self.slope(math.nextafter(near, beyond)), FLATTEST)
        found = near * (utilisation / used[place]) ** (1.0 / slope)
        return min(found, self.floor)


def equal_split(
    curves: Sequence[StageCurve],
    total: float,
    first: Sequence[float],
    announce: Callable[[Sequence[float]], None] = lambda durations: None,
) -> list[float]:
    """Durations [s] that sum up to a total and make the largest utilisation least.

    Parameters
    ----------
    curves : of the stages.
    total : [s].
    first : durations in proportion to which the search begins.
    announce : called with the duration of each stage before all are evaluated, for who does that
        side by side.
    """
    durations = [total * share / sum(first) for share in first]
    for _ in range(ROUNDS):
        announce(durations)
        used = [curve.at(duration) for curve, duration in zip(curves, durations, strict=True)]
        helped = [u for curve, u, d in zip(curves, used, durations, strict=True) if d < curve.floor]
        if not helped or max(helped) / min(helped) <= 1.0 + EQUAL:
            break
        durations = _shared(curves, total)
    return durations


def _shared(curves: Sequence[StageCurve], total: float) -> list[float]:
    """Durations of equal utilisation as the known points have it; what is left goes to all."""
    low, high = (
        f(u for curve in curves for u in curve.known.values()) * factor
        for f, factor in ((min, 0.1), (max, 10.0))
    )
    for _ in range(HALVINGS):  # of the logarithm of the common utilisation
        middle = math.sqrt(low * high)
        needed = sum(curve.duration_for(middle) for curve in curves)
        low, high = (middle, high) if needed > total else (low, middle)
    durations = [curve.duration_for(high) for curve in curves]
    return [duration * total / sum(durations) for duration in durations]


def durations_at_the_caps(
    curves: Sequence[StageCurve],
    first: Sequence[float],
    announce: Callable[[Sequence[float]], None] = lambda durations: None,
) -> list[float]:
    """Least durations [s] in which stages use all of their caps and no more, to `EQUAL`.

    Parameters
    ----------
    curves : of the stages.
    first : durations with which the search begins.
    announce : as of `equal_split`.
    """
    durations = list(first)
    for _ in range(ROUNDS):
        announce(durations)
        used = [curve.at(duration) for curve, duration in zip(curves, durations, strict=True)]
        durations = [
            duration if 1.0 - EQUAL <= share <= 1.0 else curve.duration_for(1.0 - EQUAL / 2)
            for curve, duration, share in zip(curves, durations, used, strict=True)
        ]
        if all(duration in curve.known for curve, duration in zip(curves, durations, strict=True)):
            break
    return durations
