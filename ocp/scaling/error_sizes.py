"""Sizes to which what a replay misses is relative.

The size of a state follows its values. One that moves by a small part of them, such as a metre at a
radius of 1e9 m, may stay where it is and miss its end by next to nothing of that size. So the miss
of such a state is held against the way that it is to go.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ocp.mesh.trajectory import Trajectory
from ocp.problem.parameters import Parameters

# Part of its values, below which the way of a state counts instead of them, and up to which two
# numbers are one, computed in two ways
_FAR = 1e-3
_SAME = 1e-13

# Where in each interval the range of a state is looked at
_LOOKS = np.array([0.0, 0.5, 1.0])


def error_sizes(
    parameters: Parameters, trajectory: Trajectory, sizes: Mapping[str, float]
) -> dict[str, float]:
    """Sizes of the states by name, to which the misses of their ends are relative.

    The way of a state is from one stated end value to another one, or the range of its values
    where that is more, as for a joint that swings out and comes back.

    Parameters
    ----------
    sizes : mapping of str to float
        Typical sizes of the signals by name [their units].
    """
    stated: dict[str, list[float]] = {}
    for values in (parameters.initial_values, parameters.final_values):
        for (_, name), (lower, upper) in values.items():
            if lower == upper:
                stated.setdefault(name, []).append(lower)
    found = {name: sizes[name] for phase in trajectory.phases for name in phase.states}
    for name, numbers in stated.items():
        largest = max(abs(number) for number in numbers)
        apart = [abs(a - b) for a in numbers for b in numbers]
        least = min((way for way in apart if way > _SAME * largest), default=largest)
        way = max(least, _range(trajectory, name))
        if way < _FAR * largest:
            found[name] = min(found[name], way)
    return found


def _range(trajectory: Trajectory, name: str) -> float:
    """Largest minus least value of a state, at the ends and in the middle of each interval."""
    seen = [
        motion.polynomial(name).value(
            np.repeat(np.arange(motion.intervals), _LOOKS.size), np.tile(_LOOKS, motion.intervals)
        )
        for motion in trajectory.phases
        if name in motion.states
    ]
    return float(np.ptp(np.concatenate(seen)))
